"""From samples to increments: what two sensors say of a shoulder between knots about 0.1 s apart. Pure.

The velocity of a joint is the sensor's velocity and that of the lever arm, R (w x l). Over an interval the
first changes by the integral of the acceleration, the second by the difference of its ends, so no derivative
of the angular rate is needed and nothing is filtered (preintegration: Forster et al. 2017). Everything is
linear in the errors; this module works out the coefficients for all intervals at once.
"""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_model import GRAVITY, ArmModel, Floats

KNOT_S = 0.16
"""Distance of knots, about: movement of a shoulder has little above 3 Hz."""

CONSTANTS = 39
"""Gyro bias, accelerometer bias, gyro scale, accelerometer scale (3 each) of the upper arm's sensor, the same
of the forearm's; how each sits (3 each, rotation vectors in its axes); the lever arms as _SENSOR has them (3
each, m)."""
SITS, LEVERS = slice(24, 30), slice(30, 39)


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """One sensor's calibrated samples (n, 3) and what is already known of its errors, (3,) each."""

    gyr: Floats
    acc: Floats
    gyro_bias: Floats
    accel_bias: Floats
    gyro_scale: Floats
    accel_scale: Floats

    def corrected(self) -> tuple[Floats, Floats]:
        """Return angular rate and specific force (n, 3) without the errors known."""
        return (
            self.gyr * (1.0 - self.gyro_scale) - self.gyro_bias,
            self.acc * (1.0 - self.accel_scale) - self.accel_bias,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Increments:
    """What happens between k + 1 knots; axes of the world; errors are truth minus what is known."""

    step_s: Floats
    """(k,) length of each interval."""
    velocity: Floats
    """(k, 6) change of the shoulder's velocity, by the upper arm's and by the forearm's sensor, m/s."""
    by_turn: Floats
    """(k, 6, 12) its change by the turns (upper arm, forearm) at the interval's begin, and at its end."""
    by_constant: Floats
    """(k, 6, CONSTANTS) its change by the constants."""
    turn_by_constant: Floats
    """(k, 6, CONSTANTS) change of both turns over the interval by the constants."""
    swing: Floats
    """(k, 2) (rad/s)^2: |w|^2 + |dw/dt| of each sensor, by which an unknown lever arm acts."""


def stride(rate_hz: float) -> int:
    """Return the number of samples from knot to knot."""
    return max(1, round(KNOT_S * rate_hz))


def strapdown(gyr: Floats, world_from_sensor: Floats, period_s: float) -> Floats:
    """Return world_from_sensor (n, 4) from rates (n, 3) and its first row, by the trapezium rule and the
    second-order correction for a turning axis (Miller 1983)."""
    a, b = gyr[:-1], gyr[1:]
    steps = rotation.from_rotation_vector(
        (0.5 * period_s) * (a + b) + (period_s * period_s / 12.0) * np.cross(a, b)
    )
    return accumulated(steps, world_from_sensor)


def accumulated(steps: Floats, first: Floats) -> Floats:
    """Return the running products (n + 1, 4) of rotations (n, 4) from the right, `first` before them."""
    q = np.concatenate([first[None], steps])
    reach = 1
    while reach < len(q):  # doubling: each row holds the product of the last `reach` steps
        q[reach:] = rotation.multiply(q[:-reach], q[reach:])
        reach *= 2
    return rotation.normalize(q)


def increments(
    model: ArmModel,
    period_s: float,
    every: int,
    upper: tuple[Floats, Floats, Floats],
    forearm: tuple[Floats, Floats, Floats],
    trunk_velocity: Floats | None = None,
) -> Increments:
    """Return the increments between every `every`-th sample.

    A sensor is (world_from_sensor (n, 4), angular rate (n, 3), specific force (n, 3)) with n = k every + 1.
    `trunk_velocity` (n, 3) m/s is the part of the shoulder's velocity that the trunk makes.
    """
    k = (len(upper[1]) - 1) // every
    q, w, f = (np.stack(pair) for pair in zip(upper, forearm, strict=True))
    world = rotation.to_matrix(q)
    force = np.einsum("snij,snj->sni", world, f)
    turns = np.concatenate(
        [
            force[..., None],
            world,
            world * f[:, :, None, :],
            world * w[:, :, None, :],
        ],
        axis=3,
    )
    whole, early, late = _weighted(turns.transpose(1, 0, 2, 3), every, period_s)
    velocity, by_turn = np.zeros((k, 6)), np.zeros((k, 6, 12))
    by_constant, turn_by_constant = np.zeros((k, 6, CONSTANTS)), np.zeros((k, 6, CONSTANTS))
    weighed = -rotation.cross_matrix(np.stack([early[..., 0], late[..., 0]]))
    for i in range(2):
        row, first = slice(3 * i, 3 * i + 3), 12 * i
        velocity[:, row] = whole[:, i, :, 0]
        by_turn[:, row, 3 * i : 3 * i + 3] = weighed[0, :, i]
        by_turn[:, row, 6 + 3 * i : 9 + 3 * i] = weighed[1, :, i]
        by_constant[:, row, first + 3 : first + 6] = turn_by_constant[:, row, first : first + 3] = -whole[
            :, i, :, 1:4
        ]
        by_constant[:, row, first + 9 : first + 12] = -whole[:, i, :, 4:7]
        turn_by_constant[:, row, first + 6 : first + 9] = -whole[:, i, :, 7:10]
    velocity[:, 2::3] -= every * period_s * GRAVITY
    rate = w[:, ::every]
    _levers(model, world[:, ::every], rate, velocity, by_turn, by_constant)
    if trunk_velocity is not None:
        velocity -= np.tile(np.diff(trunk_velocity[::every], axis=0), 2)
    step = np.full(k, every * period_s)
    turning = np.sqrt(np.square(np.diff(rate, axis=1)).sum(axis=2)) / step
    swing = (np.square(rate[:, 1:]).sum(axis=2) + turning).T
    return Increments(step, velocity, by_turn, by_constant, turn_by_constant, swing)


_SENSOR = np.array([0, 0, 1])
_ROW = (0, 3, 3)
_SIGN = np.array([1.0, -1.0, 1.0])
"""Levers: upper arm's sensor to the shoulder, for its own velocity of it; shoulder to elbow, against it, and
forearm's sensor to the elbow, for the forearm's."""


def _levers(
    model: ArmModel,
    world: Floats,
    rate: Floats,
    velocity: Floats,
    by_turn: Floats,
    by_constant: Floats,
) -> None:
    """Add the difference over each interval of the lever arms' velocities R (w x l) and its coefficients;
    `world` (2, k + 1, 3, 3) and `rate` (2, k + 1, 3) are the sensors' at the knots."""
    levers = np.stack([model.lever_upper, model.elbow_from_shoulder, model.lever_forearm])
    levers = levers * _SIGN[:, None]
    world, rate, arm = world[_SENSOR], rate[_SENSOR], rotation.cross_matrix(levers)[:, None]
    across = world @ arm
    speed = -np.einsum("lkij,lkj->lki", across, rate)
    turned = -rotation.cross_matrix(speed)
    by_rate = np.diff(across * rate[:, :, None, :], axis=1)
    turning = world @ rotation.cross_matrix(rate)
    by_sitting = np.diff(turning @ arm, axis=1)
    by_lever = np.diff(turning * _SIGN[:, None, None, None], axis=1)
    gained, by_bias = np.diff(speed, axis=1), np.diff(across, axis=1)
    for lever, (sensor, at) in enumerate(zip(_SENSOR.tolist(), _ROW, strict=True)):
        row, turn, first = slice(at, at + 3), 3 * sensor, 12 * sensor
        velocity[:, row] += gained[lever]
        by_turn[:, row, turn : turn + 3] -= turned[lever, :-1]
        by_turn[:, row, 6 + turn : 9 + turn] += turned[lever, 1:]
        by_constant[:, row, first : first + 3] += by_bias[lever]
        by_constant[:, row, first + 6 : first + 9] += by_rate[lever]
        sits, arm_at = SITS.start + turn, LEVERS.start + 3 * lever
        by_constant[:, row, sits : sits + 3] -= by_sitting[lever]
        by_constant[:, row, arm_at : arm_at + 3] += by_lever[lever]


def _weighted(values: Floats, every: int, period_s: float) -> tuple[Floats, Floats, Floats]:
    """Return the integrals over each interval of values (n, ...), and of the parts that a straight line from
    1 to 0 and one from 0 to 1 weigh, by the trapezium rule."""
    shape = values.shape[1:]
    flat = values.reshape(len(values), -1)
    k = (len(flat) - 1) // every
    late = np.arange(1, every + 1) / every
    rule = np.ones(every)
    rule[-1] = 0.5
    weights = period_s * np.stack([rule, rule * late])
    integral = weights @ flat[1:].reshape(k, every, -1)
    whole = (integral[:, 0] + 0.5 * period_s * flat[:-1:every]).reshape(k, *shape)
    rising = integral[:, 1].reshape(k, *shape)
    return whole, whole - rising, rising
