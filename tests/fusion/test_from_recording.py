"""A recording solved again gives what was live: with loss and swaps, from mid-stream, with commands in it."""

from itertools import takewhile
from pathlib import Path

import msgspec
import numpy as np
import pytest

from brachium_fusion import from_recording
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Change, Settings
from brachium_fusion.solve import SolveError, SolveSettings
from brachium_fusion.solve import run as solve
from brachium_nodes.link import FaultSettings
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Event, Info, Session, Snapshot
from brachium_wire.recording import Recorded, RecordingWriter, read
from brachium_wire.samples import write_samples

SUBJECT = "p01"


def stream(made, seconds: float) -> list[tuple[str, bytes]]:
    """Return an emulated wearer's messages in order of arrival, with loss, swaps and repetitions."""
    wearer = Wearer(WearerSettings(level="typical", exercise="elbow-flexion", seed=3))
    messages = []
    for segment in wearer.segments:
        known = wearer.info(segment)
        info = Info(
            node=f"n-{segment}",
            rate_hz=known.rate_hz,
            origin="emulated",
            host="gw",
            mounting=known.mounting,
            calibration=known.calibration,
            magnetometer=True,
        )
        messages.append((keys.info("room", SUBJECT, segment), encode(info)))
    faults = FaultSettings(loss=0.03, swap=0.02)
    for packet in takewhile(lambda p: p.send_time_s < seconds, wearer.all_packets(faults)):
        readings = packet.readings
        batch = write_samples(
            sequence=packet.sequence,
            time_ns=made.START + np.round(1e9 * readings.time_s).astype(np.int64),
            device_us=packet.device_us,
            received_ns=made.START + round(1e9 * packet.send_time_s),
            uncertainty_ns=0,
            acc=readings.acc,
            gyr=readings.gyr,
            mag=readings.mag,
        )
        messages.append((keys.imu("room", SUBJECT, packet.segment), encode(batch)))
    return messages


@pytest.fixture(scope="module")
def messages(made):
    return stream(made, 9.0)


class Live:
    """A pipeline as the service runs it, and a recorder beside it that may begin later."""

    def __init__(self, path: Path, settings: Settings | None = None) -> None:
        self.pipeline = Pipeline(settings)
        self._path = path
        self._writer: RecordingWriter | None = None
        self.skeletons = 0

    def record(self) -> None:
        self._writer = RecordingWriter(self._path)
        self._write(keys.snapshot("room", SUBJECT), self.pipeline.snapshot(SUBJECT))

    def close(self) -> None:
        assert self._writer is not None
        self._writer.close()

    def _write(self, key: str, payload: bytes) -> None:
        if self._writer is not None:
            self._writer.write(key, payload, 1)

    def hear(self, messages) -> None:
        """Take a turn's messages; the recorder may have them before or after what comes of them."""
        for key, payload in messages:
            self._write(key, payload)
        self.pipeline.feed_all([(keys.parse(key), payload) for key, payload in messages])
        for solved in self.pipeline.skeletons():
            self.skeletons += self._writer is not None
            self._write(keys.skeleton("room", solved.subject, solved.skeleton.side), encode(solved.skeleton))

    def change(self, kind: str, data: dict) -> None:
        change = Change(self.pipeline.subject(SUBJECT).next_tick_ns(), kind, data)
        self.pipeline.apply(SUBJECT, change)
        event = Event(time_ns=change.from_ns, kind="applied", text=kind, data=data)
        self._write(keys.event("room", SUBJECT), encode(event))


def turns(messages, size: int):
    return [messages[i : i + size] for i in range(0, len(messages), size)]


def session(**fields) -> dict:
    return msgspec.to_builtins(Session(**fields))


def check(path: Path, live: Live) -> None:
    report = solve(SolveSettings(input=path))
    assert report.live_compared == live.skeletons > 80
    assert report.live_angle_rad is not None
    assert report.live_position_m is not None
    assert report.live_angle_rad < 1e-9
    assert report.live_position_m < 1e-9


def test_a_recording_from_the_start_gives_the_live_skeletons_again(messages, tmp_path) -> None:
    live = Live(tmp_path / "a.mcap")
    live.record()
    live.change("session", session(height_m=1.7, facing_deg=0.0))
    for turn in turns(messages, 7):
        live.hear(turn)
    live.close()
    check(tmp_path / "a.mcap", live)
    drops = live.pipeline.subjects[SUBJECT].drops
    assert drops["out_of_order"] > 0
    report = solve(SolveSettings(input=tmp_path / "a.mcap"))
    assert report.drops == dict(drops)


@pytest.mark.parametrize("begin", [3, 60, 140])
def test_a_recording_from_mid_stream_begins_with_fusions_state(messages, tmp_path, begin) -> None:
    live = Live(tmp_path / "a.mcap")
    live.change("session", session(height_m=1.7, facing_deg=0.0))
    for number, turn in enumerate(turns(messages, 3)):
        if number == begin:
            live.record()
        live.hear(turn)
    live.close()
    check(tmp_path / "a.mcap", live)


@pytest.mark.parametrize("begin", [0, 40, 62])
def test_a_command_and_a_new_session_are_applied_at_the_same_instants(messages, tmp_path, begin) -> None:
    live = Live(tmp_path / "a.mcap", Settings(auto_pose=False))
    news = []
    for number, turn in enumerate(turns(messages, 5)):
        if number == begin:
            live.record()
        if number == 10:
            live.change("calibrate", {"pose": "n-pose", "seconds": 1.5, "angles_deg": {}})
        if number in (20, 60):
            live.change("session", session(height_m=1.5 + number / 100, facing_deg=0.0))
        live.hear(turn)
        news += live.pipeline.calibrations
        live.pipeline.calibrations = []
    live.close()
    assert [c.state for _, c in news] == ["waiting", "done"]
    check(tmp_path / "a.mcap", live)


def test_another_filter_solves_the_same_recording_to_other_numbers(messages, tmp_path) -> None:
    live = Live(tmp_path / "a.mcap")
    live.record()
    for turn in turns(messages, 7):
        live.hear(turn)
    live.close()
    reports = {
        name: solve(SolveSettings(input=tmp_path / "a.mcap", filter=name))
        for name in (None, "complementary", "complementary-printed")
    }
    assert reports[None].filter == "auto"
    for name in ("complementary", "complementary-printed"):
        assert reports[name].filter == name
        assert reports[name].live_compared == 0
        assert reports[name].rows == reports[None].rows
    elbows = [[s.angles.get("elbow_flexion", np.nan) for s in r.skeletons[200:]] for r in reports.values()]
    apart = np.abs(np.subtract(elbows[0], elbows[1]))
    assert np.isfinite(apart).mean() > 0.5
    assert 0.001 < np.nanmax(apart) < 0.5
    slower = solve(SolveSettings(input=tmp_path / "a.mcap", rate_hz=25.0))
    assert slower.rows == pytest.approx(reports[None].rows / 2, abs=1)


def test_without_a_snapshot_the_default_settings_solve_it(messages, tmp_path) -> None:
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for key, payload in messages:
            writer.write(key, payload, 1)
    report = solve(SolveSettings(input=tmp_path / "a.mcap", out=tmp_path / "a.csv"))
    assert report.rows > 400
    assert report.live_compared == 0
    assert (tmp_path / "a.csv").stat().st_size > 100_000


def test_which_subject_must_be_said_when_there_are_several(messages, tmp_path) -> None:
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for key, payload in messages[:600]:
            writer.write(key, payload, 1)
            writer.write(key.replace(SUBJECT, "p02"), payload, 1)
    with pytest.raises(SolveError, match="p01, p02; choose one with --subject"):
        solve(SolveSettings(input=tmp_path / "a.mcap"))
    with pytest.raises(SolveError, match="no subject 'p03'"):
        solve(SolveSettings(input=tmp_path / "a.mcap", subject="p03"))
    assert solve(SolveSettings(input=tmp_path / "a.mcap", subject="p02")).rows > 50


def test_foreign_bytes_and_changes_in_a_recording_disturb_nothing(messages, tmp_path) -> None:
    evil = [
        (keys.event("room", SUBJECT), encode(Event(time_ns=5, kind="applied", text="fly", data={"x": 1}))),
        (keys.event("room", SUBJECT), b"\xc1"),
        (keys.snapshot("room", SUBJECT), b"\x80"),
        (keys.imu("room", SUBJECT, "hand_r"), b"\x00"),
    ]
    for name, extra in (("plain", []), ("evil", evil)):
        with RecordingWriter(tmp_path / f"{name}.mcap") as writer:
            for key, payload in [*messages[:300], *extra, *messages[300:600]]:
                writer.write(key, payload, 1)
    plain, spoilt = (solve(SolveSettings(input=tmp_path / f"{n}.mcap")) for n in ("plain", "evil"))
    assert spoilt.skeletons == plain.skeletons
    assert spoilt.drops.pop("malformed") == 1
    assert spoilt.drops == plain.drops


def test_the_largest_difference_is_infinite_where_only_one_has_a_number(messages, tmp_path) -> None:
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for key, payload in messages[:200]:
            writer.write(key, payload, 1)
    skeletons = solve(SolveSettings(input=tmp_path / "a.mcap")).skeletons
    assert from_recording.largest_difference(skeletons, skeletons) == (len(skeletons), 0.0, 0.0)
    first = next(s for s in skeletons if "theta4" in s.angles)
    poorer = msgspec.structs.replace(first, angles={k: v for k, v in first.angles.items() if k != "theta4"})
    assert from_recording.largest_difference([poorer], [first])[1] == float("inf")
    with read(tmp_path / "a.mcap") as recorded:
        (contents,) = from_recording.sort_out(recorded).values()
    assert contents.snapshot is None
    assert isinstance(decode(Pipeline().snapshot(SUBJECT), Snapshot), Snapshot)


def test_without_a_snapshot_the_settings_are_those_that_fusion_told() -> None:
    chosen = Settings(filter="complementary", magnetometer=False, rate_hz=25.0, auto_pose=False)
    told = Event(time_ns=1, kind="settings", data=chosen.plain())
    other = Event(time_ns=2, kind="settings", data={"filter": "vqf", "unknown": 1})
    messages = [Recorded(keys.event("room", SUBJECT), encode(e), e.time_ns) for e in (told, other)]
    assert from_recording.settings_of(from_recording.sort_out(messages)[SUBJECT]) == chosen


def test_a_snapshot_of_another_version_is_left_aside_and_told(messages, tmp_path) -> None:
    live = Live(tmp_path / "a.mcap")
    live.record()
    for turn in turns(messages[: len(messages) // 2], 7):
        live.hear(turn)
    live.close()
    with read(tmp_path / "a.mcap") as recorded:
        content = list(recorded)
    with RecordingWriter(tmp_path / "b.mcap") as writer:
        for key, payload, time_ns in content:
            if keys.parse(key).topic == "snapshot":
                snapshot = decode(payload, Snapshot)
                payload = encode(msgspec.structs.replace(snapshot, state=b"\x82\xa7subject\x80\xa4arms\x80"))
            writer.write(key, payload, time_ns)
    report = solve(SolveSettings(input=tmp_path / "b.mcap"))
    assert report.rows > 100
    assert any("another version of fusion" in warning for warning in report.warnings)
