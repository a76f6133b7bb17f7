"""The service's part of wear checks: instructions by the samples' time, one answer to who asked."""

import threading
from typing import Any

import numpy as np
import pytest

from brachium_body.segments import Segment
from brachium_fusion import wear_guide
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.settings import Settings
from brachium_fusion.wear_desk import WearDesk, checked_wear_wish
from brachium_fusion.wear_guide import LISTENING, STEPS, WearGuide
from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Answer, Calibration, Info
from brachium_wire.samples import write_samples
from brachium_wire.sensor_records import WearProgress

NOW = 1_700_000_000_000_000_000
RATE = 25.0
PASS_S = sum(step.seconds for step in STEPS)
INFO = Info(node="n1", rate_hz=RATE, origin="worn", host="gw", mounting=(1.0, 0.0, 0.0, 0.0))


def still(segment: Segment, from_s: float, to_s: float) -> tuple[keys.Key, bytes]:
    """Return one batch of a sensor that lies still."""
    times = [NOW + round(1e9 * t) for t in np.arange(from_s, to_s, 1.0 / RATE)]
    batch = write_samples(
        sequence=round(from_s * RATE), time_ns=times, device_us=[t // 1000 for t in times],
        received_ns=times[-1], uncertainty_ns=1000, acc=[[0.0, 9.81, 0.0]] * len(times),
        gyr=[[0.0, 0.0, 0.0]] * len(times),
    )  # fmt: skip
    return keys.Key("lab", "p01", "imu", segment), encode(batch)


def guide(*segments: Segment, asked: tuple[Any, ...] = ()) -> WearGuide:
    return WearGuide("subject 'p01'", dict.fromkeys(segments, INFO), asked, now_s=0.0)


def test_instructions_follow_the_samples_and_not_the_clock() -> None:
    one = guide("forearm_r", "hand_r")
    assert one.progress() == WearProgress(state="running", reason=LISTENING)
    one.take(*still("forearm_r", 0.0, 0.2), now_s=100.0)  # late, but nobody waited for it longer than that
    seen: list[tuple[str, int]] = []
    for tenth in range(2, round(10 * (PASS_S + 0.5))):
        for segment in ("forearm_r", "hand_r"):
            one.take(*still(segment, 0.1 * tenth, 0.1 * (tenth + 1)), now_s=100.0)
        told = one.progress()
        if not one.complete and (told.step, told.left_s) not in seen:
            seen.append((told.step, told.left_s))
    assert one.complete
    steps = [name for i, (name, _) in enumerate(seen) if i == 0 or seen[i - 1][0] != name]
    assert steps[:4] == ["ready", "hang", "raise", "bend"]
    for step in STEPS:
        left = [left_s for name, left_s in seen if name == step.name]
        assert left == sorted(left, reverse=True)
        assert left[0] <= np.ceil(step.seconds)
    found = one.progress(one.outcome())
    assert found.state == "refused"  # nobody moved
    assert "raise" in found.reason


def test_a_node_that_is_silent_is_not_waited_for() -> None:
    one = guide("forearm_r", "hand_r")
    one.take(*still("forearm_r", 0.0, 0.2), now_s=1.0)
    assert one.progress().reason == LISTENING
    one.look(wear_guide.LISTEN_S + 0.1)
    assert one.progress().step == "ready"
    for second in range(14):
        one.take(*still("forearm_r", 0.2 + second, 1.2 + second), now_s=4.0 + second)
    assert one.complete


def test_samples_that_stop_end_it_with_a_reason() -> None:
    one = guide("forearm_r")
    one.take(*still("forearm_r", 0.0, 0.2), now_s=1.0)
    one.look(1.0 + wear_guide.STALLED_S)
    assert not one.complete
    one.look(1.1 + wear_guide.STALLED_S)
    assert one.complete
    assert "silent for 5 s" in one.progress(one.outcome()).reason


@pytest.mark.parametrize(
    ("segments", "heard", "asked", "reason"),
    [
        (("forearm_r",), (), (), "no samples of subject 'p01' come"),
        (("forearm_r",), ("forearm_r",), ("left",), "on the left arm sends samples"),
        (("sternum",), ("sternum",), (), "is named for an arm"),
    ],
)
def test_who_cannot_be_checked_is_told_why(
    segments: tuple[Segment, ...], heard: tuple[Segment, ...], asked: tuple[Any, ...], reason: str
) -> None:
    one = guide(*segments, asked=asked)
    for segment in heard:
        one.take(*still(segment, 0.0, 0.2), now_s=1.0)
    one.look(10.0)
    assert one.complete
    assert reason in one.progress(one.outcome()).reason


class Room:
    """A pipeline with one arm, and a desk."""

    def __init__(self) -> None:
        self.pipeline = Pipeline(Settings(auto_pose=False))
        self.pipeline.subject("p01").inform("forearm_r", INFO)
        self.desk = WearDesk(self.pipeline, "lab")
        self.answers: list[Answer] = []

    def ask(self, **arguments: Any) -> None:
        self.desk.begin("p01", arguments, lambda payload: self.answers.append(decode(payload, Answer)))

    def answered(self, count: int) -> None:
        for _ in range(1000):
            self.desk.turn()
            if len(self.answers) >= count:
                return
            threading.Event().wait(0.01)
        pytest.fail("nobody was answered")

    def told(self) -> WearProgress:
        whole = self.desk.complete("p01", Calibration(time_ns=NOW, state="done", pose="n-pose"))
        assert (whole.state, whole.pose) == ("done", "n-pose")
        assert whole.wear is not None
        return whole.wear


def test_who_asked_is_answered_once_and_everybody_is_told() -> None:
    room = Room()
    room.ask(side="right")
    assert room.desk.news == {"p01"}
    assert room.told().reason == LISTENING
    for tenth in range(round(10 * (PASS_S + 0.5))):
        room.desk.see(*still("forearm_r", 0.1 * tenth, 0.1 * (tenth + 1)))
        room.desk.see(keys.Key("lab", "p02", "imu", "forearm_r"), b"of somebody else")
    room.answered(1)
    (answer,) = room.answers
    assert not answer.ok
    assert answer.data["refused"] == answer.reason == room.told().reason
    assert room.told().state == "refused"
    room.desk.see(*still("forearm_r", 30.0, 30.1))
    room.desk.turn()
    assert len(room.answers) == 1


def test_another_check_ends_the_first_and_the_service_both() -> None:
    room = Room()
    room.ask()
    room.ask()
    assert [answer.reason for answer in room.answers] == ["another wear check was asked for"]
    room.desk.close()
    assert room.answers[1].reason == "fusion is stopping"
    assert room.told().state == "refused"


def test_what_cannot_be_worked_out_is_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wear_guide, "examine", lambda *_: 1 / 0)
    room = Room()
    room.ask()
    for tenth in range(round(10 * (PASS_S + 0.5))):
        room.desk.see(*still("forearm_r", 0.1 * tenth, 0.1 * (tenth + 1)))
    room.answered(1)
    assert "could not be worked out" in room.answers[0].reason


@pytest.mark.parametrize("arguments", [{"side": "up"}, {"sides": "left"}, {"side": 3}])
def test_what_cannot_be_asked_is_said(arguments: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="wear-check"):
        checked_wear_wish(arguments)


def test_arms_are_asked_for_by_name() -> None:
    assert checked_wear_wish({}) == []
    assert checked_wear_wish({"side": "left"}) == ["left"]
    assert checked_wear_wish({"side": "both"}) == ["right", "left"]
