"""Angles over time: whole turns kept, and the model's shoulder angles led through their singularity.

Angles of one instant lie in principal ranges and jump where those end. `AngleTracker` remembers each arm's
last angles and gives, for each new instant, the equivalent angles that follow them.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from .angles import COLUMNS, INDEX
from .rotation import Array, to_matrix, wrap
from .sides import Sides, mirror_left

Rows = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

_TURN = 2.0 * np.pi

_MIDDLE_DEG: Mapping[str, float] = {
    "shoulder_rotation": 0.0,
    "elbow_flexion": 72.5,
    "theta4": 72.5,
    "isb_elbow_flexion": 72.5,
    "forearm_pronation": 0.0,
    "theta5": 0.0,
    "isb_pronation": 90.0,
    "wrist_flexion": 0.0,
    "theta7": 0.0,
    "wrist_deviation": 7.5,
    "theta6": -7.5,
    "isb_plane": 30.0,
    "isb_axial": -30.0,
    "trunk_flexion": 0.0,
    "trunk_rotation": 0.0,
}
"""The columns that can wrap, and the middle of what each joint can do."""

_TURNING: Rows = np.array([INDEX[name] for name in _MIDDLE_DEG])
_MIDDLE: Array = np.radians(list(_MIDDLE_DEG.values()))
_REACH = np.radians(200.0)
"""An angle follows the last one until it is this far from its middle: 20 deg beyond where the principal
range ends on either side, so noise there makes no jumps. No joint gets further; an angle that does (after a
passage through hanging or overhead, where some angles are undefined) comes back by a whole turn instead of
staying off for good."""

_FLEXION, _ABDUCTION = INDEX["shoulder_flexion"], INDEX["shoulder_abduction"]
_OVERHEAD = np.radians(200.0)
"""The furthest elevation to which an arm is followed beyond 180 deg."""

_BOX_LOW: Array = np.radians([-90.0, -190.0, -110.0])
_BOX_HIGH: Array = np.radians([190.0, 90.0, 110.0])
_BOX_MIDDLE: Array = 0.5 * (_BOX_LOW + _BOX_HIGH)
"""theta1..3 that a shoulder can have; chooses the branch, clamps nothing."""
_BOX_TOLERANCE = np.radians(60.0)

_NEAR = np.sin(np.radians(10.0))
"""|cos theta2| below which theta1 is held more and more as it loses its meaning."""


class AngleTracker:
    """The last angles of `count` arms. Arms do not influence one another."""

    def __init__(self, count: int = 0) -> None:
        self._last = np.full((count, len(COLUMNS)), np.nan)

    @property
    def count(self) -> int:
        """How many arms it follows."""
        return len(self._last)

    def grow(self, count: int) -> None:
        """Follow `count` arms; new ones have no past. It never shrinks."""
        if count > self.count:
            self._last = np.concatenate([self._last, np.full((count - self.count, len(COLUMNS)), np.nan)])

    def forget(self, rows: Rows) -> None:
        """Take away the past of these arms, as when calibration has changed what their angles mean."""
        self._last[rows] = np.nan

    def state(self) -> Array:
        """Return a copy of all that it remembers, (count, len(COLUMNS)) rad."""
        return self._last.copy()

    def restore(self, state: npt.ArrayLike) -> None:
        """Continue from what `state` returned. Raises ValueError for an array of another width."""
        last = np.array(state, dtype=np.float64)
        if last.ndim != 2 or last.shape[1] != len(COLUMNS):
            raise ValueError(f"tracker state must be (arms, {len(COLUMNS)}), not {last.shape}")
        self._last = last

    def step(self, rows: Rows, raw: Array, thorax_from_upper_arm: Array, side: Sides) -> Array:
        """Return the angles (m, len(COLUMNS)) that follow the last ones of the arms `rows` (m,), each named
        once.

        `raw` comes from `angles.joint_angles`, `thorax_from_upper_arm` (m, 4) is what it was made from. NaN
        stays NaN and leaves what is remembered of that column; the next known angle follows the last known
        one.
        """
        last = self._last[rows]
        result = raw.copy()
        result[:, _TURNING] = _follow(raw[:, _TURNING], last[:, _TURNING])
        swing = [_FLEXION, _ABDUCTION]
        result[:, swing] = _follow_swing(raw[:, swing], last[:, swing])
        result[:, :3] = _follow_theta(raw[:, :3], last[:, :3], mirror_left(thorax_from_upper_arm, side))
        self._last[rows] = np.where(np.isnan(result), last, result)
        return result


def _follow(raw: Array, last: Array) -> Array:
    """Return raw (m, n) moved by whole turns to follow last; where there is none, to lie about the middle."""
    about_middle = _MIDDLE + wrap(raw - _MIDDLE)
    following = last + wrap(raw - last)
    return np.where(np.abs(following - _MIDDLE) <= _REACH, following, about_middle)


def _follow_swing(raw: Array, last: Array) -> Array:
    """Return flexion and abduction (m, 2) led over the top: the turn by e one way is that by e - 360 deg."""
    elevation = np.hypot(raw[:, 0], raw[:, 1])
    over = raw * (1.0 - _TURN / np.maximum(elevation, 1e-9))[:, None]
    nearer = np.sum((over - last) ** 2, axis=1) < np.sum((raw - last) ** 2, axis=1)
    return np.where((nearer & (_TURN - elevation <= _OVERHEAD))[:, None], over, raw)


def _follow_theta(raw: Array, last: Array, thorax_from_upper_arm: Array) -> Array:
    """Return theta1..3 (m, 3) continued; the rotations (m, 4) are those of right arms.

    Each rotation has two triples: (a1, a2, a3) and (a1 + 180, 180 - a2, a3 + 180). The one that follows the
    last is taken; the first of an arm, the one that lies in the shoulder's range.
    """
    first = np.isnan(last[:, 0])
    near_to = np.where(first[:, None], _BOX_MIDDLE, last)
    one, other = raw, _other_branch(raw)
    one_near, other_near = near_to + wrap(one - near_to), near_to + wrap(other - near_to)
    one_cost = np.where(first, _off_range(one_near), np.abs(one_near - near_to).sum(axis=1))
    other_cost = np.where(first, _off_range(other_near), np.abs(other_near - near_to).sum(axis=1))
    change: Mask = other_cost < one_cost
    result = np.where(change[:, None], other_near, one_near)
    singular: Mask = np.abs(np.cos(raw[:, 1])) < _NEAR
    if singular.any():
        # For an arm first seen there theta1 is 0 and the whole turn is theta3's.
        before = np.where(first[:, None], 0.0, last)
        result[singular] = _hold(result[singular], before[singular], thorax_from_upper_arm[singular])
    lost: Mask = ~first & ~singular & (_off_range(result) > _BOX_TOLERANCE)
    if lost.any():
        result[lost] = _back_in_range(result[lost])
    return result


def _hold(angles: Array, last: Array, thorax_from_upper_arm: Array) -> Array:
    """Return theta1..3 near theta2 = +-90 deg, where rotation fixes only theta1 +- theta3.

    theta1 keeps its last value in the singularity and goes over to the measured one 10 deg from it; theta2
    and theta3 are then read from what is left of the rotation, so the three still make the rotation to within
    |cos theta2| times the change of theta1.
    """
    weight = (np.cos(angles[:, 1]) / _NEAR) ** 2
    theta1 = last[:, 0] + weight * (angles[:, 0] - last[:, 0])
    c, s = np.cos(theta1), np.sin(theta1)
    m = to_matrix(thorax_from_upper_arm)
    theta2 = np.arctan2(m[:, 2, 1], c * m[:, 1, 1] - s * m[:, 0, 1])
    theta3 = np.arctan2(c * m[:, 0, 2] + s * m[:, 1, 2], c * m[:, 0, 0] + s * m[:, 1, 0])
    return last + wrap(np.stack([theta1, theta2, theta3], axis=1) - last)


def _back_in_range(angles: Array) -> Array:
    """Return the triple that lies in the shoulder's range, where there is one: an arm that was lowered by
    another way than it was raised would keep a triple that reads 180 deg while it hangs."""
    one = _BOX_MIDDLE + wrap(angles - _BOX_MIDDLE)
    other = _BOX_MIDDLE + wrap(_other_branch(angles) - _BOX_MIDDLE)
    best = np.where((_off_range(other) < _off_range(one))[:, None], other, one)
    return np.where((_off_range(best) == 0.0)[:, None], best, angles)


def _other_branch(angles: Array) -> Array:
    return np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=1)


def _off_range(angles: Array) -> Array:
    """Return by how much theta1..3 (m, 3) lie outside a shoulder's range, (m,) rad in all."""
    off: Array = np.maximum(np.maximum(_BOX_LOW - angles, angles - _BOX_HIGH), 0.0).sum(axis=1)
    return off
