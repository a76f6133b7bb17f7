"""The heading between two sensors on one joint, found from nothing: how likely each of 72 headings is. Pure.

Both sensors see the joint centre's horizontal acceleration, which is one vector: a heading is as likely as
it brings the two to cover each other. Where the joint's axes are known, so is the turning about the direction
that the joint has not (reference mathematics 7) and the angle between its axes.
"""

from math import hypot, pi, sin
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_matrices import Floats
from brachium_fusion.joint_model import Interval, Joint
from brachium_fusion.joint_shaking import SWING_RATE, TIP_M, Shaking
from brachium_fusion.joint_update import GRAVITY

HEADINGS = 72
LEAST_ACCELERATION = 0.3
"""m/s^2: below it accelerometer bias and tilt error, not movement, give the direction."""
ABOVE_SHAKING = 1.0
"""Times the shaking: what skin swings by says nothing of heading, what goes beyond it does."""
ACCELERATION_SD = 0.3
"""m/s^2: lever arms, bias, tilt."""
RATE_SD = 0.3
"""rad/s about the direction that the joint has not: tissue and wrong axes."""
ANGLE_SD = 0.15
"""rad, of the angle between the axes."""
MOST_EVIDENCE = 20.0
"""No single instant counts for more (natural logarithm), however hard the blow."""
ALIKE_S = 0.25
"""Errors stay alike for this long; evidence counts once in it."""
FORGET_S = 20.0
LEAST_EVIDENCE = 8.0
"""The best heading is to be this much likelier (natural logarithm) than the mean of all."""
CERTAIN_SD = 0.26
"""rad: 15 deg, within which linear estimation takes over."""


_ANGLES: Floats = np.linspace(-pi, pi, HEADINGS, endpoint=False)
_TERMS: Floats = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.ones(HEADINGS)])
_COSINES, _SINES, _ = _TERMS


class HeadingSearch:
    """Gathers evidence on the heading of sensor b to sensor a; old evidence fades."""

    def __init__(self, joint: Joint, forget_s: float = FORGET_S) -> None:
        self._joint, self._forget_s = joint, forget_s
        self.likelihood: Floats = np.zeros(HEADINGS)
        self._shaking = Shaking()

    def take(self, attitude: Floats, rate: Floats, acceleration: Floats, span_s: float) -> None:
        """Take what both sensors saw over `span_s`: world_from_sensor (2, 3, 3), each with its own heading;
        rate (2, 3) rad/s in sensor axes; acceleration (2, 3) of the joint centre in each one's world, m/s^2.
        """
        weight = min(1.0, span_s / ALIKE_S)
        self.likelihood = self.likelihood * (1.0 - span_s / self._forget_s)
        self._shaking = self._shaking.then(acceleration)
        shaken = self._shaking.squared
        if self._joint.has_levers:
            (ax, ay, _), (bx, by, _) = acceleration.tolist()
            least = LEAST_ACCELERATION**2 + (ABOVE_SHAKING**2) * shaken
            if min(ax * ax + ay * ay, bx * bx + by * by) > least:
                along, across = ax * bx + ay * by, ay * bx - ax * by
                gain = weight / max(ACCELERATION_SD**2, hypot(along, across) / MOST_EVIDENCE)
                self.likelihood += np.array([gain * along, gain * across, 0.0]) @ _TERMS
        if self._joint.has_axes:
            self.likelihood += weight * self._axes(attitude, rate, self._shaking.speed / TIP_M)

    def _axes(self, attitude: Floats, rate: Floats, tips: float) -> Floats:
        """Return the evidence (72,) of the axes, made of products of vectors of a with turned ones of b;
        `tips` rad/s is how fast sensors tip on their skin."""
        joint = self._joint
        assert joint.axis_a is not None
        assert joint.axis_b is not None
        a, b = attitude[0] @ joint.axis_a, attitude[1] @ joint.axis_b
        rate_a, rate_b = (attitude @ rate[:, :, None])[:, :, 0]
        if joint.axes == 1:
            # of d = rate_b - rate_a: |a x d|^2 = |d|^2 - (a d)^2
            products = np.array([_turning(rate_a, rate_b), _turning(a, rate_b), _turning(a, b)]) @ _TERMS
            along = products[1] - float(a @ rate_a)
            off = float(rate_b @ rate_b + rate_a @ rate_a) - 2.0 * products[0] - along * along
            bend = 2.0 - 2.0 * products[2]
        else:
            # normal a x b: its product with rate_b is a (b x rate_b), with rate_a (rate_a x a) b
            across = _turning(a, rotation.cross_matrix(b) @ rate_b)
            against = _turning(rotation.cross_matrix(rate_a) @ a, b)
            dot, along = (
                np.array([_turning(a, b), [x - y for x, y in zip(across, against, strict=True)]]) @ _TERMS
            )
            off = along * along / np.maximum(1.0 - dot * dot, 0.09)
            bend = (dot - sin(joint.carrying_rad)) ** 2
        rate_variance, variance = RATE_SD**2 + tips**2, ANGLE_SD**2 + (tips / SWING_RATE) ** 2
        again = RATE_SD**2 / rate_variance  # what tips does so with every swing: it says the same again
        found: Floats = (-0.5 * again) * (off / rate_variance + bend / variance)
        return found

    def best(self) -> tuple[float, float]:
        """Return the heading, rad, to turn b by from the left, and its standard deviation, at most pi."""
        odds = np.exp(self.likelihood - self.likelihood.max())
        odds /= odds.sum()
        x, y = float(odds @ _COSINES), float(odds @ _SINES)
        length = min(1.0, np.hypot(x, y))
        if length < 1e-3:
            return 0.0, pi
        spread = float(np.sqrt(-2.0 * np.log(length)))
        return float(np.arctan2(y, x)), min(pi, max(spread, pi / HEADINGS))

    def is_found(self) -> bool:
        """One heading stands out."""
        stands_out = float(self.likelihood.max() - self.likelihood.mean()) > LEAST_EVIDENCE
        return stands_out and self.best()[1] < CERTAIN_SD

    def against(self, heading: float) -> float:
        """Return by how much (natural logarithm) the best heading is likelier than this one."""
        at = round((heading + pi) / (2.0 * pi / HEADINGS)) % HEADINGS
        return float(self.likelihood.max() - self.likelihood[at])

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {"likelihood": self.likelihood.tolist(), "shaking": self._shaking.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the search whose state this is would have."""
        self.likelihood = np.array(state["likelihood"])
        self._shaking = Shaking.of(state["shaking"]) if "shaking" in state else Shaking()


def _turning(u: Floats, v: Floats) -> list[float]:
    """Return the product of u (3,) with v (3,) turned about the vertical: of its cosine, its sine, one."""
    (ux, uy, uz), (vx, vy, vz) = u.tolist(), v.tolist()
    return [ux * vx + uy * vy, uy * vx - ux * vy, uz * vz]


def centre_acceleration(
    joint: Joint, interval: Interval, start: Floats, end: Floats, rate_start: Floats, rate_end: Floats
) -> Floats:
    """Return the joint centre's mean acceleration (..., 2, 3) over an interval as each sensor saw it, each in
    its own world: from world_from_sensor (..., 2, 3, 3) and rates (..., 2, 3) at both ends."""
    lever = rotation.cross_matrix(
        np.array([np.zeros(3) if v is None else v for v in (joint.lever_a, joint.lever_b)])
    )
    gained = start @ (lever @ rate_start[..., None]) - end @ (lever @ rate_end[..., None])
    acceleration: Floats = ((start @ interval.push[..., None] + gained) / interval.span_s)[..., 0]
    acceleration[..., 2] -= GRAVITY
    return acceleration
