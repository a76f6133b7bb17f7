"""Whether the field that a sensor meets is the earth's: how far its direction wanders. Pure.

Seen in the world of gyroscope and accelerometer alone the earth's field keeps its direction, but for the slow
drift of that world's heading. Iron nearby turns it within seconds, and so does a magnetometer that was not
calibrated.
"""

from dataclasses import replace
from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.best_material import Material, calibrated
from brachium_fusion.offline_orientation import smooth_orientation
from brachium_fusion.pose import Alignment
from brachium_fusion.uniform import Series, grid, on_grid

Floats = npt.NDArray[np.float64]

DRIFT_S = 60.0
"""Over so long the heading's drift is a straight line."""
MOST_WANDER = radians(8.0)
"""More than a room's usual; joints do better."""
WANDERS = (
    "the magnetic field wanders at {}: magnetometers were set aside, headings rest on the joints "
    "and drift slowly in the room"
)
FEWEST = 20
"""Readings that tell anything."""


def wandering(material: Material) -> list[str]:
    """Return the segments whose sensors meet a field that wanders."""
    return [
        segment
        for segment, one in material.series.items()
        if wander_rad(calibrated(one, material.infos[segment], magnetometer=True)) > MOST_WANDER
    ]


def told_of(alignment: Alignment | None, segments: list[str]) -> Alignment | None:
    """Return the alignment with a warning that magnetometers were set aside for what these segments met."""
    if alignment is None:
        return None
    return replace(alignment, warnings=(*alignment.warnings, WANDERS.format(", ".join(segments))))


def wander_rad(one: Series) -> float:
    """Return the rms, rad, by which the field's level direction strays from a straight line over a minute, of
    calibrated samples; the worst minute counts. 0 without field or rates."""
    if one.mag is None or one.gyr is None or one.acc is None:
        return 0.0
    time_s, rate_hz = grid({"": one})
    samples = on_grid(one, time_s)
    if samples.mag is None:
        return 0.0
    world = smooth_orientation(samples.gyr, samples.acc, None, rate_hz).world_from_sensor
    field = rotation.rotate(world, samples.mag)
    known = np.isfinite(field[:, 0])
    worst, length = 0.0, round(DRIFT_S * rate_hz)
    for first in range(0, len(field), length):
        rows = np.flatnonzero(known[first : first + length]) + first
        if len(rows) >= FEWEST:
            worst = max(worst, _strays(time_s[rows], np.arctan2(field[rows, 1], field[rows, 0])))
    return worst


def _strays(time_s: Floats, direction: Floats) -> float:
    middle = np.angle(np.exp(1j * direction).mean())
    away = rotation.wrap(direction - middle)
    line = np.polynomial.Polynomial.fit(time_s, away, 1)
    return float(np.sqrt(np.mean((away - line(time_s)) ** 2)))
