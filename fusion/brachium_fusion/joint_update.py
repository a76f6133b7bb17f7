"""How the state of two sensors on one joint goes on, and what the joint tells about it. Pure."""

from math import exp, radians, sin, sqrt

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_matrices import Floats, orthonormal, turn_by
from brachium_fusion.joint_model import BLOCK, NODE_S, SPEED_SD, Interval, Joint, JointState, add
from brachium_fusion.joint_shaking import SWING_RATE, TIP_M

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
AXIS_TURN, AXIS_TIME_S = 5.0, 60.0
"""rad, s: what is wrong with the axes stays as it is while the joint does; an arm that hangs at rest must not
take its heading from a tenth of a degree."""
SHARED_HEADING_SD = radians(20.0)
"""Of the heading between two magnetometers indoors, where iron turns the field along the arm."""
SHARED_HEADING_TIME_S = 300.0
"""It stays as wrong as it is while the person stays about where they are: correlated errors of this time
count as white noise of twice its product with their variance."""
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


_SIZE = 2 * BLOCK
_UNIT: Floats = np.eye(_SIZE)
_UNITS: Floats = np.broadcast_to(np.eye(3), (2, 3, 3))


def _of_both(matrix: Floats) -> Floats:
    """Return (2, 15, 15), to be written to: what of a matrix (30, 30) belongs to each sensor alone."""
    part: Floats = np.einsum("sisj->sij", matrix.reshape(2, BLOCK, 2, BLOCK))
    return part


def advance(state: JointState, interval: Interval) -> Floats:
    """Carry the state in place over an interval; return the transition matrix (30, 30) of its error."""
    span = interval.span_s
    drift, pushed = np.split(
        interval.spread @ state.others[:, 3:9].reshape(2, 2, 3).swapaxes(1, 2), 2, axis=2
    )
    push = interval.push[:, :, None] - pushed
    push = state.attitude @ (push - 0.5 * (rotation.cross_matrix(drift[:, :, 0]) @ interval.push[:, :, None]))
    spread = state.attitude @ interval.spread
    turned = turn_by(-drift[:, :, 0]) @ interval.turn
    state.attitude = orthonormal(state.attitude @ turned)
    state.others = state.others.copy()
    state.others[:, 0:3] += push[:, :, 0]
    state.shaking = state.shaking.then(push[:, :, 0] / span)
    state.others[:, 2] -= GRAVITY * span
    still_a, still_b = (interval.angle <= STILL_RATE * span).tolist()
    state.still_s = (
        state.still_s[0] + span if still_a else 0.0,
        state.still_s[1] + span if still_b else 0.0,
    )
    lean = rotation.cross_matrix(push[:, :, 0])
    transition = _UNIT.copy()
    each = _of_both(transition)
    each[:, 0:3, 6:9] = each[:, 3:6, 9:12] = -spread
    each[:, 3:6, 0:3] = -lean
    each[:, 3:6, 6:9] = 0.5 * (lean @ spread)
    covariance = transition @ state.covariance @ transition.T
    wobble = state.noise[0]
    turning = wobble * (ATTITUDE_WALK**2 * span + ATTITUDE_WALK_PER_RATE**2 * float(interval.squared))
    speed = wobble * VELOCITY_WALK**2 * span
    walks = [turning, speed, GYRO_BIAS_WALK**2 * span, ACC_BIAS_WALK**2 * span, 0.0] * 2
    covariance.reshape(-1)[:: _SIZE + 1] += np.repeat(walks, 3)
    state.covariance = covariance
    return transition


class _Told:
    """Rows of equations about the error, gathered to be solved as one."""

    def __init__(self) -> None:
        self.rows: Floats = np.zeros((19, _SIZE))
        self.innovation: Floats = np.empty(19)
        self.variance: Floats = np.empty(19)
        self.parts: list[slice] = []
        self.count = 0

    def part(self, count: int, innovation: Floats | float, variance: float) -> Floats:
        """Add equations that are outliers together; return their rows (count, 2, 15), to be written to."""
        rows = slice(self.count, self.count + count)
        self.innovation[rows], self.variance[rows] = innovation, variance
        self.parts.append(rows)
        self.count += count
        return self.rows[rows].reshape(count, 2, BLOCK)

    def solve(self, state: JointState) -> list[float]:
        """Put it into the state; return each part's length in standard deviations, 1 as expected."""
        rows, innovation = self.rows[: self.count], self.innovation[: self.count]
        spread = rows @ state.covariance
        total = spread @ rows.T
        diagonal = total.reshape(-1)[:: self.count + 1]
        diagonal += self.variance[: self.count]
        lengths = []
        for part in self.parts:
            first = part if part.stop - part.start <= 3 else slice(part.start, part.start + 3)
            apart = innovation[first]
            far = float(apart @ np.linalg.solve(total[first, first], apart)) / len(apart)
            lengths.append(sqrt(max(far, 0.0)))
            if far > OUTLIER**2:
                diagonal[first] += self.variance[first] * (far / OUTLIER**2 - 1.0)
        gain = np.linalg.solve(total, spread)
        covariance = state.covariance - spread.T @ gain
        state.covariance = 0.5 * (covariance + covariance.T)
        add(state, innovation @ gain)
        return lengths


def constrain(state: JointState, joint: Joint, gyr: Floats, shared: float | None) -> float:
    """Apply in place what holds at a node: gyr (2, 3) there, `shared` the heading of b to a, rad, by
    magnetometers. Return how far the joint centre's two velocities were apart, in standard deviations."""
    told = _Told()
    unswung = _agree(told, state, gyr)
    if joint.has_axes:
        _hold_axes(told, state, joint, gyr)
    for i in (0, 1):
        if state.still_s[i] > STILL_S:  # what the gyroscope of a sensor at rest reads is its bias
            variance = STILL_SD**2 * STILL_TIME_S / NODE_S
            told.part(3, gyr[i] - state.gyro_bias[i], variance)[:, i, 6:9] = _UNITS[0]
    if shared is not None:
        row = told.part(1, -shared, 2.0 * SHARED_HEADING_SD**2 * SHARED_HEADING_TIME_S / NODE_S)
        row[0, 0, 2], row[0, 1, 2] = -1.0, 1.0
    lengths = told.solve(state)
    state.shaking = state.shaking.learnt(lengths[0], unswung, NODE_S)
    walks, axes = state.noise
    state.noise = _learn(walks, lengths[0]), _learn(axes, lengths[1]) if joint.has_axes else axes
    return lengths[0]


def _learn(noise: float, length: float) -> float:
    """Return a factor of noise, taken nearer to what a residual of this length asks for."""
    more = (min(length * length, OUTLIER**2) - 1.0) * (NODE_S / NOISE_TIME_S)
    return min(MOST_NOISE, max(LEAST_NOISE, noise * exp(more)))


def _agree(told: _Told, state: JointState, gyr: Floats) -> float:
    """The joint centre is one, and rests over time; return the variance of its velocity by two sensors that
    do not swing, m^2/s^2."""
    rate = gyr - state.gyro_bias
    turning = state.attitude @ rotation.cross_matrix(rate)
    arm = (turning @ state.lever[:, :, None])[:, :, 0]
    per_sensor = np.zeros((2, 3, BLOCK))
    per_sensor[:, :, 0:3] = -rotation.cross_matrix(arm)
    per_sensor[:, :, 3:6] = _UNITS
    per_sensor[:, :, 6:9] = state.attitude @ rotation.cross_matrix(state.lever)
    per_sensor[:, :, 12:15] = turning
    centre = state.velocity + arm
    squared = float(np.einsum("si,si->s", rate, rate).max())
    variance = state.noise[0] * (CENTRE_SD**2 + CENTRE_SD_PER_RATE**2 * squared)
    apart = np.concatenate([centre[1] - centre[0], -0.5 * (centre[0] + centre[1])])
    rows = told.part(6, apart, variance + state.shaking.speed**2)
    rows[0:3, 0], rows[0:3, 1] = per_sensor[0], -per_sensor[1]
    rows[3:6, 0], rows[3:6, 1] = 0.5 * per_sensor[0], 0.5 * per_sensor[1]
    told.variance[3:6] = SPEED_SD**2 * SPEED_TIME_S / NODE_S
    return variance


def _hold_axes(told: _Told, state: JointState, joint: Joint, gyr: Floats) -> None:
    """Two axes enclose a constant angle; of a hinge they are one."""
    assert joint.axis_a is not None
    assert joint.axis_b is not None
    a, b = state.attitude[0] @ joint.axis_a, state.attitude[1] @ joint.axis_b
    rate_a, rate_b = (state.attitude @ gyr[:, :, None])[:, :, 0]
    bending = rate_b - rate_a
    looks = NODE_S * (sqrt(float(bending @ bending)) / AXIS_TURN + 1.0 / AXIS_TIME_S)
    tips = state.shaking.speed / (SWING_RATE * TIP_M)
    variance = (state.noise[1] * AXIS_SD**2 + tips**2) / looks
    if joint.axes == 2:
        row = told.part(1, sin(joint.carrying_rad) - float(a @ b), variance)
        normal = rotation.cross_matrix(a) @ b
        row[0, 0, 0:3], row[0, 1, 0:3] = normal, -normal
    else:
        rows = told.part(3, b - a, variance)
        rows[:, 0, 0:3], rows[:, 1, 0:3] = -rotation.cross_matrix(a), rotation.cross_matrix(b)
