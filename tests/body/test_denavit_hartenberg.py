import numpy as np
import pytest

from brachium_body import denavit_hartenberg as printed
from brachium_body import kinematics, rotation
from brachium_body.lengths import from_height

LENGTHS = from_height(1.8)
wrap = rotation.wrap


@pytest.fixture(scope="module")
def theta():
    return np.random.default_rng(10).uniform(-1.0, 1.0, (2000, 7)) * np.radians(
        [180, 89, 180, 180, 180, 180, 180]
    )


@pytest.fixture(scope="module")
def frames(theta):
    return printed.frames(theta, LENGTHS)


def between(frames, outer, inner):
    return np.swapaxes(frames[:, outer, :3, :3], -1, -2) @ frames[:, inner, :3, :3]


def test_zero_pose_is_a_straight_arm_hanging_beside_the_chest():
    tips = printed.frames(np.zeros(7), LENGTHS)[[1, 4, 6, 8], :3, 3]
    assert np.allclose(
        tips, [[0, 0, 0.2322], [-0.3348, 0, 0.2322], [-0.5976, 0, 0.2322], [-0.792, 0, 0.2322]]
    )


def test_the_closed_form_is_the_product_of_the_printed_matrices(theta, frames):
    segments = kinematics.joint_orientations(theta, "right")
    for q, frame, constant in zip(
        segments, (4, 6, 8), (np.eye(3), printed.FRAME6_FROM_FOREARM, printed.FRAME8_FROM_HAND), strict=True
    ):
        expected = printed.TRUNK_FROM_C @ frames[:, frame, :3, :3] @ constant
        assert np.abs(rotation.to_matrix(q) - expected).max() < 1e-12
    places = frames[:, [1, 4, 6, 8]][..., :3, 3] @ printed.TRUNK_FROM_C.T
    assert np.abs(kinematics.positions(*segments, LENGTHS, "right") - places).max() < 1e-12


def test_equation_10_holds_in_the_count_from_0_to_8_only(theta, frames):
    given = printed.equation_10(theta)
    assert np.abs(given - frames[:, 4, :3, :3]).max() < 1e-12
    assert np.abs(given - frames[:, 3, :3, :3]).max() > 1.0
    assert np.abs(given - frames[:, 5, :3, :3]).max() > 1.0


def test_equation_12_is_exact_on_both_sides(theta):
    for side in ("right", "left"):
        found = printed.printed_angles(kinematics.joint_rotations(theta, side), side)
        assert np.abs(wrap(found[:, :3] - theta[:, :3])).max() < 1e-9


def test_erratum_t6_on_frames_4_and_6(theta):
    found = printed.printed_angles(kinematics.joint_rotations(theta, "right"), "right")
    assert np.abs(wrap(found[:, 3] + theta[:, 4])).max() < 1e-9  # (13) gives -theta5
    assert np.abs(wrap(found[:, 4] - theta[:, 3] - np.pi)).max() < 1e-9  # (14) gives theta4 + 180 deg
    assert np.abs(wrap(found[:, 3:5] - theta[:, 3:5])).max() > 3.0


def test_erratum_t6_on_the_segments_own_axes(theta):
    found = printed.printed_angles(kinematics.joint_rotations(theta, "left"), "left", of="segment")
    assert np.abs(wrap(found[:, 3] - theta[:, 4])).max() < 1e-9
    assert np.abs(wrap(found[:, 4] - theta[:, 3])).max() < 1e-9


def test_erratum_t7(theta):
    found = printed.printed_angles(kinematics.joint_rotations(theta, "right"), "right")
    assert np.abs(wrap(found[:, 5] - theta[:, 6])).max() < 1e-9  # (15) gives theta7
    assert np.abs(wrap(found[:, 6] - theta[:, 5] + np.pi / 2)).max() < 1e-9  # (16) gives theta6 - 90 deg


def test_printed_equations_read_the_papers_own_matrices(theta, frames):
    elbow, wrist = between(frames, 4, 6), between(frames, 6, 8)
    literal = np.stack(
        [
            np.arctan2(-elbow[:, 2, 0], elbow[:, 2, 2]),
            np.arctan2(-elbow[:, 0, 1], elbow[:, 1, 1]),
            np.arctan2(wrist[:, 2, 0], -wrist[:, 2, 2]),
            np.arctan2(wrist[:, 0, 1], -wrist[:, 1, 1]),
        ],
        axis=-1,
    )
    found = printed.printed_angles(kinematics.joint_rotations(theta, "right"), "right")
    assert np.abs(wrap(found[:, 3:] - literal)).max() < 1e-9


def test_the_correction_gives_all_angles_back(theta, frames):
    found = printed.corrected_angles(between(frames, 4, 6), between(frames, 6, 8))
    assert np.abs(wrap(found - theta[:, 3:])).max() < 1e-9


def test_table_2_counts_abduction_and_external_rotation_against_the_chain():
    """T4: positive theta2 moves a right arm's tip inward, though Table 2 lists abduction as positive."""
    tip = printed.frames([0.0, np.radians(10), 0, 0, 0, 0, 0], LENGTHS)[8, :3, 3]
    still = printed.frames(np.zeros(7), LENGTHS)[8, :3, 3]
    assert (printed.TRUNK_FROM_C @ (tip - still))[0] == pytest.approx(-0.1375, abs=1e-4)
    assert printed.TABLE_2_DEG[1] == (0.0, 180.0)
