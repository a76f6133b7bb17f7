"""Tsilomitrou 2021 as published: the Denavit-Hartenberg chain and the printed inverse, beside their
corrections.

The corrected model is `kinematics.joint_rotations` and `angles.joint_angles`; this module exists to show
that it is the same arm, and to compute what the printed equations give. Errata are numbered as in
docs/conventions.md:

T1  Three frame counts are used. Here frames count 0..8 with {C} = 0, the only count in which eq (10) holds:
frame 1
    stands in the shoulder, 4 on the upper arm, 6 on the forearm (origin in the wrist), 8 on the hand (its
    tip).
T2  {C} of Table 3 is x up, y backward, z right; the text speaks of the shoulder at x = l_c and motion in
y-z. Trunk
    axes are TRUNK_FROM_C times its coordinates.
T3  Section 4.3 calls the plane of abduction x-z "sagittal"; it is the frontal plane.
T4  For a right arm theta2 is adduction and theta3 internal rotation: opposite in sign to Table 2.
T5  theta5 = 0 with the hand in the sagittal plane contradicts Table 1's names for the wrist: there theta6
turns
    about the lateral axis (radial deviation) and theta7 about the forward axis (flexion).
T6  Eqs (13), (14) do not give theta4, theta5: see `printed_angles`.
T7  Eqs (15), (16) do not give theta6, theta7: likewise.
T8  Section 4.4 reports flexion as negative, Table 2 as positive.
"""

from typing import Literal

import numpy as np
import numpy.typing as npt

from .kinematics import JointRotations
from .lengths import ArmLengths
from .rotation import Array, to_matrix
from .sides import Sides, mirror_left

JOINTS: tuple[tuple[str, str], ...] = (
    ("S1", "shoulder flexion-extension"),
    ("S2", "shoulder abduction-adduction"),
    ("S3", "shoulder internal-external rotation"),
    ("E1", "elbow flexion-extension"),
    ("E2", "forearm pronation-supination"),
    ("W1", "wrist flexion-extension"),
    ("W2", "wrist radial-ulnar deviation"),
)
"""Table 1: the joint of each of theta1..7, as the paper names it (T5 for the last two)."""

TABLE_2_DEG: tuple[tuple[float, float], ...] = (
    (-60.0, 180.0),
    (0.0, 180.0),
    (-90.0, 20.0),
    (0.0, 130.0),
    (-90.0, 90.0),
    (-70.0, 70.0),
    (-10.0, 25.0),
)
"""Table 2 as printed: range of each joint of Table 1, deg (T4 for the signs of the second and third)."""

TRUNK_FROM_C: Array = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
"""M: coordinates in {C} to trunk axes (T2)."""

FRAME6_FROM_FOREARM: Array = np.diag([-1.0, -1.0, 1.0])
"""A6: the forearm's axes F = R6 A6 of frame 6."""

FRAME8_FROM_HAND: Array = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""A8: the hand's axes K = R8 A8 of frame 8. The upper arm's axes are those of frame 4."""

Frames = Literal["denavit-hartenberg", "segment"]


def link(a: npt.ArrayLike, alpha: npt.ArrayLike, d: npt.ArrayLike, theta: npt.ArrayLike) -> Array:
    """Eq (1): return the 4 x 4 transformation (..., 4, 4) of one row of the table."""
    a, alpha, d, theta = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (a, alpha, d, theta)))
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    matrix = np.zeros((*a.shape, 4, 4))
    for row, entries in enumerate(
        (
            (ct, -st * ca, st * sa, a * ct),
            (st, ct * ca, -ct * sa, a * st),
            (0.0, sa, ca, d),
            (0.0, 0.0, 0.0, 1.0),
        )
    ):
        for column, entry in enumerate(entries):
            matrix[..., row, column] = entry
    return matrix


def table_3(theta: npt.ArrayLike, lengths: ArmLengths) -> tuple[tuple[float, float, float, Array], ...]:
    """Table 3: return a, alpha, d, theta of {C}, S1, S2, S3, E1, E2, W1, W2 for joint angles (..., 7) rad."""
    t1, t2, t3, t4, t5, t6, t7 = np.moveaxis(np.asarray(theta, dtype=np.float64), -1, 0)
    quarter = np.pi / 2.0
    return (
        (0.0, 0.0, lengths.chest_to_shoulder, np.full_like(t1, -quarter)),
        (0.0, quarter, 0.0, t1 + quarter),
        (0.0, quarter, 0.0, t2 + quarter),
        (0.0, quarter, -lengths.upper_arm, t3 + quarter),
        (0.0, quarter, 0.0, t4 + np.pi),
        (0.0, -quarter, -lengths.forearm, t5),
        (0.0, quarter, 0.0, t6 - quarter),
        (-lengths.hand, quarter, 0.0, t7),
    )


def frames(theta: npt.ArrayLike, lengths: ArmLengths) -> Array:
    """Eq (2): return frames 0..8 in {C}, (..., 9, 4, 4), of a right arm with joint angles (..., 7) rad
    (T1)."""
    rows = table_3(theta, lengths)
    chain = [np.broadcast_to(np.eye(4), (*rows[0][3].shape, 4, 4))]
    for row in rows:
        chain.append(chain[-1] @ link(*row))
    return np.stack(chain, axis=-3)


def equation_10(theta: npt.ArrayLike) -> Array:
    """Eq (10): return R_0^4 (..., 3, 3), the upper arm in {C}, as printed; it is right in the count 0..8
    (T1)."""
    t1, t2, t3 = np.moveaxis(np.asarray(theta, dtype=np.float64)[..., :3], -1, 0)
    s1, s2, s3, c1, c2, c3 = np.sin(t1), np.sin(t2), np.sin(t3), np.cos(t1), np.cos(t2), np.cos(t3)
    rows = (
        (s1 * c3 + c1 * s2 * s3, c1 * c2, s1 * s3 - c1 * s2 * c3),
        (-c1 * c3 + s1 * s2 * s3, s1 * c2, -c1 * s3 - s1 * s2 * c3),
        (-c2 * s3, s2, c2 * c3),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def printed_angles(joints: JointRotations, side: Sides, of: Frames = "denavit-hartenberg") -> Array:
    """Eqs (12)-(16) as printed: return seven angles (..., 7) rad, of which the last four are wrong.

    `of` says which rotations R of elbow and wrist they are read from, which the paper leaves open: frames 6
    and 8 of its chain, or the segments' own axes. Eq (12) is exact. T6: eqs (13) and (14) give -theta5 and
    theta4 + 180 deg on R_4^6; on the segments' axes theta5 and theta4, the two swapped. T7: eqs (15) and
    (16) give theta7 and theta6 - 90 deg on R_6^8.
    """
    shoulder, elbow, wrist = (to_matrix(mirror_left(q, side)) for q in joints)
    if of == "denavit-hartenberg":
        elbow = elbow @ FRAME6_FROM_FOREARM.T
        wrist = FRAME6_FROM_FOREARM @ wrist @ FRAME8_FROM_HAND.T
    theta = np.empty((*np.broadcast_shapes(shoulder.shape, elbow.shape, wrist.shape)[:-2], 7))
    # Eqs (11), (12): alpha, beta, gamma are about {C}'s axes, a quarter turn about Z from the thorax's.
    theta[..., 0] = np.arctan2(-shoulder[..., 0, 1], shoulder[..., 1, 1])
    theta[..., 1] = np.arctan2(shoulder[..., 2, 1], np.hypot(shoulder[..., 0, 1], shoulder[..., 1, 1]))
    theta[..., 2] = np.arctan2(-shoulder[..., 2, 0], shoulder[..., 2, 2])
    theta[..., 3] = np.arctan2(-elbow[..., 2, 0], elbow[..., 2, 2])  # (13)
    theta[..., 4] = np.arctan2(-elbow[..., 0, 1], elbow[..., 1, 1])  # (14)
    theta[..., 5] = np.arctan2(wrist[..., 2, 0], -wrist[..., 2, 2])  # (15)
    theta[..., 6] = np.arctan2(wrist[..., 0, 1], -wrist[..., 1, 1])  # (16)
    return theta


def corrected_angles(rotation_4_6: npt.ArrayLike, rotation_6_8: npt.ArrayLike) -> Array:
    """Return theta4..7 (..., 4) rad, correct, from the rotations (..., 3, 3) between frames 4, 6 and 8 (T6,
    T7)."""
    elbow, wrist = np.asarray(rotation_4_6, dtype=np.float64), np.asarray(rotation_6_8, dtype=np.float64)
    return np.stack(
        [
            np.arctan2(elbow[..., 0, 1], -elbow[..., 1, 1]),
            np.arctan2(elbow[..., 2, 0], elbow[..., 2, 2]),
            np.arctan2(-wrist[..., 1, 1], -wrist[..., 0, 1]),
            np.arctan2(wrist[..., 2, 0], -wrist[..., 2, 2]),
        ],
        axis=-1,
    )
