"""Fits of a gyroscope's and an accelerometer's own errors, from readings as the chip gives them. Pure.

The paper's (Tsilomitrou et al. 2021, 4.1) are `gyro_at_rest` and `accel_six_faces`; `accel_laid_faces` and
`accel_still_poses` need no exact faces. Each gives the part of messages.SensorCalibration that it found, with
scores, or raises Refused with one reason. magnetometer_calibration.py has the magnetometer's.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from brachium_fusion.still_stretches import still_stretches
from brachium_wire.messages import SensorCalibration
from brachium_wire.tuples import vector

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
SCALE_OFF, BIAS_OFF = 0.1, 2.5
"""Three times, and m/s^2, what data sheets of such chips allow (3 %, 150 mg): more was no lying on a face."""
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
        calibration=SensorCalibration(gyro_bias=vector(rest.mean(axis=0))),
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
    up, down = _face_ends(poses)
    return _accel_fit("accel-six-faces", poses, 2.0 * GRAVITY / (up - down), (up + down) / 2.0)


def face_of(pose: Floats) -> str:
    """Return which axis of a still pose (3,) points up, as `-z`; empty when none does within FACE."""
    share = pose / np.linalg.norm(pose)
    axis = int(np.argmax(np.abs(share)))
    if abs(share[axis]) <= FACE:
        return ""
    return ("+" if share[axis] > 0.0 else "-") + "xyz"[axis]


def _face_ends(poses: Floats) -> tuple[Floats, Floats]:
    """Return what each axis feels upwards and downwards, or raise Refused naming what is missing."""
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
    return up, down


def accel_laid_faces(poses: Floats) -> SensorFit:
    """Return scale and bias from still poses (k, 3) m/s^2, six faces among them, laid down by hand.

    Each tells that |scale (acc - bias)| = g, however it is tilted: six equations for six unknowns, where
    `accel_six_faces` takes what a tilt takes from an axis for a part of its scale.
    """
    up, down = _face_ends(poses)
    start = np.r_[2.0 * GRAVITY / (up - down), (up + down) / 2.0]
    scale, bias = _on_sphere(poses, start)
    if np.abs(scale - 1.0).max() > SCALE_OFF or np.abs(bias).max() > BIAS_OFF:
        raise Refused(
            f"no accelerometer errs by {100.0 * np.abs(scale - 1.0).max():.0f} % and "
            f"{np.abs(bias).max():.1f} m/s^2: lay the sensor down and let go of it on every face"
        )
    return _accel_fit("accel-laid-faces", poses, scale, bias)


def _on_sphere(poses: Floats, start: Floats) -> tuple[Floats, Floats]:
    """Return scale (3,) and bias (3,) with which |scale (acc - bias)| = g at best, robustly."""

    def residual(p: Floats) -> Floats:
        lengths: Floats = np.linalg.norm(p[:3] * (poses - p[3:]), axis=1) - GRAVITY
        return lengths

    found = least_squares(residual, start, loss="soft_l1", f_scale=0.05).x
    return found[:3], found[3:]


def accel_still_poses(poses: Floats) -> SensorFit:
    """Return the accelerometer's scale and bias from any still poses (k, 3) m/s^2 all around.

    Least squares of |scale (acc - bias)| = g over all poses, robust to one that was not still.
    """
    if len(poses) < POSES:
        raise Refused(
            f"{len(poses)} still poses, {POSES} are needed: hold the sensor still, each another way"
        )
    directions = poses / np.linalg.norm(poses, axis=1, keepdims=True)
    check_covered(directions, "hold the sensor still in more directions, also upside down and on its sides")

    return _accel_fit("accel-still-poses", poses, *_on_sphere(poses, np.r_[np.ones(3), np.zeros(3)]))


def _accel_fit(method: str, poses: Floats, scale: Floats, bias: Floats) -> SensorFit:
    left = np.linalg.norm(scale * (poses - bias), axis=1) - GRAVITY
    rms = float(np.sqrt(np.mean(left**2)))
    # Six unknowns explain six faces whatever they are; what is left over then says nothing.
    if method != "accel-six-faces" and rms > ACCEL_RESIDUAL:
        raise Refused(
            f"gravity is still {rms:.2f} m/s^2 off between poses ({ACCEL_RESIDUAL:g} at most): "
            "hold the sensor against something firm in each pose"
        )
    return SensorFit(
        method=method,
        calibration=SensorCalibration(accel_scale=vector(scale), accel_bias=vector(bias)),
        scores={"poses": float(len(poses)), "residual_m_s2": rms},
    )


def check_covered(directions: Floats, to_do: str) -> None:
    """Raise Refused with what to do unless unit directions (n, 3) lie all around."""
    least = np.linalg.eigvalsh(directions.T @ directions / len(directions))[0]
    both_ends = min(directions.max(axis=0).min(), -directions.min(axis=0).max())
    if least < COVERED or both_ends < OUTWARD:
        raise Refused(f"the directions do not cover all sides: {to_do}")
