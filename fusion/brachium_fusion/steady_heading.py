"""Orientations whose heading a magnetometer gave, with the gyroscope's instead: it does not wander. Pure.

Indoors a magnetometer's heading goes up and down by ten degrees within seconds. Over the minute or two of a
calibration a gyroscope drifts by less than one; what the headings of two sensors are to each other is found
from the joint between them anyway.
"""

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.offline_orientation import smooth_orientation

Floats = npt.NDArray[np.float64]


def steady(world_from_sensor: Floats, gyr: Floats, acc: Floats, rate_hz: float) -> Floats:
    """Return orientations (n, 4) with tilt and turns by the inertial sensors, (n, 3) rad/s and m/s^2, each
    stretch without a gap turned as a whole to the mean heading of the given ones (n, 4). NaN where rates,
    forces or the given ones are missing."""
    missing = np.isnan(world_from_sensor[:, 0])
    rates = np.where(missing[:, None], np.nan, gyr)
    found = smooth_orientation(rates, acc, None, rate_hz).world_from_sensor
    there = np.isfinite(found[:, 0])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    for first, end in edges.reshape(-1, 2).tolist():
        piece = slice(first, end)
        away = rotation.heading(rotation.multiply(world_from_sensor[piece], rotation.inverse(found[piece])))
        mean = np.angle(np.exp(1j * away).mean())
        found[piece] = rotation.multiply(rotation.about(2, mean), found[piece])
    return found
