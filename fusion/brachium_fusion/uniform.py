"""Samples of several sensors, each by its own clock, on one grid of time. Pure.

Gaps up to 100 ms are bridged by a curve through the samples on both sides; longer ones stay gaps, as rows of
NaN.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.bridging import curve

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

BRIDGE_S = 0.1
"""A gap up to this is bridged."""
NEAR = 1.5
"""An instant within this many periods of two neighbouring samples lies in no gap."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Series:
    """One sensor's calibrated samples, time growing: rad/s, m/s^2, uT, or orientations."""

    time_s: Floats
    rate_hz: float
    gyr: Floats | None = None
    acc: Floats | None = None
    mag: Floats | None = None
    """A row of NaN where the magnetometer gave none."""
    quat: Floats | None = None
    """(n, 4) world_from_sensor, of a sensor that delivers orientation."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Uniform:
    """The same on a grid of n instants; NaN where nothing was measured."""

    gyr: Floats
    acc: Floats
    mag: Floats | None
    quat: Floats | None
    held: Bools
    """Bridged: no sample is near."""
    missing: Bools
    """In a longer gap, or before the first or after the last sample."""
    sample: npt.NDArray[np.int64]
    """Index of the last sample up to the instant; -1 before the first."""


def grid(series: Mapping[str, Series]) -> tuple[Floats, float]:
    """Return the instants (n,) s from the first sample of all to the last, and their rate: the fastest
    sensor's."""
    rate_hz = max(s.rate_hz for s in series.values())
    first = min(float(s.time_s[0]) for s in series.values())
    last = max(float(s.time_s[-1]) for s in series.values())
    return first + np.arange(int(np.floor((last - first) * rate_hz + 1e-6)) + 1) / rate_hz, rate_hz


def on_grid(series: Series, time_s: Floats) -> Uniform:
    """Return a sensor's samples at the instants (n,) s."""
    t = series.time_s
    slack = 1e-6 + 0.01 / series.rate_hz
    after = np.clip(np.searchsorted(t, time_s - slack), 1, max(len(t) - 1, 1)) if len(t) > 1 else None
    if after is None:
        raise ValueError("a sensor with a single sample cannot be solved")
    before = after - 1
    span = t[after] - t[before]
    part = np.clip((time_s - t[before]) / span, 0.0, 1.0)
    inside = (time_s >= t[0] - slack) & (time_s <= t[-1] + slack)
    on_sample = (np.abs(time_s - t[before]) <= slack) | (np.abs(time_s - t[after]) <= slack)
    gap = ~on_sample & (span > NEAR / series.rate_hz)
    missing = ~inside | (gap & (span > BRIDGE_S + slack))
    quat = None
    if series.quat is not None:
        quat = rotation.slerp(series.quat[before], series.quat[after], part)
        quat[missing] = np.nan
    held = gap & ~missing
    return Uniform(
        gyr=_bridged(series.gyr, _between(series.gyr, before, after, part, missing), t, time_s, before, held),
        acc=_bridged(series.acc, _between(series.acc, before, after, part, missing), t, time_s, before, held),
        mag=None if series.mag is None else _field(t, series.mag, time_s, missing),
        quat=quat,
        held=held,
        missing=missing,
        sample=np.searchsorted(t, time_s + slack) - 1,
    )


def _between(
    values: Floats | None,
    before: npt.NDArray[np.intp],
    after: npt.NDArray[np.intp],
    part: Floats,
    missing: Bools,
) -> Floats:
    if values is None:
        return np.full((len(part), 3), np.nan)
    result: Floats = values[before] + part[:, None] * (values[after] - values[before])
    result[missing] = np.nan
    return result


def _bridged(
    values: Floats | None,
    found: Floats,
    t: Floats,
    time_s: Floats,
    before: npt.NDArray[np.intp],
    held: Bools,
) -> Floats:
    """Put curves through two samples on both sides of gaps into what straight lines gave, in place."""
    rows = np.flatnonzero(held & (before >= 1) & (before + 2 < len(t)))
    if values is not None and len(rows):
        nodes = before[rows][:, None] + np.arange(-1, 3)
        found[rows] = curve(t[nodes], values[nodes], time_s[rows])
    return found


def _field(t: Floats, mag: Floats, time_s: Floats, missing: Bools) -> Floats | None:
    """Return the field at the instants; a magnetometer may be slower than its gyroscope."""
    there = np.isfinite(mag[:, 0])
    if there.sum() < 2:
        return None
    own, values = t[there], mag[there]
    period = float(np.median(np.diff(own)))
    after = np.clip(np.searchsorted(own, time_s - 1e-6), 1, len(own) - 1)
    result = np.stack([np.interp(time_s, own, column) for column in values.T], axis=1)
    result[missing | (own[after] - own[after - 1] > max(BRIDGE_S, NEAR * period))] = np.nan
    return result
