"""How far two measures of one thing agree: limits of agreement, correlations, a test of signs. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

Array = npt.NDArray[np.float64]

WITHIN = 1.96
"""Standard deviations on either side of the bias that hold 95 % of normally distributed differences."""

LARGE_P = (
    "Wilcoxon's p tells only whether the middle of the differences is off zero: "
    "a large p does not show agreement"
)
FOLLOWING = (
    "rows of one recording follow one another closely; p and the limits' intervals count them as independent"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """How `a` agrees with `b` over n pairs; differences are a - b, in their unit.

    None stands for what is not defined: with fewer than three pairs, or when neither varies.
    """

    n: int
    bias: float
    limits: tuple[float, float]
    """Bland and Altman's 95 % limits of agreement (1986): bias -+ 1.96 SD of the differences."""
    limits_margin: float | None
    """Half the 95 % confidence interval of each limit (Bland and Altman 1999: variance near 3 SD^2 / n)."""
    r: float | None
    """Pearson's correlation. It is 1 for any straight line: no measure of agreement by itself."""
    icc: float | None
    """ICC(2,1) of Shrout and Fleiss 1979: two-way random, absolute agreement, one measure."""
    ccc: float | None
    """Lin's concordance correlation (1989)."""
    wilcoxon_p: float | None
    """Two-sided p of Wilcoxon's signed-rank test, as Zhou et al. 2008 give it; 1 when nothing differs."""


def agreement(a: npt.ArrayLike, b: npt.ArrayLike) -> Agreement | None:
    """Return how a (n,) agrees with b (n,) over the pairs that are known, or None when there is none."""
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    known = np.isfinite(first) & np.isfinite(second)
    first, second = first[known], second[known]
    n = len(first)
    if n == 0:
        return None
    difference = first - second
    bias = float(difference.mean())
    sd = float(difference.std(ddof=1)) if n > 1 else 0.0
    enough = n >= 3
    return Agreement(
        n=n,
        bias=bias,
        limits=(bias - WITHIN * sd, bias + WITHIN * sd),
        limits_margin=float(stats.t.ppf(0.975, n - 1) * sd * np.sqrt(3.0 / n)) if enough else None,
        r=_pearson(first, second) if enough else None,
        icc=_icc(first, second) if enough else None,
        ccc=_concordance(first, second) if enough else None,
        wilcoxon_p=_wilcoxon(difference) if enough else None,
    )


def _varies(*values: Array) -> bool:
    return all(float(np.ptp(v)) > 1e-12 * max(1.0, float(np.abs(v).max())) for v in values)


def _pearson(a: Array, b: Array) -> float | None:
    return float(np.corrcoef(a, b)[0, 1]) if _varies(a, b) else None


def _icc(a: Array, b: Array) -> float | None:
    """ICC(2,1) = (MSR - MSE) / (MSR + (k - 1) MSE + k (MSC - MSE) / n), k = 2 measures."""
    n, both = len(a), np.column_stack([a, b])
    if not _varies(both):
        return None
    rows, columns, mean = both.mean(axis=1), both.mean(axis=0), both.mean()
    msr = 2.0 * float(((rows - mean) ** 2).sum()) / (n - 1)
    msc = n * float(((columns - mean) ** 2).sum())
    mse = float(((both - rows[:, None] - columns[None, :] + mean) ** 2).sum()) / (n - 1)
    return (msr - mse) / (msr + mse + 2.0 * (msc - mse) / n)


def _concordance(a: Array, b: Array) -> float | None:
    if not _varies(np.concatenate([a, b])):
        return None
    together = float(np.mean((a - a.mean()) * (b - b.mean())))
    return 2.0 * together / (float(a.var()) + float(b.var()) + float(a.mean() - b.mean()) ** 2)


def _wilcoxon(difference: Array) -> float:
    if not np.any(difference):
        return 1.0
    result: Any = stats.wilcoxon(difference, method="approx")  # its stub hides the fields
    return float(result.pvalue)
