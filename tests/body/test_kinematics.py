import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium_body import angles, kinematics, rotation, sides
from brachium_body.lengths import ArmLengths, from_height

SIDES = ("right", "left")
LENGTHS = from_height(1.8)
OUTWARD = {"right": 1.0, "left": -1.0}


def hand_of(side, **theta):
    values = np.zeros(7)
    for name, degrees in theta.items():
        values[int(name[-1]) - 1] = np.radians(degrees)
    return kinematics.joint_orientations(values, side)


def places(side, **theta):
    return kinematics.positions(*hand_of(side, **theta), LENGTHS, side)


def test_thorax_axes_lie_in_the_trunk_as_stated():
    axes = rotation.to_matrix(kinematics.TRUNK_FROM_THORAX)
    assert np.allclose(axes, [[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # columns: forward, up, right


@pytest.mark.parametrize("side", SIDES)
def test_neutral_hangs_straight_down_beside_the_chest(side):
    x = OUTWARD[side] * 0.129 * 1.8
    assert np.allclose(
        places(side), [[x, 0, 0], [x, 0, -0.3348], [x, 0, -0.5976], [x, 0, -0.7920]], atol=1e-12
    )
    for q in hand_of(side):
        assert np.allclose(q, kinematics.TRUNK_FROM_NEUTRAL)


@pytest.mark.parametrize("side", SIDES)
def test_each_angle_moves_the_arm_where_its_name_says(side):
    right, forward, up = 0, 1, 2
    still = places(side)
    assert (places(side, theta1=10)[3] - still[3])[forward] > 0.1  # flexion
    assert (places(side, theta2=-10)[3] - still[3])[right] * OUTWARD[side] > 0.1  # abduction
    assert (places(side, theta4=10)[2] - still[2])[forward] > 0.04  # elbow flexion brings the wrist forward
    bent = places(side, theta4=90)
    turned = places(side, theta3=10, theta4=90)
    assert (turned[2] - bent[2])[right] * OUTWARD[
        side
    ] < -0.04  # internal rotation brings it before the belly
    assert bent[2][up] == pytest.approx(bent[1][up])
    thumb = rotation.rotate(hand_of(side, theta5=10).trunk_from_hand, [1.0, 0.0, 0.0])
    assert thumb[right] * OUTWARD[side] < -0.1  # pronation turns the thumb, which points forward, inward
    assert (places(side, theta6=10)[3] - still[3])[forward] > 0.03  # radial deviation, towards the thumb
    assert (places(side, theta7=10)[3] - still[3])[right] * OUTWARD[side] < -0.03  # flexion, towards the palm


def random_theta(rng, n):
    return rng.uniform(-1.0, 1.0, (n, 7)) * np.radians([180, 89, 180, 180, 180, 180, 180])


def test_closed_form_is_scipys_product_of_turns():
    theta = random_theta(np.random.default_rng(2), 200)
    joints = kinematics.joint_rotations(theta, "right", 0.1)
    expected = (
        Rotation.from_euler("ZXY", theta[:, :3]),
        Rotation.from_euler("ZXY", np.stack([theta[:, 3], np.full(200, 0.1), theta[:, 4]], axis=1)),
        Rotation.from_euler("ZX", theta[:, 5:]),
    )
    for q, judge in zip(joints, expected, strict=True):
        assert np.abs(rotation.to_matrix(q) - judge.as_matrix()).max() < 1e-12


def test_left_is_the_mirror_image_of_right():
    theta = random_theta(np.random.default_rng(3), 500)
    right = kinematics.positions(*kinematics.joint_orientations(theta, "right"), LENGTHS, "right")
    left = kinematics.positions(*kinematics.joint_orientations(theta, "left"), LENGTHS, "left")
    assert np.abs(left - right * [-1.0, 1.0, 1.0]).max() < 1e-12


def test_chain_and_between_undo_one_another():
    theta = random_theta(np.random.default_rng(4), 100)
    thorax = rotation.normalize(np.random.default_rng(5).normal(size=(100, 4)))
    joints = kinematics.joint_rotations(theta, "left", 0.2)
    back = kinematics.between(kinematics.chain(joints, thorax), thorax)
    for q, given in zip(back, joints, strict=True):
        assert rotation.angle_between(q, given).max() < 1e-7


def test_twenty_thousand_poses_of_both_arms_give_their_angles_back():
    rng = np.random.default_rng(6)
    low = np.array([-60, -89, -90, -15, -100, -35, -95])
    high = np.array([179, 89, 110, 160, 100, 50, 100])
    theta = np.radians(rng.uniform(low, high, (20_000, 7)))
    carrying = rng.uniform(-0.4, 0.4, 20_000)
    left = rng.random(20_000) < 0.5
    segments = kinematics.joint_orientations(theta, left, carrying)
    assert (
        rotation.angle_between(segments.trunk_from_hand[left], segments.trunk_from_hand[~left][0]).max() > 0.1
    )
    found = angles.joint_angles(*kinematics.between(segments), left)
    assert np.abs(found[:, :7] - theta).max() < 1e-9
    assert np.abs(found[:, angles.INDEX["isb_carrying"]] - carrying).max() < 1e-9


def test_mixed_sides_and_lengths_equal_one_arm_at_a_time():
    rng = np.random.default_rng(7)
    theta = random_theta(rng, 40)
    left = rng.random(40) < 0.5
    sizes = np.asarray(LENGTHS) * rng.uniform(0.8, 1.2, (40, 1))
    shift = rng.normal(0.0, 0.02, (40, 3))
    many = kinematics.positions(*kinematics.joint_orientations(theta, left), sizes, left, shift)
    assert many.shape == (40, 4, 3)
    for i in range(40):
        side = "left" if left[i] else "right"
        segments = kinematics.joint_orientations(theta[i], side)
        one = kinematics.positions(*segments, ArmLengths(*sizes[i]), side, shift[i])
        assert np.allclose(one, many[i], atol=1e-14)


def test_shoulder_shift_moves_the_whole_arm():
    segments = hand_of("left", theta1=40, theta4=30)
    moved = kinematics.positions(*segments, LENGTHS, "left", [0.01, 0.02, 0.03])
    assert np.allclose(moved - kinematics.positions(*segments, LENGTHS, "left"), [0.01, 0.02, 0.03])


def test_an_unknown_segment_leaves_only_what_hangs_on_it_unknown():
    upper_arm, _, hand = hand_of("right")
    found = kinematics.positions(upper_arm, np.full(4, np.nan), hand, LENGTHS, "right")
    assert np.isnan(found).any(axis=-1).tolist() == [False, False, True, True]


def test_a_side_is_right_or_left():
    with pytest.raises(ValueError, match="a side is right or left, not 'both'"):
        sides.is_left("both")
