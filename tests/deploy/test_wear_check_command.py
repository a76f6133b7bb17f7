"""`brachium wear-check`: what is told of a capture, of a recording, and of a wearer who is led through it."""

import json
import threading
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from brachium.__main__ import main
from brachium.commands.wear_check import SPANS
from brachium_body.segments import Segment, Side, arm_segments
from brachium_fusion.service import FuseSettings, FusionService
from brachium_fusion.uniform import Series
from brachium_fusion.wear_guide import LISTENING, STEPS
from brachium_fusion.wear_passes import Heard, Plan, Sensor, examine, of_capture, wear_pass
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import Turn, Wearing
from brachium_wire import capture, keys
from brachium_wire.bus import Bus
from brachium_wire.capture_settings import CaptureSettings
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Calibration, Info, Quaternion, SensorCalibration
from brachium_wire.recording import Recorded, RecordingWriter
from brachium_wire.samples import write_samples

RATE_HZ = 25.0
ROOM, SUBJECT = "dressing", "p01"
RIGHT = arm_segments("right")
SWAP: dict[Segment, Segment] = {"forearm_r": "hand_r", "hand_r": "forearm_r"}
FLIP: dict[Segment, Turn] = {"upper_arm_r": "upside-down"}
WRONG = Wearing(seats=SWAP, turned=FLIP)
START_NS = 1_700_000_000_000_000_000


@cache
def session(wrong: bool = False) -> SessionArrays:
    """Return 13 s: standing, hanging, raising, bending, with some standing after it."""
    return session_of("right", RIGHT, WRONG if wrong else Wearing())


def session_of(moved: Side, nodes: tuple[Segment, ...], wearing: Wearing) -> SessionArrays:
    settings = WearerSettings(
        routine="wear-check", arms=moved, seed=3, rate_hz=RATE_HZ, segments=nodes, wearing=wearing
    )
    return session_arrays(settings, 13.0)


def span(made: SessionArrays, kind: str) -> tuple[float, float]:
    return next((s.from_s, s.to_s) for s in made.spans if s.kind == kind)


def words_of(made: SessionArrays) -> list[str]:
    spans = {name: span(made, name) for name in ("hang", "raise", "bend")}
    return ["--moved=right", *(f"--{name}={a}:{b}" for name, (a, b) in spans.items())]


def mounting_of(made: SessionArrays, segment: Segment) -> Quaternion:
    w, x, y, z = made.sensors[segment].nominal_mounting.tolist()
    return w, x, y, z


def as_capture(folder: Path, made: SessionArrays) -> Path:
    settings = CaptureSettings(mounting={s: mounting_of(made, s) for s in made.sensors})
    segments: dict[Segment, capture.CaptureSegment] = {
        s: capture.CaptureSegment(t=made.time_s, rate_hz=RATE_HZ, acc=a.acc, gyr=a.gyr)
        for s, a in made.sensors.items()
    }
    capture.write(folder, settings, segments, "csv")
    return folder


def info_of(made: SessionArrays, segment: Segment, **more: object) -> bytes:
    known = {"node": f"node-{segment}", "rate_hz": RATE_HZ, "origin": "emulated", "host": "gw"}
    return encode(Info(**(known | {"mounting": mounting_of(made, segment)} | more)))  # type: ignore[arg-type]


def batch(made: SessionArrays, segment: Segment, first: int, end: int, start_ns: int = START_NS) -> bytes:
    """Return rows `first` to `end` of a session whose row 0 is at `start_ns`."""
    data, times = made.sensors[segment], [start_ns + round(i * 1e9 / RATE_HZ) for i in range(first, end)]
    return encode(
        write_samples(
            sequence=first,
            time_ns=times,
            device_us=[t // 1000 for t in times],
            received_ns=times[-1],
            uncertainty_ns=0,
            acc=data.acc[first:end],
            gyr=data.gyr[first:end],
        )
    )


def told(said: str) -> dict[str, tuple[str | None, str]]:
    return {f["segment"]: (f["seat"], f["turn"]) for f in json.loads(said)["findings"]}


AS_WRONG = {s: (SWAP.get(s, s), FLIP.get(s, "")) for s in RIGHT}


def test_a_swap_and_a_flip_in_a_capture_are_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = as_capture(tmp_path / "wrong", session(wrong=True))
    words = ["wear-check", str(folder), *words_of(session(wrong=True))]
    assert main(words) == 1
    said = capsys.readouterr().out
    assert "right forearm: is on the right hand; swap it with hand_r" in said
    assert "right upper arm: is upside down" in said
    assert main([*words, "--json"]) == 1
    said = capsys.readouterr().out
    assert told(said) == AS_WRONG
    assert json.loads(said)["fine"] is False


def test_a_capture_worn_as_it_should_be_is_fine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = as_capture(tmp_path / "fine", session())
    assert main(["wear-check", str(folder), *words_of(session())]) == 0
    assert capsys.readouterr().out.count("worn as it should be") == 3


def test_both_arms_one_after_the_other_tell_which_arm_a_node_is_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes = (*RIGHT, *arm_segments("left"))
    seats: dict[Segment, Segment] = {"forearm_r": "forearm_l", "forearm_l": "forearm_r"}
    first, then = (session_of(side, nodes, Wearing(seats=seats)) for side in ("right", "left"))
    after_s = first.time_s[-1] + 1.0 / RATE_HZ
    segments: dict[Segment, capture.CaptureSegment] = {
        s: capture.CaptureSegment(
            t=np.concatenate([first.time_s, after_s + then.time_s]),
            rate_hz=RATE_HZ,
            acc=np.concatenate([first.sensors[s].acc, then.sensors[s].acc]),
            gyr=np.concatenate([first.sensors[s].gyr, then.sensors[s].gyr]),
        )
        for s in nodes
    }
    settings = CaptureSettings(side="both", mounting={s: mounting_of(first, s) for s in nodes})
    capture.write(tmp_path / "both", settings, segments, "csv")
    later = [f"--{n}={after_s + a}:{after_s + b}" for n in SPANS for a, b in [span(then, n)]]
    words = ["wear-check", str(tmp_path / "both"), *words_of(first), "--moved=left", *later, "--json"]
    assert main(words) == 1
    assert told(capsys.readouterr().out) == {s: (seats.get(s, s), "") for s in nodes}


def test_a_recording_tells_the_same_and_its_subject_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, made = tmp_path / "first.mcap", session(wrong=True)
    with RecordingWriter(path, {}) as writer:
        for subject in (SUBJECT, "p02"):
            for s in RIGHT:
                writer.write(*Recorded(keys.info(ROOM, subject, s), info_of(made, s), START_NS))
                for first in range(0, len(made.time_s), 25):
                    end = min(first + 25, len(made.time_s))
                    writer.write(*Recorded(keys.imu(ROOM, subject, s), batch(made, s, first, end), START_NS))
    words = ["wear-check", str(path), *words_of(made), "--json"]
    assert main(words) == 2
    assert "there is p01, p02" in capsys.readouterr().err
    assert main([*words, "--subject", SUBJECT]) == 1
    assert told(capsys.readouterr().out) == AS_WRONG


def test_a_refusal_is_one_line_and_an_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = as_capture(tmp_path / "still", session())
    words = ["wear-check", str(folder), "--moved=right", "--hang=0:2", "--raise=0:2", "--bend=0:2", "--json"]
    assert main(words) == 1
    said = capsys.readouterr()
    assert "raise it sideways" in said.err
    assert json.loads(said.out)["refused"]


def test_without_a_mounting_it_says_what_it_took(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = as_capture(tmp_path / "untold", session())
    (folder / "capture.toml").unlink()
    main(["wear-check", str(folder), *words_of(session())])
    assert "nobody told how upper_arm_r, forearm_r, hand_r should be worn" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--moved=right"], "belong to a recording"),
        (["{}"], "each once for an arm"),
        (["{}", "--side=right"], "belongs to a running network"),
        (["{}", "--moved=right", "--hang=0:3", "--raise=3:6"], "each once for an arm"),
        (["{}", "--moved=right", "--hang=0:3", "--raise=3:6", "--bend=10:30"], "--bend ends at 30 s"),
        (["{}", *["--moved=left", "--hang=0:3", "--raise=3:6", "--bend=6:9"] * 2], "given twice"),
        (["nothing.mcap", "--moved=right", "--hang=0:3", "--raise=3:6", "--bend=6:9"], "no such recording"),
    ],
)
def test_bad_input_is_usage(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = as_capture(tmp_path / "capture", session())
    assert main(["wear-check", *(word.format(folder) for word in words)]) == 2
    assert said in capsys.readouterr().err


# The pure part


def heard_all(made: SessionArrays, without: range = range(0), **more: object) -> Heard:
    heard = Heard()
    for s in RIGHT:
        heard.take(keys.Key(ROOM, SUBJECT, "info", s), info_of(made, s, **more))
        for first in reversed(range(0, len(made.time_s), 5)):  # a batch that is late is in its place
            if first not in without:
                one = batch(made, s, first, min(first + 5, len(made.time_s)))
                heard.take(keys.Key(ROOM, SUBJECT, "imu", s), one)
                heard.take(keys.Key(ROOM, SUBJECT, "imu", s), one)  # what comes twice counts once
    return heard


def plan_of(made: SessionArrays) -> Plan:
    at = {kind: span(made, kind) for kind in ("hang", "raise", "bend")}
    zero_s = 1e-9 * START_NS
    shifted = {kind: (zero_s + a, zero_s + b) for kind, (a, b) in at.items()}
    return Plan("right", {"hang": shifted["hang"], "raise": shifted["raise"], "bend": shifted["bend"]})


def test_batches_become_the_rows_of_the_spans() -> None:
    made = session()
    made_pass = wear_pass(heard_all(made).sensors(), plan_of(made), RATE_HZ)
    ends = [rows for _, rows in made_pass.spans.values()]
    assert [first for first, _ in made_pass.spans.values()] == [0, *ends[:-1]]
    np.testing.assert_allclose(np.diff([0, *ends]), [75, 87.5, 87.5], atol=0.6)
    first = round(span(made, "hang")[0] * RATE_HZ)
    rows = made_pass.spans["hang"][1]
    np.testing.assert_allclose(
        made_pass.records["hand_r"].acc[:rows], made.sensors["hand_r"].acc[first : first + rows], atol=1e-3
    )


def test_the_sensors_own_calibration_is_applied() -> None:
    calibration = SensorCalibration(gyro_bias=(0.1, 0.0, 0.0), accel_scale=(2.0, 1.0, 1.0))
    series = heard_all(session(), calibration=calibration).sensors()["hand_r"].series
    assert series is not None
    assert series.gyr is not None
    assert series.acc is not None
    real = session().sensors["hand_r"]
    np.testing.assert_allclose(series.gyr, real.gyr - [0.1, 0.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(series.acc, real.acc * [2.0, 1.0, 1.0], atol=1e-4)


def test_a_long_gap_is_no_reading_and_is_said() -> None:
    made = session()
    middle = round(sum(span(made, "raise")) / 2 * RATE_HZ)
    outcome = examine(heard_all(made, without=range(middle - 10, middle + 10)).sensors(), [plan_of(made)])
    assert "was silent for" in outcome.check.refused
    assert not outcome.fine


def test_a_node_that_cannot_be_checked_is_left_out_by_name() -> None:
    sensors = heard_all(session()).sensors()
    sensors["hand_r"] = Sensor(sensors["hand_r"].info, None)
    outcome = examine(sensors, [plan_of(session())])
    assert list(outcome.left_out) == ["hand_r"]
    assert outcome.check.fine
    assert not outcome.fine
    assert "named for the right arm" in examine({}, [plan_of(session())]).check.refused
    slow: dict[Segment, Sensor] = {
        s: Sensor(v.info, Series(time_s=np.arange(2.0), rate_hz=5.0)) for s, v in sensors.items()
    }
    assert set(examine(slow, [plan_of(session())]).left_out) == set(RIGHT)


def test_what_breaks_the_contract_is_counted() -> None:
    heard = Heard()
    heard.take(keys.Key(ROOM, SUBJECT, "imu", "hand_r"), b"\xc1")
    heard.take(keys.Key(ROOM, SUBJECT, "info", "hand_r"), b"\xc1")
    assert heard.drops.total() == 2
    assert heard.sensors() == {}


def test_a_capture_of_orientations_is_left_out(tmp_path: Path) -> None:
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (50, 1))
    segments: dict[Segment, capture.CaptureSegment] = {
        "hand_r": capture.CaptureSegment(t=np.arange(50) / 25.0, rate_hz=25.0, quat=quat)
    }
    capture.write(tmp_path / "quat", CaptureSettings(), segments, "csv")
    outcome = examine(of_capture(capture.load(tmp_path / "quat")), [plan_of(session())])
    assert "orientations only" in outcome.left_out["hand_r"]


# The network


class Wearer:
    """Does at once what is said: an instruction's samples are put as soon as it is heard."""

    def __init__(self, bus: Bus, made: SessionArrays) -> None:
        self._bus, self._made, self.said = bus, made, list[str]()
        self._now_ns = START_NS
        for s in RIGHT:
            bus.retain(keys.info(ROOM, SUBJECT, s), info_of(made, s))
        assert len(bus.fetch(keys.subjects(ROOM, "imu/*/info", SUBJECT))) == len(RIGHT)
        hang_s = span(made, "hang")[0]
        self._begins = [hang_s, hang_s, span(made, "raise")[0], span(made, "bend")[0]]

    def hears(self, text: str) -> None:
        self.said.append(text)
        if text.startswith("listening"):
            self._does(self._begins[0], 0.2)
        for step, begin_s in zip(STEPS, self._begins, strict=True):
            if text == step.words.format(side="right"):
                self._does(begin_s, step.seconds)

    def _does(self, begin_s: float, seconds: float) -> None:
        first, count = round(begin_s * RATE_HZ), round(seconds * RATE_HZ)
        zero_ns = self._now_ns - round(first * 1e9 / RATE_HZ)
        for s in RIGHT:
            for at in range(first, first + count, 5):
                end = min(at + 5, first + count)
                self._bus.put(keys.imu(ROOM, SUBJECT, s), batch(self._made, s, at, end, zero_ns))
        self._now_ns += round(count * 1e9 / RATE_HZ)


class Fusion:
    """The service in a thread, until the end of the `with` block."""

    def __init__(self, endpoint: str, room: str) -> None:
        self._settings, self._stop = FuseSettings(endpoint=endpoint, room=room), threading.Event()
        self._ready, self._thread = threading.Event(), threading.Thread(target=self._run)

    def __enter__(self) -> None:
        self._thread.start()
        assert self._ready.wait(60.0)

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(15.0)
        assert not self._thread.is_alive()

    def _run(self) -> None:
        with Bus.open(self._settings.endpoint, stop=self._stop) as bus:
            service = FusionService(bus, self._settings)
            self._ready.set()
            while not self._stop.wait(service.pause_s()):
                service.turn()
            service.close()


@pytest.mark.network
@pytest.mark.parametrize("wrong", [False, True])
def test_a_wearer_is_led_and_told(
    endpoint: str, wrong: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with Bus.open(endpoint) as bus:
        wearer = Wearer(bus, session(wrong))
        monkeypatch.setattr("brachium.commands.wear_check._say", wearer.hears)
        news = bus.subscribe(keys.calibration(ROOM, SUBJECT))
        with Fusion(endpoint, ROOM):
            code = main(["wear-check", "--endpoint", endpoint, "--room", ROOM, "--json"])
        for s in RIGHT:
            bus.forget(keys.info(ROOM, SUBJECT, s))
        bus.forget(keys.calibration(ROOM, SUBJECT))
        last = [decode(payload, Calibration).wear for _, payload in news.drain()][-1]
    assert code == (1 if wrong else 0)
    expected = AS_WRONG if wrong else {s: (s, "") for s in RIGHT}
    assert told(capsys.readouterr().out) == expected
    instructions = [text for text in wearer.said if not text.startswith(" ")]
    assert instructions == [LISTENING, *(s.words.format(side="right") for s in STEPS)]
    assert last is not None
    assert (last.state, last.fine) == ("done", not wrong)
    assert {f.segment: (f.seat, f.turn) for f in last.findings} == expected


@pytest.mark.network
def test_silence_is_a_reason_and_no_wait_without_end(
    endpoint: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("brachium_fusion.wear_guide.LISTEN_S", 0.2)
    words = ["wear-check", "--endpoint", endpoint, "--room", "quiet"]
    assert main(words) == 1
    assert "fusion does not answer" in capsys.readouterr().err
    with Bus.open(endpoint) as bus, Fusion(endpoint, "quiet"):
        assert main(words) == 1
        assert "no sensor of subject 'p01' has been heard yet" in capsys.readouterr().err
        bus.retain(keys.info("quiet", SUBJECT, "hand_r"), info_of(session(), "hand_r"))
        said = ""
        for _ in range(100):  # until fusion has heard of the node
            assert main(words) == 1
            said = capsys.readouterr().err
            if "has been heard yet" not in said:
                break
        bus.forget(keys.info("quiet", SUBJECT, "hand_r"))
    assert "nothing can be said: no samples of subject 'p01' in room 'quiet' come" in said
