"""What wearers are led through: spans that hold what they say, poses with a person's errors, and bad ones."""

import numpy as np
import pytest

from brachium_body.angles import INDEX
from brachium_body.rotation import angle_between
from brachium_nodes.motions import pose_error
from brachium_nodes.mounting import Worn
from brachium_nodes.person import LONGEST_STAND_S, NEUTRAL_S, Person, PersonSettings
from brachium_nodes.routines import ROUTINES
from brachium_nodes.script import Span
from brachium_nodes.wearer import Wearer, WearerSettings

NAMED = [name for name in ROUTINES if name]


def person(routine: str, **other: object) -> Person:
    return Person(PersonSettings(routine=routine, exercise="shrugging", **other))  # type: ignore[arg-type]


def angle(one: Person, name: str, span: Span) -> np.ndarray:
    return np.degrees(one.posture(np.arange(span.from_s, span.to_s, 0.01), one.moving_side).angles[name])


def span(one: Person, kind: str) -> Span:
    (found,) = [s for s in one.spans[1:] if s.kind == kind] or [one.spans[0]]
    assert found.kind == kind
    return found


def repetitions(values: np.ndarray) -> int:
    middle = 0.5 * (values.min() + values.max())
    return int(((values[1:] > middle) & (values[:-1] <= middle)).sum())


@pytest.mark.parametrize("routine", NAMED)
def test_spans_follow_one_another_before_the_exercise(routine: str) -> None:
    one = person(routine)
    assert one.spans[0] == Span("n-pose", 0.0, NEUTRAL_S)
    ends = [s.to_s for s in one.spans]
    assert all(s.from_s < s.to_s for s in one.spans)
    assert all(late.from_s >= end for late, end in zip(one.spans[2:], ends[1:], strict=False))
    assert ends[-1] < one.begins_s < 60.0
    exercise = Person(PersonSettings(exercise="shrugging")).posture(np.arange(6.0, 20.0, 0.1), "right")
    later = one.posture(np.arange(6.0, 20.0, 0.1) + one.begins_s - NEUTRAL_S, "right")
    assert np.ptp(later.shift[:, 2]) == pytest.approx(np.ptp(exercise.shift[:, 2]), rel=0.05)


@pytest.mark.parametrize("routine", ["", "calibration-table", "wear-check"])
def test_who_stands_longer_does_the_same_later(routine: str) -> None:
    longer_s = 9.0
    soon, late = (
        Wearer(WearerSettings(level="typical", routine=routine, stand_s=NEUTRAL_S + more))
        for more in (0.0, longer_s)
    )
    assert late.person.begins_s == soon.person.begins_s + longer_s
    assert late.person.spans[0] == Span("n-pose", 0.0, NEUTRAL_S + longer_s)
    assert late.person.spans[1:] == tuple(s.later(longer_s) for s in soon.person.spans[1:])
    stood = late.truth(np.arange(0.0, NEUTRAL_S + longer_s - 3.0, 0.1), "right").angles
    assert np.abs(stood - stood[0]).max() < 1e-9
    t = np.arange(0.0, soon.person.begins_s + 5.0, 0.1)
    assert late.truth(t + longer_s, "right").angles == pytest.approx(soon.truth(t, "right").angles, abs=1e-9)
    then, now = (Worn.put_on("forearm_r", one.person, one.errors) for one in (soon, late))
    apart = angle_between(then.pose(t, soon.person)[0], now.pose(t + longer_s, late.person)[0])
    assert apart.max() < 1e-6, "straps settle when movement begins"


@pytest.mark.parametrize("stand_s", [NEUTRAL_S - 0.1, LONGEST_STAND_S + 1.0, float("nan")])
def test_nobody_stands_for_less_than_a_pose_takes_or_for_ever(stand_s: float) -> None:
    with pytest.raises(ValueError, match=r"of standing cannot be used; give 4 to 3600 s"):
        PersonSettings(stand_s=stand_s)


@pytest.mark.parametrize("routine", NAMED)
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_routine_is_smooth_and_ends_in_neutral(routine: str, side: str) -> None:
    one, step = person(routine, arms=side, contracture_deg=20.0), 1e-3
    hand = one.arm(np.arange(NEUTRAL_S - 0.1, one.begins_s + 3.0, step), side).joints["hand"]  # type: ignore[arg-type]
    acceleration = np.diff(hand, 2, axis=0) / step**2
    assert np.abs(np.diff(acceleration, axis=0)).max() < 1.0  # a jump of 1 mm/s would show as 1 m/s^2
    rest = person(routine, arms=side).posture(np.array([one.begins_s - 0.2]), side)  # type: ignore[arg-type]
    assert max(abs(float(v[0])) for v in rest.angles.values()) < 1e-9


def test_the_calibration_bends_five_times_turns_five_times_and_mixes_for_ten_seconds() -> None:
    one = person("calibration")
    bends, turns, mixed = (span(one, kind) for kind in ("elbow-flexion", "pronation", "free"))
    elbow = angle(one, "elbow_flexion", bends)
    assert repetitions(elbow) == 5
    assert elbow.min() == pytest.approx(8.0)
    assert elbow.max() == pytest.approx(110.0, abs=3.0)
    assert np.ptp(angle(one, "forearm_pronation", bends)) < 1e-9
    assert repetitions(angle(one, "forearm_pronation", turns)) == 5
    assert angle(one, "elbow_flexion", turns) == pytest.approx(90.0)
    assert mixed.to_s - mixed.from_s == pytest.approx(10.0)
    assert np.ptp(angle(one, "elbow_flexion", mixed)) > 30.0
    assert np.ptp(angle(one, "forearm_pronation", mixed)) > 30.0


def test_poses_are_held_still_as_they_are_named() -> None:
    table = person("calibration-table")
    held = span(table, "table")
    assert held.to_s - held.from_s == pytest.approx(4.0)
    assert angle(table, "elbow_flexion", held) == pytest.approx(90.0)
    assert angle(table, "shoulder_flexion", held) == pytest.approx(0.0)
    given = person("calibration-given")
    assert span(given, "given").angles_deg == {"elbow_flexion": 30.0}
    assert angle(given, "elbow_flexion", span(given, "given")) == pytest.approx(30.0)


def test_a_contracture_stops_the_elbow_in_every_pose_and_movement() -> None:
    one = person("calibration-given", contracture_deg=35.0, arms="both")
    assert span(one, "given").angles_deg == {"elbow_flexion": 35.0}
    for held in (one.spans[0], span(one, "given")):
        assert angle(one, "elbow_flexion", held) == pytest.approx(35.0, abs=0.4)
    assert angle(one, "elbow_flexion", span(one, "elbow-flexion")).min() == pytest.approx(35.0, abs=0.4)
    table = person("calibration-table", contracture_deg=35.0)
    assert angle(table, "elbow_flexion", span(table, "table")) == pytest.approx(90.0, abs=0.4)
    for side in ("right", "left"):
        assert np.degrees(one.posture(np.arange(0.0, 90.0, 0.1), side).angles["elbow_flexion"]).min() > 35.0  # type: ignore[arg-type]


def test_the_errors_of_poses_have_the_stated_size_and_the_truth_tells_them() -> None:
    off = [pose_error(5.0, seed, "right") for seed in range(400)]
    upper = [[e["shoulder_flexion"], e["shoulder_abduction"], e["shoulder_rotation"]] for e in off]
    fore = [[e["elbow_flexion"], e["forearm_pronation"]] for e in off]
    for turn in (upper, fore):
        assert np.sqrt((np.array(turn) ** 2).sum(axis=1).mean()) == pytest.approx(5.0, rel=0.07)
    assert min(e["elbow_flexion"] for e in off) >= 0.0
    wearer = Wearer(WearerSettings(level="patient", seed=3, routine="calibration-table"))
    expected = pose_error(5.0, 3, "right")
    (_, held, *_), mean = wearer.person.spans, 0.0
    for at, bent in ((np.arange(0.0, 4.0, 0.01), 0.0), (np.arange(held.from_s, held.to_s, 0.01), 90.0)):
        mean = np.degrees(wearer.truth(at, "right").angles.mean(axis=0))
        for name, error in expected.items():
            assert mean[INDEX[name]] == pytest.approx(error + bent * (name == "elbow_flexion"), abs=0.05)


def test_only_a_level_with_pose_errors_holds_neutral_wrong() -> None:
    for level in ("exact", "ideal", "typical"):
        wearer = Wearer(WearerSettings(level=level, arms="both"))  # type: ignore[arg-type]
        for side in ("right", "left"):
            held = wearer.truth(np.arange(0.0, 4.0, 0.5), side).angles[:, INDEX["shoulder_flexion"] :][:, :7]  # type: ignore[arg-type]
            assert np.abs(held).max() < 1e-12


def test_bad_calibrations_are_bad_in_their_way() -> None:
    good, shrugged = person("calibration"), person("calibration-shrugged")
    assert np.ptp(angle(good, "shoulder_flexion", span(good, "elbow-flexion"))) < 20.0
    assert np.ptp(angle(shrugged, "shoulder_flexion", span(shrugged, "elbow-flexion"))) > 35.0
    small = person("calibration-small")
    assert np.ptp(angle(small, "elbow_flexion", span(small, "elbow-flexion"))) < 9.0
    mixed = person("calibration-mixed-up")
    for kind in ("elbow-flexion", "pronation"):
        both = [angle(mixed, name, span(mixed, kind)) for name in ("elbow_flexion", "forearm_pronation")]
        assert np.corrcoef(both)[0, 1] > 0.999
    restless = person("calibration-restless")
    assert np.ptp(angle(restless, "shoulder_flexion", span(restless, "n-pose"))) > 5.0


def test_the_wear_check_hangs_raises_and_bends_within_ten_seconds() -> None:
    one = person("wear-check")
    hang, lift, bend = one.spans[1:]
    assert [s.kind for s in (hang, lift, bend)] == ["hang", "raise", "bend"]
    assert bend.to_s - hang.from_s == pytest.approx(10.0)
    assert np.ptp(angle(one, "shoulder_abduction", hang)) == 0.0
    lifted, bent = [], []
    for seed in range(30):
        one = person("wear-check", seed=seed)
        lifted.append([np.ptp(angle(one, name, lift)) for name in ("shoulder_abduction", "shoulder_flexion")])
        bent.append([np.ptp(angle(one, name, bend)) for name in ("elbow_flexion", "shoulder_abduction")])
    assert np.min(lifted, axis=0)[0] > 60.0
    assert np.max(lifted, axis=0)[1] < 35.0
    assert np.min(bent, axis=0)[0] > 90.0
    assert np.max(bent, axis=0)[1] < 30.0
    assert np.std(lifted, axis=0).min() > 3.0  # people do it differently


def test_the_other_arm_waits_in_neutral() -> None:
    other = person("calibration").posture(np.arange(0.0, 50.0, 0.1), "left")
    assert max(np.abs(v).max() for v in other.angles.values()) == 0.0
