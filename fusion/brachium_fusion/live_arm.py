"""What one arm's joints tell of its sensors' orientations, and how its shoulder moves. Pure, causal.

A sensor alone does not know its heading well: a magnetometer errs by the field indoors, a gyroscope drifts.
Two sensors on one joint know more together. Corrections are turns from the left, before the mounting.
"""

from collections.abc import Mapping
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.arm_knowledge import ArmKnowledge
from brachium_fusion.humeral_rotation import HumeralRotation
from brachium_fusion.joint_filter import JointEstimate, JointFilter
from brachium_fusion.live_shoulder import LiveShoulder, RestMean
from brachium_fusion.shoulder_trunk import trunk_velocity
from brachium_fusion.strap_slip import Slip, SlipWatch
from brachium_fusion.timeline import SensorNow, Shift

Floats = npt.NDArray[np.float64]


RESTED = 25
"""Instants of stillness that show a gyroscope's bias."""


class ArmNow(NamedTuple):
    """What is found of an arm at an instant."""

    world_from_sensor: dict[str, Floats]
    """(4,) of the segments about which a joint says something."""
    shift: Shift | None
    slip: Slip | None
    """A strap that slipped, at the instant in which it became certain."""


class LiveArm:
    """The joints of one arm. `step` takes the sensors that are there at each instant."""

    def __init__(
        self,
        segments: tuple[str, str, str],
        knowledge: ArmKnowledge,
        rate_hz: float,
        magnetometers: frozenset[str],
        worn: frozenset[str],
    ) -> None:
        """Begin with what is known; `worn` are the segments whose sensors deliver samples."""
        self._upper, self._forearm, self._hand = segments
        self._joints: dict[str, JointFilter] = {}
        if knowledge.elbow is not None:
            shared = {self._upper, self._forearm} <= magnetometers
            start_sd = None if shared else knowledge.heading_sd.get("elbow")
            self._joints["elbow"] = JointFilter(knowledge.elbow, rate_hz, shared, start_sd)
        if knowledge.wrist is not None:
            shared = {self._forearm, self._hand} <= magnetometers
            start_sd = None if shared else knowledge.heading_sd.get("wrist")
            self._joints["wrist"] = JointFilter(knowledge.wrist, rate_hz, shared, start_sd)
        self._shoulder, self._humerus = None, None
        model = knowledge.model
        if model is not None:
            self._shoulder = LiveShoulder(model, rate_hz, {self._upper, self._forearm} <= magnetometers)
        if model is not None and knowledge.carrying_known:
            self._humerus = HumeralRotation(model.carrying_rad, model.side)
            self._sensor_from = model.sensor_from_upper_arm, model.sensor_from_forearm
        watched = [s for s in segments if s in worn]
        joints = {self._upper: knowledge.elbow, self._forearm: knowledge.wrist}
        between = [joints[s] if s in worn and after in worn else None for s, after in pairwise(segments)]
        self._slips = None
        if knowledge.model is not None:
            self._slips = SlipWatch(watched, rate_hz, between[: len(watched) - 1])
        self._trunk = knowledge.trunk
        self._bias = np.zeros(3)
        self._period_ns = 1e9 / rate_hz
        self._last_ns: dict[str, int] = {}

    @property
    def segments(self) -> tuple[str, ...]:
        """Whose samples it wants: none when there is nothing to estimate."""
        if not self._joints and self._shoulder is None:
            return ()
        trunk = () if self._trunk is None else ("sternum",)
        return (*trunk, self._upper, self._forearm, self._hand)

    @property
    def shoulder_segments(self) -> tuple[str, ...]:
        """Of whose sensors the shoulder's shift is made."""
        trunk = () if self._trunk is None else ("sternum",)
        return (*trunk, self._upper, self._forearm)

    def heading_sd(self, joint: str) -> float | None:
        """Return the standard deviation of the heading across `elbow` or `wrist`, rad; None: unknown."""
        found = self._joints.get(joint)
        return found.heading_sd_rad if found is not None and found.heading_sd_rad < pi else None

    def step(self, now: int, sensors: Mapping[str, SensorNow], rests: Mapping[str, RestMean]) -> ArmNow:
        """Return what the joints tell at an instant, of the sensors that are there."""
        found: dict[str, Floats] = {}
        shift = None
        upper, forearm, hand = self._upper, self._forearm, self._hand
        if upper in sensors and forearm in sensors:
            found[upper], found[forearm] = self._elbow(now, sensors[upper], sensors[forearm])
            shift = self._follow_shoulder(now, found, sensors, rests)
            if self._humerus is not None:
                found[upper] = self._untwisted(found[upper], found[forearm])
        if "wrist" in self._joints and forearm in sensors and hand in sensors:
            estimate = self._joint_step("wrist", now, sensors[forearm], sensors[hand])
            if forearm in found:  # the elbow has turned it already: the hand turns with it
                turn = rotation.multiply(found[forearm], rotation.inverse(estimate.world_from_a))
                about_up = rotation.about(2, rotation.heading(turn))
                found[hand] = rotation.multiply(about_up, estimate.world_from_b)
            else:
                found[forearm], found[hand] = estimate.world_from_a, estimate.world_from_b
        return ArmNow(found, shift, self._slipped(now, found, sensors))

    def _slipped(
        self, now: int, found: Mapping[str, Floats], sensors: Mapping[str, SensorNow]
    ) -> Slip | None:
        if self._slips is None:
            return None
        seen = {s: SensorNow(found.get(s, one.world_from_sensor), one.motion) for s, one in sensors.items()}
        return self._slips.step(now, seen)

    def _elbow(self, now: int, upper: SensorNow, forearm: SensorNow) -> tuple[Floats, Floats]:
        if "elbow" not in self._joints:
            return upper.world_from_sensor, forearm.world_from_sensor
        estimate = self._joint_step("elbow", now, upper, forearm)
        return estimate.world_from_a, estimate.world_from_b

    def _follow_shoulder(
        self,
        now: int,
        found: dict[str, Floats],
        sensors: Mapping[str, SensorNow],
        rests: Mapping[str, RestMean],
    ) -> Shift | None:
        """Put better orientations into `found`; return the shift, None while it is not known."""
        if self._shoulder is None or (self._trunk is not None and "sternum" not in sensors):
            return None
        upper, forearm = self._upper, self._forearm
        carried = None
        if self._trunk is not None:
            sternum = sensors["sternum"]
            rate = sternum.motion.gyr - self._sternum_bias(rests["sternum"])
            carried = trunk_velocity(sternum.world_from_sensor, rate, self._trunk)
        estimate = self._shoulder.step(
            (found[upper], found[forearm]),
            (sensors[upper].motion, sensors[forearm].motion),
            (rests[upper], rests[forearm]),
            self._missing_s("shoulder", now),
            carried,
        )
        if estimate is None or not estimate.valid:
            return None
        found[upper], found[forearm] = estimate.world_from_upper, estimate.world_from_forearm
        return Shift(estimate.shift_m, np.sqrt(np.diag(estimate.covariance)))

    def _sternum_bias(self, rest: RestMean) -> Floats:
        """Return the gyroscope's bias as its last rest of some length showed it."""
        if rest.count >= RESTED:
            self._bias = rest.bias
        return self._bias

    def _untwisted(self, upper: Floats, forearm: Floats) -> Floats:
        """Return the upper-arm sensor's orientation as if it had followed the humerus about its length."""
        assert self._humerus is not None
        from_upper, from_forearm = self._sensor_from
        bone = self._humerus.correct(
            rotation.multiply(upper, from_upper)[None], rotation.multiply(forearm, from_forearm)[None]
        )[0]
        return rotation.multiply(bone, rotation.inverse(from_upper))

    def _joint_step(self, name: str, now: int, a: SensorNow, b: SensorNow) -> JointEstimate:
        return self._joints[name].step(
            a.world_from_sensor,
            b.world_from_sensor,
            a.motion.gyr,
            b.motion.gyr,
            a.motion.acc,
            b.motion.acc,
            missing_s=self._missing_s(name, now),
        )

    def _missing_s(self, name: str, now: int) -> float:
        """Return for how long before this instant there were no samples for an estimator."""
        missing_ns = now - self._last_ns.get(name, now) - self._period_ns
        self._last_ns[name] = now
        return 1e-9 * missing_ns if missing_ns > 0.5 * self._period_ns else 0.0

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "joints": {name: joint.state() for name, joint in self._joints.items()},
            "shoulder": None if self._shoulder is None else self._shoulder.state(),
            "humerus": None if self._humerus is None else self._humerus.state(),
            "slips": None if self._slips is None else self._slips.state(),
            "bias": self._bias.tolist(),
            "last_ns": self._last_ns,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the arm whose state this is would have."""
        for name, joint in self._joints.items():
            joint.restore(state["joints"][name])
        if self._shoulder is not None:
            self._shoulder.restore(state["shoulder"])
        if self._humerus is not None:
            self._humerus.restore(state["humerus"])
        if self._slips is not None:
            self._slips.restore(state["slips"])
        self._bias, self._last_ns = np.array(state["bias"]), dict(state["last_ns"])
