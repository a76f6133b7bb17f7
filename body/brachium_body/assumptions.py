"""What each set of sensors gives: which angles and positions are measured, which rest on a stated pose, which
stay empty; and the segments' orientations completed with that pose.

A row's set of known segments is the number 1 (upper arm) + 2 (forearm) + 4 (hand).
"""

from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .angles import CLAVICLE, COLUMNS, ELBOW, SHOULDER, TRUNK, WRIST
from .kinematics import TRUNK_FROM_NEUTRAL, SegmentOrientations, joint_rotations
from .rotation import Array, multiply
from .sides import Sides

Codes = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]

UPPER_ARM, FOREARM, HAND = 1, 2, 4

EMPTY, MEASURED, ASSUMED = 0, 1, 2
"""Codes of an angle or position: not known; follows from the sensors; follows from the sensors and a pose
that was stated for a segment without one."""

ASSUMPTION: tuple[str, ...] = (
    "",
    "elbow and wrist are held at the angles the exercise states",
    "the upper arm hangs still, the hand is in line with the forearm",
    "the hand is in line with the forearm",
    "the upper arm hangs still, the forearm is held at the angles the exercise states",
    "",
    "the upper arm hangs still",
    "",
)
"""By set: what the angles and positions with code ASSUMED rest on."""


@dataclass(frozen=True, kw_only=True)
class StatedAngles:
    """Angles in rad, one number or (...) each, that an exercise states for joints that no sensor sees.

    `elbow_flexion` NaN means that it states none: the elbow is then at 90 deg under a sensor on the hand
    alone (Tsilomitrou 2021, 4.4) and straight under one on the upper arm alone (4.3).
    """

    elbow_flexion: npt.ArrayLike = np.nan
    forearm_pronation: npt.ArrayLike = 0.0
    wrist_flexion: npt.ArrayLike = 0.0
    wrist_deviation: npt.ArrayLike = 0.0


AS_STATED_BY_DEFAULT = StatedAngles()
ASSUMABLE: tuple[str, ...] = tuple(field.name for field in fields(StatedAngles))
"""Angles that may be stated of joints that no sensor sees."""


class Provenance(NamedTuple):
    """Codes EMPTY, MEASURED or ASSUMED: of angles (..., len(COLUMNS)) and of positions (..., 4)."""

    angles: Codes
    positions: Codes


def known_set(segments: SegmentOrientations) -> npt.NDArray[np.intp]:
    """Return the set (...) of segments whose orientation is known, that is, not NaN."""
    upper_arm, forearm, hand = (~np.isnan(np.asarray(q)[..., 0]) for q in segments)
    result: npt.NDArray[np.intp] = (UPPER_ARM * upper_arm + FOREARM * forearm + HAND * hand).astype(np.intp)
    return result


def complete(
    segments: SegmentOrientations, side: Sides, stated: StatedAngles = AS_STATED_BY_DEFAULT
) -> SegmentOrientations:
    """Return the orientations with those that are not known filled in as far as the set of sensors allows.

    Unknown ones (..., 4) come in as NaN; `side` and `stated` are one for all rows or one each. Upper arm:
    hanging in neutral. Forearm: at the stated elbow angles, where one of its neighbours alone is known.
    Hand: in line with the forearm, or at the stated wrist angles under an upper arm alone. What it does not
    give stays NaN: a forearm between a known upper arm and a known hand.
    """
    known = known_set(segments)
    hanging, posed, straight = (_among(known, sets) for sets in ((2, 4, 6), (1, 4), (2, 3)))
    if not (hanging | posed | straight).any():
        return segments
    upper_arm = np.where(hanging, TRUNK_FROM_NEUTRAL, segments.trunk_from_upper_arm)
    forearm, hand = segments.trunk_from_forearm, segments.trunk_from_hand
    if posed.any():
        joints = joint_rotations(_stated_theta(known, stated), side)
        forearm = np.where(posed, multiply(upper_arm, joints.upper_arm_from_forearm), forearm)
        hand = np.where(_among(known, (1,)), multiply(forearm, joints.forearm_from_hand), hand)
    return SegmentOrientations(upper_arm, forearm, np.where(straight, forearm, hand))


def provenance(
    known: npt.NDArray[np.intp],
    sternum: Mask | bool = False,
    shift: Mask | bool = False,
    silent: Mask | bool = False,
) -> Provenance:
    """Return what rows with these sets (...) give.

    `sternum` (...) says where the thorax against its calibration pose is known; `shift` (...) where the
    shoulder's shift is, which takes sensors on upper arm and forearm; `silent` (...) where a segment is not
    known though it carries a sensor: a pose is stated for segments without one, and a gap stays a gap.
    """
    angles = np.take(_ANGLES, known, axis=0)
    both = (known & (UPPER_ARM | FOREARM)) == (UPPER_ARM | FOREARM)
    angles[..., _TRUNK] = np.where(np.asarray(sternum)[..., None], MEASURED, EMPTY)
    angles[..., _CLAVICLE] = np.where((both & np.asarray(shift))[..., None], MEASURED, EMPTY)
    positions = np.take(_POSITIONS, known, axis=0)
    gap = np.asarray(silent)[..., None]
    return Provenance(
        np.where(gap & (angles == ASSUMED), EMPTY, angles).astype(np.uint8),
        np.where(gap & (positions == ASSUMED), EMPTY, positions).astype(np.uint8),
    )


def withhold(values: npt.ArrayLike, codes: Codes) -> Array:
    """Return angles (..., n) or positions (..., n, 3) with NaN where their code (..., n) is EMPTY."""
    array = np.asarray(values, dtype=np.float64)
    empty = (codes == EMPTY).reshape(*codes.shape, *(1,) * (array.ndim - codes.ndim))
    return np.where(empty, np.nan, array)


def _among(known: npt.NDArray[np.intp], sets: tuple[int, ...]) -> Mask:
    chosen = np.zeros(8, dtype=np.bool_)
    chosen[list(sets)] = True
    return chosen[known][..., None]


def _stated_theta(known: npt.NDArray[np.intp], stated: StatedAngles) -> Array:
    theta = np.zeros((*known.shape, 7))
    elbow = np.asarray(stated.elbow_flexion, dtype=np.float64)
    theta[..., 3] = np.where(np.isnan(elbow), np.where(known == HAND, np.pi / 2.0, 0.0), elbow)
    theta[..., 4] = stated.forearm_pronation
    theta[..., 5] = -np.asarray(stated.wrist_deviation, dtype=np.float64)
    theta[..., 6] = stated.wrist_flexion
    return theta


_NOT_CARRYING = tuple(name for name in ELBOW if name != "isb_carrying")  # no pose states a carrying angle


def _columns(names: Collection[str]) -> Mask:
    return np.array([name in names for name in COLUMNS])


def _row(measured: Collection[str] = (), assumed: Collection[str] = ()) -> Codes:
    codes = np.where(_columns(measured), MEASURED, np.where(_columns(assumed), ASSUMED, EMPTY))
    return codes.astype(np.uint8)


_TRUNK, _CLAVICLE = _columns(TRUNK), _columns(CLAVICLE)

_ANGLES: Codes = np.stack(
    [
        _row(),
        _row(measured=SHOULDER, assumed=(*_NOT_CARRYING, *WRIST)),  # upper arm
        _row(assumed=_NOT_CARRYING),  # forearm
        _row(measured=(*SHOULDER, *ELBOW)),  # upper arm + forearm
        _row(assumed=WRIST),  # hand
        _row(measured=SHOULDER),  # upper arm + hand
        _row(measured=WRIST, assumed=_NOT_CARRYING),  # forearm + hand
        _row(measured=(*SHOULDER, *ELBOW, *WRIST)),  # all three
    ]
)

_E, _M, _A = EMPTY, MEASURED, ASSUMED
_POSITIONS: Codes = np.array(  # shoulder, elbow, wrist, hand; the shoulder is where the trunk carries it
    [
        [_E, _E, _E, _E],
        [_M, _M, _A, _A],  # upper arm
        [_A, _A, _A, _A],  # forearm
        [_M, _M, _M, _A],  # upper arm + forearm
        [_A, _A, _A, _A],  # hand
        [_M, _M, _E, _E],  # upper arm + hand
        [_A, _A, _A, _A],  # forearm + hand
        [_M, _M, _M, _M],  # all three
    ],
    dtype=np.uint8,
)
