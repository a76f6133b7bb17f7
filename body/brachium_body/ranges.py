"""Ranges of the angles, by name, in degrees because people read them. An angle outside is kept and
flagged."""

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .angles import COLUMNS
from .rotation import Array


class Range(NamedTuple):
    """From `low` to `high`, deg; a side that the source does not give is None."""

    low: float | None
    high: float | None

    def ends(self) -> tuple[float, float]:
        """Return both, infinite where there is none."""
        return -np.inf if self.low is None else self.low, np.inf if self.high is None else self.high


REFERENCE: Mapping[str, Range] = {
    "shoulder_flexion": Range(-60.0, 180.0),
    "shoulder_abduction": Range(0.0, 180.0),
    "shoulder_rotation": Range(-90.0, 70.0),
    "elbow_flexion": Range(0.0, 150.0),
    "forearm_pronation": Range(-80.0, 80.0),
    "wrist_flexion": Range(-70.0, 80.0),
    "wrist_deviation": Range(-20.0, 30.0),
}
"""AAOS, shown as "AAOS reference": ranges of healthy adults in general, not what is to be expected of one
person."""

PAPER: Mapping[str, Range] = {
    "shoulder_flexion": Range(-60.0, 180.0),
    "shoulder_abduction": Range(0.0, 180.0),
    "shoulder_rotation": Range(-20.0, 90.0),
    "elbow_flexion": Range(0.0, 130.0),
    "forearm_pronation": Range(-90.0, 90.0),
    "wrist_flexion": Range(-70.0, 70.0),
    "wrist_deviation": Range(-10.0, 25.0),
}
"""Tsilomitrou 2021, Table 2, in our signs: there internal rotation counts negative (-90..20)."""

FUNCTIONAL: Mapping[str, Range] = {
    "shoulder_flexion": Range(-46.0, 121.0),
    "shoulder_abduction": Range(None, 128.0),
    "elbow_flexion": Range(30.0, 130.0),
    "forearm_pronation": Range(-50.0, 50.0),
    "wrist_flexion": Range(-40.0, 40.0),
}
"""What most daily activities need: shoulder Namdari 2012 (means), elbow, forearm Morrey 1981, wrist Ryu 1991.

Namdari's cross-body adduction of 116 deg has no column here; of the wrist's deviation Ryu states only both
directions together (40 deg)."""

PLAUSIBLE: Mapping[str, Range] = {
    "shoulder_rotation": Range(-110.0, 110.0),
    "elbow_flexion": Range(-15.0, 160.0),
    "forearm_pronation": Range(-100.0, 100.0),
    "wrist_flexion": Range(-95.0, 100.0),
    "wrist_deviation": Range(-35.0, 50.0),
    "isb_elevation": Range(0.0, 185.0),
}
"""What a joint can do at all: chooses between branches and flags, never clamps."""

STATED: Mapping[str, Range] = {
    "shoulder_flexion": Range(-185.0, 185.0),  # of elevation the part to the front: it goes as far
    **{
        name: PLAUSIBLE[name]
        for name in ("elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation")
    },
}
"""Angles that a person may state, of a pose that is held or of a joint without a sensor."""

RANGES: Mapping[str, Mapping[str, Range]] = {
    "reference": REFERENCE,
    "paper": PAPER,
    "plausible": PLAUSIBLE,
    "functional": FUNCTIONAL,
}


def check_stated(angles_deg: Mapping[str, float], names: Collection[str] = tuple(STATED)) -> None:
    """Raise ValueError that begins with the angle: one that is not among `names`, or that no joint can do."""
    for name, value in angles_deg.items():
        if name not in names:
            raise ValueError(f"{name}: no angle that can be stated; expected {', '.join(sorted(names))}")
        low, high = STATED[name].ends()
        if not low <= value <= high:  # true for NaN too
            raise ValueError(f"{name} = {value:g}: no joint does that; expected degrees, {low:g} to {high:g}")


def _bounds(ranges: Mapping[str, Range]) -> tuple[Array, Array]:
    low, high = np.full(len(COLUMNS), -np.inf), np.full(len(COLUMNS), np.inf)
    for index, name in enumerate(COLUMNS):
        low[index], high[index] = np.radians(ranges.get(name, Range(None, None)).ends())
    return low, high


_LOW, _HIGH = _bounds(PLAUSIBLE)


def outside_plausible(angles: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return booleans (..., len(COLUMNS)), true where an angle in rad lies outside its plausible range.

    False where the angle is not known (NaN) or its column has no plausible range.
    """
    a = np.asarray(angles, dtype=np.float64)
    outside: npt.NDArray[np.bool_] = (a < _LOW) | (a > _HIGH)
    return outside
