"""Calibration by a pose: where forward is, and how each sensor sits on its segment. Pure.

World is z up. Heading corrections are applied from the left, before the pose fixes the mounting (reference
mathematics 5.1): otherwise the mounting would absorb them and every later turn would be about a wrong axis.
"""

from dataclasses import dataclass, field
from math import degrees, radians
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL, joint_orientations
from brachium_body.segments import SIDES, arm_segments
from brachium_fusion.alignment_warnings import warnings_for
from brachium_fusion.joint_alignment import JointAlignment
from brachium_wire.messages import Forward

Floats = npt.NDArray[np.float64]
PoseName = Literal["n-pose", "table", "given"]
POSES: tuple[PoseName, ...] = ("n-pose", "table", "given")

HORIZONTAL = 0.3
"""A direction can give heading only if at least this part of it is horizontal (17 deg from the vertical)."""

X_FORWARD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseSensor:
    """One sensor at rest in the pose."""

    world_from_sensor: Floats
    """(k, 4) orientations while the pose was held."""
    magnetometer: bool
    """Its world is the common one; without, its heading is its own."""
    nominal_mounting: Floats | None
    """segment_from_sensor as the wearer was told to put it on; None when nothing is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Alignment:
    """What a pose gives: everything needed to turn world_from_sensor into trunk_from_segment."""

    forward: Forward = "none"
    world_from_trunk: Floats = field(default_factory=lambda: rotation.IDENTITY)
    """Heading only; a sternum sensor replaces it from instant to instant."""
    heading: dict[str, float] = field(default_factory=dict)
    """Angle about the vertical, rad, applied from the left to each sensor's orientation."""
    mounting: dict[str, Floats] = field(default_factory=dict)
    """segment_from_sensor of each segment."""
    assumed: frozenset[str] = frozenset()
    """Segments whose heading no rule gives."""
    scores: dict[str, float] = field(default_factory=dict)
    """Sway in the pose and turn from the nominal mounting, deg, per segment."""
    warnings: tuple[str, ...] = ()
    joints: dict[str, JointAlignment] = field(default_factory=dict)
    """What movement showed of `elbow_r`, `wrist_l` and so on."""
    refused: dict[str, str] = field(default_factory=dict)
    """What could not be found, and the reason."""

    def state(self) -> dict[str, Any]:
        """Return the alignment as plain values."""
        return {
            "forward": self.forward,
            "world_from_trunk": self.world_from_trunk.tolist(),
            "heading": self.heading,
            "mounting": {k: v.tolist() for k, v in self.mounting.items()},
            "assumed": sorted(self.assumed),
            "scores": self.scores,
            "warnings": list(self.warnings),
            "joints": {k: v.state() for k, v in self.joints.items()},
            "refused": dict(self.refused),
        }

    @staticmethod
    def from_state(state: dict[str, Any]) -> "Alignment":
        """Return the alignment of a state."""
        return Alignment(
            forward=state["forward"],
            world_from_trunk=np.array(state["world_from_trunk"]),
            heading=state["heading"],
            mounting={k: np.array(v) for k, v in state["mounting"].items()},
            assumed=frozenset(state["assumed"]),
            scores=state["scores"],
            warnings=tuple(state["warnings"]),
            joints={k: JointAlignment.from_state(v) for k, v in state.get("joints", {}).items()},
            refused=dict(state.get("refused", {})),
        )


def pose_orientations(pose: PoseName, angles_deg: dict[str, float]) -> dict[str, Floats]:
    """Return trunk_from_segment of every segment in a pose: by part and side, `forearm_l` and so on.

    `given` takes the model's angles by their clinical names, deg; others are 0. Raises ValueError for a
    name that is
    not among them.
    """
    known = {
        "shoulder_flexion": 0,
        "elbow_flexion": 3,
        "forearm_pronation": 4,
        "wrist_deviation": 5,
        "wrist_flexion": 6,
    }
    if pose == "table":
        angles_deg = {"elbow_flexion": 90.0, "forearm_pronation": 0.0}
    elif pose == "n-pose":
        angles_deg = {}
    theta = np.zeros(7)
    for name, value in angles_deg.items():
        if name not in known:
            raise ValueError(f"pose 'given' cannot use {name!r}; it takes {', '.join(sorted(known))}")
        theta[known[name]] = radians(-value if name == "wrist_deviation" else value)
    orientations: dict[str, Floats] = {"sternum": TRUNK_FROM_NEUTRAL}
    for side in SIDES:
        orientations.update(zip(arm_segments(side), joint_orientations(theta, side), strict=True))
    return orientations


def align(
    sensors: dict[str, PoseSensor],
    trunk_from_segment: dict[str, Floats],
    *,
    facing_deg: float | None = None,
    elbow_axis: dict[str, Floats] | None = None,
) -> Alignment:
    """Return the alignment that makes every sensor's segment stand as `trunk_from_segment` says.

    `facing_deg` is where the pose faces, 0 north, 90 east. `elbow_axis` holds, per segment, the axis of
    elbow flexion
    (3,) seen in that sensor's world, pointing to the subject's right: from a functional movement.
    """
    measured = {s: rotation.mean(sensor.world_from_sensor) for s, sensor in sensors.items()}
    forward, direction = _forward(sensors, measured, facing_deg, elbow_axis or {})
    world_from_trunk = rotation.about(2, np.arctan2(-direction[0], direction[1]))
    heading: dict[str, float] = {}
    assumed: set[str] = set()
    mounting: dict[str, Floats] = {}
    scores: dict[str, float] = {}
    for segment, sensor in sensors.items():
        target = rotation.multiply(world_from_trunk, trunk_from_segment[segment])
        turn = 0.0
        if not sensor.magnetometer:
            found = _own_heading(segment, sensor, measured[segment], target, direction, elbow_axis or {})
            if found is None:
                assumed.add(segment)
            else:
                turn = found
        elif forward == "none":
            assumed.add(segment)
        heading[segment] = turn
        in_world = rotation.multiply(rotation.about(2, turn), measured[segment])
        mounting[segment] = rotation.multiply(rotation.inverse(target), in_world)
        sway = rotation.angle_between(measured[segment], sensor.world_from_sensor)
        scores[f"sway_deg_{segment}"] = degrees(float(np.sqrt(np.mean(sway**2))))
        if sensor.nominal_mounting is not None:
            off = rotation.angle_between(sensor.nominal_mounting, mounting[segment])
            scores[f"from_nominal_deg_{segment}"] = degrees(float(off))
    return Alignment(
        forward=forward,
        world_from_trunk=world_from_trunk,
        heading=heading,
        mounting=mounting,
        assumed=frozenset(assumed),
        scores=scores,
        warnings=warnings_for(forward, heading, assumed, [with_magnetometers(sensors)], scores),
    )


def with_magnetometers(sensors: dict[str, PoseSensor]) -> set[str]:
    """Return the segments whose sensors share one world."""
    return {segment for segment, sensor in sensors.items() if sensor.magnetometer}


def _forward(
    sensors: dict[str, PoseSensor],
    measured: dict[str, Floats],
    facing_deg: float | None,
    elbow_axis: dict[str, Floats],
) -> tuple[Forward, Floats]:
    """Return the rule that applies first and the horizontal unit vector it gives, in the common world.

    Without any magnetometer the world's heading is free: the rule then sets it so that forward is +y.
    """
    free = not any(sensor.magnetometer for sensor in sensors.values())
    sternum = sensors.get("sternum")
    if sternum is not None and (free or sternum.magnetometer):
        direction = _nominal_forward(sternum, measured["sternum"])
        if direction is not None:
            return "sternum", Y_FORWARD if free else direction
    for segment, axis in elbow_axis.items():
        if segment in sensors and (free or sensors[segment].magnetometer):
            direction = _horizontal(
                np.array([-axis[1], axis[0], 0.0])
            )  # forward is a quarter turn left of right
            if direction is not None:
                return "elbow", Y_FORWARD if free else direction
    if facing_deg is not None and not free:
        angle = radians(facing_deg)
        return "facing", np.array([np.sin(angle), np.cos(angle), 0.0])
    for segment in ("upper_arm_r", "upper_arm_l"):
        sensor = sensors.get(segment)
        if sensor is not None and (free or sensor.magnetometer):
            direction = _nominal_forward(sensor, measured[segment])
            if direction is not None:
                return "mounting", Y_FORWARD if free else direction
    return "none", Y_FORWARD


Y_FORWARD = np.array([0.0, 1.0, 0.0])


def _own_heading(
    segment: str,
    sensor: PoseSensor,
    world_from_sensor: Floats,
    target: Floats,
    direction: Floats,
    elbow_axis: dict[str, Floats],
) -> float | None:
    """Return the turn about the vertical that brings a sensor without magnetometer into the common world."""
    if segment in elbow_axis:
        axis = elbow_axis[segment]
        own = _horizontal(np.array([-axis[1], axis[0], 0.0]))
        if own is not None:
            return _turn(own, direction)
    if sensor.nominal_mounting is None:
        return None
    segment_axes = rotation.multiply(world_from_sensor, rotation.inverse(sensor.nominal_mounting))
    # Compare the axis that is most horizontal in the pose, whichever that is.
    for axis_of_segment in np.eye(3):
        own = _horizontal(rotation.rotate(segment_axes, axis_of_segment))
        wanted = _horizontal(rotation.rotate(target, axis_of_segment))
        if own is not None and wanted is not None:
            return _turn(own, wanted)
    return None


def _nominal_forward(sensor: PoseSensor, world_from_sensor: Floats) -> Floats | None:
    if sensor.nominal_mounting is None:
        return None
    world_from_segment = rotation.multiply(world_from_sensor, rotation.inverse(sensor.nominal_mounting))
    return _horizontal(rotation.rotate(world_from_segment, X_FORWARD))


def _horizontal(vector: Floats) -> Floats | None:
    length = float(np.hypot(vector[0], vector[1]))
    if length < HORIZONTAL:
        return None
    return np.array([vector[0], vector[1], 0.0]) / length


def _turn(start: Floats, end: Floats) -> float:
    return float(np.arctan2(start[0] * end[1] - start[1] * end[0], start[0] * end[0] + start[1] * end[1]))
