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
    begin,
    heading_sd,
    in_given_world,
    resume,
    step_of,
)
from brachium_fusion.joint_update import SHARED_HEADING_SD, advance, constrain

LOST_S = 0.5
"""After a longer gap nothing is known of the heading; biases and lever arms stay."""
GAP_HEADING_RATE = radians(60.0)
"""rad/s: how much a sensor may have turned unseen about the vertical, beyond what its own filter bridged."""
JUMP = radians(10.0)
"""Between nodes: what was found of the heading that b came with is void."""
AWAY = radians(45.0)
OVERTHROWN = 20.0
"""The filter gives up its heading for one this far away with this much more evidence (natural logarithm)."""
_UNTURNED: Floats = np.array([rotation.IDENTITY, rotation.IDENTITY])


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
    `start_sd_rad`: both orientations begin in one world, for instance by a pose, to this standard deviation.
    Until a heading is found orientations pass unchanged, its standard deviation pi.
    With neither lever arms nor axes known, nothing binds the sensors: orientations pass unchanged.
    """

    def __init__(
        self, joint: Joint, rate_hz: float, shared_heading: bool = False, start_sd_rad: float | None = None
    ) -> None:
        self._joint, self._shared = joint, shared_heading
        self._start_sd = SHARED_HEADING_SD if shared_heading and start_sd_rad is None else start_sd_rad
        self._period = 1.0 / rate_hz
        self._every = max(1, round(NODE_S * rate_hz))
        self._search = HeadingSearch(joint)
        self._model: JointState | None = None
        self._tracking = False
        self._samples: list[tuple[Floats, Floats, Floats]] = []
        """Turns since the last node, rates and specific forces, from it on."""
        self._node: Floats | None = None
        """Given orientations at the last node."""
        self._attitude: Floats = _UNTURNED
        """The model's at the last node, in the given world."""
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
        if self._node is None or missing_s > 0.0:
            self._begin(given, gyr, missing_s)
            self._node, self._samples = given, [(_UNTURNED, gyr, acc)]
        else:
            turn, gyr_before, _ = self._samples[-1]
            turn = rotation.multiply(turn, step_of(gyr_before, gyr, self._period))
            self._samples.append((turn, gyr, acc))
            if len(self._samples) > self._every:
                self._reach_node(self._node, given)
                self._node, self._samples = given, [(_UNTURNED, gyr, acc)]
        if not self._tracking:
            return JointEstimate(given[0], given[1], 0.0, pi, self._residual)
        a, b = rotation.multiply(self._attitude, self._samples[-1][0])
        return JointEstimate(a, b, self._heading, self._heading_sd, self._residual)

    def _begin(self, given: Floats, gyr: Floats, missing_s: float) -> None:
        """Begin, or go on behind a gap: the sensors' own filters tell how they lie now."""
        if self._node is None or missing_s > LOST_S:
            self._search = HeadingSearch(self._joint)
            self._tracking = False
            self._heading, self._heading_sd = 0.0, pi
            if self._start_sd is not None and (self._shared or self._node is None):
                self._track(given, gyr, 0.0, self._start_sd)
        elif self._tracking:
            sd = self._heading_sd + GAP_HEADING_RATE * missing_s
            self._track(given, gyr, self._heading, min(pi, sd))

    def _track(self, given: Floats, gyr: Floats, heading: float, sd: float) -> None:
        """Begin linear estimation at a heading."""
        turned = np.array([given[0], rotation.multiply(rotation.about(2, heading), given[1])])
        self._attitude = turned
        self._heading, self._heading_sd = heading, sd
        if self._model is None:
            self._model = begin(self._joint, turned, gyr, sd)
        else:
            self._model = resume(self._joint, self._model, turned, gyr, sd)
        self._tracking = self._joint.has_axes or self._joint.has_levers

    def _reach_node(self, given_before: Floats, given: Floats) -> None:
        turns, rates, forces = (np.array(values) for values in zip(*self._samples, strict=True))
        interval = Interval.gather(turns, rates, forces, self._period)
        gyr = rates[-1]
        if self._tracking:
            assert self._model is not None
            advance(self._model, interval)
            shared = self._heading if self._shared else None
            self._residual = constrain(self._model, self._joint, gyr, shared)
            self._heading_sd = heading_sd(self._model.covariance)
            self._attitude, heading = in_given_world(self._model.attitude, given, self._shared)
            before, self._heading = self._heading, float(heading)
            if abs(float(rotation.wrap(self._heading - before))) > JUMP:
                self._search = HeadingSearch(self._joint)  # a given heading is another one than before
                return
        acceleration = centre_acceleration(self._joint, interval, given_before, given, rates[0], gyr)
        self._search.take(given, gyr, acceleration, interval.span_s)
        if not self._search.is_found():
            return
        best, sd = self._search.best()
        away = abs(float(rotation.wrap(best - self._heading)))
        other = away > AWAY and self._search.against(self._heading) > OVERTHROWN
        if not self._tracking or other:
            self._track(given, gyr, best, max(sd, CERTAIN_SD))

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        model = self._model
        return {
            "search": self._search.state(),
            "samples": [[values.tolist() for values in sample] for sample in self._samples],
            "model": None if model is None else model.state(),
            "tracking": self._tracking,
            "node": None if self._node is None else self._node.tolist(),
            "attitude": self._attitude.tolist(),
            "numbers": [self._heading, self._heading_sd, self._residual],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        self._search.restore(state["search"])
        self._samples = [(np.array(t), np.array(g), np.array(a)) for t, g, a in state["samples"]]
        self._tracking, model, node = state["tracking"], state["model"], state["node"]
        self._model = None if model is None else JointState.of(model)
        self._node = None if node is None else np.array(node)
        self._attitude = np.array(state["attitude"])
        self._heading, self._heading_sd, self._residual = state["numbers"]
