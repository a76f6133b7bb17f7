"""One orientation filter a sensor: samples at the nominal period in, world_from_sensor out. Pure.

World is z up; with a magnetometer x east and y magnetic north (ENU), without one heading zero is arbitrary.
"""

from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from brachium_fusion.auto_filter import AutoFilter
from brachium_fusion.complementary import ComplementaryFilter
from brachium_fusion.vqf_filter import VqfFilter

Floats = npt.NDArray[np.float64]
FilterName = Literal["auto", "vqf", "complementary", "complementary-printed"]
FILTERS: tuple[FilterName, ...] = ("auto", "vqf", "complementary", "complementary-printed")
AUTO: FilterName = "auto"
"""The default."""


class OrientationFilter(Protocol):
    """Turns calibrated samples into orientations; its state can be read and put back."""

    @property
    def disturbed(self) -> bool:
        """The magnetic field is not the one the filter learnt, so heading rests on the gyroscope."""
        ...

    def update(
        self, gyr: Floats, acc: Floats, mag: Floats | None, mag_index: tuple[int, ...] | None
    ) -> Floats:
        """Return world_from_sensor (n, 4) after each of n samples: rad/s, m/s^2, uT in sensor axes.

        `mag` has one row a sample, or one for each of the sample positions in `mag_index`.
        """
        ...

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        ...


def make(name: FilterName, period_s: float, magnetometer: bool) -> OrientationFilter:
    """Return a new filter for samples every `period_s`, with or without a magnetometer."""
    if name == "auto":
        return AutoFilter(period_s, magnetometer)
    if name == "vqf":
        return VqfFilter(period_s, magnetometer)
    return ComplementaryFilter(period_s, magnetometer, printed=name == "complementary-printed")
