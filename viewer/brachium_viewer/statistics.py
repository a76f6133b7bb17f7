"""Figures of arrays of errors. Pure: arrays in, records out; what is not known is NaN and left out."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorFigures:
    """Statistics of an error (estimate minus reference), in the error's unit."""

    n: int
    """Errors that are known."""
    bias: float
    """Their mean."""
    sd: float
    """Standard deviation about the bias, n - 1 in the denominator; 0 for a single one."""
    rmse: float
    max_abs: float


def error_figures(error: npt.ArrayLike) -> ErrorFigures | None:
    """Return the figures of the errors (n,) that are known, or None when there is none."""
    known = np.asarray(error, dtype=np.float64)
    known = known[np.isfinite(known)]
    if not known.size:
        return None
    return ErrorFigures(
        n=int(known.size),
        bias=float(known.mean()),
        sd=float(known.std(ddof=1)) if known.size > 1 else 0.0,
        rmse=float(np.sqrt(np.mean(known**2))),
        max_abs=float(np.abs(known).max()),
    )


def percentiles(values: Iterable[float]) -> tuple[float | None, float | None]:
    """Return the 50th and 99th percentile, None where there is nothing."""
    numbers = list(values)
    if not numbers:
        return None, None
    p50, p99 = np.percentile(numbers, [50, 99])
    return float(p50), float(p99)


def wrap_deg(error: npt.ArrayLike) -> Array:
    """Return angle errors in degrees as the same angles within [-180, 180)."""
    wrapped: Array = (np.asarray(error, dtype=np.float64) + 180.0) % 360.0 - 180.0
    return wrapped


def interpolate(time: Array, at: Array, values: Array, max_gap: float) -> Array:
    """Return `values` (m, k), known at the growing times `at` (m,), at each of `time` (n,), as (n, k).

    Linearly between two of them; NaN outside, in gaps longer than `max_gap`, and beside what is NaN itself.
    """
    if not len(at):
        return np.full((len(time), values.shape[1]), np.nan)
    right = np.searchsorted(at, time, side="left")
    result = np.full((len(time), values.shape[1]), np.nan)
    exact = (right < len(at)) & (at[np.minimum(right, len(at) - 1)] == time)
    result[exact] = values[right[exact]]
    inner = ~exact & (right > 0) & (right < len(at))
    r = right[inner]
    gap = at[r] - at[r - 1]
    fraction = ((time[inner] - at[r - 1]) / gap)[:, None]
    between = values[r - 1] * (1.0 - fraction) + values[r] * fraction
    between[gap > max_gap] = np.nan
    result[inner] = between
    return result


def orientation_errors_deg(estimate: Array, reference: Array) -> tuple[Array, Array, Array]:
    """Return the whole angle, heading and inclination (n,) deg between world-from-body quaternions (n, 4).

    The error turns reference into estimate in world axes, z up: its twist about z is the heading error, with
    its sign, what remains is the inclination error (Laidig 2021, BROAD). NaN where one of them is not known.
    """
    error = rotation.multiply(estimate, rotation.inverse(reference))
    error = np.where(error[:, :1] < 0.0, -error, error)
    w, x, y, z = error.T
    total = 2.0 * np.arctan2(np.sqrt(x * x + y * y + z * z), w)
    heading = 2.0 * np.arctan2(z, w)
    inclination = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    return np.degrees(total), wrap_deg(np.degrees(heading)), np.degrees(inclination)


@dataclass(frozen=True, slots=True)
class NormFigures:
    """Tsilomitrou's eq 17, m."""

    mae: float
    largest: float
    rmse: float


def eq17(estimate: Array, reference: Array) -> NormFigures | None:
    """Return the figures of eq 17 for positions (n, 3) from the chest.

    It compares distances from the chest, not places, so most of an error does not show (erratum T17).
    """
    apart = np.abs(np.linalg.norm(estimate, axis=1) - np.linalg.norm(reference, axis=1))
    apart = apart[np.isfinite(apart)]
    if not apart.size:
        return None
    return NormFigures(float(apart.mean()), float(apart.max()), float(np.sqrt((apart**2).mean())))
