"""The heading between two sensors on one joint, found from nothing: how likely each of 72 headings is. Pure.

Both sensors see the joint centre's horizontal acceleration, which is one vector: a heading is as likely as
it brings the two to cover each other. Where the joint's axes are known, so is the turning about the direction
that the joint has not (reference mathematics 7) and the angle between its axes.
"""

from math import hypot, pi, sin
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_model import Floats, Interval, Joint
from brachium_fusion.joint_update import GRAVITY

HEADINGS = 72
LEAST_ACCELERATION = 0.3
"""m/s^2: below it accelerometer bias and tilt error, not movement, give the direction."""
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


class HeadingSearch:
    """Gathers evidence on the heading of sensor b to sensor a; old evidence fades."""

    def __init__(self, joint: Joint, forget_s: float = FORGET_S) -> None:
        self._joint, self._forget_s = joint, forget_s
        self._angles = np.arange(HEADINGS) * (2.0 * pi / HEADINGS) - pi
        self._cosines, self._sines = np.cos(self._angles), np.sin(self._angles)
        self.likelihood: Floats = np.zeros(HEADINGS)

    def take(self, attitude: Floats, rate: Floats, acceleration: Floats, span_s: float) -> None:
        """Take what both sensors saw over `span_s`: world_from_sensor (2, 4), each with its own heading; rate
        (2, 3) rad/s in sensor axes; acceleration (2, 3) of the joint centre in each one's world, m/s^2."""
        weight = min(1.0, span_s / ALIKE_S)
        self.likelihood = self.likelihood * (1.0 - span_s / self._forget_s)
        if self._joint.has_levers:
            (ax, ay, _), (bx, by, _) = acceleration.tolist()
            if min(ax * ax + ay * ay, bx * bx + by * by) > LEAST_ACCELERATION**2:
                along, across = ax * bx + ay * by, ay * bx - ax * by
                gain = weight / max(ACCELERATION_SD**2, hypot(along, across) / MOST_EVIDENCE)
                self.likelihood += gain * (along * self._cosines + across * self._sines)
        if self._joint.has_axes:
            self.likelihood += weight * self._axes(attitude, rotation.rotate(attitude, rate))

    def _axes(self, attitude: Floats, rate: Floats) -> Floats:
        joint = self._joint
        assert joint.axis_a is not None
        assert joint.axis_b is not None
        a = rotation.rotate(attitude[0], joint.axis_a)
        b = self._turned(rotation.rotate(attitude[1], joint.axis_b))
        difference = self._turned(rate[1]) - rate[0]
        if joint.axes == 1:
            off = np.linalg.norm(np.cross(a, difference), axis=1)
            bend = np.linalg.norm(b - a, axis=1)
        else:
            normal = np.cross(a, b)
            length = np.maximum(np.linalg.norm(normal, axis=1), 0.3)
            off = np.einsum("ni,ni->n", normal, difference) / length
            bend = b @ a - sin(joint.carrying_rad)
        found: Floats = -0.5 * ((off / RATE_SD) ** 2 + (bend / ANGLE_SD) ** 2)
        return found

    def _turned(self, v: Floats) -> Floats:
        """Return v (3,) turned about the vertical by every heading, (72, 3)."""
        x, y, z = v.tolist()
        turned = np.empty((HEADINGS, 3))
        turned[:, 0] = self._cosines * x - self._sines * y
        turned[:, 1] = self._sines * x + self._cosines * y
        turned[:, 2] = z
        return turned

    def best(self) -> tuple[float, float]:
        """Return the heading, rad, to turn b by from the left, and its standard deviation, at most pi."""
        odds = np.exp(self.likelihood - self.likelihood.max())
        odds /= odds.sum()
        x, y = float(odds @ self._cosines), float(odds @ self._sines)
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
        return {"likelihood": self.likelihood.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the search whose state this is would have."""
        self.likelihood = np.array(state["likelihood"])


def centre_acceleration(
    joint: Joint, interval: Interval, start: Floats, end: Floats, rate_start: Floats, rate_end: Floats
) -> Floats:
    """Return the joint centre's mean acceleration (..., 2, 3) over an interval as each sensor saw it, each in
    its own world: from world_from_sensor (..., 2, 4) and rates (..., 2, 3) at both ends."""
    lever = np.array([np.zeros(3) if v is None else v for v in (joint.lever_a, joint.lever_b)])
    arm_start = rotation.rotate(start, np.cross(rate_start, lever))
    gained = rotation.rotate(end, np.cross(rate_end, lever)) - arm_start
    acceleration = (rotation.rotate(start, interval.push) + gained) / interval.span_s
    acceleration[..., 2] -= GRAVITY
    return acceleration
