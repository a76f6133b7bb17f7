"""One arm of a whole recording: joints and shoulder smoothed over all samples. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side, arm_segments
from brachium_fusion.arm_knowledge import ArmKnowledge, Centres, arm_knowledge
from brachium_fusion.humeral_rotation import HumeralRotation
from brachium_fusion.joint_smoother import smooth_joint
from brachium_fusion.pose import Alignment
from brachium_fusion.sensor_to_segment import Span
from brachium_fusion.shoulder_model import NOT_OBSERVABLE_WITHOUT_STERNUM, ArmModel
from brachium_fusion.shoulder_smoother import smooth_shoulder
from brachium_fusion.shoulder_trunk import trunk_velocity
from brachium_fusion.timeline import Shift
from brachium_fusion.uniform import Uniform

Floats = npt.NDArray[np.float64]


@dataclass(slots=True, eq=False)
class Tracked:
    """One sensor on the grid of n instants."""

    samples: Uniform
    world_from_sensor: Floats
    """(n, 4); replaced as more is known."""
    disturbed: npt.NDArray[np.bool_]
    magnetometer: bool
    """Its world is the common one."""
    raw: bool
    """It delivers rates and forces."""

    @property
    def motion(self) -> tuple[Floats, Floats]:
        """Rates and forces (n, 3)."""
        return self.samples.gyr, self.samples.acc


@dataclass(slots=True, kw_only=True)
class ArmSolution:
    """What of one arm could be smoothed."""

    side: Side
    shift: Floats | None = None
    """(n, 2, 3) m, world: the shoulder's displacement and its standard deviation."""
    parts: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def at(self, rows: npt.NDArray[np.int64]) -> list[Shift | None]:
        """Return the shift at rows (m,)."""
        if self.shift is None:
            return [None] * len(rows)
        known = np.isfinite(self.shift[rows].sum(axis=(1, 2)))
        return [
            Shift(*self.shift[row]) if ok else None
            for row, ok in zip(rows.tolist(), known.tolist(), strict=True)
        ]


def solve_arm(
    side: Side,
    tracked: Mapping[str, Tracked],
    alignment: Alignment | None,
    lengths: ArmLengths,
    stated: Centres,
    pose: Span | None,
    rate_hz: float,
) -> ArmSolution:
    """Smooth one arm; the sensors' orientations in `tracked` are replaced by better ones."""
    solution = ArmSolution(side=side)
    upper, forearm, hand = arm_segments(side)
    magnetometers = [s for s, one in tracked.items() if one.magnetometer]
    knowledge = arm_knowledge(side, alignment, lengths, stated, magnetometers)
    if knowledge.elbow is not None:
        _bind("elbow", knowledge, upper, forearm, tracked, rate_hz, solution)
    if alignment is not None and pose is not None and knowledge.model is not None:
        _smooth_shoulder(knowledge, tracked, (upper, forearm), pose, rate_hz, solution)
        if "sternum" not in tracked and solution.shift is not None:
            solution.warnings.append(NOT_OBSERVABLE_WITHOUT_STERNUM)
    if knowledge.wrist is not None:
        _bind("wrist", knowledge, forearm, hand, tracked, rate_hz, solution)
    if knowledge.carrying_known and knowledge.model is not None:
        _untwist(knowledge.model, tracked, (upper, forearm))
    return solution


def _bind(
    name: str,
    knowledge: ArmKnowledge,
    near: str,
    far: str,
    tracked: Mapping[str, Tracked],
    rate_hz: float,
    solution: ArmSolution,
) -> None:
    joint = knowledge.elbow if name == "elbow" else knowledge.wrist
    a, b = tracked.get(near), tracked.get(far)
    if joint is None or a is None or b is None or not (a.raw and b.raw):
        return
    shared = a.magnetometer and b.magnetometer
    found = smooth_joint(
        joint,
        rate_hz,
        a.motion,
        b.motion,
        a.world_from_sensor,
        b.world_from_sensor,
        shared,
        None if shared else knowledge.heading_sd.get(name),
    )
    known = np.isfinite(found.world_from_b[:, 0]) & np.isfinite(found.world_from_a[:, 0])
    far_q = found.world_from_b
    if name == "wrist":  # the joint above has turned it already: the rest of the arm turns with it
        turn = rotation.heading(rotation.multiply(a.world_from_sensor, rotation.inverse(found.world_from_a)))
        far_q = rotation.multiply(rotation.about(2, turn), far_q)
    else:
        a.world_from_sensor = np.where(known[:, None], found.world_from_a, a.world_from_sensor)
    b.world_from_sensor = np.where(known[:, None], far_q, b.world_from_sensor)
    bound = [w for w, known_so in (("axes", joint.has_axes), ("lever arms", joint.has_levers)) if known_so]
    solution.parts[f"{name}_{solution.side[0]}"] = f"bound by {' and '.join(bound) or 'nothing'}"


def _smooth_shoulder(
    knowledge: ArmKnowledge,
    tracked: Mapping[str, Tracked],
    segments: tuple[str, str],
    pose: Span,
    rate_hz: float,
    solution: ArmSolution,
) -> None:
    assert knowledge.model is not None
    upper, forearm = (tracked.get(s) for s in segments)
    name = f"shoulder_{solution.side[0]}"
    if upper is None or forearm is None:
        return
    if not (upper.raw and forearm.raw):
        solution.refused[name] = "sensors that deliver orientation only show no shift of the shoulder"
        return
    try:
        found = smooth_shoulder(
            knowledge.model,
            rate_hz,
            upper.motion,
            forearm.motion,
            upper.world_from_sensor,
            forearm.world_from_sensor,
            slice(pose.first, pose.end),
            trunk_velocity=_trunk_velocity(knowledge, tracked, pose),
        )
    except ValueError as error:
        solution.refused[name] = str(error)
        return
    use = found.valid & np.isfinite(found.shift_m).all(axis=1)
    use[: pose.first] = False
    upper.world_from_sensor = np.where(use[:, None], found.world_from_upper, upper.world_from_sensor)
    forearm.world_from_sensor = np.where(use[:, None], found.world_from_forearm, forearm.world_from_sensor)
    missing = upper.samples.missing | forearm.samples.missing
    shift = np.stack([found.shift_m, found.sd_m], axis=1)
    shift[~use | missing] = np.nan
    solution.shift = shift
    solution.parts[name] = "error-state smoother of both sensors"


def _trunk_velocity(knowledge: ArmKnowledge, tracked: Mapping[str, Tracked], pose: Span) -> Floats | None:
    """Return how fast the trunk carries the shoulder, (n, 3) m/s; None without a sensor on the sternum."""
    sternum = tracked.get("sternum")
    if knowledge.trunk is None or sternum is None or not sternum.raw:
        return None
    bias = np.nanmean(sternum.samples.gyr[pose.first : pose.end], axis=0)
    rate = sternum.samples.gyr - bias
    return np.nan_to_num(trunk_velocity(sternum.world_from_sensor, rate, knowledge.trunk))


def _untwist(model: ArmModel, tracked: Mapping[str, Tracked], segments: tuple[str, str]) -> None:
    """Turn the upper arm about its length to where the bent forearm shows it."""
    upper, forearm = (tracked[s] for s in segments)
    bone = HumeralRotation(model.carrying_rad, model.side).correct(
        rotation.multiply(upper.world_from_sensor, model.sensor_from_upper_arm),
        rotation.multiply(forearm.world_from_sensor, model.sensor_from_forearm),
    )
    upper.world_from_sensor = rotation.multiply(bone, rotation.inverse(model.sensor_from_upper_arm))
