"""How the state of two sensors on one joint goes on, and what the joint tells about it. Pure."""

from math import radians, sin

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_model import (
    BLOCK,
    NODE_S,
    SPEED_SD,
    Floats,
    Interval,
    Joint,
    JointState,
    add,
    attitude_after,
)

GRAVITY = 9.80665

ATTITUDE_WALK = radians(0.1)
"""rad/sqrt(s): white noise of the gyroscope and play of the strap."""
ATTITUDE_WALK_PER_RATE = 0.005
"""Per rad/s of turning: scale and cross-axis errors, 0.5 % over a turn of about a second."""
GYRO_BIAS_WALK = radians(0.005)
ACC_BIAS_WALK = 1e-4
VELOCITY_WALK = 0.025
"""m/s/sqrt(s): accelerometer noise and tissue that wobbles."""
CENTRE_SD = 0.01
"""m/s: how well both sensors must agree on the joint centre's velocity."""
CENTRE_SD_PER_RATE = 0.004
"""m: the centre moves in both segments by this as they turn."""
SPEED_TIME_S = 1.0
"""For how long its velocity stays alike."""
AXIS_SD = radians(3.0)
AXIS_TIME_S = 5.0
SHARED_HEADING_SD = radians(20.0)
"""Of the heading between two magnetometers indoors, where iron turns the field along the arm."""
SHARED_HEADING_TIME_S = 60.0
"""It stays as wrong as it is while the arm stays where it is."""
STILL_RATE = radians(2.0)
"""rad/s, mean over an interval: slower is rest, once it lasted."""
STILL_S = 0.8
STILL_SD = radians(0.15)
"""rad/s: an arm at rest sways."""
STILL_TIME_S = 1.0
NOISE_TIME_S = 20.0
"""Over this the noise of walks and agreement is learnt from the joint's residuals."""
LEAST_NOISE, MOST_NOISE = 0.1, 10.0
"""Within which the learnt noise stays, of the variances above."""
OUTLIER = 3.0
"""An innovation of more than this many standard deviations is given less weight."""


_DIAGONAL = np.arange(2 * BLOCK)


def skew(v: Floats) -> Floats:
    """Return the matrices (..., 3, 3) whose product with x is v x x."""
    s = np.zeros((*v.shape, 3))
    s[..., 0, 1], s[..., 0, 2], s[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    s[..., 1, 0], s[..., 2, 0], s[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return s


def advance(state: JointState, interval: Interval) -> Floats:
    """Carry the state in place over an interval; return the transition matrix (30, 30) of its error."""
    matrix = rotation.to_matrix(state.attitude)
    span = interval.span_s
    drift = np.einsum("sij,sj->si", interval.spread, state.gyro_bias)
    push = interval.push - 0.5 * np.cross(drift, interval.push)
    push -= np.einsum("sij,sj->si", interval.spread, state.acc_bias)
    push = np.einsum("sij,sj->si", matrix, push)
    state.attitude = attitude_after(state.attitude, state.gyro_bias, interval.turn, interval.spread)
    state.velocity = state.velocity + push
    state.velocity[:, 2] -= GRAVITY * span
    moves = np.linalg.norm(rotation.to_rotation_vector(interval.turn), axis=1) > STILL_RATE * span
    state.still_s = np.where(moves, 0.0, state.still_s + span)
    spread = matrix @ interval.spread
    lean = skew(push)
    transition = np.eye(2 * BLOCK)
    for i, at in enumerate((0, BLOCK)):
        transition[at : at + 3, at + 6 : at + 9] = -spread[i]
        transition[at + 3 : at + 6, at : at + 3] = -lean[i]
        transition[at + 3 : at + 6, at + 6 : at + 9] = 0.5 * lean[i] @ spread[i]
        transition[at + 3 : at + 6, at + 9 : at + 12] = -spread[i]
    covariance = transition @ state.covariance @ transition.T
    turning = ATTITUDE_WALK**2 * span + ATTITUDE_WALK_PER_RATE**2 * float(interval.squared)
    wobble = float(state.noise[0])
    walks = [wobble * turning, wobble * VELOCITY_WALK**2 * span]
    noise = np.repeat([*walks, GYRO_BIAS_WALK**2 * span, ACC_BIAS_WALK**2 * span, 0.0], 3)
    covariance[_DIAGONAL, _DIAGONAL] += np.concatenate([noise, noise])
    state.covariance = covariance
    return transition


def constrain(state: JointState, joint: Joint, gyr: Floats, shared: float | None) -> float:
    """Apply in place what holds at a node: gyr (2, 3) there, `shared` the heading of b to a, rad, by
    magnetometers. Return how far the joint centre's two velocities were apart, in standard deviations."""
    matrix = rotation.to_matrix(state.attitude)
    rate = gyr - state.gyro_bias
    arm = np.einsum("sij,sj->si", matrix, np.cross(rate, state.lever))
    rows = np.zeros((6, 2 * BLOCK))
    per_sensor = np.empty((2, 3, BLOCK))
    per_sensor[:, :, 0:3] = -skew(arm)
    per_sensor[:, :, 3:6] = np.eye(3)
    per_sensor[:, :, 6:9] = matrix @ skew(state.lever)
    per_sensor[:, :, 9:12] = 0.0
    per_sensor[:, :, 12:15] = matrix @ skew(rate)
    centre = state.velocity + arm
    rows[0:3, :BLOCK], rows[0:3, BLOCK:] = per_sensor[0], -per_sensor[1]
    rows[3:6, :BLOCK], rows[3:6, BLOCK:] = 0.5 * per_sensor[0], 0.5 * per_sensor[1]
    apart = centre[0] - centre[1]
    squared = float(np.einsum("si,si->s", rate, rate).max())
    agree = float(state.noise[0]) * (CENTRE_SD**2 + CENTRE_SD_PER_RATE**2 * squared)
    noise = np.repeat([agree, SPEED_SD**2 * SPEED_TIME_S / NODE_S], 3)
    residual = _correct(state, rows, np.concatenate([-apart, -centre.mean(axis=0)]), noise)
    surprise = np.array([residual, 1.0])
    for i in np.flatnonzero(state.still_s > STILL_S).tolist():
        _hold_still(state, gyr, i)
    if joint.has_axes:
        surprise[1] = _hold_axes(state, joint)
    learnt = np.exp((np.minimum(surprise**2, OUTLIER**2) - 1.0) * (NODE_S / NOISE_TIME_S))
    state.noise = np.clip(state.noise * learnt, LEAST_NOISE, MOST_NOISE)
    if shared is not None:
        row = np.zeros((1, 2 * BLOCK))
        row[0, 2], row[0, BLOCK + 2] = -1.0, 1.0
        variance = SHARED_HEADING_SD**2 * SHARED_HEADING_TIME_S / NODE_S
        _correct(state, row, np.array([-shared]), np.array([variance]))
    return residual


def _hold_still(state: JointState, gyr: Floats, sensor: int) -> None:
    """What the gyroscope of a sensor at rest reads is its bias."""
    rows = np.zeros((3, 2 * BLOCK))
    rows[:, sensor * BLOCK + 6 : sensor * BLOCK + 9] = np.eye(3)
    _correct(
        state, rows, gyr[sensor] - state.gyro_bias[sensor], np.full(3, STILL_SD**2 * STILL_TIME_S / NODE_S)
    )


def _hold_axes(state: JointState, joint: Joint) -> float:
    """Two axes enclose a constant angle; of a hinge they are one."""
    assert joint.axis_a is not None
    assert joint.axis_b is not None
    a = rotation.rotate(state.attitude[0], joint.axis_a)
    b = rotation.rotate(state.attitude[1], joint.axis_b)
    variance = float(state.noise[1]) * AXIS_SD**2 * AXIS_TIME_S / NODE_S
    if joint.axes == 2:
        row = np.zeros((1, 2 * BLOCK))
        normal = np.cross(a, b)
        row[0, 0:3], row[0, BLOCK : BLOCK + 3] = normal, -normal
        bend = np.array([sin(joint.carrying_rad) - float(a @ b)])
        return _correct(state, row, bend, np.array([variance]))
    rows = np.zeros((3, 2 * BLOCK))
    rows[:, 0:3], rows[:, BLOCK : BLOCK + 3] = -skew(a), skew(b)
    return _correct(state, rows, b - a, np.full(3, variance))


def _correct(state: JointState, rows: Floats, innovation: Floats, variance: Floats) -> float:
    """Take a measurement whose first three rows may be outliers; return their length, 1 as expected."""
    spread = rows @ state.covariance
    total = spread @ rows.T
    total[np.diag_indices_from(total)] += variance
    first = min(3, len(innovation))
    far = float(innovation[:first] @ np.linalg.solve(total[:first, :first], innovation[:first])) / first
    if far > OUTLIER**2:
        total[np.arange(first), np.arange(first)] += variance[:first] * (far / OUTLIER**2 - 1.0)
    gain = np.linalg.solve(total, spread).T
    covariance = state.covariance - gain @ spread
    state.covariance = 0.5 * (covariance + covariance.T)
    add(state, gain @ innovation)
    return float(np.sqrt(far))
