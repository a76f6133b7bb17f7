import itertools

import numpy as np
import pytest

from brachium_body import angles, assumptions, kinematics, rotation
from brachium_body.assumptions import ASSUMED, EMPTY, MEASURED, StatedAngles
from brachium_body.kinematics import SegmentOrientations

N = 400
NOT_KNOWN = np.full((N, 4), np.nan)
SHOULDER, ELBOW, WRIST = set(angles.SHOULDER), set(angles.ELBOW), set(angles.WRIST)
POSED = ELBOW - {"isb_carrying"}

# What each set of sensors gives, written out: set -> measured, assumed; the rest is empty.
ANGLES = {
    "": (set(), set()),
    "upper_arm": (SHOULDER, POSED | WRIST),
    "forearm": (set(), POSED),
    "hand": (set(), WRIST),
    "forearm hand": (WRIST, POSED),
    "upper_arm hand": (SHOULDER, set()),
    "upper_arm forearm": (SHOULDER | ELBOW, set()),
    "upper_arm forearm hand": (SHOULDER | ELBOW | WRIST, set()),
}
POSITIONS = {  # shoulder, elbow, wrist, hand
    "": "....",
    "upper_arm": "mmaa",
    "forearm": "aaaa",
    "hand": "aaaa",
    "forearm hand": "aaaa",
    "upper_arm hand": "mm..",
    "upper_arm forearm": "mmma",
    "upper_arm forearm hand": "mmmm",
}
LETTER = {EMPTY: ".", MEASURED: "m", ASSUMED: "a"}


def only(segments, sensors):
    names = ("upper_arm", "forearm", "hand")
    return SegmentOrientations(
        *(q if name in sensors.split() else NOT_KNOWN for name, q in zip(names, segments, strict=True))
    )


def arms(rng, **fixed_deg):
    """Return theta (N, 7) of random arms with some angles fixed, their sides and orientations."""
    theta = rng.uniform(-1.0, 1.0, (N, 7)) * np.radians([60, 80, 80, 70, 80, 30, 60])
    for name, degrees in fixed_deg.items():
        theta[:, int(name[-1]) - 1] = np.radians(degrees)
    left = rng.random(N) < 0.5
    return theta, left, kinematics.joint_orientations(theta, left)


@pytest.mark.parametrize("sensors", ANGLES)
def test_table(sensors):
    _, _, segments = arms(np.random.default_rng(30))
    known = assumptions.known_set(only(segments, sensors))
    codes, places = assumptions.provenance(known)
    assert codes.shape == (N, len(angles.COLUMNS))
    measured = {name for name in angles.COLUMNS if (codes[:, angles.INDEX[name]] == MEASURED).all()}
    assumed = {name for name in angles.COLUMNS if (codes[:, angles.INDEX[name]] == ASSUMED).all()}
    assert (measured, assumed) == ANGLES[sensors]
    assert "".join(LETTER[int(code)] for code in places[0]) == POSITIONS[sensors]
    has_assumption = ASSUMED in codes or ASSUMED in places
    assert bool(assumptions.ASSUMPTION[known[0]]) == has_assumption


HOLDS = {  # the angles that make each assumption true, deg
    "upper_arm": {"theta4": 0, "theta5": 0, "theta6": 0, "theta7": 0},
    "forearm": {"theta1": 0, "theta2": 0, "theta3": 0, "theta6": 0, "theta7": 0},
    "hand": {"theta1": 0, "theta2": 0, "theta3": 0, "theta4": 90, "theta5": 0},
    "forearm hand": {"theta1": 0, "theta2": 0, "theta3": 0},
    "upper_arm forearm": {"theta6": 0, "theta7": 0},
    "upper_arm forearm hand": {},
}


@pytest.mark.parametrize("sensors", HOLDS)
def test_where_the_assumption_holds_the_whole_arm_is_found(sensors):
    theta, left, segments = arms(np.random.default_rng(31), **HOLDS[sensors])
    completed = assumptions.complete(only(segments, sensors), left)
    found = angles.joint_angles(*kinematics.between(completed), left)
    assert np.abs(found[:, :7] - theta).max() < 1e-9
    lengths = [0.2, 0.3, 0.25, 0.18]
    true = kinematics.positions(*segments, lengths, left)
    assert np.abs(kinematics.positions(*completed, lengths, left) - true).max() < 1e-9


@pytest.mark.parametrize("sensors", [s for s in HOLDS if HOLDS[s]])
def test_where_it_does_not_hold_what_is_wrong_is_not_called_measured(sensors):
    theta, left, segments = arms(np.random.default_rng(32))
    partial = only(segments, sensors)
    completed = assumptions.complete(partial, left)
    found = angles.joint_angles(*kinematics.between(completed), left)
    codes, place_codes = assumptions.provenance(assumptions.known_set(partial))
    wrong = np.abs(found[:, :7] - theta) > 1e-9
    assert wrong.any()
    assert not (wrong & (codes[:, :7] == MEASURED)).any()
    lengths = [0.2, 0.3, 0.25, 0.18]
    true = kinematics.positions(*segments, lengths, left)
    off = np.abs(kinematics.positions(*completed, lengths, left) - true).max(axis=-1) > 1e-9
    assert off.any()
    assert not (off & (place_codes == MEASURED)).any()


def test_upper_arm_and_hand_leave_the_forearm_open():
    _, left, segments = arms(np.random.default_rng(33))
    completed = assumptions.complete(only(segments, "upper_arm hand"), left)
    assert np.isnan(completed.trunk_from_forearm).all()
    assert np.array_equal(completed.trunk_from_hand, segments.trunk_from_hand)


def test_what_is_known_is_never_changed():
    _, left, segments = arms(np.random.default_rng(34))
    for sensors in ANGLES:
        partial = only(segments, sensors)
        for given, q in zip(partial, assumptions.complete(partial, left), strict=True):
            assert np.array_equal(q[~np.isnan(given)], given[~np.isnan(given)])


def test_the_pose_that_the_exercise_states():
    stated = StatedAngles(
        elbow_flexion=np.radians(35),
        forearm_pronation=np.radians(20),
        wrist_flexion=np.radians(-10),
        wrist_deviation=np.radians(5),
    )
    theta, left, segments = arms(np.random.default_rng(35), theta4=35, theta5=20, theta6=-5, theta7=-10)
    found = assumptions.complete(only(segments, "upper_arm"), left, stated)
    assert rotation.angle_between(found.trunk_from_hand, segments.trunk_from_hand).max() < 1e-7
    theta, left, segments = arms(
        np.random.default_rng(36), theta1=0, theta2=0, theta3=0, theta4=35, theta5=20, theta7=40
    )
    completed = assumptions.complete(only(segments, "hand"), left, stated)
    wrist = angles.joint_angles(*kinematics.between(completed), left)[:, angles.INDEX["wrist_flexion"]]
    assert np.abs(wrist - theta[:, 6]).max() < 1e-9


def test_rows_with_different_sensors_equal_each_alone():
    _, left, segments = arms(np.random.default_rng(37))
    sets = list(itertools.islice(itertools.cycle(ANGLES), N))
    mixed = SegmentOrientations(
        *(np.stack([only(segments, s)[k][i] for i, s in enumerate(sets)]) for k in range(3))
    )
    completed = assumptions.complete(mixed, left, StatedAngles(elbow_flexion=np.where(left, 0.5, np.nan)))
    codes, places = assumptions.provenance(assumptions.known_set(mixed))
    for i in range(24):
        one = SegmentOrientations(*(q[i] for q in mixed))
        side = "left" if left[i] else "right"
        alone = assumptions.complete(one, side, StatedAngles(elbow_flexion=0.5 if left[i] else np.nan))
        for q, many in zip(alone, completed, strict=True):
            assert np.allclose(q, many[i], atol=1e-15, equal_nan=True)
        own = assumptions.provenance(assumptions.known_set(one))
        assert np.array_equal(own.angles, codes[i])
        assert np.array_equal(own.positions, places[i])


def test_trunk_and_clavicle_come_with_their_own_sensors():
    known = np.array([7, 7, 3, 1, 0])
    sternum = np.array([True, False, True, True, True])
    shift = np.array([True, True, False, True, True])
    codes = assumptions.provenance(known, sternum, shift).angles
    trunk = codes[:, [angles.INDEX[name] for name in angles.TRUNK]]
    clavicle = codes[:, [angles.INDEX[name] for name in angles.CLAVICLE]]
    assert (trunk == np.where(sternum, MEASURED, EMPTY)[:, None]).all()
    # No shift from an upper arm alone, whoever says so: it takes the forearm's sensor too.
    assert (clavicle == np.array([MEASURED, MEASURED, EMPTY, EMPTY, EMPTY])[:, None]).all()
    assert (assumptions.provenance(known).angles[:, 20:] == EMPTY).all()


def test_a_pose_stands_for_segments_without_a_sensor_and_never_for_a_silent_one():
    known = np.arange(8)
    codes, silent = assumptions.provenance(known), assumptions.provenance(known, silent=np.ones(8, bool))
    for plain, gap in zip(codes, silent, strict=True):
        assert (plain == ASSUMED).any()
        assert np.array_equal(gap, np.where(plain == ASSUMED, EMPTY, plain))
        assert gap.dtype == plain.dtype


def test_what_is_empty_is_withheld():
    _, left, segments = arms(np.random.default_rng(38))
    partial = only(segments, "forearm")
    completed = assumptions.complete(partial, left)
    raw = angles.joint_angles(*kinematics.between(completed), left)
    codes, places = assumptions.provenance(assumptions.known_set(partial))
    shown = assumptions.withhold(raw, codes)
    known = {name for name in angles.COLUMNS if not np.isnan(shown[:, angles.INDEX[name]]).any()}
    assert known == POSED
    empty = np.full_like(places, EMPTY)
    assert np.isnan(assumptions.withhold(np.zeros((N, 4, 3)), empty)).all()
    assert not np.isnan(assumptions.withhold(np.zeros((N, 4, 3)), places)).any()
