"""Short gaps of a movement, bridged so that its speed and jerk stay what they were. Pure."""

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.even_grid import BRIDGED_S

Floats = npt.NDArray[np.float64]


def rounded(time_s: Floats, values: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Return times (m,) s and values (m,) whose gaps up to BRIDGED_S are filled at `rate_hz` by cubics.

    `values` (n,) at growing times (n,); those that are NaN are not known. Through the known ones at both ends
    of a gap, and one at least a step farther on either side. A straight line would put jerk at both ends of
    a gap: of one of 0.1 s in a reach of 1 s it makes LDLJ lower by 1, a cubic by less than 0.1.
    """
    known = np.isfinite(values)
    t, v = time_s[known], values[known]
    step = 1.0 / rate_hz
    gaps = np.flatnonzero((np.diff(t) > 1.5 * step) & (np.diff(t) <= BRIDGED_S))
    times, found = [t], [v]
    for i in gaps.tolist():
        before = int(np.searchsorted(t, t[i] - 1.5 * step, side="right")) - 1
        after = int(np.searchsorted(t, t[i + 1] + 1.5 * step))
        if before < 0 or after >= len(t):
            continue
        knots = [before, i, i + 1, after]
        inside = np.arange(t[i] + step, t[i + 1] - 0.5 * step, step)
        times.append(inside)
        found.append(_cubic(t[knots], v[knots], inside))
    order = np.argsort(np.concatenate(times), kind="stable")
    return np.concatenate(times)[order], np.concatenate(found)[order]


def _cubic(t: Floats, v: Floats, at: Floats) -> Floats:
    """Return at times (m,) the cubic through four values (4,) at times (4,), by Lagrange."""
    out = np.zeros_like(at)
    for i, value in enumerate(v.tolist()):
        others = np.delete(t, i)
        out += value * np.prod((at[:, None] - others) / (t[i] - others), axis=1)
    return out
