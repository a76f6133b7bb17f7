"""The equations of joint_axes: residuals, derivatives and loss for a guess. Pure."""

from dataclasses import dataclass, field
from math import cos, radians, sin

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_motion import JointMotion, knots, shares

Floats = npt.NDArray[np.float64]

RATE_SD = 0.04
"""rad/s: of the first equation when nearly still; skin and timing."""
RATE_SHARE = 0.05
"""Of both sensors' rates: what skin adds to the first equation in movement."""
ANGLE_SD = radians(15.0)
"""Of the second equation: 3 deg of tilt and skin, which do not change from one instant to the next."""
INDEPENDENT = 6.0
"""All instants together count as so many independent ones: skin's errors follow the movement, and
repeating it repeats them."""
LEAST_SINE = 0.3
"""Of the angle between the axes: nearly parallel ones would explain any movement."""
CARRYING_SD = radians(12.0)
"""People's is 10 +- 5 deg valgus; little is presumed, least of all its sign."""
HEADING_RATE_SD = radians(0.05)
"""rad/s: headings drift apart by this without magnetometers."""
LEAST_NOISE = 0.01
"""Residuals are never believed to be smaller than this part of what is expected."""
LOSS_SCALE = 2.0
"""Beyond so many standard deviations residuals count less (soft L1)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeadingPrior:
    """What is believed of the heading at some instants, straight between them, constant beyond."""

    time_s: Floats
    heading: Floats
    """(k,) rad."""
    sd: Floats
    """(k,) rad."""

    def at(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Return heading and standard deviation at times (n,)."""
        heading = np.interp(time_s, self.time_s, self.heading).astype(np.float64)
        return heading, np.interp(time_s, self.time_s, self.sd).astype(np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisPriors:
    """What is believed before anything has moved; None: nothing."""

    axis_a: Floats | None = None
    axis_a_sd: float = radians(20.0)
    across_a: Floats | None = None
    """A direction (3,) in sensor a that its axis stands across, as gravity does in a hanging arm."""
    across_a_sd: float = radians(10.0)
    axis_b: Floats | None = None
    axis_b_sd: float = radians(12.0)
    heading: HeadingPrior | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Values of the unknowns."""

    axis_a: Floats
    axis_b: Floats
    carrying: float
    headings: Floats
    across_a: Floats = field(init=False)
    """(2, 3): the directions in which axis_a can tilt."""
    across_b: Floats = field(init=False)

    def __post_init__(self) -> None:
        """Span both tangent planes."""
        object.__setattr__(self, "across_a", np.linalg.svd(self.axis_a[None])[2][1:])
        object.__setattr__(self, "across_b", np.linalg.svd(self.axis_b[None])[2][1:])

    def moved(self, step: Floats) -> "Guess":
        """Return the guess after a step: tilts of axis_a (2) and axis_b (2), carrying, headings."""
        axis_a = self.axis_a + step[:2] @ self.across_a
        axis_b = self.axis_b + step[2:4] @ self.across_b
        return Guess(
            axis_a / np.linalg.norm(axis_a),
            axis_b / np.linalg.norm(axis_b),
            self.carrying + float(step[4]),
            self.headings + step[5:],
        )


class JointEquations:
    """All residuals in standard deviations: n of rates, n of angles, then the priors."""

    def __init__(self, motion: JointMotion, priors: AxisPriors, noise: float = 1.0) -> None:
        self.motion, self.priors, self._noise = motion, priors, noise
        self.knots_s = knots(motion.time_s)
        self._share = shares(motion.time_s, self.knots_s)
        speed = np.linalg.norm(motion.rate_a, axis=1) + np.linalg.norm(motion.rate_b, axis=1)
        self.rate_weight = 1.0 / (noise * np.hypot(RATE_SD, RATE_SHARE * speed))
        self.angle_sd = noise * ANGLE_SD
        self._together = max(1.0, len(motion.time_s) / INDEPENDENT)

    @staticmethod
    def loss(residuals: Floats) -> Floats:
        """Return the soft L1 loss: the square of small residuals, linear for large ones."""
        return 2.0 * LOSS_SCALE**2 * (np.sqrt(1.0 + (residuals / LOSS_SCALE) ** 2) - 1.0)

    def weights(self, residuals: Floats) -> Floats:
        """Return the weights with which squares stand for the loss; priors count in full."""
        weight = 1.0 / (self._together * np.sqrt(1.0 + (residuals / LOSS_SCALE) ** 2))
        weight[2 * len(self.motion.time_s) :] = 1.0
        return weight

    def cost(self, guess: Guess) -> float:
        """Return the sum of the loss over all rows and of the priors' squares."""
        first, second, prior = self._residuals(guess)
        return float((self.loss(first).sum() + self.loss(second).sum()) / self._together + prior @ prior)

    def noise(self, guess: Guess) -> float:
        """Return the factor by which residuals differ from RATE_SD and ANGLE_SD, by the first equation."""
        first = self._residuals(guess)[0]
        return max(LEAST_NOISE, self._noise * float(np.sqrt(np.mean(self.loss(first)))))

    def unexplained(self, guess: Guess) -> float:
        """Return the rms of the rate across both axes over the rms of the joint's rate."""
        first = self._residuals(guess)[0] / self.rate_weight
        _, _, _, relative = self._axes(guess)
        total = float(np.sqrt(np.mean(np.einsum("ni,ni->n", relative, relative))))
        return float(np.sqrt(np.mean(first**2))) / max(total, 1e-9)

    def _axes(self, guess: Guess) -> tuple[Floats, Floats, Floats, Floats]:
        """Return a1, a2, rate_b and the joint's rate, (n, 3) each in a's world."""
        m = self.motion
        turn = self._share @ guess.headings
        cosine, sine = np.cos(turn), np.sin(turn)
        a2 = _turned(m.world_from_b @ guess.axis_b, cosine, sine)
        rate_b = _turned(m.rate_b, cosine, sine)
        return m.world_from_a @ guess.axis_a, a2, rate_b, rate_b - m.rate_a

    def _residuals(self, guess: Guess) -> tuple[Floats, Floats, Floats]:
        a1, a2, _, relative = self._axes(guess)
        cosine = _dot(a1, a2)
        first = _dot(relative, _cross(a1, a2)) / _sine(cosine) * self.rate_weight
        second = (cosine - sin(guess.carrying)) / self.angle_sd
        return first, second, self._prior(guess)[0]

    def linear(self, guess: Guess) -> tuple[Floats, Floats]:
        """Return the residuals and their derivatives by the step of Guess.moved."""
        m = self.motion
        n = len(m.time_s)
        a1, a2, rate_b, relative = self._axes(guess)
        turn = self._share @ guess.headings
        back = np.cos(turn), -np.sin(turn)
        across = _cross(relative, a1)
        cosine = _dot(a1, a2)
        sine = _sine(cosine)
        # by_first: the rate's derivatives; by_second: those of a1 . a2, which also change the sine below it
        by_first, by_second = np.zeros((2, n, 5 + len(self.knots_s)))
        by_first[:, :2] = _in_sensor(m.world_from_a, _cross(a2, relative)) @ guess.across_a.T
        by_first[:, 2:4] = _in_sensor(m.world_from_b, _turned(across, *back)) @ guess.across_b.T
        by_heading = _dot(_quarter(rate_b), _cross(a1, a2)) + _dot(_quarter(a2), across)
        by_first[:, 5:] = by_heading[:, None] * self._share
        by_second[:, :2] = _in_sensor(m.world_from_a, a2) @ guess.across_a.T
        by_second[:, 2:4] = _in_sensor(m.world_from_b, _turned(a1, *back)) @ guess.across_b.T
        by_second[:, 5:] = _dot(_quarter(a2), a1)[:, None] * self._share
        slope = np.where(sine > LEAST_SINE, _dot(relative, _cross(a1, a2)) * cosine / sine**2, 0.0)
        by_first = (by_first + slope[:, None] * by_second) * (self.rate_weight / sine)[:, None]
        by_second[:, 4] = -cos(guess.carrying)
        rows = np.concatenate([by_first, by_second / self.angle_sd])
        first, second, _ = self._residuals(guess)
        prior, by_prior = self._prior(guess)
        return np.concatenate([first, second, prior]), np.concatenate([rows, by_prior])

    def _prior(self, guess: Guess) -> tuple[Floats, Floats]:
        """Return the priors' residuals and their derivatives."""
        p, k = self.priors, len(self.knots_s)
        residuals, rows = [guess.carrying / CARRYING_SD], [np.eye(5 + k)[4] / CARRYING_SD]

        def add(value: float, row: Floats, first: int) -> None:
            residuals.append(value)
            rows.append(np.concatenate([np.zeros(first), row, np.zeros(5 + k - first - len(row))]))

        if p.axis_a is not None:
            for side in np.linalg.svd(p.axis_a[None])[2][1:]:
                add(float(side @ guess.axis_a) / p.axis_a_sd, guess.across_a @ side / p.axis_a_sd, 0)
        if p.across_a is not None:
            add(
                float(p.across_a @ guess.axis_a) / p.across_a_sd,
                guess.across_a @ p.across_a / p.across_a_sd,
                0,
            )
        if p.axis_b is not None:
            for side in np.linalg.svd(p.axis_b[None])[2][1:]:
                add(float(side @ guess.axis_b) / p.axis_b_sd, guess.across_b @ side / p.axis_b_sd, 2)
        if p.heading is not None:
            # what is said of neighbouring knots is one knowledge, not k independent ones
            headings, sd = p.heading.at(self.knots_s)
            sd = sd * np.sqrt(k)
            off = rotation.wrap(guess.headings - headings) / sd
            for i in range(k):
                add(float(off[i]), np.array([1.0 / sd[i]]), 5 + i)
        for i, gap in enumerate(np.diff(self.knots_s).tolist()):
            size = HEADING_RATE_SD * gap
            add((guess.headings[i + 1] - guess.headings[i]) / size, np.array([-1.0, 1.0]) / size, 5 + i)
        return np.array(residuals), np.array(rows)


def _turned(v: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Return v (n, 3) turned about the vertical."""
    x, y = v[:, 0], v[:, 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, v[:, 2]], axis=-1)


def _quarter(v: Floats) -> Floats:
    """Return the derivative of v (n, 3) by a turn about the vertical."""
    return np.stack([-v[:, 1], v[:, 0], np.zeros(len(v))], axis=-1)


def _cross(p: Floats, q: Floats) -> Floats:
    return np.stack(
        [
            p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1],
            p[:, 2] * q[:, 0] - p[:, 0] * q[:, 2],
            p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0],
        ],
        axis=-1,
    )


def _sine(cosine: Floats) -> Floats:
    return np.sqrt(np.maximum(1.0 - cosine**2, LEAST_SINE**2))


def _dot(p: Floats, q: Floats) -> Floats:
    dot: Floats = np.einsum("ni,ni->n", p, q)
    return dot


def _in_sensor(world_from_sensor: Floats, v: Floats) -> Floats:
    seen: Floats = np.einsum("nij,ni->nj", world_from_sensor, v)
    return seen
