"""Shimmer3's calibration blocks, and raw steps to SI in the sensor's own axes. Pure.

A block holds offset b and sensitivity k of each channel (i16, high byte first) and the alignment R (i8, in
hundredths): calibrated = R^-1 K^-1 (raw - b) (Ferraris, Grimaldi and Parvis 1995). R turns each chip's axes
into those printed on the case, which are one frame for all three chips.
"""

from dataclasses import dataclass
from math import pi
from struct import unpack
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_nodes.shimmer.protocol import Accelerometer, Inquiry, Kind
from brachium_wire.messages import SensorCalibration, Vector
from brachium_wire.tuples import vector

Floats = npt.NDArray[np.float64]

BLOCK_BYTES = 21
KINDS: tuple[Kind, ...] = ("low-noise", "gyr", "mag", "wide-range")
"""In the order of the blocks."""
UT_PER_GAUSS = 100.0
LARGEST_TURN = 0.2
"""Of an alignment's elements from those of the chip's nominal one: 12 deg; more is no calibration."""
FACTOR = 1.6
"""A sensitivity further than this from the chip's own is none of accelerometer or gyroscope."""

_A: Floats = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_B: Floats = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
_C: Floats = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """What turns the raw steps (n, 3) of one chip into its unit: m/s^2, deg/s or gauss."""

    offset: Floats
    """(3,) steps."""
    sensitivity: Floats
    """(3,) steps a unit."""
    alignment: Floats
    """(3, 3) chip from case."""

    @property
    def case_from_steps(self) -> Floats:
        """(3, 3): R^-1 K^-1."""
        inverted: Floats = np.linalg.inv(self.alignment) / self.sensitivity
        return inverted


_DLHC_MAG = ((1100, 980), (855, 760), (670, 600), (450, 400), (400, 355), (330, 295), (230, 205))
"""LSM303DLHC: steps a gauss in x, y and in z, of ranges 1 to 7 (+-1.3 to 8.1 gauss)."""
_DLHC_ACCEL, _AH_ACCEL = (1631, 815, 408, 135), (1671, 209, 836, 418)
"""Steps a m/s^2 by range register: 2, 4, 8, 16 g, of the LSM303AH 2, 16, 4, 8 g."""
_GYRO = (131.0, 65.5, 32.8, 16.4)
"""MPU-9150: steps a deg/s."""


def nominal(kind: Kind, inquiry: Inquiry, *, newer: bool) -> Block:
    """Return what the data sheets say of a chip at the range that it is set to."""
    zero = np.zeros(3)
    if kind == "low-noise":
        return (
            Block(np.full(3, 2253.0), np.full(3, 92.0), _A)
            if newer
            else Block(np.full(3, 2047.0), np.full(3, 83.0), _A)
        )
    if kind == "wide-range":
        steps = (_AH_ACCEL if newer else _DLHC_ACCEL)[inquiry.accel_range]
        return Block(zero, np.full(3, float(steps)), _C if newer else _B)
    if kind == "gyr":
        return Block(zero, np.full(3, _GYRO[inquiry.gyro_range]), _A)
    if newer:
        return Block(zero, np.full(3, 667.0), _C)
    across, along = _DLHC_MAG[max(inquiry.mag_range, 1) - 1]
    return Block(zero, np.array([across, across, along], dtype=np.float64), _B)


def stored(kind: Kind, block: bytes, usual: Block) -> Block | None:
    """Return what a block of 21 bytes holds, or None when the device was never calibrated or it cannot be."""
    values = np.array(unpack(">6h9b", block), dtype=np.float64)
    offset, sensitivity, alignment = values[:3], values[3:6], values[6:].reshape(3, 3) / 100.0
    if kind == "gyr":
        sensitivity = sensitivity / 100.0
    if (sensitivity <= 0.0).any() or np.abs(alignment - usual.alignment).max() > LARGEST_TURN:
        return None
    ratio = sensitivity / usual.sensitivity
    if kind != "mag" and ((ratio > FACTOR).any() or (ratio < 1.0 / FACTOR).any()):
        return None
    return Block(offset, sensitivity, alignment)


class Conversion(NamedTuple):
    """From steps to what a node sends: unit * case_from_steps (steps - zero)."""

    zero: Floats
    matrix: Floats

    def __call__(self, steps: npt.ArrayLike) -> Floats:
        """Return steps (n, 3) in SI (uT for the field), case axes."""
        converted: Floats = (np.asarray(steps, dtype=np.float64) - self.zero) @ self.matrix.T
        return converted


class Converted(NamedTuple):
    """How each sensor's steps are converted, and the calibration that is left for the samples' users."""

    acc: Conversion
    gyr: Conversion
    mag: Conversion
    calibration: SensorCalibration
    warnings: tuple[str, ...]


def conversions(inquiry: Inquiry, blocks: bytes, accelerometer: Accelerometer, *, newer: bool) -> Converted:
    """Return the conversions of a device from its four blocks (84 bytes).

    Alignment and sensitivity of accelerometer and gyroscope are applied: a node's calibration has no place
    for them. Offsets, and all of the magnetometer's, are left in `calibration`. The magnetometer's own
    blocks are in units of the local field; its size is taken from the data sheet.
    """
    found, usual, missing = dict[Kind, Block | None](), dict[Kind, Block](), list[str]()
    for i, kind in enumerate(KINDS):
        usual[kind] = nominal(kind, inquiry, newer=newer)
        found[kind] = stored(kind, blocks[i * BLOCK_BYTES : (i + 1) * BLOCK_BYTES], usual[kind])
    for kind in (accelerometer, "gyr", "mag"):
        if found[kind] is None:
            missing.append(f"{kind}: no calibration is stored on the device; the data sheet's is used")
    acc, accel_bias = _applied(found[accelerometer], usual[accelerometer], 1.0)
    gyr, gyro_bias = _applied(found["gyr"], usual["gyr"], pi / 180.0)
    mag = Conversion(usual["mag"].offset, UT_PER_GAUSS * usual["mag"].case_from_steps)
    calibration = SensorCalibration(gyro_bias=gyro_bias, accel_bias=accel_bias)
    if (block := found["mag"]) is not None:
        shape = block.case_from_steps @ np.linalg.inv(usual["mag"].case_from_steps)
        shape = shape / np.cbrt(abs(np.linalg.det(shape)))
        x, y, z = (vector(row) for row in shape)
        calibration = SensorCalibration(
            gyro_bias=gyro_bias,
            accel_bias=accel_bias,
            mag_offset=vector(mag(block.offset[None])[0]),
            mag_matrix=(x, y, z),
        )
    return Converted(acc, gyr, mag, calibration, tuple(missing))


def _applied(block: Block | None, usual: Block, unit: float) -> tuple[Conversion, Vector | None]:
    """Return the conversion about the chip's nominal zero, and the bias that is then left."""
    if block is None:
        return Conversion(usual.offset, unit * usual.case_from_steps), None
    conversion = Conversion(usual.offset, unit * block.case_from_steps)
    return conversion, vector(conversion(block.offset[None])[0])
