"""The orientation of two sensors to each other by the joint between them, sample by sample. Pure, causal."""

from dataclasses import dataclass
from math import pi, radians
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.joint_heading import CERTAIN_SD, HeadingSearch, centre_acceleration
from brachium_fusion.joint_matrices import Floats, Quaternion, matrix_of, product, quaternion_of, turn
from brachium_fusion.joint_model import (
    NODE_S,
    Interval,
    Joint,
    JointState,
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
JUMP = radians(10.0)
"""Between nodes: what was found of the heading that b came with is void."""
AWAY = radians(45.0)
OVERTHROWN = 20.0
"""The filter gives up its heading for one this far away with this much more evidence (natural logarithm)."""
_UNTURNED: Quaternion = (1.0, 0.0, 0.0, 0.0)


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
        self._samples: list[tuple[list[Quaternion], Floats, Floats]] = []
        """Turns since the last node, rates (2, 3) and specific forces (2, 3), from it on."""
        self._node: Floats | None = None
        """Given orientations (2, 3, 3) at the last node."""
        self._attitude: list[Quaternion] = [_UNTURNED, _UNTURNED]
        """The model's at the last node, in the given world."""
        self._heading, self._heading_sd, self._residual = 0.0, pi, 0.0

    @property
    def heading_sd_rad(self) -> float:
        """Standard deviation of the heading between a and b as it is now; pi while nothing is known."""
        return self._heading_sd

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
        gyr, acc = np.array([gyr_a, gyr_b]), np.array([acc_a, acc_b])
        if self._node is None or missing_s > 0.0:
            given = matrix_of(np.array([world_from_a, world_from_b]))
            self._begin(given, gyr, missing_s)
            self._node, self._samples = given, [([_UNTURNED, _UNTURNED], gyr, acc)]
        else:
            turns, gyr_before, _ = self._samples[-1]
            steps = (0.5 * self._period * (gyr_before + gyr)).tolist()
            turns = [product(before, turn(*step)) for before, step in zip(turns, steps, strict=True)]
            self._samples.append((turns, gyr, acc))
            if len(self._samples) > self._every:
                given = matrix_of(np.array([world_from_a, world_from_b]))
                self._reach_node(self._node, given)
                self._node, self._samples = given, [([_UNTURNED, _UNTURNED], gyr, acc)]
        if not self._tracking:
            return JointEstimate(world_from_a, world_from_b, 0.0, pi, self._residual)
        turn_a, turn_b = self._samples[-1][0]
        a, b = product(self._attitude[0], turn_a), product(self._attitude[1], turn_b)
        return JointEstimate(np.array(a), np.array(b), self._heading, self._heading_sd, self._residual)

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
        turned = given.copy()
        turned[1] = matrix_of(rotation.about(2, heading)) @ given[1]
        self._stand_at(turned)
        self._heading, self._heading_sd = heading, sd
        if self._model is None:
            self._model = begin(self._joint, turned, gyr, sd)
        else:
            self._model = resume(self._joint, self._model, turned, gyr, sd)
        self._tracking = self._joint.has_axes or self._joint.has_levers

    def _stand_at(self, attitude: Floats, heading: float = 0.0) -> None:
        """Have both at attitudes (2, 3, 3) turned about the vertical."""
        up = turn(0.0, 0.0, heading)
        self._attitude = [product(up, quaternion_of(one)) for one in attitude]

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
            common, heading = in_given_world(self._model.attitude, given, self._shared)
            self._stand_at(self._model.attitude, float(common))
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
            "samples": [[[list(q) for q in t], g.tolist(), a.tolist()] for t, g, a in self._samples],
            "model": None if model is None else model.state(),
            "tracking": self._tracking,
            "node": None if self._node is None else self._node.tolist(),
            "attitude": [list(q) for q in self._attitude],
            "numbers": [self._heading, self._heading_sd, self._residual],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        self._search.restore(state["search"])
        self._samples = [
            ([_quaternion(q) for q in turns], np.array(gyr), np.array(acc))
            for turns, gyr, acc in state["samples"]
        ]
        self._tracking, model, node = state["tracking"], state["model"], state["node"]
        self._model = None if model is None else JointState.of(model)
        self._node = None if node is None else np.array(node)
        self._attitude = [_quaternion(q) for q in state["attitude"]]
        self._heading, self._heading_sd, self._residual = state["numbers"]


def _quaternion(values: list[float]) -> Quaternion:
    w, x, y, z = values
    return w, x, y, z
