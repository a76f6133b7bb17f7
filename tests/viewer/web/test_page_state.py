"""What pages are told, from bus messages and times."""

import json

import pytest

from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.web import frames
from brachium_viewer.web.page_state import GONE_NS, MISSING_NS, PageState
from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info, Session

S = 1_000_000_000


@pytest.fixture
def fed(arm_at):
    """A function that feeds one skeleton into a state, at a time."""

    def feed(state: PageState, seconds: float, subject: str = "p01", **words: object) -> None:
        skeleton = arm_at(seconds, time_ns=round(S * seconds), **words)
        state.feed(keys.skeleton("lab", subject, skeleton.side), encode(skeleton), round(S * seconds))

    return feed


def test_a_frame_holds_the_newest_of_each_arm_once(fed):
    state = PageState("lab")
    fed(state, 1.0)
    fed(state, 1.02)
    fed(state, 1.02, side="left")
    frame = state.frame(round(1.03 * S))
    assert frame is not None
    assert frame["subject"] == "p01"
    assert {side: arm["t"] for side, arm in frame["arms"].items()} == {"right": 1020.0, "left": 1020.0}
    assert state.frame(round(1.04 * S)) is None
    fed(state, 1.05)
    assert state.frame(round(1.06 * S)) is not None


def test_a_silent_arm_keeps_its_pose_and_loses_its_numbers(fed):
    state = PageState("lab")
    fed(state, 1.0)
    live = state.frame(S)
    silent = state.frame(S + MISSING_NS + 1)
    assert live is not None
    assert silent is not None
    assert not live["arms"]["right"]["stale"]
    assert silent["arms"]["right"]["stale"]
    assert silent["arms"]["right"]["positions"] == live["arms"]["right"]["positions"]
    assert set(silent["arms"]["right"]["parts"].values()) == {"missing"}
    assert {tuple(angle) for angle in silent["arms"]["right"]["angles"].values()} == {(None, "missing")}
    gone = state.frame(S + GONE_NS + 1)
    assert gone is not None
    assert gone["arms"] == {}


def test_an_angle_goes_with_its_quality_and_one_that_is_not_known_is_null(arm_at):
    import msgspec

    skeleton = msgspec.structs.replace(arm_at(1.0), assumed={"wrist_flexion": "assumed"})
    del skeleton.angles["wrist_deviation"]
    shown = frames.arm(skeleton, stale=False)["angles"]
    assert shown["wrist_flexion"][1] == "assumed"
    assert shown["elbow_flexion"][1] == "good"
    assert shown["wrist_deviation"] == (None, "missing")
    assert shown["isb_elevation"] == (None, "missing")


@pytest.mark.parametrize("origin", ["emulated", "playback"])
def test_anything_that_is_not_worn_makes_the_whole_page_say_so(fed, origin):
    state = PageState("lab")
    fed(state, 1.0, origin="worn")
    assert state.state(S)["origin"] == "worn"
    info = Info(node="n", rate_hz=100.0, origin=origin, host="h")
    state.feed(keys.info("lab", "p01", "sternum"), encode(info), S)
    assert state.state(S)["origin"] == origin


def test_the_first_heard_is_shown_and_a_reference_set_is_not(fed):
    state = PageState("lab")
    fed(state, 1.0, subject="p01.ref")
    assert state.subject is None
    fed(state, 1.0, subject="p02")
    fed(state, 1.0, subject="p01")
    assert state.subject == "p02"
    state.choose("p01")
    frame = state.frame(S)
    assert frame is not None
    assert frame["subject"] == "p01"


def test_nobody_else_is_chosen_while_a_set_runs_and_no_second_set_begins(fed):
    state = PageState("lab")
    begins = ExerciseBegins(exercise="elbow-flexion", side="right")
    with pytest.raises(ValueError, match="no subject"):
        state.begin(begins, S)
    fed(state, 1.0)
    state.begin(begins, S)
    with pytest.raises(ValueError, match="stop it first"):
        state.begin(begins, S)
    with pytest.raises(ValueError, match="stop it first"):
        state.choose("p02")
    assert state.end() is not None
    assert state.end() is None
    state.choose("p02")
    with pytest.raises(keys.BadKey):
        state.choose("a/b")


def test_a_set_counts_what_the_arm_does(fed):
    state = PageState("lab")
    fed(state, 0.0)
    state.begin(ExerciseBegins(exercise="elbow-flexion", side="right", repetitions=3, limit_deg=100.0), 0)
    for number in range(1, 50 * 20):
        fed(state, number / 50)
    frame = state.frame(20 * S)
    assert frame is not None
    # The arm swings with 1.3 rad/s between 25 and 115 deg: four times within 20 s.
    assert frame["set"]["count"] in (3, 4)
    assert frame["set"]["done"]
    assert frame["set"]["best"] == pytest.approx(115.0, abs=3.0)
    assert state.state(20 * S)["set"]["repetitions"] == 3


def test_calibration_and_session_are_shown_as_they_were_told():
    state = PageState("lab", "p01")
    news = Calibration(time_ns=1, state="running", motion="pronation", progress=0.5)
    state.feed(keys.calibration("lab", "p01"), encode(news), S)
    state.feed(keys.session("lab", "p01"), encode(Session(side="left", height_m=1.7)), S)
    shown = state.state(S)
    assert shown["calibration"]["motion"] == "pronation"
    assert shown["session"] == {"side": "left", "height_m": 1.7, "lengths_m": {}}


@pytest.mark.parametrize(("state", "left"), [("waiting", None), ("running", None), ("done", "done")])
def test_a_calibration_that_goes_on_ends_with_fusion(state, left):
    pages = PageState("lab", "p01")
    pages.feed(keys.calibration("lab", "p01"), encode(Calibration(time_ns=1, state=state)), S)
    pages.token(keys.services("lab", "gateway/g/alive"), False)
    assert pages.state(S)["calibration"]["state"] == state
    pages.token(keys.services("lab", "fusion/f/alive"), True)
    assert pages.state(S)["calibration"]["state"] == state
    pages.token(keys.services("lab", "fusion/f/alive"), False)
    shown = pages.state(S)["calibration"]
    assert (shown and shown["state"]) == left


def test_what_cannot_be_read_is_counted_and_harms_nothing(fed):
    state = PageState("lab")
    state.feed("not/ours", b"x", S)
    state.feed(keys.skeleton("lab", "p01", "right"), b"\x00\xff", S)
    state.feed(keys.info("lab", "p01", "sternum"), b"\x00\xff", S)
    fed(state, 1.0)
    assert state.network.drops == {"bad_key": 1, "malformed": 2}
    assert state.frame(S) is not None


def test_everything_told_is_json(fed):
    state = PageState("lab")
    fed(state, 1.0)
    state.begin(ExerciseBegins(exercise="free", side="right"), S)
    for told in (frames.hello("lab"), state.frame(S), state.state(S)):
        assert json.loads(json.dumps(told, allow_nan=False)) is not None


def test_exercises_of_the_shoulder_are_held_against_their_movements_reference():
    rows = {row["name"]: row for row in frames.hello("lab")["exercises"]}
    assert (rows["elbow-flexion"]["band"], rows["elbow-flexion"]["need"]) == ([0.0, 150.0], 130.0)
    assert rows["elbow-extension"]["need"] == 30.0
    assert (rows["shoulder-flexion"]["band"], rows["shoulder-flexion"]["need"]) == ([0.0, 180.0], 121.0)
    assert (rows["shoulder-abduction"]["band"], rows["shoulder-abduction"]["need"]) == ([0.0, 180.0], 128.0)
    assert (rows["shoulder-extension"]["band"], rows["shoulder-extension"]["need"]) == ([0.0, 60.0], 46.0)
    assert rows["scapular-elevation"]["band"] is None


def test_a_mark_has_the_time_of_the_samples_though_an_arm_is_silent_and_this_clock_is_another(arm_at):
    state = PageState("lab")
    assert state.instant_ns(5 * S) == 5 * S
    for side, heard_s, taken_s in (("left", 4.0, 2000.0), ("right", 5.0, 1000.0)):
        skeleton = arm_at(0.0, side=side, time_ns=round(S * taken_s))
        state.feed(keys.skeleton("lab", "p01", side), encode(skeleton), round(S * heard_s))
    assert state.instant_ns(5 * S) == 1000 * S
    begun_ns = state.instant_ns(7 * S)
    assert begun_ns == 1002 * S
    state.begin(ExerciseBegins(exercise="free", side="right"), begun_ns)
    late = arm_at(3.0, time_ns=1003 * S)
    state.feed(keys.skeleton("lab", "p01", "right"), encode(late), 8 * S)
    assert state.running is not None
    assert state.running.progress().angle_deg is not None
