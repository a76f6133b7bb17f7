"""Which fit of a sensor's calibration is asked for, and what its samples gave. Pure."""

from collections.abc import Callable
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from brachium_fusion import magnetometer_calibration as magnetometer
from brachium_fusion import sensor_calibration as fits
from brachium_fusion.sensor_calibration import Refused, SensorFit
from brachium_wire.calibration_file import Part

Floats = npt.NDArray[np.float64]
What = Literal["gyro", "accel", "accel-faces", "mag", "mag-min-max"]
WHATS: tuple[What, ...] = get_args(What)
ALL: tuple[What, ...] = ("gyro", "accel", "mag")
"""The best fit of each part."""


class RawSamples(NamedTuple):
    """One sensor's samples as the chip gave them, in sensor axes; blocks it does not deliver are None."""

    rate_hz: float
    gyr: Floats | None
    """(n, 3) rad/s."""
    acc: Floats | None
    """(n, 3) m/s^2, of the same instants."""
    mag: Floats | None
    """(k, 3) uT."""


class Outcome(NamedTuple):
    """What was asked for, and what was found: a fit, or why there is none."""

    what: What
    found: SensorFit | str

    @property
    def part(self) -> Part:
        """The part of a calibration that it concerns."""
        return _PARTS[self.what]


_PARTS: dict[What, Part] = {
    "gyro": "gyro",
    "accel": "accel",
    "accel-faces": "accel",
    "mag": "mag",
    "mag-min-max": "mag",
}


def fit(what: What, samples: RawSamples) -> Outcome:
    """Fit one part; a movement that does not tell it is a reason, not an error."""
    try:
        return Outcome(what, _FITS[what](samples))
    except Refused as reason:
        return Outcome(what, str(reason))


def _motion(samples: RawSamples) -> tuple[Floats, Floats]:
    if samples.gyr is None or samples.acc is None:
        raise Refused("the sensor gives no angular rates and forces of its own: it calibrates itself")
    return samples.gyr, samples.acc


def _field(samples: RawSamples) -> Floats:
    if samples.mag is None or not len(samples.mag):
        raise Refused("the samples have no magnetic field")
    return samples.mag


def _gyro(samples: RawSamples) -> SensorFit:
    return fits.gyro_at_rest(*_motion(samples), samples.rate_hz)


def _poses(samples: RawSamples) -> Floats:
    return fits.still_poses(*_motion(samples), samples.rate_hz)


_FITS: dict[What, Callable[[RawSamples], SensorFit]] = {
    "gyro": _gyro,
    "accel": lambda samples: fits.accel_still_poses(_poses(samples)),
    "accel-faces": lambda samples: fits.accel_six_faces(_poses(samples)),
    "mag": lambda samples: magnetometer.mag_ellipsoid(_field(samples)),
    "mag-min-max": lambda samples: magnetometer.mag_min_max(_field(samples)),
}
