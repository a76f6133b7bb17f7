"""What is known of one arm before it moves: its joints' axes and centres as its sensors see them. Pure."""

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field, replace
from math import radians
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side, arm_segments
from brachium_fusion.joint_model import Joint
from brachium_fusion.pose import Alignment
from brachium_fusion.shoulder_model import ArmModel
from brachium_fusion.shoulder_trunk import shoulder_from_pelvis

Floats = npt.NDArray[np.float64]
Centres = Mapping[str, tuple[int, Mapping[str, Floats]]]
"""By joint: its axes, and its centre (3,) m from each segment's sensor, in sensor axes."""

ABOVE_EPICONDYLE_M, ABOVE_WRIST_M = 0.04, 0.03
"""Where sensors are worn as told: upper arm lateral, forearm dorsal, this far above the joint below."""
OFF_UPPER_ARM_M, OFF_FOREARM_M, OFF_HAND_M = 0.04, 0.03, 0.02
"""From the segment's middle line to the chip."""
WORN_SD_M = 0.02
"""Of each lever arm, along each axis, for sensors worn as told."""
MEASURED_SD_M = 0.01
"""Of one that was measured."""
POSE_HEADING_SD = radians(10.0)
"""How well a pose, with sensors put on as told, gives the heading between two of them."""
UNSURE_AXIS = radians(10.0)
"""An axis that is not known better than this binds nothing."""
ON_HAND = 0.41
"""Of the hand's length: the middle of the third metacarpal."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmKnowledge:
    """One arm's joints, None where nothing binds their sensors."""

    elbow: Joint | None = None
    wrist: Joint | None = None
    model: ArmModel | None = None
    """For the shoulder's displacement; None without upper arm and forearm aligned."""
    carrying_known: bool = False
    """Movement showed the elbow's axes."""
    heading_sd: Mapping[str, float] = field(default_factory=dict)
    """By joint, rad: how well calibration knows the heading between its sensors."""
    trunk: Floats | None = None
    """(3,) m from the middle of the pelvis to the shoulder, in the sternum sensor's axes; None without it."""

    def without_shoulder(self) -> "ArmKnowledge":
        """Return the same without what the shoulder needs."""
        return replace(self, model=None)

    def plain(self) -> list[Any]:
        """Return all of it as plain values that compare."""
        joints = [None if joint is None else _plain(joint) for joint in (self.elbow, self.wrist)]
        model = {} if self.model is None else asdict(self.model)
        return [
            *joints,
            self.carrying_known,
            {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in model.items()},
        ]


def _plain(joint: Joint) -> list[Any]:
    vectors = (joint.axis_a, joint.axis_b, joint.lever_a, joint.lever_b)
    return [joint.axes, joint.carrying_rad, *(None if v is None else np.asarray(v).tolist() for v in vectors)]


def arm_knowledge(
    side: Side,
    alignment: Alignment | None,
    lengths: ArmLengths,
    stated: Centres,
    magnetometers: Collection[str],
) -> ArmKnowledge:
    """Return what is known of an arm's joints: as stated, else as its alignment has them.

    Axes that rest on a pose alone can be 10 deg off, and turn the heading between sensors as far: they are
    used only where there is no magnetometer to do better.
    """
    upper, forearm, hand = arm_segments(side)
    elbow = _joint("elbow", upper, forearm, side, alignment, lengths, stated)
    wrist = _joint("wrist", forearm, hand, side, alignment, lengths, stated)
    found = {} if alignment is None else alignment.joints
    shown = {name: f"{name}_{side[0]}" in found for name in ("elbow", "wrist")}
    if elbow is not None and not shown["elbow"] and {upper, forearm} <= set(magnetometers):
        elbow = _centre_only(elbow) if "elbow" in stated else None
    if wrist is not None and not shown["wrist"] and {forearm, hand} <= set(magnetometers):
        wrist = _centre_only(wrist) if "wrist" in stated else None
    model = _model(side, alignment, lengths, stated)
    return ArmKnowledge(
        elbow=elbow,
        wrist=wrist,
        model=model,
        carrying_known=shown["elbow"],
        heading_sd={
            name: found[f"{name}_{side[0]}"].heading_sd_rad if known else POSE_HEADING_SD
            for name, known in shown.items()
        },
        trunk=None if model is None else _trunk(side, alignment, lengths),
    )


def _trunk(side: Side, alignment: Alignment | None, lengths: ArmLengths) -> Floats | None:
    if alignment is None or "sternum" not in alignment.mounting or "sternum" in alignment.assumed:
        return None
    trunk_from_sensor = rotation.multiply(TRUNK_FROM_THORAX, alignment.mounting["sternum"])
    return rotation.rotate(rotation.inverse(trunk_from_sensor), shoulder_from_pelvis(lengths, side))


def _centre_only(joint: Joint) -> Joint:
    return replace(joint, axis_a=None, axis_b=None)


def _model(side: Side, alignment: Alignment | None, lengths: ArmLengths, stated: Centres) -> ArmModel | None:
    upper, forearm, _ = arm_segments(side)
    if alignment is None or not {upper, forearm} <= alignment.mounting.keys() - alignment.assumed:
        return None
    from_upper, from_forearm = (rotation.inverse(alignment.mounting[s]) for s in (upper, forearm))
    on_upper, on_forearm, _ = places(side, lengths)
    told_shoulder = stated.get("shoulder", (3, {}))[1].get(upper)
    told_elbow = stated.get("elbow", (2, {}))[1].get(forearm)
    elbow = alignment.joints.get(f"elbow_{side[0]}")
    return ArmModel(
        upper_arm_m=lengths.upper_arm,
        forearm_m=lengths.forearm,
        sensor_from_upper_arm=from_upper,
        sensor_from_forearm=from_forearm,
        lever_upper=rotation.rotate(from_upper, -on_upper) if told_shoulder is None else told_shoulder,
        lever_forearm=rotation.rotate(from_forearm, -on_forearm) if told_elbow is None else told_elbow,
        carrying_rad=0.0 if elbow is None else elbow.carrying_rad,
        side=side,
        lever_sd_m=WORN_SD_M if told_shoulder is None or told_elbow is None else MEASURED_SD_M,
    )


def _joint(
    name: str,
    a: str,
    b: str,
    side: Side,
    alignment: Alignment | None,
    lengths: ArmLengths,
    stated: Centres,
) -> Joint | None:
    axes, centres = stated.get(name, (2, {}))
    lever_a, lever_b = centres.get(a), centres.get(b)
    aligned = alignment is not None and {a, b} <= alignment.mounting.keys() - alignment.assumed
    if not aligned or alignment is None:
        if lever_a is None or lever_b is None:
            return None
        return Joint(axes=axes, lever_a=lever_a, lever_b=lever_b)
    from_a, from_b = (rotation.inverse(alignment.mounting[s]) for s in (a, b))
    told_a, told_b = levers(name, side, lengths)
    found = alignment.joints.get(f"{name}_{side[0]}")
    if found is not None and max(found.axis_near_sd_rad, found.axis_far_sd_rad) > UNSURE_AXIS:
        axes = 3  # movement did not show them: only where the joint is still binds the sensors
    axis_a = rotation.rotate(from_a, [0.0, 0.0, 1.0])
    axis_b = rotation.rotate(from_b, [0.0, 1.0, 0.0] if name == "elbow" else [1.0, 0.0, 0.0])
    return Joint(
        axes=axes,
        axis_a=axis_a if found is None else np.array(found.axis_near),
        axis_b=axis_b if found is None else np.array(found.axis_far),
        carrying_rad=0.0 if found is None else mirrored(found.carrying_rad, side),
        lever_a=rotation.rotate(from_a, told_a) if lever_a is None else lever_a,
        lever_b=rotation.rotate(from_b, told_b) if lever_b is None else lever_b,
    )


def mirrored(carrying_rad: float, side: Side) -> float:
    """Return the elbow's carrying angle as an angle between its axes, of an angle that means the same on both
    sides."""
    return carrying_rad if side == "right" else -carrying_rad


def places(side: Side, lengths: ArmLengths) -> tuple[Floats, Floats, Floats]:
    """Return where the sensors of upper arm, forearm and hand are worn as told: (3,) m from the joint above,
    in segment axes."""
    out = 1.0 if side == "right" else -1.0
    return (
        np.array([0.0, ABOVE_EPICONDYLE_M - lengths.upper_arm, out * OFF_UPPER_ARM_M]),
        np.array([0.0, ABOVE_WRIST_M - lengths.forearm, out * OFF_FOREARM_M]),
        np.array([0.0, -ON_HAND * lengths.hand, out * OFF_HAND_M]),
    )


def levers(joint: str, side: Side, lengths: ArmLengths) -> tuple[Floats, Floats]:
    """Return the way (3,) m from the sensor above a joint, and from the one below it, to its centre: in
    segment axes, for sensors worn as told."""
    upper, forearm, hand = places(side, lengths)
    if joint == "elbow":
        return np.array([0.0, -lengths.upper_arm, 0.0]) - upper, -forearm
    return np.array([0.0, -lengths.forearm, 0.0]) - forearm, -hand
