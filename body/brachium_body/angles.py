"""Joint angles from rotations: the model's, the clinical and ISB's, side by side, in their principal ranges.

Signs, zeros and formulas stand in docs/conventions.md. Every row stands by itself; what needs the past
(turns, the way through a singularity) is in continuation.py.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .rotation import Array, wrap
from .sides import Sides, is_left, mirror_left

COLUMNS: tuple[str, ...] = (
    *("theta1", "theta2", "theta3", "theta4", "theta5", "theta6", "theta7"),
    *("shoulder_flexion", "shoulder_abduction", "shoulder_rotation"),
    *("elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation"),
    *("isb_plane", "isb_elevation", "isb_axial", "isb_elbow_flexion", "isb_carrying", "isb_pronation"),
    *("trunk_flexion", "trunk_lateral", "trunk_rotation"),
    *("clavicle_protraction", "clavicle_elevation"),
)
"""Names of all angles, in the order in which they stand in arrays, on the wire and in files."""

INDEX: dict[str, int] = {name: index for index, name in enumerate(COLUMNS)}
CLINICAL: tuple[str, ...] = COLUMNS[7:14]
SHOULDER: tuple[str, ...] = (*COLUMNS[0:3], *COLUMNS[7:10], *COLUMNS[14:17])
ELBOW: tuple[str, ...] = (*COLUMNS[3:5], *COLUMNS[10:12], *COLUMNS[17:20])
WRIST: tuple[str, ...] = (*COLUMNS[5:7], *COLUMNS[12:14])
TRUNK: tuple[str, ...] = COLUMNS[20:23]
CLAVICLE: tuple[str, ...] = COLUMNS[23:25]
SHARING_QUALITY: dict[str, tuple[str, ...]] = {
    "shoulder_angles": SHOULDER,
    "elbow_angles": ELBOW,
    "wrist_angles": WRIST,
    "trunk_angles": TRUNK,
    "clavicle_angles": CLAVICLE,
}
"""Angles of one joint rest on the same segments, so one quality holds for all of them: by the name that
tables give it."""


class _Entries(NamedTuple):
    """Entries m<row><column> (1-based, as in the papers) of rotation matrices, each (...)."""

    m11: Array
    m12: Array
    m21: Array
    m22: Array
    m31: Array
    m32: Array
    m33: Array


def joint_angles(
    thorax_from_upper_arm: npt.ArrayLike,
    upper_arm_from_forearm: npt.ArrayLike,
    forearm_from_hand: npt.ArrayLike,
    side: Sides,
    *,
    calibration_from_thorax: npt.ArrayLike | None = None,
    shoulder_shift: npt.ArrayLike | None = None,
    chest_to_shoulder: npt.ArrayLike | None = None,
) -> Array:
    """Return the angles (..., len(COLUMNS)) in rad of rotations (..., 4) of right and left arms.

    `calibration_from_thorax` (..., 4) is the thorax against its calibration pose, both in ISB axes;
    `shoulder_shift` (..., 3) is the girdle's, in trunk axes, m, with `chest_to_shoulder` (...) m. Rotations
    must be of unit length. NaN, or an argument left out, leaves NaN in every angle that needs it and nowhere
    else.
    """
    given = [
        np.asarray(q, dtype=np.float64)
        for q in (thorax_from_upper_arm, upper_arm_from_forearm, forearm_from_hand)
    ]
    trunk = np.full(4, np.nan) if calibration_from_thorax is None else calibration_from_thorax
    rows = np.broadcast_shapes(*(q.shape[:-1] for q in given), np.shape(trunk)[:-1], is_left(side).shape)
    q = np.empty((4, *rows, 4))
    for index, rotation in enumerate(given):
        q[index] = mirror_left(rotation, side)
    q[3] = trunk
    angles = np.full((*rows, len(COLUMNS)), np.nan)
    m = _entries(q)
    first = np.arctan2(-m.m12, m.m22)
    second = np.arctan2(m.m32, np.hypot(m.m12, m.m22))
    third = np.arctan2(-m.m31, m.m33)
    angles[..., 0], angles[..., 1], angles[..., 2] = first[0], second[0], third[0]
    _put_shoulder(angles, q[0])
    angles[..., 3] = angles[..., 10] = angles[..., 17] = first[1]
    angles[..., 18] = second[1]
    angles[..., 4] = angles[..., 11] = third[1]
    angles[..., 19] = wrap(third[1] + np.pi / 2.0)  # ISB counts from full supination
    angles[..., 5] = np.arctan2(m.m21[2], m.m11[2])
    angles[..., 6] = angles[..., 12] = np.arctan2(m.m32[2], m.m33[2])
    angles[..., 13] = -angles[..., 5]
    angles[..., 20], angles[..., 21], angles[..., 22] = -first[3], second[3], third[3]
    if shoulder_shift is not None and chest_to_shoulder is not None:
        angles[..., 23:25] = clavicle_angles(shoulder_shift, chest_to_shoulder, side)
    return angles


def _put_shoulder(angles: Array, q: Array) -> None:
    """Put the clinical triple and ISB's into angles, for thorax_from_upper_arm (..., 4) of right arms.

    q = swing * twist, the twist about the humerus (Y), the swing about an axis across it. With ISB's Y-X-Y
    angles p, e, a the swing is the turn by e whose axis is (-cos p, 0, sin p) and the twist is p + a, so the
    clinical triple needs no p and is smooth where p is undefined.
    """
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    half_twist = np.arctan2(y, w)
    cos_twist, sin_twist = np.cos(half_twist), np.sin(half_twist)
    sine = np.hypot(x, z)
    elevation = 2.0 * np.arctan2(sine, np.hypot(w, y))
    scale = np.where(sine > 1e-12, elevation / np.maximum(sine, 1e-300), 2.0)
    flexion = scale * (z * cos_twist - x * sin_twist)
    abduction = -scale * (x * cos_twist + z * sin_twist)
    plane = np.arctan2(flexion + 0.0, abduction + 0.0)  # + 0.0 turns -0.0 round: just hanging, the plane is 0
    angles[..., 7], angles[..., 8], angles[..., 9] = flexion, abduction, wrap(2.0 * half_twist)
    angles[..., 14], angles[..., 15], angles[..., 16] = plane, elevation, wrap(2.0 * half_twist - plane)


def clavicle_angles(shoulder_shift: npt.ArrayLike, chest_to_shoulder: npt.ArrayLike, side: Sides) -> Array:
    """Return protraction and elevation (..., 2) in rad: by how much the line from chest to shoulder turns
    forward and upward when the shoulder moves by `shoulder_shift` (..., 3) m in trunk axes."""
    lateral, forward, up = np.moveaxis(np.asarray(shoulder_shift, dtype=np.float64), -1, 0)
    reach = np.asarray(chest_to_shoulder, dtype=np.float64) + np.where(is_left(side), -lateral, lateral)
    return np.stack([np.arctan2(forward, reach), np.arctan2(up, np.hypot(reach, forward))], axis=-1)


def _entries(q: Array) -> _Entries:
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    xx, yy, zz = x * x, y * y, z * z
    return _Entries(
        m11=1.0 - 2.0 * (yy + zz),
        m12=2.0 * (x * y - w * z),
        m21=2.0 * (x * y + w * z),
        m22=1.0 - 2.0 * (xx + zz),
        m31=2.0 * (x * z - w * y),
        m32=2.0 * (y * z + w * x),
        m33=1.0 - 2.0 * (xx + yy),
    )
