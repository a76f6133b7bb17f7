import numpy as np
import pytest

from brachium_body import angles, kinematics, rotation
from brachium_body.continuation import AngleTracker

RATE_HZ = 50.0
SIDES = ("right", "left")
THETA = [0, 1, 2]


def movement(theta_deg, side, noise_deg=0.0, seed=0):
    """Return thorax_from_upper_arm and raw angles of theta1..3 (n, 3) deg over time."""
    theta = np.zeros((len(theta_deg), 7))
    theta[:, :3] = np.radians(theta_deg)
    joints = kinematics.joint_rotations(theta, side)
    jitter = np.random.default_rng(seed).normal(0.0, np.radians(noise_deg) / np.sqrt(3.0), (len(theta), 3))
    q = rotation.multiply(joints.thorax_from_upper_arm, rotation.from_rotation_vector(jitter))
    return q, angles.joint_angles(q, joints.upper_arm_from_forearm, joints.forearm_from_hand, side)


def follow(q, raw, side, tracker=None):
    tracker = tracker or AngleTracker(1)
    rows = np.array([0])
    return np.concatenate([tracker.step(rows, raw[i : i + 1], q[i : i + 1], side) for i in range(len(raw))])


def abduction(seconds=20.0):
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    raised = 79.0 - 71.0 * np.cos(2.0 * np.pi * time / 10.0)
    return np.stack([np.full_like(time, 5.0), -raised, 10.0 * np.sin(time)], axis=1)


def steps_deg(found, columns):
    return np.degrees(np.abs(np.diff(found[:, columns], axis=0))).max()


@pytest.mark.parametrize("side", SIDES)
def test_abduction_8_to_150_passes_the_singularity(side):
    truth = abduction()
    q, raw = movement(truth, side)
    assert steps_deg(raw, THETA) > 150.0  # without continuation it does jump
    found = follow(q, raw, side)
    assert steps_deg(found, THETA) < 2.0
    away = np.abs(np.cos(np.radians(truth[:, 1]))) > np.sin(np.radians(10.0))
    assert np.abs(found[away, :3] - np.radians(truth[away])).max() < 1e-9


def test_abduction_with_noise_stays_continuous_and_close():
    truth = abduction()
    q, raw = movement(truth, "right", noise_deg=0.3)
    found = follow(q, raw, "right")
    assert steps_deg(found, THETA) < 10.0
    assert np.degrees(np.sqrt(np.mean((found[:, :3] - np.radians(truth)) ** 2, axis=0))).max() < 2.0


def test_held_angles_still_make_the_rotation():
    q, raw = movement(abduction(), "right", noise_deg=0.3)
    found = follow(q, raw, "right")
    made = kinematics.joint_rotations(np.pad(found[:, :3], ((0, 0), (0, 4))), "right").thorax_from_upper_arm
    assert np.degrees(rotation.angle_between(made, q)).max() < 1.0


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    "start", [(5.0, -150.0, 10.0), (120.0, -20.0, 0.0), (-40.0, 0.0, 60.0), (0.0, -100.0, -40.0)]
)
def test_the_first_sample_takes_the_branch_that_a_shoulder_can_have(side, start):
    q, raw = movement(np.array([start]), side)
    assert np.allclose(np.degrees(follow(q, raw, side)[0, :3]), start)


@pytest.mark.parametrize("side", SIDES)
def test_an_arm_first_seen_in_the_singularity_has_no_theta1(side):
    q, raw = movement(np.array([(30.0, -89.999, 50.0)]), side)
    assert np.allclose(np.degrees(follow(q, raw, side)[0, :3]), [0.0, -90.0, 20.0], atol=0.01)


def test_continued_angles_are_the_same_rotations():
    rng = np.random.default_rng(40)
    steps = rotation.from_rotation_vector(rng.normal(0.0, np.radians(2.0), (3, 3000, 3)))
    q = np.empty_like(steps)
    q[:, 0] = rotation.about(0, np.radians(-85.0))
    for i in range(1, q.shape[1]):
        q[:, i] = rotation.multiply(q[:, i - 1], steps[:, i])
    raw = angles.joint_angles(*q, "right")
    found = follow(q[0], raw, "right")
    turning = [i for i in range(3, 20) if angles.COLUMNS[i] not in ("shoulder_flexion", "shoulder_abduction")]
    assert np.abs(rotation.wrap(found[:, turning] - raw[:, turning])).max() < 1e-9

    def swing(values):
        return rotation.from_rotation_vector(
            np.pad(values[:, [8, 7]] * [-1.0, 1.0], ((0, 0), (0, 1)))[:, [0, 2, 1]]
        )

    assert np.abs(np.abs(np.sum(swing(found) * swing(raw), axis=1)) - 1.0).max() < 1e-9
    made = kinematics.joint_rotations(np.pad(found[:, :3], ((0, 0), (0, 4))), "right").thorax_from_upper_arm
    cosine = np.abs(np.cos(raw[:, 1]))
    near = cosine < np.sin(np.radians(10.0))
    assert 50 < near.sum() < 1500
    error = rotation.angle_between(made, q[0])
    assert error[~near].max() < 1e-7
    assert (error[near] <= np.pi * cosine[near] + 1e-7).all()


def test_a_shoulder_lowered_another_way_than_raised_hangs_at_zero_again():
    # Up in abduction, round to the front, down in flexion: the triple of the way up would end at 180.

    def way(a, b, n=150):
        return rotation.slerp(a, b, np.linspace(0.0, 1.0, n))

    up = rotation.from_rotation_vector([-np.radians(150), 0.0, 0.0])
    front = rotation.from_rotation_vector([0.0, 0.0, np.radians(150)])
    low = rotation.from_rotation_vector([-np.radians(8), 0.0, 0.0])
    q = np.concatenate([way(low, up), way(up, front), way(front, rotation.IDENTITY)])
    raw = angles.joint_angles(q, rotation.IDENTITY, rotation.IDENTITY, "right")
    found = follow(q, raw, "right")
    assert np.abs(found[-1, :3]).max() < 1e-6
    assert np.abs(found[-1, 7:10]).max() < 1e-6


def test_turning_angles_are_unwrapped():
    time = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
    pronation = np.radians(185.0 * np.sin(2.0 * np.pi * time / 4.0))
    theta = np.zeros((len(time), 7))
    theta[:, 4] = pronation
    joints = kinematics.joint_rotations(theta, "left")
    raw = angles.joint_angles(*joints, "left")
    column = angles.INDEX["forearm_pronation"]
    assert steps_deg(raw, [column]) > 300.0
    found = follow(joints.thorax_from_upper_arm, raw, "left")
    assert np.abs(found[:, column] - pronation).max() < 1e-9
    assert np.abs(found[:, angles.INDEX["theta5"]] - pronation).max() < 1e-9
    assert np.abs(found[:, angles.INDEX["isb_pronation"]] - pronation - np.pi / 2).max() < 1e-9


def test_isb_pronation_of_a_pronated_forearm_starts_beyond_half_a_turn():
    theta = np.zeros((1, 7))
    theta[0, 4] = np.radians(95.0)
    joints = kinematics.joint_rotations(theta, "right")
    found = follow(joints.thorax_from_upper_arm, angles.joint_angles(*joints, "right"), "right")
    assert np.degrees(found[0, angles.INDEX["isb_pronation"]]) == pytest.approx(185.0)


def test_an_angle_that_no_joint_reaches_comes_back_by_a_whole_turn():
    time = np.arange(0.0, 10.0, 1.0 / RATE_HZ)
    theta = np.zeros((len(time), 7))
    theta[:, 4] = np.radians(np.linspace(0.0, 700.0, len(time)))
    joints = kinematics.joint_rotations(theta, "right")
    found = follow(joints.thorax_from_upper_arm, angles.joint_angles(*joints, "right"), "right")
    pronation = found[:, angles.INDEX["forearm_pronation"]]
    assert np.degrees(np.abs(pronation)).max() <= 200.0
    assert np.abs(rotation.wrap(pronation - theta[:, 4])).max() < 1e-9


def test_flexion_goes_over_the_top_without_a_jump():
    elevation = np.radians(np.concatenate([np.linspace(150.0, 186.0, 60), np.linspace(186.0, 10.0, 200)]))
    q = rotation.from_rotation_vector(elevation[:, None] * np.array([0.0, 0.0, 1.0]))
    raw = angles.joint_angles(q, rotation.IDENTITY, rotation.IDENTITY, "right")
    found = follow(q, raw, "right")
    assert np.abs(found[:, angles.INDEX["shoulder_flexion"]] - elevation).max() < 1e-9


def test_an_arm_lowered_behind_after_passing_overhead_hangs_at_zero():
    up = np.linspace(150.0, 179.0, 60)[:, None] * [0.0, 0.0, 1.0]
    down = np.linspace(175.0, 0.0, 200)[:, None] * [-np.cos(np.radians(-30)), 0.0, np.sin(np.radians(-30))]
    q = rotation.from_rotation_vector(np.radians(np.concatenate([up, down])))
    found = follow(q, angles.joint_angles(q, rotation.IDENTITY, rotation.IDENTITY, "right"), "right")
    swing = found[:, [angles.INDEX["shoulder_flexion"], angles.INDEX["shoulder_abduction"]]]
    assert np.degrees(np.hypot(*swing.T)).max() <= 200.0
    assert np.abs(swing[-1]).max() < 1e-9


def test_a_turned_forearm_is_still_turned_after_a_gap():
    theta = np.zeros((4, 7))
    theta[:, 4] = np.radians([170.0, 185.0, 190.0, 192.0])
    joints = kinematics.joint_rotations(theta, "right")
    raw = angles.joint_angles(*joints, "right")
    raw[2] = np.nan
    found = follow(joints.thorax_from_upper_arm, raw, "right")
    pronation = np.degrees(found[:, angles.INDEX["forearm_pronation"]])
    assert np.allclose(pronation, [170.0, 185.0, np.nan, 192.0], equal_nan=True)


def test_a_gap_leaves_the_past_and_comes_out_empty():
    q, raw = movement(abduction(), "right")
    q[200:240], raw[200:240] = np.nan, np.nan
    found = follow(q, raw, "right")
    assert np.isnan(found[200:240]).all()
    assert np.isnan(found[:, : angles.INDEX["trunk_flexion"]]).any(axis=1).sum() == 40
    assert np.degrees(np.abs(found[240, :3] - found[199, :3])).max() < 40.0


def test_an_unknown_elbow_does_not_disturb_the_shoulder():
    q, raw = movement(abduction(), "right")
    elbow = [angles.INDEX[name] for name in angles.ELBOW]
    partial = raw.copy()
    partial[50:60][:, elbow] = np.nan
    found, expected = follow(q, partial, "right"), follow(q, raw, "right")
    shoulder = [angles.INDEX[name] for name in angles.SHOULDER]
    assert np.array_equal(found[:, shoulder], expected[:, shoulder])


def test_save_equals_continue():
    q, raw = movement(abduction(), "left", noise_deg=0.3)
    whole = follow(q, raw, "left")
    before = AngleTracker(1)
    follow(q[:400], raw[:400], "left", before)
    saved = before.state()
    unchanged = saved.copy()
    follow(q[400:500], raw[400:500], "left", before)
    assert np.array_equal(saved, unchanged, equal_nan=True)
    after = AngleTracker()
    after.restore(saved.tolist())
    assert np.array_equal(follow(q[400:], raw[400:], "left", after), whole[400:], equal_nan=True)


def test_one_arm_equals_many_and_they_do_not_influence_one_another():
    sides = np.array([False, True, True, False])
    seen = [movement(abduction(), "left" if left else "right", 0.3, seed) for seed, left in enumerate(sides)]
    alone = [follow(q, raw, "left" if left else "right") for (q, raw), left in zip(seen, sides, strict=True)]
    tracker = AngleTracker(2)
    tracker.grow(4)
    tracker.grow(3)
    assert tracker.count == 4
    order = np.array([2, 0, 3, 1])
    for i in range(len(alone[0])):
        rows = order if i % 7 else order[:4]
        raw = np.stack([seen[arm][1][i] for arm in rows])
        q = np.stack([seen[arm][0][i] for arm in rows])
        found = tracker.step(rows, raw, q, sides[rows])
        assert np.allclose(found, [alone[arm][i] for arm in rows], atol=1e-12, equal_nan=True)


def test_growing_keeps_and_forgetting_drops_the_past():
    q, raw = movement(abduction(), "right")
    tracker = AngleTracker(1)
    follow(q, raw, "right", tracker)
    kept = tracker.state()
    tracker.grow(3)
    assert np.array_equal(tracker.state()[:1], kept, equal_nan=True)
    assert np.isnan(tracker.state()[1:]).all()
    tracker.forget(np.array([0]))
    assert np.isnan(tracker.state()).all()


def test_a_state_of_another_width_is_refused():
    with pytest.raises(ValueError, match=r"tracker state must be \(arms, 25\), not \(2, 7\)"):
        AngleTracker().restore(np.zeros((2, 7)))
