"""Fits of a sensor's own errors, from readings as the chip gives them. Pure.

The paper's three (Tsilomitrou et al. 2021, 4.1) are `gyro_at_rest`, `accel_six_faces` and `mag_min_max`;
`accel_still_poses` and `mag_ellipsoid` need no exact faces and find more. Each gives the part of
messages.SensorCalibration that it found, with scores, or raises Refused with one reason.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from brachium_fusion.still_stretches import still_stretches
from brachium_wire.messages import SensorCalibration, Vector

Floats = npt.NDArray[np.float64]

GRAVITY = 9.81
"""m/s^2, as the filters take it; places on Earth differ by 0.3 %, which scales lengths of nothing here."""
REST_S = 3.0
"""Of stillness for the gyroscope: its noise then averages to 0.003 dps."""
MARGIN_S = 0.3
"""Of a rest that is left out at each end: the sensor was being let go."""
POSE_S = 0.7
"""Of stillness for one pose of the accelerometer."""
FACE = 0.9
"""An axis stands upright when it feels at least this part of gravity (26 deg)."""
POSES = 9
"""Still poses for the ellipsoid at least: 6 unknowns and a half as many again."""
COVERED = 0.08
"""Least eigenvalue of the directions' scatter; a third when they fill the sphere, 0 when one is missing."""
ACCEL_RESIDUAL = 0.1
"""m/s^2 rms: more is no still pose, or another sensor."""
MAG_RESIDUAL = 0.06
"""Part of the field, a robust SD: more means that iron or a magnet was near for much of the turning."""
MAG_ROWS = 100
OUTWARD = 0.55
"""The field's middle must lie this deep inside the readings: on each axis both ends reach this part of it."""


class Refused(ValueError):
    """The movement does not tell what was asked; the message says why and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFit:
    """What a fit found."""

    method: str
    calibration: SensorCalibration
    scores: dict[str, float]


def gyro_at_rest(gyr: Floats, acc: Floats, rate_hz: float) -> SensorFit:
    """Return the gyroscope's bias: its mean (n, 3) rad/s over the longest rest.

    `bias_sd_dps` is how far two halves of the rest are apart.
    """
    stretches = still_stretches(gyr, acc, rate_hz, REST_S)
    if not stretches:
        raise Refused(f"the sensor did not lie still for {REST_S:g} s: put it on a table and leave it")
    longest = max(stretches, key=lambda s: s.stop - s.start)
    margin = round(MARGIN_S * rate_hz)
    rest = gyr[longest.start + margin : longest.stop - margin]
    half = len(rest) // 2
    apart = np.abs(rest[:half].mean(axis=0) - rest[half:].mean(axis=0)).max()
    return SensorFit(
        method="gyro-at-rest",
        calibration=SensorCalibration(gyro_bias=_vector(rest.mean(axis=0))),
        scores={"rest_s": len(rest) / rate_hz, "bias_sd_dps": float(np.degrees(apart) / np.sqrt(2.0))},
    )


def still_poses(gyr: Floats, acc: Floats, rate_hz: float) -> Floats:
    """Return the mean specific force (k, 3) m/s^2 of every still pose."""
    return np.array(
        [acc[s].mean(axis=0) for s in still_stretches(gyr, acc, rate_hz, POSE_S)], dtype=np.float64
    ).reshape(-1, 3)


def accel_six_faces(poses: Floats) -> SensorFit:
    """Return the accelerometer's scale and bias from the sensor laid on each of its six faces.

    `poses` (k, 3) m/s^2: a face is a pose in which one axis feels nearly all of gravity. On each axis
    bias = (up + down) / 2 and scale = 2 g / (up - down).
    """
    share = poses / np.linalg.norm(poses, axis=1, keepdims=True)
    up, down, missing = np.empty(3), np.empty(3), []
    for axis, name in enumerate("xyz"):
        for sign, ends, word in ((1.0, up, "up"), (-1.0, down, "down")):
            there = poses[sign * share[:, axis] > FACE, axis]
            if len(there):
                ends[axis] = sign * (sign * there).max()
            else:
                missing.append(f"{name} {word}")
    if missing:
        raise Refused(f"no still pose with {', '.join(missing)}: lay the sensor on each of its six faces")
    return _accel_fit("accel-six-faces", poses, 2.0 * GRAVITY / (up - down), (up + down) / 2.0)


def accel_still_poses(poses: Floats) -> SensorFit:
    """Return the accelerometer's scale and bias from any still poses (k, 3) m/s^2 all around.

    Least squares of |scale (acc - bias)| = g over all poses, robust to one that was not still.
    """
    if len(poses) < POSES:
        raise Refused(
            f"{len(poses)} still poses, {POSES} are needed: hold the sensor still, each another way"
        )
    directions = poses / np.linalg.norm(poses, axis=1, keepdims=True)
    _check_covered(directions, "hold the sensor still in more directions, also upside down and on its sides")

    def residual(p: Floats) -> Floats:
        lengths: Floats = np.linalg.norm(p[:3] * (poses - p[3:]), axis=1) - GRAVITY
        return lengths

    found = least_squares(residual, np.r_[np.ones(3), np.zeros(3)], loss="soft_l1", f_scale=0.05)
    return _accel_fit("accel-still-poses", poses, found.x[:3], found.x[3:])


def _accel_fit(method: str, poses: Floats, scale: Floats, bias: Floats) -> SensorFit:
    left = np.linalg.norm(scale * (poses - bias), axis=1) - GRAVITY
    rms = float(np.sqrt(np.mean(left**2)))
    # Six unknowns explain six faces whatever they are; what is left over then says nothing.
    if method == "accel-still-poses" and rms > ACCEL_RESIDUAL:
        raise Refused(
            f"gravity is still {rms:.2f} m/s^2 off between poses ({ACCEL_RESIDUAL:g} at most): "
            "hold the sensor against something firm in each pose"
        )
    return SensorFit(
        method=method,
        calibration=SensorCalibration(accel_scale=_vector(scale), accel_bias=_vector(bias)),
        scores={"poses": float(len(poses)), "residual_m_s2": rms},
    )


def mag_min_max(mag: Floats) -> SensorFit:
    """Return the magnetometer's offset as the paper has it: per axis the middle of least and greatest.

    `mag` (n, 3) uT while the sensor is turned in many directions.
    """
    low, high = mag.min(axis=0), mag.max(axis=0)
    offset, reach = (low + high) / 2.0, (high - low) / 2.0
    if len(mag) < MAG_ROWS or reach.min() < OUTWARD * reach.max():
        raise Refused("the sensor was not turned through all directions: turn it slowly about every axis")
    return SensorFit(
        method="mag-min-max",
        calibration=SensorCalibration(mag_offset=_vector(offset)),
        scores=_mag_scores(mag - offset),
    )


def mag_ellipsoid(mag: Floats) -> SensorFit:
    """Return hard iron (offset) and soft iron (symmetric matrix) of readings (n, 3) uT all around.

    The readings lie on an ellipsoid; the matrix of determinant 1 makes it a sphere. First the general
    quadric with least squares of its ten coefficients, then |matrix (m - offset)| = field, robust to a
    passing magnet. A turn between magnetometer and accelerometer is not found by this.
    """
    if len(mag) < MAG_ROWS:
        raise Refused(f"{len(mag)} readings, {MAG_ROWS} are needed: turn the sensor for half a minute")
    offset, matrix = _quadric(mag)
    centred = (mag - offset) @ matrix
    _check_covered(
        centred / np.linalg.norm(centred, axis=1, keepdims=True), "turn the sensor slowly about every axis"
    )
    field = float(np.median(np.linalg.norm(centred, axis=1)))
    upper = np.triu_indices(3)

    def residual(p: Floats) -> Floats:
        w = np.zeros((3, 3))
        w[upper] = p[3:]
        w = w + np.triu(w, 1).T
        lengths: Floats = np.linalg.norm((mag - p[:3]) @ w, axis=1) - 1.0
        return lengths

    found = least_squares(
        residual, np.r_[offset, (matrix / field)[upper]], loss="soft_l1", f_scale=0.02, x_scale="jac"
    )
    offset = found.x[:3]
    whole = np.zeros((3, 3))
    whole[upper] = found.x[3:]
    whole = whole + np.triu(whole, 1).T
    matrix = whole / np.cbrt(np.linalg.det(whole))
    scores = _mag_scores((mag - offset) @ matrix)
    if scores["residual_part"] > MAG_RESIDUAL:
        raise Refused(
            f"the field varies by {100 * scores['residual_part']:.0f} % after the fit "
            f"({100 * MAG_RESIDUAL:.0f} % at most): turn the sensor away from iron, cables and speakers"
        )
    return SensorFit(
        method="mag-ellipsoid",
        calibration=SensorCalibration(
            mag_offset=_vector(offset),
            mag_matrix=(_vector(matrix[0]), _vector(matrix[1]), _vector(matrix[2])),
        ),
        scores=scores,
    )


def _quadric(m: Floats) -> tuple[Floats, Floats]:
    """Return the centre and the symmetric matrix of determinant 1 of the ellipsoid through m (n, 3)."""
    middle, size = m.mean(axis=0), float(m.std())
    x, y, z = ((m - middle) / size).T
    design = np.column_stack(
        [x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z, np.ones_like(x)]
    )
    a = np.linalg.svd(design, full_matrices=False)[2][-1]
    shape = np.array([[a[0], a[3], a[4]], [a[3], a[1], a[5]], [a[4], a[5], a[2]]])
    shape = shape * (np.sign(np.trace(shape)) or 1.0)
    linear = a[6:9] * (np.sign(a[0] + a[1] + a[2]) or 1.0)
    values, vectors = np.linalg.eigh(shape)
    if values[0] <= 1e-3 * values[-1]:
        raise Refused("the readings lie on no ellipsoid: turn the sensor slowly about every axis")
    centre = -np.linalg.solve(shape, linear)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    return centre * size + middle, root / np.cbrt(np.linalg.det(root))


def _mag_scores(centred: Floats) -> dict[str, float]:
    """Return the field and, as parts of it, how far readings are off: nine of ten as an SD, and all."""
    lengths = np.linalg.norm(centred, axis=1)
    field = float(np.median(lengths))
    off = np.abs(lengths - field) / field
    return {
        "field_ut": field,
        "residual_part": float(np.percentile(off, 90.0) / 1.645),
        "residual_rms_part": float(np.sqrt(np.mean(off**2))),
    }


def _check_covered(directions: Floats, to_do: str) -> None:
    least = np.linalg.eigvalsh(directions.T @ directions / len(directions))[0]
    both_ends = min(directions.max(axis=0).min(), -directions.min(axis=0).max())
    if least < COVERED or both_ends < OUTWARD:
        raise Refused(f"the directions do not cover all sides: {to_do}")


def _vector(v: Floats) -> Vector:
    x, y, z = v.tolist()
    return (x, y, z)
