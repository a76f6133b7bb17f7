"""One measured number with how far it can be trusted, or the reason why it is withheld. Pure."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

ENOUGH = 0.8
"""Of a movement's instants: with less measured its extreme may have been missed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """A value in `unit`, or None and why."""

    value: float | None
    unit: str
    coverage: float
    """Part of the instants that were measured, 0 to 1."""
    withheld: str = ""
    """Empty when there is a value."""


def measure(value: float, unit: str, coverage: float = 1.0) -> Measure:
    """Return the measure; a NaN is withheld, and so is what was measured for less than ENOUGH of the time."""
    if coverage < ENOUGH:
        return withheld(f"only {100 * coverage:.0f} % of it was measured", unit, coverage)
    if not np.isfinite(value):
        return withheld("not known", unit, coverage)
    return Measure(value=float(value), unit=unit, coverage=coverage)


def withheld(reason: str, unit: str, coverage: float = 0.0) -> Measure:
    """Return a measure without a value."""
    return Measure(value=None, unit=unit, coverage=coverage, withheld=reason)


REASONS = {
    "missing": "the sensor was not there",
    "held": "samples were lost",
    "uncalibrated": "the sensors were not calibrated",
    "heading_assumed": "the heading is assumed",
    "assumed": "the angle rests on an assumption",
}
"""By quality: why a number is not measured."""


def why_not(quality: npt.NDArray[np.str_]) -> str:
    """Return the commonest reason why instants (n,) are not measured; empty when all are."""
    words, counts = np.unique(quality, return_counts=True)
    bad = [(int(c), str(w)) for w, c in zip(words, counts, strict=True) if str(w) in REASONS]
    return REASONS[max(bad)[1]] if bad else ""
