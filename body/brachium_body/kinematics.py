"""Forward kinematics: model angles to segment orientations, orientations and lengths to positions.

The seven joints of Tsilomitrou 2021 in their reduced closed form (docs/conventions.md has frames and zeros):

    thorax_from_upper_arm  = Z(theta1) X(theta2) Y(theta3)
    upper_arm_from_forearm = Z(theta4) X(carrying) Y(theta5)
    forearm_from_hand      = Z(theta6) X(theta7)

It equals the product of the paper's Denavit-Hartenberg matrices (denavit_hartenberg.py) without any 4 x 4
matrix.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .lengths import ArmLengths
from .rotation import Array, about, inverse, multiply, rotate
from .sides import Sides, is_left, mirror_left

TRUNK_FROM_THORAX: Array = np.array([0.5, 0.5, 0.5, 0.5])
"""ISB thorax axes (X forward, Y up, Z right) to trunk axes (x right, y forward, z up), of a trunk that is
still."""

TRUNK_FROM_NEUTRAL: Array = TRUNK_FROM_THORAX
"""Orientation of upper arm, forearm and hand in neutral, both arms: their axes are the thorax's."""

JOINTS = ("shoulder", "elbow", "wrist", "hand")
"""Names of the positions, in the order of the rows of `positions`; `hand` is the tip of the middle finger."""

_DISTAL: Array = np.array([0.0, -1.0, 0.0])


class JointRotations(NamedTuple):
    """Each segment against the next nearer one, (..., 4); what joint angles are read from."""

    thorax_from_upper_arm: Array
    upper_arm_from_forearm: Array
    forearm_from_hand: Array


class SegmentOrientations(NamedTuple):
    """Each segment in trunk axes, (..., 4)."""

    trunk_from_upper_arm: Array
    trunk_from_forearm: Array
    trunk_from_hand: Array


def joint_rotations(theta: npt.ArrayLike, side: Sides, carrying: npt.ArrayLike = 0.0) -> JointRotations:
    """Return the joints' rotations for model angles theta (..., 7) rad, which mean the same on both sides.

    `carrying` (...) rad is the elbow's angle about X, ISB's sign (valgus negative); the paper's model has 0.
    """
    t1, t2, t3, t4, t5, t6, t7 = np.moveaxis(np.asarray(theta, dtype=np.float64), -1, 0)
    x, y, z = 0, 1, 2
    shoulder = multiply(multiply(about(z, t1), about(x, t2)), about(y, t3))
    elbow = multiply(multiply(about(z, t4), about(x, carrying)), about(y, t5))
    wrist = multiply(about(z, t6), about(x, t7))
    return JointRotations(*(mirror_left(q, side) for q in (shoulder, elbow, wrist)))


def joint_orientations(
    theta: npt.ArrayLike,
    side: Sides,
    carrying: npt.ArrayLike = 0.0,
    trunk_from_thorax: npt.ArrayLike = TRUNK_FROM_THORAX,
) -> SegmentOrientations:
    """Return the segments' orientations in trunk axes for model angles theta (..., 7) rad of arms of either
    side."""
    return chain(joint_rotations(theta, side, carrying), trunk_from_thorax)


def chain(
    joints: JointRotations, trunk_from_thorax: npt.ArrayLike = TRUNK_FROM_THORAX
) -> SegmentOrientations:
    """Return the segments' orientations in trunk axes from the joints' rotations."""
    upper_arm = multiply(trunk_from_thorax, joints.thorax_from_upper_arm)
    forearm = multiply(upper_arm, joints.upper_arm_from_forearm)
    return SegmentOrientations(upper_arm, forearm, multiply(forearm, joints.forearm_from_hand))


def between(
    segments: SegmentOrientations, trunk_from_thorax: npt.ArrayLike = TRUNK_FROM_THORAX
) -> JointRotations:
    """Return the joints' rotations from the segments' orientations: the inverse of `chain`."""
    upper_arm, forearm, hand = segments
    return JointRotations(
        multiply(inverse(trunk_from_thorax), upper_arm),
        multiply(inverse(upper_arm), forearm),
        multiply(inverse(forearm), hand),
    )


def positions(
    trunk_from_upper_arm: npt.ArrayLike,
    trunk_from_forearm: npt.ArrayLike,
    trunk_from_hand: npt.ArrayLike,
    lengths: ArmLengths | npt.ArrayLike,
    side: Sides,
    shoulder_shift: npt.ArrayLike | None = None,
) -> Array:
    """Return shoulder, elbow, wrist and hand (..., 4, 3) in trunk axes, m.

    `lengths` (..., 4) and `side` hold for all rows or for each; `shoulder_shift` (..., 3) m in trunk axes
    moves the whole arm. A segment that is not known (NaN) leaves all that hangs on it NaN. Positions are
    never mirrored: a left shoulder has negative x.
    """
    segments = np.stack(
        np.broadcast_arrays(
            *(
                np.asarray(q, dtype=np.float64)
                for q in (trunk_from_upper_arm, trunk_from_forearm, trunk_from_hand)
            )
        ),
        axis=-2,
    )
    size = np.asarray(lengths, dtype=np.float64)
    rows = np.broadcast_shapes(segments.shape[:-2], size.shape[:-1], is_left(side).shape)
    steps = np.zeros((*rows, 4, 3))
    steps[..., 0, 0] = np.where(is_left(side), -1.0, 1.0) * size[..., 0]
    if shoulder_shift is not None:
        steps[..., 0, :] += np.asarray(shoulder_shift, dtype=np.float64)
    steps[..., 1:, :] = size[..., 1:, None] * rotate(segments, _DISTAL)
    result: Array = np.cumsum(steps, axis=-2)
    return result
