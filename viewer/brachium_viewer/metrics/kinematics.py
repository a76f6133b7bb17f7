"""Angles and positions of one movement: range, speed, path, holding. Pure.

Extremes are those of the mean over HOLD_S: a position counts when it is held so long, and a tremor of 5 Hz
adds nothing to a range.
"""

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.even_grid import even, smooth, stretches

Floats = npt.NDArray[np.float64]

RATE_HZ = 50.0
HOLD_S = 0.2
SPEED_CUTOFF_HZ = 6.0
"""Above it there is no voluntary movement, and differentiating makes noise larger."""
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


def angular_speed(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return an even grid (m,) s and the derivative of values (n,) or (n, k) per second."""
    grid, found = even(time_s, values, RATE_HZ)
    if len(grid) < 2:
        return grid, np.full_like(found, np.nan)
    smoothed = smooth(found, RATE_HZ, SPEED_CUTOFF_HZ)
    return grid, np.asarray(np.gradient(smoothed, 1.0 / RATE_HZ, axis=0), dtype=np.float64)


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
    """Return how long after its begin a rising movement (n,) reached `goal`; NaN when it did not."""
    grid, mean = held_mean(time_s, values)
    at = np.flatnonzero(mean >= goal)
    return float(grid[at[0]] - time_s[0]) if len(at) else float("nan")
