"""Two sensors on one joint: what both know of the joint centre's motion, as one error state. Pure.

Each sensor is a strapdown system of its own: attitude and velocity by its gyroscope and accelerometer. The
joint centre belongs to both segments, so the two velocities found for it must be one, and its mean over
seconds must be small. That gives tilt, the heading between the sensors, gyroscope and accelerometer biases
and the lever arms, without a magnetometer. Where the joint's axes are known they hold too.

Being a velocity constraint, it needs no angular acceleration: integrated over an interval, the lever arm's
part is the difference of R (w x r) at its ends. (Kok, Hol and Schoen 2014 and Weygers and Kok 2020 use
accelerations.)

Error state, 15 per sensor, a then b: attitude (world axes, rad), velocity of the sensor (world, m/s),
gyroscope bias (rad/s), accelerometer bias (m/s^2), lever arm (m); attitude_true = exp(error) attitude.
"""

from dataclasses import dataclass
from math import pi, radians, sqrt
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_matrices import Floats, headings, matrix_of, turn_by, vector_of
from brachium_fusion.joint_shaking import LEAST, Shaking

NODE_S = 0.08
"""Constraints are applied this often: twice as often as the arm's fastest movements need."""
TILT_SD = radians(10.0)
"""At the beginning, maybe in full movement: 1 m/s^2 sideways is 6 deg."""
GYRO_BIAS_SD = radians(0.5)
"""Left after calibration, or after switching on in another temperature."""
ACC_BIAS_SD = 0.05
"""m/s^2: 5 mg, of a consumer accelerometer calibrated at another time and temperature."""
LEVER_SD = 0.01
"""m: a measured lever arm; the chip lies a few mm from the middle of its case."""
UNKNOWN_LEVER_SD = 0.15
SPEED_SD = 0.5
"""m/s of the joint centre over time."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """What is known of a joint between sensor a (proximal) and sensor b (distal)."""

    axes: int
    """1 hinge, 2 two axes as an elbow with pronation, 3 ball joint."""
    axis_a: Floats | None = None
    """(3,) the axis fixed in a's segment (elbow: flexion), in sensor a's axes; None: unknown."""
    axis_b: Floats | None = None
    """(3,) the axis fixed in b's segment (elbow: pronation; hinge: the same axis), in sensor b's axes."""
    lever_a: Floats | None = None
    """(3,) m, from sensor a to the joint centre in a's axes; None: unknown."""
    lever_b: Floats | None = None
    """(3,) m, from sensor b to the joint centre in b's axes."""
    carrying_rad: float = 0.0
    """For two axes: a's axis and b's enclose 90 deg less this."""

    def __post_init__(self) -> None:
        """Raise ValueError for what is no joint."""
        if self.axes not in (1, 2, 3):
            raise ValueError(f"a joint has 1, 2 or 3 axes, not {self.axes}")
        for name in ("axis_a", "axis_b", "lever_a", "lever_b"):
            vector = getattr(self, name)
            if vector is not None and (np.shape(vector) != (3,) or not np.isfinite(vector).all()):
                raise ValueError(f"{name}: expected three numbers, came {vector!r}")

    @property
    def has_axes(self) -> bool:
        """Both axes are known and constrain the joint."""
        return self.axes < 3 and self.axis_a is not None and self.axis_b is not None

    @property
    def has_levers(self) -> bool:
        """Both lever arms are known."""
        return self.lever_a is not None and self.lever_b is not None


@dataclass(slots=True, eq=False)
class Interval:
    """Samples of both sensors gathered between two nodes, in each sensor's axes at its beginning. The arrays
    may have further leading axes: many intervals, gathered at once."""

    turn: Floats
    """(..., 2, 3, 3) start_from_end by the gyroscopes as they read."""
    angle: Floats
    """(..., 2) rad: how far that turns."""
    spread: Floats
    """(..., 2, 3, 3) s: the integral of start_from_now."""
    push: Floats
    """(..., 2, 3) m/s: the integral of start_from_now times the specific force."""
    squared: Floats
    """(...) rad^2/s: the integral of the faster sensor's squared rate."""
    span_s: float

    @staticmethod
    def gather(turns: Floats, gyr: Floats, acc: Floats, period_s: float) -> "Interval":
        """Return what samples (..., k + 1, 2, 3), rad/s and m/s^2, from one node to the next add up to;
        `turns` (..., k + 1, 2, 4) are the rotations start_from_sample."""
        matrix = matrix_of(turns)
        count = gyr.shape[-3]
        weight = np.full(count, period_s)
        weight[[0, -1]] = 0.5 * period_s
        lead = gyr.shape[:-3]
        push = weight @ (matrix @ acc[..., None]).reshape(*lead, count, 6)
        spread = weight @ matrix.reshape(*lead, count, 18)
        squared = np.einsum("...i,...i->...", gyr, gyr).max(axis=-1) @ weight
        return Interval(
            matrix[..., -1, :, :, :],
            2.0 * np.arccos(np.minimum(np.abs(turns[..., -1, :, 0]), 1.0)),
            spread.reshape(*lead, 2, 3, 3),
            push.reshape(*lead, 2, 3),
            squared,
            period_s * (count - 1),
        )

    def at(self, index: int | slice) -> "Interval":
        """Return one of many intervals, or some."""
        turn, angle, spread, push, squared = (
            a[index] for a in (self.turn, self.angle, self.spread, self.push, self.squared)
        )
        return Interval(turn, angle, spread, push, squared, self.span_s)


@dataclass(slots=True, eq=False)
class JointState:
    """Both sensors' motion and errors, and their covariance."""

    attitude: Floats
    """(2, 3, 3) world_from_sensor."""
    others: Floats
    """(2, 12): velocity of the sensor in the world, m/s, and what is learnt of it: gyroscope bias,
    accelerometer bias, lever arm."""
    covariance: Floats
    """(30, 30)."""
    noise: tuple[float, float]
    """Learnt factors of the variances of noise: of walks and agreement, of axes."""
    still_s: tuple[float, float]
    """For how long each sensor has been at rest."""
    shaking: Shaking
    """How far skin lets them swing."""

    @property
    def velocity(self) -> Floats:
        """(2, 3) m/s."""
        return self.others[:, 0:3]

    @property
    def gyro_bias(self) -> Floats:
        """(2, 3) rad/s."""
        return self.others[:, 3:6]

    @property
    def lever(self) -> Floats:
        """(2, 3) m."""
        return self.others[:, 9:12]

    def copy(self) -> "JointState":
        """Return another with the same values; arrays are replaced, never written to."""
        return JointState(self.attitude, self.others, self.covariance, self.noise, self.still_s, self.shaking)

    def state(self) -> list[Any]:
        """Return all as plain values."""
        arrays = self.attitude, self.others, self.covariance
        plain = [array.tolist() for array in arrays]
        return [*plain, list(self.noise), list(self.still_s), self.shaking.state()]

    @staticmethod
    def of(state: list[Any]) -> "JointState":
        """Return what has this state."""
        attitude, others, covariance = (np.array(values) for values in state[:3])
        (walks, axes), (still_a, still_b) = state[3:5]
        shaking = Shaking.of(state[5]) if state[5:] else Shaking(share=LEAST)
        return JointState(attitude, others, covariance, (walks, axes), (still_a, still_b), shaking)


BLOCK = 15
_LEARNT = np.concatenate([np.arange(6, BLOCK), np.arange(BLOCK + 6, 2 * BLOCK)])


def begin(joint: Joint, attitude: Floats, gyr: Floats, heading_sd: float) -> JointState:
    """Return the state at attitudes (2, 3, 3), the heading between them known to `heading_sd` rad."""
    lever = np.zeros((2, 3))
    deviation = np.empty((2, BLOCK))
    for i, known in enumerate((joint.lever_a, joint.lever_b)):
        if known is not None:
            lever[i] = known
        deviation[i] = np.repeat(
            [TILT_SD, SPEED_SD, GYRO_BIAS_SD, ACC_BIAS_SD, UNKNOWN_LEVER_SD if known is None else LEVER_SD], 3
        )
    deviation[0, 2], deviation[1, 2] = 1e-4, heading_sd
    others = np.zeros((2, 12))
    others[:, 0:3] = _velocity_at_rest(attitude, gyr, lever)
    others[:, 9:12] = lever
    covariance = np.diag(deviation.ravel() ** 2)
    return JointState(attitude, others, covariance, (1.0, 1.0), (0.0, 0.0), Shaking(share=LEAST))


def resume(joint: Joint, state: JointState, attitude: Floats, gyr: Floats, heading_sd: float) -> JointState:
    """Return the state begun anew at attitudes (2, 3, 3), with the biases and lever arms that were learnt."""
    new = begin(joint, attitude, gyr, heading_sd)
    kept = _LEARNT[:, None], _LEARNT[None, :]
    new.covariance[kept] = state.covariance[kept]
    new.others[:, 3:] = state.others[:, 3:]
    new.others[:, 0:3] = _velocity_at_rest(attitude, gyr - state.gyro_bias, state.lever)
    new.noise, new.shaking = state.noise, state.shaking.after_gap()
    return new


def _velocity_at_rest(attitude: Floats, rate: Floats, lever: Floats) -> Floats:
    """Return the sensors' velocities (2, 3) while the joint centre rests."""
    moved: Floats = attitude @ (rotation.cross_matrix(lever) @ rate[:, :, None])
    return moved[:, :, 0]


def add(state: JointState, error: Floats) -> None:
    """Put an error (30,) into the state."""
    e = error.reshape(2, BLOCK)
    state.attitude = turn_by(e[:, 0:3]) @ state.attitude
    state.others = state.others + e[:, 3:]


def difference(to: JointState, of: JointState) -> Floats:
    """Return the error (30,) that takes the state `of` to `to`."""
    e = np.empty((2, BLOCK))
    e[:, 0:3] = vector_of(to.attitude @ of.attitude.transpose(0, 2, 1))
    e[:, 3:] = to.others - of.others
    return e.ravel()


def in_given_world(attitude: Floats, given: Floats, shared: bool) -> tuple[Floats, Floats]:
    """Return by how much attitudes (..., 2, 3, 3) are to be turned about the vertical (...) to have the
    heading of the given ones' world (..., 2, 3, 3), and by how much the given b is turned to a (...). That
    world's heading is a's, or the mean of both where they share one."""
    to_given = headings(given @ np.swapaxes(attitude, -1, -2))
    away = to_given[..., 0] - to_given[..., 1]
    heading = (away + pi) % (2.0 * pi) - pi
    return to_given[..., 0] - (0.5 * heading if shared else 0.0), heading


def heading_sd(covariance: Floats) -> float:
    """Return the standard deviation of b's heading to a's, rad, at most pi."""
    variance = float(covariance[2, 2] + covariance[17, 17] - 2.0 * covariance[2, 17])
    return min(pi, sqrt(max(variance, 0.0)))
