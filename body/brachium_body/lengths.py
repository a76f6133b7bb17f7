"""Lengths of an arm between joint centres: measured, or estimated from the person's height."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .rotation import Array

FRACTION_OF_HEIGHT: Mapping[str, float] = {
    "chest_to_shoulder": 0.129,
    "upper_arm": 0.186,
    "forearm": 0.146,
    "hand": 0.108,
}
"""Tsilomitrou 2021, section 2: l_c, l_ua, l_fa, l_h over body height."""

HEIGHT_RELATIVE_SD = 0.05
"""Standard deviation over length of a segment estimated from height. A working assumption of this project
(people of one height differ by some centimetres over a whole arm), not a figure of the paper."""

_PLAUSIBLE_M: Mapping[str, tuple[float, float]] = {
    "chest_to_shoulder": (0.05, 0.40),
    "upper_arm": (0.10, 0.60),
    "forearm": (0.08, 0.50),
    "hand": (0.04, 0.35),
}
_PLAUSIBLE_HEIGHT_M = (0.7, 2.5)


@dataclass(frozen=True)
class ArmLengths:
    """Lengths in m between humeral head, middle of the epicondyles, middle of the styloids and tip of the
    middle finger; `chest_to_shoulder` is lateral, from the trunk's origin (Tsilomitrou's l_c).

    `relative_sd` is the standard deviation of each length over the length; 0 where it was measured.
    Raises ValueError for a length that no arm has; as an array it is those four numbers in this order.
    """

    chest_to_shoulder: float
    upper_arm: float
    forearm: float
    hand: float
    relative_sd: float = 0.0

    def __post_init__(self) -> None:
        for name, (low, high) in _PLAUSIBLE_M.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and low <= value <= high):
                raise ValueError(
                    f"length {name} must be {low:g} to {high:g} m, not {value!r}; give it in metres"
                )
        if not 0.0 <= self.relative_sd < 1.0:
            raise ValueError(f"relative_sd of lengths must be 0 to 1, not {self.relative_sd!r}")

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        """Return chest_to_shoulder, upper_arm, forearm, hand as (4,)."""
        del copy  # always a new array
        return np.array([self.chest_to_shoulder, self.upper_arm, self.forearm, self.hand], dtype=dtype)

    def position_sd(self) -> Array:
        """Return the standard deviation (4,) in m that uncertain lengths give to the positions of shoulder,
        elbow, wrist and hand, each length erring by itself along its own segment."""
        result: Array = self.relative_sd * np.sqrt(np.cumsum(np.asarray(self) ** 2))
        return result


def from_height(height_m: float) -> ArmLengths:
    """Return lengths estimated from body height in m, with their stated uncertainty. Raises ValueError."""
    low, high = _PLAUSIBLE_HEIGHT_M
    if not (math.isfinite(height_m) and low <= height_m <= high):
        raise ValueError(f"height must be {low:g} to {high:g} m, not {height_m!r}; give it in metres")
    estimated = {name: fraction * height_m for name, fraction in FRACTION_OF_HEIGHT.items()}
    return ArmLengths(**estimated, relative_sd=HEIGHT_RELATIVE_SD)


def from_measured(lengths_m: Mapping[str, float], height_m: float | None = None) -> ArmLengths:
    """Return lengths by name, those left out estimated from height.

    With any length estimated, `relative_sd` is that of an estimate for all. Raises ValueError for an unknown
    name, and for a length that is missing while the height is not known.
    """
    unknown = sorted(set(lengths_m) - set(FRACTION_OF_HEIGHT))
    if unknown:
        raise ValueError(f"unknown length {unknown[0]!r}; lengths are {', '.join(FRACTION_OF_HEIGHT)}")
    missing = [name for name in FRACTION_OF_HEIGHT if name not in lengths_m]
    if not missing:
        return ArmLengths(**lengths_m)
    if height_m is None:
        raise ValueError(f"length {missing[0]} is not given; give it, or the person's height")
    return replace(from_height(height_m), **lengths_m)
