"""The step of a sensor's calibration in which it is turned through all directions. Pure."""

import numpy as np

from brachium_fusion import sphere_coverage as sphere
from brachium_fusion.magnetometer_calibration import mag_ellipsoid
from brachium_fusion.sensor_calibration import Floats
from brachium_fusion.sensor_steps import WORDS, Motion, Seen, Tail
from brachium_fusion.still_stretches import WINDOW_S
from brachium_wire.calibration_file import Part

TURNED_S, LONGEST_S = 15.0, 120.0
FITTED = 1000
"""Readings that the fit takes at least, of more: their noise leaves 0.02 uT, and others wait meanwhile."""
COVERED = 0.85
"""Share of the cells: what a figure of eight about all axes sees in a quarter of a minute."""


class Turn:
    """Turn it through all directions: the magnetometer's hard and soft iron."""

    part: Part = "mag"
    longest_s = LONGEST_S

    def __init__(self, rate_hz: float) -> None:
        self._tail = Tail(rate_hz, 2.0 * WINDOW_S)
        self._mag: list[Floats] = []
        self._new: list[Floats] = []
        self._turned_s = 0.0
        self._since = 0
        self.cells = np.zeros((sphere.BANDS, sphere.ROUND))

    @property
    def coverage(self) -> float:
        """Share of the cells seen."""
        return float(self.cells.mean())

    def take(self, samples: Motion) -> None:
        """Take samples."""
        self._tail.take(samples)
        self._since += len(samples.gyr)
        if samples.mag is not None and len(samples.mag):
            self._new.append(samples.mag)

    def look(self) -> Seen:
        """See what is covered; what came while it lay still says the same again and does not count."""
        still = self._tail.still_rows() > 0
        if not still:
            self._mag += self._new
            self._turned_s += self._since / self._tail.rate_hz
        self._new, self._since = [], 0
        left_s = max(0.0, TURNED_S - self._turned_s)
        if sum(map(len, self._mag)) < 2:
            return Seen(WORDS["turn"], still, left_s)
        mag = np.concatenate(self._mag)
        directions = mag - sphere.centre_of(mag)
        lengths = np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)
        self.cells = sphere.cells_of(directions / lengths)
        if self.coverage < COVERED or left_s > 0.0:
            return Seen(self._words(), still, left_s)
        found = mag_ellipsoid(mag[:: max(1, len(mag) // FITTED)])
        sizes = np.linalg.norm(mag, axis=1)
        found.scores["field_spread_before_part"] = float(sizes.std() / sizes.mean())
        found.scores["field_spread_part"] = found.scores.pop("residual_rms_part")
        found.scores["coverage"] = self.coverage
        return Seen(WORDS["turn"], still, found=found)

    @property
    def lacks(self) -> str:
        """Which side should still be turned downwards."""
        return sphere.lacking(self.cells) if self._mag else ""

    def _words(self) -> str:
        side = self.lacks
        if not side or self._turned_s < 5.0:
            return WORDS["turn"]
        return f"go on turning, above all with the side {side} downwards"

    def too_late(self) -> str:
        """Say why."""
        if not self._mag:
            return (
                "no magnetic field came while it was turned: pick it up and turn it slowly about every axis"
            )
        return (
            f"the turning covered {100.0 * self.coverage:.0f} % of all directions, {100.0 * COVERED:.0f} % "
            f"are needed: turn it about every axis, above all with the side {self.lacks} downwards"
        )
