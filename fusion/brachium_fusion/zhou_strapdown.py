"""The front end of Zhou et al. 2008: filters of section 2.2, orientation by eq 2, acceleration by eq 1 and 3.

Pure. World is z up; rows are uniform in time.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import signal

from brachium_body import rotation

Floats = npt.NDArray[np.float64]

G = 9.81
"""As eq 3 has it, m/s^2."""
ACC_LOWPASS_HZ = 10.0
GYR_HIGHPASS_HZ = 0.05
ORDER = 2
"""Of both filters: a Butterworth of second order, causal. The paper gives the corners alone (erratum Z9)."""


def filtered(values: Floats, rate_hz: float, corner_hz: float, kind: str, *, zero_phase: bool) -> Floats:
    """Return values (n, 3) through one of section 2.2's filters, `kind` lowpass or highpass.

    It starts as if the first row had stood for ever; `zero_phase` runs it both ways. Raises ValueError where
    the corner is not below half the rate: at the paper's 25 Hz its 10 Hz are 0.8 of that (erratum Z9).
    """
    if not 0.0 < corner_hz < 0.5 * rate_hz:
        raise ValueError(
            f"a corner of {corner_hz:g} Hz needs more than {2.0 * corner_hz:g} samples a second, "
            f"not {rate_hz:g}"
        )
    sos: Any = signal.butter(ORDER, corner_hz, kind, fs=rate_hz, output="sos")
    if zero_phase:
        return np.asarray(signal.sosfiltfilt(sos, values, axis=0))
    start = signal.sosfilt_zi(sos)[:, :, None] * values[0]
    return np.asarray(signal.sosfilt(sos, values, axis=0, zi=start)[0])


def strapdown(start: Floats, gyr: Floats, rate_hz: float, *, orthonormal: bool) -> Floats:
    """Return the matrices (n, 3, 3) of eq 2, R + R S(w) T, that begin as quaternion `start` (4,).

    As printed they stop being rotations: a column grows by 1 + (w T)^2 a step, squared (erratum Z3).
    `orthonormal` takes the nearest rotation after each step, which is what a singular value decomposition
    gives: R S turns about w and stretches across it, so the nearest turns by atan(|w| T) about w.
    """
    steps = gyr[1:] / rate_hz
    if orthonormal:
        angle = np.linalg.norm(steps, axis=1, keepdims=True)
        turn = rotation.from_rotation_vector(steps * np.arctan(angle) / np.maximum(angle, 1e-300))
        return rotation.to_matrix(_chained(start, turn))
    result = np.empty((len(gyr), 3, 3))
    result[0] = rotation.to_matrix(start)
    growth = np.eye(3) + rotation.cross_matrix(steps)
    for i in range(len(steps)):
        result[i + 1] = result[i] @ growth[i]
    return result


def world_acceleration(world_from_sensor: Floats, acc: Floats) -> Floats:
    """Return the acceleration (n, 3) of eq 1 and 3 from matrices (n, 3, 3) and specific force (n, 3).

    Eq 3 adds [0, 0, 9.81], which is right where z points down; here it points up (erratum Z1).
    """
    force: Floats = np.einsum("nij,nj->ni", world_from_sensor, acc)
    acceleration: Floats = force - np.array([0.0, 0.0, G])
    return acceleration


def displacement(acceleration: Floats, rate_hz: float) -> Floats:
    """Return the double integral (n, 3) by trapezoids, from rest."""
    return _integral(_integral(acceleration, rate_hz), rate_hz)


def nearest_rotation(matrices: Floats) -> Floats:
    """Return the quaternions (n, 4) of the rotations nearest to matrices (n, 3, 3)."""
    u, _, v = np.linalg.svd(matrices)
    flip = np.linalg.det(u @ v)
    u = u.copy()
    u[:, :, 2] *= flip[:, None]
    return rotation.from_matrix(u @ v)


def static_orientation(acc: Floats, mag: Floats | None) -> Floats:
    """Return world_from_sensor (4,) of a sensor at rest: acc (n, 3) points up, mag (n, 3) has north in it.

    Without a magnetometer its heading is free: the sensor axis that is most level points along world x.
    """
    up = acc.mean(axis=0)
    up = up / np.linalg.norm(up)
    if mag is None:
        level = np.eye(3)[np.argmin(np.abs(up))]
        north = np.cross(up, level)
    else:
        north = np.nanmean(mag, axis=0)
    east = np.cross(north, up)
    east = east / np.linalg.norm(east)
    return rotation.from_matrix(np.stack([east, np.cross(up, east), up]))


def _integral(values: Floats, rate_hz: float) -> Floats:
    result = np.zeros_like(values)
    np.cumsum(0.5 * (values[1:] + values[:-1]) / rate_hz, axis=0, out=result[1:])
    return result


def _chained(start: Floats, turns: Floats) -> Floats:
    """Return start (4,) and its products with turns (n - 1, 4), one after the other, (n, 4)."""
    w, x, y, z = (float(c) for c in start)
    rows = [(w, x, y, z)]
    for a, b, c, d in turns.tolist():
        w, x, y, z = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        )
        rows.append((w, x, y, z))
    return rotation.normalize(np.array(rows))
