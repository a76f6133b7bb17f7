"""Measured values on an even grid, so that they can be filtered. Pure."""

import numpy as np
import numpy.typing as npt
from scipy.signal import butter, sosfiltfilt

Floats = npt.NDArray[np.float64]

BRIDGED_S = 0.5
"""A longer gap stays one. No arm turns round unseen within it by more than a tremor."""


def even(time_s: Floats, values: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Return the grid (m,) s from the first to the last known value, and the values (m,) or (m, k) on it.

    `values` (n,) or (n, k) at growing times (n,); a row with NaN is not known. Between known rows at most
    BRIDGED_S apart it is interpolated, elsewhere NaN. Nothing known: empty arrays.
    """
    table = values[:, None] if values.ndim == 1 else values
    known = np.isfinite(table).all(axis=1)
    t, v = time_s[known], table[known]
    if len(t) == 0:
        return np.empty(0), np.empty((0, *values.shape[1:]))
    grid = np.arange(t[0], t[-1] + 1e-9, 1.0 / rate_hz)
    out = np.stack([np.interp(grid, t, column) for column in v.T], axis=1)
    after = np.clip(np.searchsorted(t, grid, side="left"), 0, len(t) - 1)
    before = np.clip(np.searchsorted(t, grid, side="right") - 1, 0, len(t) - 1)
    out[t[after] - t[before] > BRIDGED_S] = np.nan
    return grid, out[:, 0] if values.ndim == 1 else out


def smooth(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Return even values (m,) or (m, k) through a Butterworth low-pass of order 4 without delay.

    It runs over each stretch between gaps by itself.
    """
    known = np.isfinite(values if values.ndim == 2 else values[:, None]).all(axis=1)
    sections = butter(2, cutoff_hz, fs=rate_hz, output="sos")
    out = np.full_like(values, np.nan)
    for first, end in stretches(known):
        pad = min(end - first - 1, round(rate_hz / cutoff_hz))
        out[first:end] = sosfiltfilt(sections, values[first:end], axis=0, padlen=pad)
    return out


def stretches(known: npt.ArrayLike) -> list[tuple[int, int]]:
    """Return the runs [first, end) of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(known), [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
