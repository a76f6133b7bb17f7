"""How errors are counted: in three dimensions, as Tsilomitrou's eq 17 has it, and as Zhou's tables do. Pure.

Estimates hold NaN where nothing is known; such rows do not count, and `covered` says how many did.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from brachium_body import rotation

Floats = npt.NDArray[np.float64]


def rms(errors: npt.ArrayLike) -> float | None:
    """Return the root mean square of the errors (n,) or of the lengths of errors (n, 3) that are known."""
    known = np.asarray(errors, dtype=np.float64)
    squares = known * known if known.ndim == 1 else (known * known).sum(axis=1)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if squares.size else None


def covered(estimate: Floats) -> float:
    """Return which part of the rows of an estimate is known."""
    flat = estimate.reshape(len(estimate), -1)
    return float(np.isfinite(flat).all(axis=1).mean()) if len(flat) else 0.0


def angle_error(estimate: Floats, truth: Floats) -> Floats:
    """Return estimate - truth (n,) rad within half a turn."""
    return rotation.wrap(estimate - truth)


def relative_angle(a: Floats, b: Floats, true_a: Floats, true_b: Floats) -> Floats:
    """Return the angle (n,) rad between estimated and true b as seen from a, of quaternions (n, 4)."""
    found = rotation.multiply(rotation.inverse(a), b)
    return rotation.angle_between(found, rotation.multiply(rotation.inverse(true_a), true_b))


FEWEST_MEANS = 3
"""Wilcoxon's test says nothing of fewer."""


def _wilcoxon(means: Sequence[float]) -> float | None:
    if len(means) < FEWEST_MEANS or not any(means):
        return None
    result: Any = stats.wilcoxon(means)
    return float(result.pvalue)


class CycleFigures(NamedTuple):
    """What Zhou's tables 1 to 5 state, in the error's unit: means over cycles and axes."""

    mean: float
    sd: float
    rms: float
    correlation: float | None
    p: float | None
    """Of Wilcoxon's signed rank test on the cycles' means; a large one does not show agreement."""


def per_cycle(estimate: Floats, reference: Floats, cycles: Sequence[int]) -> CycleFigures | None:
    """Return the figures of estimate against reference (n, k axes), cycle by cycle.

    `cycles` are the rows at which they begin, and the last one's end. An axis in which the reference hardly
    moves has no correlation.
    """
    means, sds, rmss, correlations = [], [], [], []
    for begin, end in pairwise(cycles):
        error = (estimate - reference)[begin:end]
        for axis in range(error.shape[1]):
            one = error[:, axis]
            known = np.isfinite(one)
            if known.sum() < 4:
                continue
            means.append(float(one[known].mean()))
            sds.append(float(one[known].std(ddof=1)))
            rmss.append(float(np.sqrt((one[known] ** 2).mean())))
            a, b = estimate[begin:end, axis][known], reference[begin:end, axis][known]
            if b.std() > 0.1 * reference[begin:end].std() and a.std() > 0.0:
                correlations.append(float(np.corrcoef(a, b)[0, 1]))
    if not means:
        return None
    return CycleFigures(
        float(np.mean(means)),
        float(np.mean(sds)),
        float(np.mean(rmss)),
        float(np.mean(correlations)) if correlations else None,
        _wilcoxon(means),
    )
