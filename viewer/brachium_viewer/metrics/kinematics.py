"""Angles and positions of one movement: range, speed, path, holding. Pure.

Extremes are those of the mean over HOLD_S: a position counts when it is held so long, and a tremor of 5 Hz
adds nothing to a range.
"""

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.bridge import rounded
from brachium_viewer.metrics.even_grid import even, smooth, stretches
from brachium_viewer.metrics.smoothness import LDLJ_RATE_HZ, at_ldlj_rate

Floats = npt.NDArray[np.float64]

RATE_HZ = 50.0
HOLD_S = 0.2
SPEED_CUTOFF_HZ = 6.0
"""Above it there is no voluntary movement, and differentiating makes noise larger."""
AROUND_S = 1.0
"""So much before and after a movement is filtered with it."""
HELD_SHARE = 0.1
"""Held: within this part of the movement's range of its farthest point."""


def held_mean(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return an even grid (m,) s and the mean of values (n,) over HOLD_S about each instant, NaN in gaps."""
    grid, found = even(time_s, values, RATE_HZ)
    out = np.full_like(found, np.nan)
    width = round(HOLD_S * RATE_HZ)
    for first, end in stretches(np.isfinite(found)):
        if end - first >= width:
            longer = np.pad(found[first:end], (width // 2, (width - 1) // 2), mode="edge")
            out[first:end] = np.convolve(longer, np.full(width, 1.0 / width), mode="valid")
    return grid, out


def extremes(time_s: Floats, values: Floats) -> tuple[float, float]:
    """Return the lowest and highest value that was held for HOLD_S; NaN when there is none."""
    _, mean = held_mean(time_s, values)
    known = mean[np.isfinite(mean)]
    return (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)


def angular_velocity(time_s: Floats, values: Floats, from_s: float, to_s: float) -> Floats:
    """Return the derivative of values (n,) per second at LDLJ_RATE_HZ, from `from_s` to `to_s`.

    What is known within AROUND_S of them is used, so that a filter does not begin where a movement does.
    Empty when the values are not known throughout.
    """
    near = (time_s >= from_s - AROUND_S) & (time_s <= to_s + AROUND_S)
    grid, found = even(*rounded(time_s[near], values[near], RATE_HZ), RATE_HZ)
    inside = (
        (first, end)
        for first, end in stretches(np.isfinite(found))
        if grid[first] <= from_s + 1.0 / RATE_HZ and grid[end - 1] >= to_s - 1.0 / RATE_HZ and end - first > 4
    )
    for first, end in inside:
        smoothed = smooth(found[first:end], RATE_HZ, SPEED_CUTOFF_HZ)
        velocity = at_ldlj_rate(np.gradient(smoothed, 1.0 / RATE_HZ), RATE_HZ)
        begin, last = (round((s - float(grid[first])) * LDLJ_RATE_HZ) for s in (from_s, to_s))
        return velocity[max(begin, 0) : last + 1]
    return np.empty(0)


def coverage(time_s: Floats, known: npt.ArrayLike) -> float:
    """Return the part of the rows (n,) that are measured, 0 to 1; none: 0.

    A row between two known ones at most HOLD_S apart is: what is held for so long shows in one of them. So
    packets lost one by one leave no hole in a movement.
    """
    seen = np.asarray(known, dtype=np.bool_)
    if not seen.any():
        return 0.0
    t = time_s[seen]
    after = np.searchsorted(t, time_s)
    inner = (after > 0) & (after < len(t))
    near = np.zeros_like(seen)
    near[inner] = t[after[inner]] - t[after[inner] - 1] <= HOLD_S + 1e-9
    return float((seen | near).mean())


def longest_gap_s(time_s: Floats, known: npt.ArrayLike, from_s: float, to_s: float) -> float:
    """Return the longest time between `from_s` and `to_s` in which no known row (n,) lies."""
    seen = time_s[np.asarray(known, dtype=np.bool_)]
    inside = seen[(seen > from_s) & (seen < to_s)]
    return float(np.diff(np.concatenate([[from_s], inside, [to_s]])).max())


def path(time_s: Floats, places: Floats) -> tuple[float, float]:
    """Return the length of a path (n, 3) in its unit, and its straightness: the distance between its ends
    over that length, 0 to 1; NaN for one with a gap or without a way."""
    _, found = even(time_s, places, RATE_HZ)
    if len(found) < 2 or not np.isfinite(found).all():
        return np.nan, np.nan
    smoothed = smooth(found, RATE_HZ, SPEED_CUTOFF_HZ)
    length = float(np.linalg.norm(np.diff(smoothed, axis=0), axis=1).sum())
    if length < 1e-3:
        return length, np.nan
    return length, float(np.linalg.norm(smoothed[-1] - smoothed[0])) / length


def hold_s(time_s: Floats, values: Floats) -> float:
    """Return how long in a row a rising movement (n,) was within HELD_SHARE of its range of the top, s."""
    grid, mean = held_mean(time_s, values)
    known = np.isfinite(mean)
    if not known.any():
        return float("nan")
    low, high = float(mean[known].min()), float(mean[known].max())
    near = known & (mean >= high - HELD_SHARE * (high - low))
    return max(((end - first) / RATE_HZ for first, end in stretches(near)), default=0.0) if len(grid) else 0.0


def reached_s(time_s: Floats, values: Floats, goal: float) -> float:
    """Return when a rising movement (n,) reached `goal`, s; NaN when it did not."""
    grid, mean = held_mean(time_s, values)
    at = np.flatnonzero(mean >= goal)
    return float(grid[at[0]]) if len(at) else float("nan")
