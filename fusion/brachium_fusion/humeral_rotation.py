"""Rotation of the upper arm about its own axis, from where the bent forearm points. Pure.

Skin lets the upper-arm sensor follow only part of the humerus's rotation (about 70 % by common report), but
the elbow is a hinge: with the carrying angle b known, the forearm's axis seen from the upper arm can only be

    Z(flexion) X(b) e_y = (-sin f cos b, cos f cos b, sin b)

so the angle about the humerus by which it is seen elsewhere is how far the sensor stayed behind. A straight
arm shows nothing: below 15 deg of flexion what was last seen is kept, from 30 deg on the forearm decides, in
between the two are blended, so the correction has no jumps and does not depend on the rate of the rows.
"""

from math import radians
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Side
from brachium_body.sides import Sides, is_left

Floats = npt.NDArray[np.float64]

UNSEEN = radians(15.0)
SEEN = radians(30.0)
MOST = radians(60.0)
"""A twist beyond this is no lag of the skin: sensors were moved or mounted otherwise."""


def lagging_twist(
    world_from_upper_arm: npt.ArrayLike,
    world_from_forearm: npt.ArrayLike,
    carrying: npt.ArrayLike,
    side: Sides,
) -> tuple[Floats, Floats]:
    """Return the twist (...) rad about the upper arm's axis that its sensor missed, and its weight 0..1.

    Orientations (..., 4) of the segments in one world; `carrying` (...) rad, ISB's sign (valgus negative).
    The corrected upper arm is multiply(world_from_upper_arm, about(1, twist)). The weight is 0 for a straight
    arm, where nothing is known, and the twist then 0.
    """
    q = rotation.multiply(rotation.inverse(world_from_upper_arm), world_from_forearm)
    x, y, z = np.moveaxis(rotation.rotate(q, np.array([0.0, 1.0, 0.0])), -1, 0)
    b = np.where(is_left(side), -1.0, 1.0) * np.asarray(carrying, dtype=np.float64)
    flexion = np.arccos(np.clip(y / np.cos(b), -1.0, 1.0))
    expected = np.arctan2(np.sin(b), np.sin(flexion) * np.cos(b))
    twist = rotation.wrap(np.arctan2(z, -x) - expected)
    share = np.clip((flexion - UNSEEN) / (SEEN - UNSEEN), 0.0, 1.0)
    weight = share * share * (3.0 - 2.0 * share)
    usable = np.isfinite(twist) & (np.abs(twist) <= MOST) & (weight > 0.0)
    return np.where(usable, twist, 0.0), np.where(usable, weight, 0.0)


class HumeralRotation:
    """The correction of one arm, with the memory of what was last seen."""

    def __init__(self, carrying_rad: float, side: Side) -> None:
        self._carrying = carrying_rad
        self._side: Side = side
        self._kept = 0.0

    def correct(self, world_from_upper_arm: Floats, world_from_forearm: Floats) -> Floats:
        """Return the upper arm's orientations (n, 4), corrected; rows in order of time, NaN stays NaN."""
        twist, weight = lagging_twist(world_from_upper_arm, world_from_forearm, self._carrying, self._side)
        sure = np.maximum.accumulate(np.where(weight >= 1.0, np.arange(len(twist)), -1))
        kept = np.where(sure >= 0, twist[sure], self._kept)
        if len(kept):
            self._kept = float(kept[-1])
        offset = weight * twist + (1.0 - weight) * kept
        return rotation.multiply(world_from_upper_arm, rotation.about(1, offset))

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {"kept": self._kept}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the arm whose state this is would have."""
        self._kept = float(state["kept"])
