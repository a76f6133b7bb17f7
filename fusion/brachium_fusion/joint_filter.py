"""The orientation of two sensors to each other by the joint between them, sample by sample. Pure, causal."""

from dataclasses import dataclass
from math import pi, radians
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_heading import CERTAIN_SD, HeadingSearch, centre_acceleration
from brachium_fusion.joint_model import (
    NODE_S,
    Floats,
    Interval,
    Joint,
    JointState,
    attitude_after,
    begin,
    heading_sd,
    in_given_world,
    resume,
)
from brachium_fusion.joint_update import SHARED_HEADING_SD, advance, constrain

LOST_S = 0.5
"""After a longer gap nothing is known of the heading; biases and lever arms stay."""
GAP_HEADING_RATE = radians(60.0)
"""rad/s: how much a sensor may have turned unseen about the vertical, beyond what its own filter bridged."""
AWAY = radians(45.0)
OVERTHROWN = 20.0
"""The filter gives up its heading for one this far away with this much more evidence (natural logarithm)."""


@dataclass(frozen=True, slots=True, eq=False)
class JointEstimate:
    """Both sensors in one world."""

    world_from_a: Floats
    """(4,), its heading as given."""
    world_from_b: Floats
    """(4,), its heading that of the same world."""
    heading_rad: float
    """By how much b's given orientation had to be turned about the vertical, from the left."""
    heading_sd_rad: float
    """Standard deviation of the heading between a and b; pi while nothing is known."""
    residual: float
    """How far the two velocities of the joint centre were apart, in standard deviations; 1 is as expected."""


class JointFilter:
    """Finds the heading between two sensors and their tilt; give it every sample of both, at one rate.

    `shared_heading`: both orientations come with a magnetometer's heading, which then is weak evidence.
    With neither lever arms nor axes known, nothing binds the sensors: orientations pass unchanged.
    """

    def __init__(self, joint: Joint, rate_hz: float, shared_heading: bool = False) -> None:
        self._joint, self._shared = joint, shared_heading
        self._period = 1.0 / rate_hz
        self._every = max(1, round(NODE_S * rate_hz))
        self._search = HeadingSearch(joint)
        self._interval = Interval.empty()
        self._count = 0
        self._model: JointState | None = None
        self._tracking = False
        self._before: tuple[Floats, Floats, Floats] | None = None
        """Orientations, rates and specific forces of the last sample."""
        self._node: tuple[Floats, Floats] | None = None
        """Orientations and rates at the last node."""
        self._heading, self._heading_sd, self._residual = 0.0, pi, 0.0

    def step(
        self,
        world_from_a: Floats,
        world_from_b: Floats,
        gyr_a: Floats,
        gyr_b: Floats,
        acc_a: Floats,
        acc_b: Floats,
        missing_s: float = 0.0,
    ) -> JointEstimate:
        """Take one sample of both: orientations (4,) by each sensor's own filter, rad/s and m/s^2 in sensor
        axes, and for how long before it samples were missing."""
        given = np.array([world_from_a, world_from_b])
        gyr, acc = np.array([gyr_a, gyr_b]), np.array([acc_a, acc_b])
        if self._before is None or missing_s > 0.0:
            self._begin(given, gyr, missing_s)
        else:
            _, gyr_before, acc_before = self._before
            self._interval.extend(0.5 * (gyr_before + gyr), 0.5 * (acc_before + acc), self._period)
            self._count += 1
            if self._count >= self._every:
                self._reach_node(given, gyr)
        self._before = given, gyr, acc
        return self._estimate(given)

    def _begin(self, given: Floats, gyr: Floats, missing_s: float) -> None:
        """Begin, or go on behind a gap: the sensors' own filters tell how they lie now."""
        if self._before is None or missing_s > LOST_S:
            self._search = HeadingSearch(self._joint)
            self._tracking = False
            self._heading, self._heading_sd = 0.0, pi
            if self._shared:
                self._track(given, gyr, 0.0, SHARED_HEADING_SD)
        elif self._tracking:
            sd = self._heading_sd + GAP_HEADING_RATE * missing_s
            self._track(given, gyr, self._heading, min(pi, sd))
        self._interval, self._count = Interval.empty(), 0
        self._node = given, gyr

    def _track(self, given: Floats, gyr: Floats, heading: float, sd: float) -> None:
        """Begin linear estimation at a heading."""
        turned = np.array([given[0], rotation.multiply(rotation.about(2, heading), given[1])])
        self._heading, self._heading_sd = heading, sd
        if self._model is None:
            self._model = begin(self._joint, turned, gyr, sd)
        else:
            self._model = resume(self._joint, self._model, turned, gyr, sd)
        self._tracking = self._joint.has_axes or self._joint.has_levers

    def _reach_node(self, given: Floats, gyr: Floats) -> None:
        interval, self._interval, self._count = self._interval, Interval.empty(), 0
        assert self._node is not None
        given_before, gyr_before = self._node
        self._node = given, gyr
        acceleration = centre_acceleration(self._joint, interval, given_before, given, gyr_before, gyr)
        self._search.take(given, gyr, acceleration, interval.span_s)
        if self._tracking:
            assert self._model is not None
            advance(self._model, interval)
            shared = self._heading if self._shared else None
            self._residual = constrain(self._model, self._joint, gyr, shared)
            self._heading_sd = heading_sd(self._model.covariance)
        if not self._search.is_found():
            return
        best, sd = self._search.best()
        away = abs(float(rotation.wrap(best - self._heading)))
        other = away > AWAY and self._search.against(self._heading) > OVERTHROWN
        if not self._tracking or other:
            self._track(given, gyr, best, max(sd, CERTAIN_SD))

    def _estimate(self, given: Floats) -> JointEstimate:
        if not self._tracking:
            best, sd = self._search.best()
            b = rotation.multiply(rotation.about(2, best), given[1])
            return JointEstimate(given[0], b, best, sd, self._residual)
        assert self._model is not None
        interval = self._interval
        attitude = attitude_after(self._model.attitude, self._model.gyro_bias, interval.turn, interval.spread)
        (a, b), heading = in_given_world(attitude, given, self._shared)
        self._heading = float(heading)
        return JointEstimate(a, b, self._heading, self._heading_sd, self._residual)

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        model = self._model
        return {
            "search": self._search.state(),
            "interval": self._interval.state(),
            "count": self._count,
            "model": None if model is None else model.state(),
            "tracking": self._tracking,
            "before": None if self._before is None else [v.tolist() for v in self._before],
            "node": None if self._node is None else [v.tolist() for v in self._node],
            "numbers": [self._heading, self._heading_sd, self._residual],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        self._search.restore(state["search"])
        self._interval = Interval.of(state["interval"])
        self._count, self._tracking = state["count"], state["tracking"]
        model, before, node = state["model"], state["before"], state["node"]
        self._model = None if model is None else JointState.of(model)
        self._before = (
            None if before is None else (np.array(before[0]), np.array(before[1]), np.array(before[2]))
        )
        self._node = None if node is None else (np.array(node[0]), np.array(node[1]))
        self._heading, self._heading_sd, self._residual = state["numbers"]
