"""Captures and recordings played as nodes: the numbers and times of the file, marked as playback."""

import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

from brachium_nodes.play import PlaySettings, node_entries, run
from brachium_nodes.playback import capture_packets
from brachium_wire import keys
from brachium_wire.capture import CaptureError, CaptureSegment, write
from brachium_wire.capture_settings import CaptureSettings
from brachium_wire.codec import decode
from brachium_wire.messages import Info, SampleBatch, SensorCalibration, Session
from brachium_wire.recording import RecordingError, RecordingWriter, read
from brachium_wire.samples import read_samples

ROOM = "test"
ENDS_WITHIN_S = 15.0
"""A service promises 2 s; a machine with much to do takes some times that. One that hangs is not excused."""


def segment(
    rate_hz: float, start_s: float, seconds: float, *, mag: bool = False, seed: int = 0
) -> CaptureSegment:
    rng = np.random.default_rng(seed)
    n = round(rate_hz * seconds)
    field = rng.normal(0, 30, (n, 3))
    field[::3] = np.nan
    return CaptureSegment(
        t=1000.0 + start_s + np.arange(n) / rate_hz,
        rate_hz=rate_hz,
        acc=rng.normal([0.0, 0.0, 9.81], 1.0, (n, 3)),
        gyr=rng.normal(0, 1, (n, 3)),
        mag=field if mag else None,
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    settings = CaptureSettings(
        side="right",
        height_m=1.7,
        facing_deg=90.0,
        mounting={"forearm_r": (0.0, 1.0, 0.0, 0.0)},
        sensor={"forearm_r": SensorCalibration(gyro_bias=(0.1, 0.2, 0.3))},
    )
    segments = {
        "upper_arm_r": segment(100.0, 0.0, 1.5),
        "forearm_r": segment(60.0, 0.217, 1.0, mag=True, seed=1),
    }
    write(tmp_path / "capture", settings, segments, "csv")
    return tmp_path / "capture"


def samples_of(listener, name: str) -> list:
    return [read_samples(b) for b in listener.of("imu", name)]


def joined(parts: list) -> np.ndarray:
    return np.concatenate(parts)


def same_numbers(listener, name: str, wanted: CaptureSegment) -> None:
    got = samples_of(listener, name)
    assert joined([s.acc for s in got]) == pytest.approx(wanted.acc, rel=1e-6, abs=1e-6)
    assert joined([s.gyr for s in got]) == pytest.approx(wanted.gyr, rel=1e-6, abs=1e-6)


@pytest.mark.network
def test_a_capture_keeps_its_numbers_and_times(listener, folder, endpoint) -> None:
    settings = PlaySettings(path=folder, endpoint=endpoint, room=ROOM, direct=True, speed=5.0)
    report = run(settings, threading.Event())
    last = listener.until_gone(2)
    assert {n: c.sent for n, c in report.streams["p01"].items()} == {"upper_arm_r": 150, "forearm_r": 60}
    assert {k[1]: s.received for k, s in last.items()} == {"upper_arm_r": 150, "forearm_r": 60}
    wanted = {
        "upper_arm_r": segment(100.0, 0.0, 1.5),
        "forearm_r": segment(60.0, 0.217, 1.0, mag=True, seed=1),
    }
    begins = min(s.time_ns[0] for s in samples_of(listener, "upper_arm_r"))
    for name, source in wanted.items():
        same_numbers(listener, name, source)
        times = np.array([t for s in samples_of(listener, name) for t in s.time_ns])
        assert np.abs((times - begins) * 1e-9 - (source.t - 1000.0)).max() < 1e-6
    field, rows = wanted["forearm_r"].mag, []
    for s in samples_of(listener, "forearm_r"):
        index = s.mag_index if s.mag_index is not None or s.mag is None else range(len(s))
        rows += [s.sequence + i for i in index or ()]
    assert field is not None
    assert rows == np.flatnonzero(np.isfinite(field[:, 0])).tolist()
    infos = {k.detail: m for k, m in listener.heard if isinstance(m, Info)}
    assert {i.origin for i in infos.values()} == {"playback"}
    assert infos["forearm_r"].mounting == (0.0, 1.0, 0.0, 0.0)
    assert infos["forearm_r"].calibration.gyro_bias == (0.1, 0.2, 0.3)
    assert infos["forearm_r"].rate_hz == pytest.approx(60.0, rel=0.01)
    assert (infos["forearm_r"].magnetometer, infos["upper_arm_r"].magnetometer) == (True, False)
    assert listener.of("session")[0] == Session(side="right", height_m=1.7, facing_deg=90.0)


@pytest.mark.network
def test_a_capture_goes_through_a_gateway(gateway, listener, folder, endpoint) -> None:
    settings = PlaySettings(path=folder, endpoint=endpoint, room=ROOM, token="t")
    running = gateway(*node_entries(settings))
    report = run(_at(settings, running.url), threading.Event())
    last = listener.until_gone(2)
    for name, count in report.streams["p01"].items():
        assert last["p01", name].received == count.sent > 0
        assert last["p01", name].lost == 0
    same_numbers(listener, "forearm_r", segment(60.0, 0.217, 1.0, mag=True, seed=1))
    infos = {k.detail: m for k, m in listener.heard if isinstance(m, Info)}
    assert infos["forearm_r"].mounting == (0.0, 1.0, 0.0, 0.0)
    assert infos["forearm_r"].origin == "playback"


def _at(settings: PlaySettings, url: str) -> PlaySettings:
    return PlaySettings(**{**vars(settings), "gateway": url})


@pytest.fixture
def recorded(listener, folder, endpoint, tmp_path) -> tuple[Path, dict[str, list[bytes]]]:
    """A recording of a room in which the capture was played."""
    run(
        PlaySettings(path=folder, endpoint=endpoint, room=ROOM, id="first", direct=True, speed=5.0),
        threading.Event(),
    )
    listener.until_gone(2)
    payloads: dict[str, list[bytes]] = {}
    path = tmp_path / "r.mcap"
    with RecordingWriter(path) as writer:
        for key, payload, message in listener.raw:
            received = getattr(message, "received_ns", None) or getattr(message, "time_ns", 1)
            writer.write(key, payload, received)
            payloads.setdefault(keys.parse(key).topic, []).append(payload)
    listener.heard.clear()
    listener.raw.clear()
    return path, payloads


@pytest.mark.network
def test_a_recording_keeps_its_bytes(listener, recorded, endpoint) -> None:
    path, payloads = recorded
    report = run(
        PlaySettings(path=path, endpoint=endpoint, room=ROOM, id="again", direct=True, speed=5.0),
        threading.Event(),
    )
    listener.until_gone(2)
    played = [p for k, p, _ in listener.raw if keys.parse(k).topic == "imu"]
    assert played == payloads["imu"]
    assert {i.origin for i in listener.of("info")} == {"playback"}
    assert {i.host for i in listener.of("info")} == {"again"}
    assert report.streams["p01"]["upper_arm_r"].sent == 150
    assert listener.of("session")[0].height_m == 1.7


@pytest.mark.network
def test_a_recording_goes_through_a_gateway_with_its_own_times(gateway, listener, recorded, endpoint) -> None:
    path, _ = recorded
    settings = PlaySettings(path=path, endpoint=endpoint, room=ROOM, token="t")
    url = gateway(*node_entries(settings)).url
    report = run(_at(settings, url), threading.Event())
    last = listener.until_gone(2)
    assert {n: c.sent for n, c in report.streams["p01"].items()} == {"upper_arm_r": 150, "forearm_r": 60}
    assert {k[1]: s.received for k, s in last.items()} == {"upper_arm_r": 150, "forearm_r": 60}
    same_numbers(listener, "upper_arm_r", segment(100.0, 0.0, 1.5))
    assert {i.origin for i in listener.of("info")} == {"playback"}
    with read(path) as recording:
        then = {(k, m.sequence): m.time_ns for k, m in batches((r.key, r.payload) for r in recording)}
    now = {(k, m.sequence): m for k, m in batches((k, p) for k, p, _ in listener.raw)}
    assert then.keys() == now.keys()
    shifts = {k: m.time_ns - then[k] for k, m in now.items()}
    middle = np.median(list(shifts.values()))
    # The middle is another batch's, perhaps of the other node's clock: each is off by its own uncertainty.
    widest = max(m.uncertainty_ns for m in now.values())
    assert all(abs(shifts[k] - middle) <= now[k].uncertainty_ns + widest + 1000 for k in now)


def batches(messages: Iterable[tuple[str, bytes]]) -> Iterator[tuple[str, SampleBatch]]:
    for key, payload in messages:
        if keys.parse(key).topic == "imu":
            yield key, decode(payload, SampleBatch)


def test_packets_of_a_capture_never_span_a_gap() -> None:
    source = segment(100.0, 0.0, 1.0)
    source = CaptureSegment(
        t=source.t + (np.arange(100) >= 42) * 30.0, rate_hz=100.0, acc=source.acc, gyr=source.gyr
    )
    packets = list(capture_packets(source, float(source.t[0])))
    assert sum(len(p.times_s) for p in packets) == 100
    assert all(p.times_s[-1] - p.times_s[0] < 0.051 for p in packets)
    assert [p.batch.sequence for p in packets] == np.cumsum([0, *(len(p.times_s) for p in packets)])[
        :-1
    ].tolist()
    assert all(p.due_s == p.times_s[-1] for p in packets)


@pytest.mark.parametrize(
    ("more", "said"),
    [({}, "token"), ({"token": "x", "speed": 2.0}, "direct"), ({"direct": True, "speed": -1.0}, "speed")],
)
def test_settings_that_cannot_be_are_refused(tmp_path, more, said) -> None:
    with pytest.raises(ValueError, match=said):
        PlaySettings(path=tmp_path, **more)


@pytest.mark.parametrize("direct", [True, False])
def test_what_cannot_be_played_is_named_before_anything_is_opened(tmp_path, direct) -> None:
    nowhere = "tcp/127.0.0.1:1"
    way = {"direct": direct, "token": "t", "endpoint": nowhere}
    with pytest.raises(RecordingError, match="no such file or folder"):
        run(PlaySettings(path=tmp_path / "gone", **way), threading.Event())
    with pytest.raises(CaptureError, match="no segment file"):
        run(PlaySettings(path=tmp_path, **way), threading.Event())
    (tmp_path / "x.mcap").write_bytes(b"not a recording")
    with pytest.raises(RecordingError, match="not a recording"):
        run(PlaySettings(path=tmp_path / "x.mcap", **way), threading.Event())


@pytest.mark.network
def test_playback_ends_when_told(listener, folder, endpoint) -> None:
    stop = threading.Event()
    settings = PlaySettings(path=folder, endpoint=endpoint, room=ROOM, direct=True, speed=0.01)
    thread = threading.Thread(target=run, args=(settings, stop))
    thread.start()
    listener.until(lambda: len(listener.of("info")) == 2, "both infos")
    stop.set()
    thread.join(timeout=ENDS_WITHIN_S)
    assert not thread.is_alive(), "play did not end"
    listener.until_gone(2)
