"""The measures of movements whose numbers are known."""

import numpy as np
import pytest

from brachium_viewer.exercises import EXERCISES
from brachium_viewer.metrics.arm_motion import ArmMotion
from brachium_viewer.metrics.medians import FEW, values
from brachium_viewer.metrics.repetition_measures import NAMES, count, repetition_measures
from brachium_viewer.metrics.set_measures import SetMeasures, loss_between, set_measures, together

TIME = np.arange(0.0, 60.0, 0.02)


def reaches(ways: list[float], base: float = 0.0, move_s: float = 1.5, hold_s: float = 1.0) -> np.ndarray:
    """Return minimum-jerk repetitions every 5 s."""
    angle = np.full_like(TIME, base)
    for k, way in enumerate(ways):
        for at, change in ((5 * k + 0.5, way), (5 * k + 0.5 + move_s + hold_s, -way)):
            u = np.clip((TIME - at) / move_s, 0.0, 1.0)
            angle += change * u**3 * (10 - 15 * u + 6 * u * u)
    return angle


def test_one_repetition_of_known_size(motion_of) -> None:
    motion = motion_of(TIME, {"elbow_flexion": reaches([80.0] * 3, base=20.0)})
    exercise = EXERCISES["elbow-flexion"]
    found = [
        repetition_measures(motion, exercise, r, "hand", 90.0) for r in count(motion, exercise).repetitions
    ]
    assert len(found) == 3
    for one in found:
        numbers = {name: m.value for name, m in one.measures.items()}
        assert list(numbers) == list(NAMES)
        assert numbers["start"] == pytest.approx(20.0, abs=0.2)
        assert numbers["peak"] == pytest.approx(100.0, abs=0.2)
        assert numbers["range"] == pytest.approx(80.0, abs=0.3)
        assert numbers["peak_speed"] == pytest.approx(1.875 * 80.0 / 1.5, rel=0.02)
        assert 1.0 < numbers["hold_time"] < 2.0
        assert numbers["sparc"] == pytest.approx(-1.45, abs=0.1)
        assert 0.3 < numbers["time_to_goal"] < 1.2
        assert numbers["shoulder_shift"] is None
        assert numbers["trunk_lean"] is None


def test_an_exercise_that_lowers_its_angle_counts_downwards(motion_of) -> None:
    motion = motion_of(TIME, {"elbow_flexion": reaches([-60.0] * 4, base=90.0)})
    found = set_measures(motion, EXERCISES["elbow-extension"], goal_deg=35.0)
    assert len(found.repetitions) == 4
    assert found.medians["start"].value == pytest.approx(90.0, abs=0.3)
    assert found.medians["peak"].value == pytest.approx(30.0, abs=0.3)
    assert found.medians["range"].value == pytest.approx(60.0, abs=0.5)
    assert found.best_peak.value == pytest.approx(30.0, abs=0.5)
    assert found.medians["time_to_goal"].value is not None
    assert found.extension_deficit.value == pytest.approx(30.0, abs=0.5)


def test_a_tremor_adds_nothing_to_the_range(motion_of) -> None:
    angle = reaches([15.0] * 4, base=35.0) + 2.0 * np.sin(2 * np.pi * 5.0 * TIME)
    found = set_measures(motion_of(TIME, {"elbow_flexion": angle}), EXERCISES["elbow-flexion"])
    assert len(found.repetitions) == 4
    assert values(found.repetitions, "range") == pytest.approx([15.0] * 4, abs=0.5)


@pytest.mark.parametrize(("plane", "exercise", "is_withheld"), [
    (0.0, "shoulder-abduction", False),
    (40.0, "shoulder-abduction", True),
    (40.0, "scapular-elevation", False),
    (90.0, "shoulder-flexion", False),
    (-90.0, "shoulder-extension", False),
    (-90.0, "shoulder-flexion", True),
])  # fmt: skip
def test_an_elevation_counts_in_its_plane_only(
    motion_of, plane: float, exercise: str, is_withheld: bool
) -> None:
    angles = {"isb_elevation": reaches([80.0] * 3), "isb_plane": np.full_like(TIME, plane)}
    found = set_measures(motion_of(TIME, angles), EXERCISES[exercise])
    assert len(found.repetitions) == 3
    peak = found.medians["peak"]
    assert (peak.value is None) == is_withheld
    assert ("plane" in peak.withheld) == is_withheld


@pytest.mark.parametrize("known_at", [lambda angle: angle > 79.5, lambda angle: angle < 40.0])
def test_a_plane_must_be_measured_throughout_the_top(motion_of, known_at) -> None:
    angle = reaches([80.0] * 3)
    motion: ArmMotion = motion_of(TIME, {"isb_elevation": angle, "isb_plane": np.zeros_like(TIME)})
    motion.quality["isb_plane"][~known_at(angle)] = "heading_assumed"
    found = set_measures(motion, EXERCISES["shoulder-abduction"])
    assert len(found.repetitions) == 3
    for one in found.repetitions:
        assert one.measures["range"].withheld.startswith("plane: ")
        assert one.measures["range"].value is None


def test_what_is_assumed_or_lost_is_withheld_with_its_reason(motion_of) -> None:
    motion: ArmMotion = motion_of(TIME, {"elbow_flexion": reaches([80.0] * 3)})
    words = motion.quality["elbow_flexion"]
    words[(TIME > 5.9) & (TIME < 6.4)] = "held"
    lost = set_measures(motion, EXERCISES["elbow-flexion"])
    assert len(lost.repetitions) == 3
    words[:] = "assumed"
    assert set_measures(motion, EXERCISES["elbow-flexion"]).repetitions == ()
    deficit = set_measures(motion, EXERCISES["elbow-flexion"]).extension_deficit
    assert deficit.value is None
    assert deficit.withheld


def test_only_who_was_asked_to_straighten_the_elbow_lacks_something(motion_of) -> None:
    motion: ArmMotion = motion_of(TIME, {"elbow_flexion": reaches([80.0] * 3)})
    for name, exercise in EXERCISES.items():
        deficit = set_measures(motion, exercise).extension_deficit
        if name in ("elbow-flexion", "elbow-extension"):
            assert deficit.value is not None
        else:
            assert deficit.withheld == "nobody was asked to straighten the elbow"


def test_half_a_repetition_unseen_is_withheld(motion_of) -> None:
    motion = motion_of(TIME, {"elbow_flexion": reaches([80.0] * 3, hold_s=2.0)})
    motion.quality["elbow_flexion"][(TIME > 6.8) & (TIME < 9.0)] = "missing"
    found = set_measures(motion, EXERCISES["elbow-flexion"])
    assert len(found.repetitions) == 3
    peak = found.repetitions[1].measures["peak"]
    assert peak.value is None
    assert peak.coverage < 0.8
    assert "sensor was not there" in peak.withheld


def test_first_against_last(motion_of) -> None:
    ways = [90.0] * FEW + [70.0] * FEW
    found = set_measures(motion_of(TIME, {"elbow_flexion": reaches(ways)}), EXERCISES["elbow-flexion"])
    assert found.first_to_last["range"].value == pytest.approx(-20.0, abs=0.5)
    few = set_measures(motion_of(TIME, {"elbow_flexion": reaches(ways[:6])}), EXERCISES["elbow-flexion"])
    assert few.first_to_last["range"].value is None
    assert "fewer than 10" in few.first_to_last["range"].withheld


@pytest.mark.parametrize(
    ("name", "active_deg", "passive_deg", "lag"),
    [("elbow-flexion", 80.0, 95.0, 15.0), ("elbow-flexion", 95.0, 80.0, -15.0),
     ("external-rotation", 40.0, 50.0, 10.0), ("external-rotation", 50.0, 40.0, -10.0)],
)  # fmt: skip
def test_active_against_passive(
    motion_of, name: str, active_deg: float, passive_deg: float, lag: float
) -> None:
    exercise = EXERCISES[name]
    sign = 1.0 if exercise.rises else -1.0
    active, passive = (
        set_measures(motion_of(TIME, {exercise.angle: sign * reaches([way] * 3)}), exercise, mode=mode)
        for way, mode in ((active_deg, "active"), (passive_deg, "passive"))
    )
    found = loss_between(active, passive, rises=exercise.rises)
    assert found.value == pytest.approx(lag, abs=0.5)


def test_the_hands_way(motion_of) -> None:
    angle = reaches([80.0] * 3)
    straight = np.stack([0.3 * angle / 80.0, np.zeros_like(angle), np.zeros_like(angle)], axis=1)
    turn = np.pi * angle / 80.0
    round_way = 0.15 * np.stack([-np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    exercise = EXERCISES["elbow-flexion"]
    found = [
        set_measures(motion_of(TIME, {"elbow_flexion": angle}, hand=h), exercise)
        for h in (straight, round_way)
    ]
    assert found[0].medians["straightness"].value == pytest.approx(1.0, abs=0.01)
    assert found[0].medians["hand_path"].value == pytest.approx(0.3, abs=0.005)
    assert found[1].medians["straightness"].value < 0.75
    assert found[1].medians["hand_path"].value > 0.35


@pytest.mark.parametrize(("sd_m", "is_withheld"), [(0.01, False), (0.02, True)])
def test_a_shoulder_that_moved_no_more_than_its_error_is_not_said_to(motion_of, sd_m, is_withheld) -> None:
    shift = np.zeros((len(TIME), 3))
    shift[:, 2] = reaches([0.05] * 3)
    angles = {"elbow_flexion": reaches([80.0] * 3)}
    motion = motion_of(TIME, angles, shift=shift, shift_sd=np.full_like(shift, sd_m))
    found = set_measures(motion, EXERCISES["elbow-flexion"]).medians["shoulder_shift"]
    assert (found.value is None) == is_withheld
    assert ("no more than its own error" in found.withheld) == is_withheld


def test_the_shoulder_is_named_by_what_is_worn(motion_of) -> None:
    shift = np.zeros((len(TIME), 3))
    shift[:, 2] = reaches([0.05] * 3)
    angles = {"elbow_flexion": reaches([80.0] * 3)}
    alone = set_measures(motion_of(TIME, angles, shift=shift), EXERCISES["elbow-flexion"])
    assert alone.medians["shoulder_shift"].value == pytest.approx(0.045, abs=0.006)
    assert alone.shoulder_word == "shoulder or trunk movement"
    lean = {**angles, "trunk_flexion": reaches([12.0] * 3)}
    both = set_measures(motion_of(TIME, lean, shift=shift, with_sternum=True), EXERCISES["elbow-flexion"])
    assert both.shoulder_word == "shoulder"
    assert both.medians["trunk_lean"].value == pytest.approx(11.0, abs=1.5)


@pytest.mark.parametrize(
    ("quality", "said"), [("assumed", "assumption"), ("held", "lost"), ("good", "no rep")]
)
def test_a_set_without_repetitions_says_whether_its_angle_was_measured(
    motion_of, quality: str, said: str
) -> None:
    still = motion_of(TIME, {"elbow_flexion": np.full(len(TIME), 30.0)})
    still.quality["elbow_flexion"][:] = quality
    found = set_measures(still, EXERCISES["elbow-flexion"])
    for one in (found, together([found, found], EXERCISES["elbow-flexion"])):
        assert said in one.medians["range"].withheld
        assert said in one.best_peak.withheld


def test_a_set_tells_the_path_of_one_point(motion_of) -> None:
    angle = reaches([80.0] * 6)
    wrist = np.stack([0.3 * angle / 80.0, np.zeros_like(angle), np.zeros_like(angle)], axis=1)

    def measured(lost_from_s: float, lost_to_s: float) -> SetMeasures:
        motion: ArmMotion = motion_of(TIME, {"elbow_flexion": angle}, hand=1.6 * wrist)
        motion.positions_m["wrist"][:] = wrist
        motion.quality["hand"][(lost_from_s <= TIME) & (lost_to_s > TIME)] = "missing"
        return set_measures(motion, EXERCISES["elbow-flexion"])

    whole, died, blinked, late = (measured(*at) for at in ((0, 0), (12, 60), (5.2, 6.6), (6, 60)))
    assert (whole.path_of, died.path_of, blinked.path_of, late.path_of) == ("hand", "wrist", "hand", "wrist")
    assert values(whole.repetitions, "hand_path") == pytest.approx([0.48] * 6, abs=0.01)
    assert values(died.repetitions, "hand_path") == pytest.approx([0.3] * 6, abs=0.01)
    assert values(blinked.repetitions, "hand_path") == pytest.approx([0.48] * 5, abs=0.01)
    same, other = (together(sets, EXERCISES["elbow-flexion"]) for sets in ((died, late), (whole, died)))
    assert same.path_of == "wrist"
    assert same.medians["hand_path"].value == pytest.approx(0.3, abs=0.01)
    assert other.path_of == ""
    for name in ("hand_path", "straightness"):
        assert other.medians[name].withheld == "of the hand in one set, of the wrist in another"
        assert other.first_to_last[name].value is None
    assert other.medians["range"].value == pytest.approx(80.0, abs=0.3)
