"""Whether a change between two sessions is more than the measurement's own error. Pure.

A sensor that is put on anew sits differently, so the same arm gives other numbers. From pairs of the same
movement with the sensors put on anew between, the smallest detectable change is 1.96 * sqrt(2) * SEM, with
SEM = sd of the differences / sqrt(2) (Weir 2005; de Vet et al. 2006): that is 1.96 * sd of the differences.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

STATED_SDC_DEG = 10.0
"""Until there are repeated donnings of this subject: what range of motion by worn sensors is known to differ
by."""
FEWEST_PAIRS = 5
"""From fewer pairs a standard deviation says nothing."""


@dataclass(frozen=True, kw_only=True)
class SmallestChange:
    """The smallest detectable change, and what it comes from."""

    value_deg: float
    pairs: int
    """Of repeated donnings; 0: it is the stated one."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """A number now and before."""

    now: float
    before: float
    smallest: SmallestChange

    @property
    def difference(self) -> float:
        """Return now minus before."""
        return self.now - self.before

    @property
    def detected(self) -> bool:
        """Return whether it is more than the measurement error: only then is it shown as a change."""
        return abs(self.difference) > self.smallest.value_deg


def smallest_change(pairs: Sequence[tuple[float, float]]) -> SmallestChange:
    """Return the smallest detectable change from pairs of repeated donnings (deg), or the stated one.

    It never falls below what the number of pairs can show: the sd is taken about zero, at its upper one-sided
    95 % confidence limit by chi-square.
    """
    if len(pairs) < FEWEST_PAIRS:
        return SmallestChange(value_deg=STATED_SDC_DEG, pairs=0)
    from scipy.stats import chi2

    differences = np.array([b - a for a, b in pairs], dtype=np.float64)
    n = len(differences)
    sd = float(np.sqrt(np.sum(differences**2) / chi2.ppf(0.05, n)))
    return SmallestChange(value_deg=1.96 * sd, pairs=n)
