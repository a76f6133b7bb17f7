"""From samples to increments: what two sensors say of a shoulder between knots about 0.1 s apart. Pure.

The velocity of a joint is the sensor's velocity and that of the lever arm, R (w x l). Over an interval the
first changes by the integral of the acceleration, the second by the difference of its ends, so no derivative
of the angular rate is needed and nothing is filtered (preintegration: Forster et al. 2017). Everything is
linear in the errors; this module works out the coefficients for all intervals at once.
"""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_model import GRAVITY, ArmModel, Floats, cross_matrix

KNOT_S = 0.16
"""Distance of knots, about: movement of a shoulder has little above 3 Hz."""

CONSTANTS = 30
"""Gyro bias, accelerometer bias, gyro scale, accelerometer scale (3 each) of the upper arm's sensor, the same
of the forearm's, then how each sits (3 each, rotation vectors in its axes)."""
SITS_UPPER, SITS_FOREARM = 24, 27


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
    step = np.full(k, every * period_s)
    velocity, by_turn = np.zeros((k, 6)), np.zeros((k, 6, 12))
    by_constant, turn_by_constant = np.zeros((k, 6, CONSTANTS)), np.zeros((k, 6, CONSTANTS))
    elbow = model.elbow_from_shoulder
    swing = np.zeros((k, 2))
    for i, (sensor, lever) in enumerate(((upper, model.lever_upper), (forearm, model.lever_forearm))):
        q, w, f = sensor
        world = rotation.to_matrix(q)
        force = np.einsum("nij,nj->ni", world, f)
        row, turn, first = slice(3 * i, 3 * i + 3), slice(3 * i, 3 * i + 3), 12 * i
        whole, early, late = _weighted(force, every, period_s)
        end_turn = slice(6 + 3 * i, 9 + 3 * i)
        velocity[:, row] += whole - step[:, None] * np.array([0.0, 0.0, GRAVITY])
        by_turn[:, row, turn] = -cross_matrix(early)
        by_turn[:, row, end_turn] = -cross_matrix(late)
        mean_world, mean_scaled, mean_rate = (
            _weighted(m, every, period_s)[0] for m in (world, world * f[:, None, :], world * w[:, None, :])
        )
        by_constant[:, row, first + 3 : first + 6] = -mean_world
        by_constant[:, row, first + 9 : first + 12] = -mean_scaled
        turn_by_constant[:, row, first : first + 3] = -mean_world
        turn_by_constant[:, row, first + 6 : first + 9] = -mean_rate
        world, w = world[::every], w[::every]
        _lever(velocity, by_turn, by_constant, world, w, lever, i, row, 1.0)
        if i == 0:
            _lever(velocity, by_turn, by_constant, world, w, elbow, i, slice(3, 6), -1.0)
        swing[:, i] = np.einsum("ki,ki->k", w[1:], w[1:]) + np.linalg.norm(np.diff(w, axis=0), axis=1) / step
    if trunk_velocity is not None:
        velocity -= np.tile(np.diff(trunk_velocity[::every], axis=0), 2)
    return Increments(step, velocity, by_turn, by_constant, turn_by_constant, swing)


def _lever(
    velocity: Floats,
    by_turn: Floats,
    by_constant: Floats,
    world: Floats,
    w: Floats,
    lever: Floats,
    sensor: int,
    row: slice,
    sign: float,
) -> None:
    """Add the difference over each interval of the lever arm's velocity R (w x l) and its coefficients."""
    speed = sign * np.einsum("kij,kj->ki", world, np.cross(w, lever))
    velocity[:, row] += np.diff(speed, axis=0)
    turned = -cross_matrix(speed)
    turn = slice(3 * sensor, 3 * sensor + 3)
    by_turn[:, row, turn] -= turned[:-1]
    by_turn[:, row, 6 + 3 * sensor : 9 + 3 * sensor] += turned[1:]
    first, sits = 12 * sensor, SITS_UPPER + 3 * sensor
    across = sign * (world @ cross_matrix(lever))
    by_constant[:, row, first : first + 3] += np.diff(across, axis=0)
    by_constant[:, row, first + 6 : first + 9] += np.diff(across * w[:, None, :], axis=0)
    by_constant[:, row, sits : sits + 3] -= np.diff(
        sign * (world @ cross_matrix(w) @ cross_matrix(lever)), axis=0
    )


def _weighted(values: Floats, every: int, period_s: float) -> tuple[Floats, Floats, Floats]:
    """Return the integrals over each interval of values (n, ...), and of the parts that a straight line from
    1 to 0 and one from 0 to 1 weigh, by the trapezium rule."""
    k = (len(values) - 1) // every
    shape = values.shape[1:]
    late = np.arange(1, every + 1) / every
    rule = np.ones(every)
    rule[-1] = 0.5
    inner = values[1:].reshape(k, every, -1)
    begin = 0.5 * values[:-1:every].reshape(k, -1)
    whole = (begin + np.einsum("kei,e->ki", inner, rule)) * period_s
    rising = np.einsum("kei,e->ki", inner, rule * late) * period_s
    return (
        whole.reshape(k, *shape),
        (whole - rising).reshape(k, *shape),
        rising.reshape(k, *shape),
    )
