"""Inertial sensors strapped to the emulated wearer, of the MPU-9150's class: what they read and how they err.

A reading is the truth in sensor axes and what the chip adds. The chip's errors have two parts: what its
calibration knows (large) and what is left after it (residual). A calibrated reading is
`true * (1 + scale error) + residual bias + noise`; the raw one is what the calibration turns into that.
"""

from dataclasses import dataclass, fields
from math import cos, pi, radians, sin, sqrt
from typing import Literal
from zlib import crc32

import numpy as np
import numpy.typing as npt

from brachium_nodes.movement import Array
from brachium_wire.messages import SensorCalibration, Vector
from brachium_wire.tuples import vector

Level = Literal["exact", "ideal", "typical", "patient"]

G = 9.81
"""Standard acceleration in this project, m/s^2."""
GRAVITY: Array = np.array([0.0, 0.0, -G])
FIELD_UT: Array = 46.0 * np.array([0.0, cos(radians(60.0)), -sin(radians(60.0))])
"""Earth's field east, north, up: 46 uT, dip 60 deg (central Europe is 48 uT, 60 to 67 deg)."""
CHIP = "MPU-9150 (emulated)"

_DPS = pi / 180.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Every figure of what stands between the movement meant and the readings got.

    Figures of the chip are standard deviations per axis, drawn once a sensor from the seed. Densities are the
    MPU-9150 product specification's (revision 4.3, sections 6.1 to 6.3), and raw errors lie within what it
    allows; residuals are assumptions of this project for a calibration done by hand.
    """

    gyro_noise: float = 0.005 * _DPS
    """rad/s/sqrt(Hz): the specification's typical 0.005 dps/sqrt(Hz)."""
    gyro_bias_raw: float = 5.0 * _DPS
    """rad/s: the specification allows +-20 dps at 25 C."""
    gyro_bias_residual: float = 0.05 * _DPS
    """rad/s: after some seconds at rest and a little warming."""
    gyro_walk: float = 0.002 * _DPS
    """rad/s/sqrt(s)."""
    gyro_scale: float = 0.005
    """No calibration of ours finds it (the specification allows 3 %)."""
    accel_noise: float = 400e-6 * G
    """m/s^2/sqrt(Hz): the specification's typical 400 ug/sqrt(Hz)."""
    accel_bias_raw: float = 0.06 * G
    """m/s^2: the specification allows +-80 mg (x, y) and +-150 mg (z)."""
    accel_bias_residual: float = 0.003 * G
    """m/s^2: after six faces laid down by hand."""
    accel_scale_raw: float = 0.02
    """The specification allows 3 %."""
    accel_scale_residual: float = 0.003
    mag_noise: float = 0.4
    """uT a sample."""
    hard_iron_raw: float = 30.0
    """uT: battery and board."""
    hard_iron_residual: float = 1.0
    """uT."""
    soft_iron: float = 0.03
    """Of each element of the symmetric matrix; the calibration knows it exactly."""
    placement_deg: float = 10.0
    """3-D rms of the angle between strap and nominal mounting as put on; a pose calibration finds it."""
    settling_deg: float = 0.0
    """3-D rms of the angle by which the strap settles as movement begins, after the pose: nothing sees it."""
    soft_tissue_deg: float = 0.0
    """Angle by which skin turns against bone for 90 deg in a neighbouring joint; 0 in neutral."""
    humeral_lag: float = 0.0
    """Share of the humerus's axial rotation that the skin under the upper-arm sensor does not follow."""
    pronation_lag: float = 0.0
    """Share of pronation that the skin under the forearm sensor does not follow."""
    slip_deg: float = 0.0
    """Angle by which one strap of the wearer slips, once."""
    pose_error_deg: float = 0.0
    """3-D rms of the angle by which the upper arm, and by which the forearm on it, is held off neutral and
    off every pose of a calibration."""
    tremor_deg: float = 0.0
    """Standard deviation of a 5 Hz tremor in each of shoulder flexion, elbow flexion and pronation. An arm
    that holds a calibration's pose is relaxed and has none."""
    quantised: bool = True
    """Round to the chip's steps and stop at its full scale."""


LEVELS: dict[Level, Errors] = {
    "exact": Errors(
        **dict.fromkeys((f.name for f in fields(Errors) if f.name != "quantised"), 0.0), quantised=False
    ),
    "ideal": Errors(),
    "typical": Errors(settling_deg=1.5, soft_tissue_deg=2.0),
    "patient": Errors(
        settling_deg=1.5,
        soft_tissue_deg=2.0,
        humeral_lag=0.3,
        pronation_lag=0.1,
        slip_deg=8.0,
        pose_error_deg=5.0,
        tremor_deg=0.02,
    ),
}
"""exact: no error at all, for tests; ideal: a calibrated chip on a rigid body; typical: the same on skin;
patient: a wearer who cannot stand in neutral, whose skin follows rotation in part, whose hand trembles by
some 0.3 mm and one of whose straps slips. The shares that skin follows are assumptions of this project."""

ACCEL_FULL_SCALE = 8.0 * G
"""m/s^2; 4096 steps a g. A hand that hits the table passes 4 g."""
GYRO_FULL_SCALE = 2000.0 * _DPS
"""rad/s; 16.4 steps a dps."""
ACCEL_STEP = G / 4096.0
GYRO_STEP = _DPS / 16.4
MAG_STEP = 0.3
"""uT, AK8975."""
MAG_FULL_SCALE = 1229.0


def generator(seed: int, segment: str, what: str, block: int = 0) -> np.random.Generator:
    """Return the random numbers of one purpose of one sensor; no two purposes or blocks share any."""
    return np.random.default_rng([seed, crc32(f"{segment}/{what}".encode()), block])


@dataclass(frozen=True, slots=True, eq=False)
class Chip:
    """One chip's own errors, drawn once; `calibration` is what is known of them."""

    errors: Errors
    gyro_bias: Array
    gyro_factor: Array
    accel_factor: Array
    accel_bias: Array
    mag_bias: Array
    calibration: SensorCalibration

    @classmethod
    def draw(cls, errors: Errors, seed: int, segment: str) -> "Chip":
        """Return the chip that this seed puts on this segment."""
        random, e = generator(seed, segment, "chip"), errors
        soft = e.soft_iron * random.standard_normal((3, 3))
        calibration = SensorCalibration(
            gyro_bias=vector(e.gyro_bias_raw * random.standard_normal(3)),
            accel_scale=vector(1.0 + e.accel_scale_raw * random.standard_normal(3)),
            accel_bias=vector(e.accel_bias_raw * random.standard_normal(3)),
            mag_offset=vector(e.hard_iron_raw * random.standard_normal(3)),
            mag_matrix=_matrix(np.linalg.inv(np.eye(3) + 0.5 * (soft + soft.T))),
        )
        return cls(
            errors,
            gyro_bias=e.gyro_bias_residual * random.standard_normal(3),
            gyro_factor=1.0 + e.gyro_scale * random.standard_normal(3),
            accel_factor=1.0 + e.accel_scale_residual * random.standard_normal(3),
            accel_bias=e.accel_bias_residual * random.standard_normal(3),
            mag_bias=e.hard_iron_residual * random.standard_normal(3),
            calibration=calibration,
        )

    def read(
        self, acc: Array, gyr: Array, mag: Array, rate_hz: float, drift: Array, white: Array
    ) -> tuple[Array, Array, Array]:
        """Return raw readings (n, 3) of true specific force, angular rate and field in sensor axes.

        `drift` (n, 3) rad/s is where the gyro's bias has walked to; `white` (3, n, 3) is noise of variance 1.
        White noise of a density over the band rate_hz / 2 has the variance density^2 rate_hz / 2.
        """
        e, c = self.errors, self.calibration
        band = sqrt(rate_hz / 2.0)
        acc = acc * self.accel_factor + self.accel_bias + e.accel_noise * band * white[0]
        gyr = gyr * self.gyro_factor + self.gyro_bias + drift + e.gyro_noise * band * white[1]
        mag = mag + self.mag_bias + e.mag_noise * white[2]
        acc = acc / np.array(c.accel_scale) + np.array(c.accel_bias)
        gyr = gyr + np.array(c.gyro_bias)
        mag = np.einsum("ij,nj->ni", np.linalg.inv(np.array(c.mag_matrix)), mag) + np.array(c.mag_offset)
        if not e.quantised:
            return acc, gyr, mag
        return (
            _quantised(acc, ACCEL_STEP, ACCEL_FULL_SCALE),
            _quantised(gyr, GYRO_STEP, GYRO_FULL_SCALE),
            _quantised(mag, MAG_STEP, MAG_FULL_SCALE),
        )


def calibrated(
    calibration: SensorCalibration, acc: Array, gyr: Array, mag: Array
) -> tuple[Array, Array, Array]:
    """Return readings with a complete calibration applied, as messages.SensorCalibration defines it."""
    c = calibration
    matrix = np.array(c.mag_matrix)
    return (
        np.array(c.accel_scale) * (acc - np.array(c.accel_bias)),
        gyr - np.array(c.gyro_bias),
        np.einsum("ij,nj->ni", matrix, mag - np.array(c.mag_offset)),
    )


def _quantised(values: Array, step: float, full_scale: float) -> Array:
    return step * np.round(np.clip(values, -full_scale, full_scale) / step)


def _matrix(m: npt.ArrayLike) -> tuple[Vector, Vector, Vector]:
    x, y, z = np.asarray(m, dtype=np.float64)
    return (vector(x), vector(y), vector(z))
