"""Sensor calibration applied to samples. Pure."""

import msgspec
import numpy as np
import numpy.typing as npt

from brachium_wire.messages import Info, SensorCalibration

Floats = npt.NDArray[np.float64]


class Calibrated:
    """Turns raw samples (n, 3) of one sensor into calibrated ones; what has no entry passes unchanged."""

    def __init__(self, calibration: SensorCalibration) -> None:
        cal = calibration
        self._gyro_bias = None if cal.gyro_bias is None else np.array(cal.gyro_bias)
        self._accel = None
        if cal.accel_bias is not None or cal.accel_scale is not None:
            self._accel = np.array(cal.accel_bias or (0.0,) * 3), np.array(cal.accel_scale or (1.0,) * 3)
        self._mag = None
        if cal.mag_offset is not None or cal.mag_matrix is not None:
            matrix = np.eye(3) if cal.mag_matrix is None else np.array(cal.mag_matrix)
            self._mag = np.array(cal.mag_offset or (0.0,) * 3), matrix.T

    def gyr(self, raw: Floats) -> Floats:
        """Return angular rates, rad/s."""
        return raw if self._gyro_bias is None else raw - self._gyro_bias

    def acc(self, raw: Floats) -> Floats:
        """Return specific forces, m/s^2."""
        if self._accel is None:
            return raw
        bias, scale = self._accel
        result: Floats = (raw - bias) * scale
        return result

    def mag(self, raw: Floats) -> Floats:
        """Return magnetic fields, uT."""
        if self._mag is None:
            return raw
        offset, transposed = self._mag
        result: Floats = np.dot(raw - offset, transposed)  # as @, at half its cost for a few rows
        return result


def recalibrated(before: Info, after: Info) -> bool:
    """Return whether it is the same sensor, with nothing new but its calibration and who keeps it."""
    return msgspec.structs.replace(before, calibration=after.calibration, kept=after.kept) == after
