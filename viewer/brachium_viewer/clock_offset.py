"""By how much one sensor's times are late against another's on the same segment, from what both turn. Pure.

Angular rates of a rigid pair differ by one turn and nothing else, whatever a filter makes of them: the shift
in time that leaves the least difference is the offset between their clocks.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from brachium_viewer.statistics import interpolate

Floats = npt.NDArray[np.float64]

RATE_HZ = 100.0
"""Of the grid on which both are compared."""
WITHIN_S = 0.5
"""An offset is looked for up to this."""
MAX_GAP_S = 0.1
"""Nothing is interpolated between samples further apart."""
SHORTEST_S = 5.0
MOVING = 0.2
"""rad/s, root mean square: less movement tells no time."""
ALIKE = 0.8
"""Correlation of the angular speeds below which the two are not on one segment."""
BLOCKS = 12
"""Parts of the time that each tell the offset; their spread says how sure it is."""
FEWEST_BLOCKS = 4
_STEP_S = 0.01


class Unrelated(ValueError):
    """The two cannot be set beside each other; the text says why and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockOffset:
    """The second sensor's times minus the first one's at the same instants."""

    offset_s: float
    margin_s: float
    """Half its 95 % confidence interval."""
    drift_ppm: float
    """By how much the offset grows."""
    drift_margin_ppm: float
    """Half its 95 % confidence interval."""
    correlation: float
    """Of the angular speeds, with the offset taken out."""
    seconds: float
    """Of movement that both measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Rates:
    """A sensor's angular rates (n, 3) rad/s at its times (n,) s, calibrated, in its own axes."""

    time_s: Floats
    gyr: Floats


def clock_offset(a: Rates, b: Rates) -> ClockOffset:
    """Return by how much b's times are late against a's. Raises Unrelated."""
    if len(a.time_s) < 2 or len(b.time_s) < 2:
        raise Unrelated("one of the two has not measured anything yet; is it switched on?")
    begin, end = max(a.time_s[0], b.time_s[0]) + WITHIN_S, min(a.time_s[-1], b.time_s[-1]) - WITHIN_S
    if end - begin < SHORTEST_S:
        raise Unrelated(
            f"both measured together for {max(end - begin, 0.0):.1f} s; {SHORTEST_S:g} are needed"
        )
    time = np.arange(begin, end, 1.0 / RATE_HZ)
    first = interpolate(time, a.time_s, a.gyr, MAX_GAP_S)
    if float(np.sqrt(np.nanmean((first**2).sum(axis=1)))) < MOVING:
        raise Unrelated("the segment hardly moves: exercise, and the offset between the clocks can be told")
    offset_s, correlation = _coarse(time, first, b)
    if correlation < ALIKE:
        raise Unrelated(
            f"the two turn differently (correlation {correlation:.2f}): are they fixed to the same segment?"
        )
    for _ in range(6):
        offset_s += float(np.clip(_step(*_slopes(time, first, b, offset_s)[:2]), -_STEP_S, _STEP_S))
    along, weight, known = _slopes(time, first, b, offset_s)
    margin_s, drift, drift_margin = _spread(time[known], along, weight)
    return ClockOffset(
        offset_s=offset_s,
        margin_s=margin_s,
        drift_ppm=1e6 * drift,
        drift_margin_ppm=1e6 * drift_margin,
        correlation=_alike(_speeds(first), _speeds(interpolate(time + offset_s, b.time_s, b.gyr, MAX_GAP_S))),
        seconds=float(known.sum() / RATE_HZ),
    )


def wahba(a: Floats, b: Floats) -> Floats:
    """Return the rotation matrix R (3, 3) that brings vectors b onto a with least squares: a ~ R b."""
    u, _, vt = np.linalg.svd(a.T @ b)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt)) or 1.0])
    turn: Floats = u @ sign @ vt
    return turn


def _coarse(time: Floats, first: Floats, b: Rates) -> tuple[float, float]:
    """Return the whole number of steps at which the speeds are most alike, in s, and how alike."""
    most = round(WITHIN_S * RATE_HZ)
    around = time[0] + np.arange(-most, len(time) + most) / RATE_HZ
    second = _speeds(interpolate(around, b.time_s, b.gyr, MAX_GAP_S))
    speeds = _speeds(first)
    scores = [_alike(speeds, second[k : k + len(time)]) for k in range(2 * most + 1)]
    best = int(np.argmax(scores))
    return (best - most) / RATE_HZ, scores[best]


def _speeds(rates: Floats) -> Floats:
    speeds: Floats = np.linalg.norm(rates, axis=1)
    return speeds


def _alike(a: Floats, b: Floats) -> float:
    known = np.isfinite(a) & np.isfinite(b)
    if known.sum() < SHORTEST_S * RATE_HZ:
        return -1.0
    found = np.corrcoef(a[known], b[known])[0, 1]
    return float(found) if np.isfinite(found) else -1.0


def _slopes(
    time: Floats, first: Floats, b: Rates, lag_s: float
) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Return, row by row, what is left along the rate of change (n,), that rate squared, and which rows."""
    before, second, after = (
        interpolate(time + lag_s + h, b.time_s, b.gyr, MAX_GAP_S) for h in (-_STEP_S, 0.0, _STEP_S)
    )
    known: npt.NDArray[np.bool_] = np.asarray(np.isfinite(first + before + second + after).all(axis=1))
    x, y = first[known], second[known]
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    turn = wahba(x, y)
    change = ((after - before)[known] / (2.0 * _STEP_S)) @ turn.T
    return ((x - y @ turn.T) * change).sum(axis=1), (change**2).sum(axis=1), known


def _step(along: Floats, weight: Floats) -> float:
    return float(along.sum() / weight.sum())


def _spread(time: Floats, along: Floats, weight: Floats) -> tuple[float, float, float]:
    """Return half the 95 % interval of the mean of the blocks' steps, s; how they grow, s/s, and half its
    interval.
    """
    parts = [p for p in np.array_split(np.arange(len(time)), BLOCKS) if weight[p].sum() > 0.0]
    w = np.array([weight[p].sum() for p in parts])
    steps = np.array([along[p].sum() for p in parts]) / w
    middle = np.array([time[p].mean() for p in parts])
    # A part in which little moves says little; one that says next to nothing is none.
    told = w > 0.05 * w.mean()
    w, steps, middle = w[told] / w[told].sum(), steps[told], middle[told]
    n = len(w)
    if n < FEWEST_BLOCKS:
        raise Unrelated("the segment moved for a moment only: exercise for longer")
    off, at = steps - (w * steps).sum(), middle - (w * middle).sum()
    squares = (w * at**2).sum()
    drift = float((w * at * off).sum() / squares)
    left = off - drift * at
    return (
        float(stats.t.ppf(0.975, n - 1) * np.sqrt((w**2 * off**2).sum() * n / (n - 1))),
        drift,
        float(stats.t.ppf(0.975, n - 2) * np.sqrt((w**2 * at**2 * left**2).sum() * n / (n - 2)) / squares),
    )
