"""Measured values on an even grid, so that they can be filtered. Pure.

Numpy alone: scipy's filters and splines take longer to import than a session's measures take. In tests they
are the judge.
"""

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

BRIDGED_S = 0.5
"""A longer gap stays one. No arm turns round unseen within it by more than a tremor."""
LONGEST_S = 600.0
"""A grid over a gap of a day would be a day long and hold nothing."""


def even(time_s: Floats, values: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Return the grid (m,) s from the first to the last known value, and the values (m,) or (m, k) on it.

    `values` (n,) or (n, k) at growing times (n,); a row with NaN is not known. Between known rows at most
    BRIDGED_S apart it is interpolated, elsewhere NaN; a gap longer than LONGEST_S has one instant. Nothing
    known: empty arrays.
    """
    table = values[:, None] if values.ndim == 1 else values
    known = np.isfinite(table).all(axis=1)
    t, v = time_s[known], table[known]
    if len(t) == 0:
        return np.empty(0), np.empty((0, *values.shape[1:]))
    grid = _grid(t, rate_hz)
    out = np.stack([np.interp(grid, t, column) for column in v.T], axis=1)
    after = np.clip(np.searchsorted(t, grid, side="left"), 0, len(t) - 1)
    before = np.clip(np.searchsorted(t, grid, side="right") - 1, 0, len(t) - 1)
    out[t[after] - t[before] > BRIDGED_S] = np.nan
    return grid, out[:, 0] if values.ndim == 1 else out


def _grid(t: Floats, rate_hz: float) -> Floats:
    begins = np.flatnonzero(np.diff(t) > LONGEST_S) + 1
    if not len(begins):
        return np.arange(t[0], t[-1] + 1e-9, 1.0 / rate_hz)
    parts = np.split(t - t[0], begins)
    counts = [
        np.arange(np.ceil(p[0] * rate_hz - 1e-9), np.floor(p[-1] * rate_hz + 1e-9) + 2.0) for p in parts
    ]
    return np.asarray(t[0] + np.concatenate(counts)[:-1] / rate_hz)


def smooth(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Return even values (m,) or (m, k) through a Butterworth low-pass of order 4 without delay.

    It is of order 2 and runs forwards and backwards, over each stretch between gaps by itself; beyond its
    ends a stretch goes on as it would turned about them.
    """
    table = values[:, None] if values.ndim == 1 else values
    response = _impulse_response(rate_hz, cutoff_hz)
    out = np.full_like(table, np.nan)
    for first, end in stretches(np.isfinite(table).all(axis=1)):
        pad = min(end - first - 1, round(rate_hz / cutoff_hz))
        for column, target in zip(table[first:end].T, out[first:end].T, strict=True):
            longer = np.pad(column, pad, mode="reflect", reflect_type="odd")
            there = _filtered(longer, response)
            target[:] = _filtered(there[::-1], response)[::-1][pad : len(longer) - pad]
    return out.reshape(values.shape)


def _filtered(values: Floats, response: Floats) -> Floats:
    """Return values (m,) filtered, as if they had been the first one for ever before."""
    return np.asarray(np.convolve(values - values[0], response)[: len(values)] + values[0])


@lru_cache(maxsize=16)
def _impulse_response(rate_hz: float, cutoff_hz: float) -> Floats:
    """Return the impulse response of a Butterworth low-pass of order 2, to where it is below 1e-17.

    By the bilinear transform, prewarped: with k = tan(pi cutoff / rate), the recursion of biquad filters.
    """
    k = math.tan(math.pi * cutoff_hz / rate_hz)
    scale = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    one, two = 2.0 * (1.0 - k * k) * scale, (math.sqrt(2.0) * k - 1.0 - k * k) * scale
    gain = k * k * scale
    found = [gain, (2.0 + one) * gain]
    found.append(gain + one * found[1] + two * found[0])
    while max(abs(found[-1]), abs(found[-2])) > 1e-17:
        found.append(one * found[-1] + two * found[-2])
    return np.array(found)


def stretches(known: npt.ArrayLike) -> list[tuple[int, int]]:
    """Return the runs [first, end) of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(known), [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
