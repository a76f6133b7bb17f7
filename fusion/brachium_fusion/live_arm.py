"""What one arm's joints tell of its sensors' orientations, instant by instant. Pure, causal.

A sensor alone does not know its heading well: a magnetometer errs by the field indoors, a gyroscope drifts.
Two sensors on one joint know more together. Corrections are turns from the left, before the mounting.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.arm_knowledge import ArmKnowledge
from brachium_fusion.joint_filter import JointEstimate, JointFilter
from brachium_fusion.timeline import Motion

Floats = npt.NDArray[np.float64]


class SensorNow(NamedTuple):
    """One sensor at an instant: orientation (4,), its heading as the pose set it, rate and force."""

    world_from_sensor: Floats
    motion: Motion


class LiveArm:
    """The joints of one arm. `step` takes the sensors that are there at each instant."""

    def __init__(
        self,
        segments: tuple[str, str, str],
        knowledge: ArmKnowledge,
        rate_hz: float,
        magnetometers: frozenset[str],
    ) -> None:
        upper, forearm, hand = segments
        pairs = (("elbow", upper, forearm, knowledge.elbow), ("wrist", forearm, hand, knowledge.wrist))
        self._pairs = {
            name: (a, b, JointFilter(joint, rate_hz, {a, b} <= magnetometers))
            for name, a, b, joint in pairs
            if joint is not None
        }
        self._period_ns = 1e9 / rate_hz
        self._last_ns: dict[str, int] = {}

    def __bool__(self) -> bool:
        return bool(self._pairs)

    @property
    def segments(self) -> frozenset[str]:
        """Whose samples it wants."""
        return frozenset(s for a, b, _ in self._pairs.values() for s in (a, b))

    def step(self, now: int, sensors: Mapping[str, SensorNow]) -> dict[str, Floats]:
        """Return corrected world_from_sensor (4,) of the segments about which a joint says something."""
        found: dict[str, Floats] = {}
        for name, (a, b, joint_filter) in self._pairs.items():
            if a not in sensors or b not in sensors:
                continue
            estimate = self._joint_step(name, now, joint_filter, sensors[a], sensors[b])
            if a in found:  # the joint above has turned it already: the rest of the arm turns with it
                turn = rotation.heading(rotation.multiply(found[a], rotation.inverse(estimate.world_from_a)))
                found[b] = rotation.multiply(rotation.about(2, turn), estimate.world_from_b)
            else:
                found[a], found[b] = estimate.world_from_a, estimate.world_from_b
        return found

    def _joint_step(
        self, name: str, now: int, joint_filter: JointFilter, a: SensorNow, b: SensorNow
    ) -> JointEstimate:
        missing_ns = now - self._last_ns.get(name, now) - self._period_ns
        self._last_ns[name] = now
        return joint_filter.step(
            a.world_from_sensor,
            b.world_from_sensor,
            a.motion.gyr,
            b.motion.gyr,
            a.motion.acc,
            b.motion.acc,
            missing_s=1e-9 * missing_ns if missing_ns > 0.5 * self._period_ns else 0.0,
        )

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "joints": {name: joint_filter.state() for name, (_, _, joint_filter) in self._pairs.items()},
            "last_ns": self._last_ns,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the arm whose state this is would have."""
        for name, (_, _, joint_filter) in self._pairs.items():
            joint_filter.restore(state["joints"][name])
        self._last_ns = dict(state["last_ns"])
