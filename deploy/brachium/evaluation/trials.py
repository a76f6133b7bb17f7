"""One emulated recording: who wears what, moves how, is calibrated by what, and what is lost. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
import numpy.typing as npt

from brachium_body.segments import SEGMENTS, Segment, Side, arm_segments, part_of
from brachium_nodes.exercises import EXERCISES
from brachium_nodes.magnetism import Surroundings
from brachium_nodes.places import Arrangement
from brachium_nodes.script import Span
from brachium_nodes.sensors import LEVELS, Level
from brachium_nodes.session import Reading, SensorArrays
from brachium_nodes.wearer import WearerSettings
from brachium_nodes.wearing import Wearing
from brachium_wire.capture_settings import CalibrationSpans, Functional, Joint, JointName, Motion, Pose
from brachium_wire.messages import Vector
from brachium_wire.tuples import vector

Floats = npt.NDArray[np.float64]

GUIDED = "calibration"
"""The routine that a wearer with two sensors or more is led through first."""
STANDING = (0.5, 3.5)
"""From when to when, of standing in neutral, the pose is taken, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One emulated recording."""

    exercise: str
    level: Level
    seed: int
    rate_hz: float = 50.0
    seconds: float = 20.0
    """Of the exercise itself; standing and the way to it come before."""
    side: Side = "right"
    parts: tuple[str, ...] = ("upper_arm", "forearm")
    magnetometer: bool = True
    loss: float = 0.0
    """Which part of the samples is lost."""
    burst: int = 1
    """How many at a time."""
    uncalibrated: tuple[Reading, ...] = ()
    """Sensor calibrations left out: gyr, acc, mag."""
    assumed_angles_deg: tuple[tuple[str, float], ...] = ()
    """What the exercise states of joints that no sensor sees."""
    routine: str = ""
    """What the wearer is led through first; its spans calibrate the recording."""
    arrangement: Arrangement = "usual"
    second_set: bool = False
    """Solve another set of sensors, worn on the same segments during the same movement."""
    disturbance_ut: float = 0.0
    """Of the magnetic field, as magnetism.Surroundings has it."""
    placement_deg: float | None = None
    """How far straps sit from their nominal mounting, 3-D rms; None: as the level has it."""
    more: tuple[tuple[str, float], ...] = ()
    """Other settings of the person, by name: height_m, carrying_deg, contracture_deg, sway_deg."""

    def segments(self) -> tuple[Segment, ...]:
        """Return the segments that carry a sensor."""
        worn: tuple[Segment, ...] = ("sternum", *arm_segments(self.side))
        return tuple(segment for segment in worn if part_of(segment) in self.parts)

    def stand_ins(self) -> dict[Segment, Segment]:
        """Return the nodes that carry the second set: by the segment that each sits on, its own name."""
        worn = self.segments()
        free: list[Segment] = [segment for segment in SEGMENTS if segment not in worn]
        return {seat: free[i] for i, seat in enumerate(worn)}

    def settings(self) -> WearerSettings:
        """Return the wearer."""
        errors, worn = LEVELS[self.level], self.segments()
        second = self.stand_ins() if self.second_set else {}
        if self.placement_deg is not None:
            errors = replace(errors, placement_deg=self.placement_deg)
        return WearerSettings(
            exercise=self.exercise,
            arms=self.side,
            level=self.level,
            errors=errors,
            seed=self.seed,
            rate_hz=self.rate_hz,
            segments=(*worn, *second.values()),
            routine=self.routine,
            wearing=Wearing(
                arrangement=self.arrangement, seats={name: seat for seat, name in second.items()}
            ),
            surroundings=Surroundings(disturbance_ut=self.disturbance_ut),
            **dict(self.more),  # type: ignore[arg-type]
        )


_UNSEEN = ("elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation")


def stated_angles(exercise: str) -> tuple[tuple[str, float], ...]:
    """Return what an exercise states of the joints beyond the shoulder, deg."""
    stated = EXERCISES[exercise].assumed_angles_deg
    return tuple((name, stated[name]) for name in _UNSEEN if name in stated)


def spans(done: Sequence[Span]) -> CalibrationSpans:
    """Return what the wearer did before the exercise as spans of a capture: the last pose, and movements."""
    pose = next(span for span in reversed(done) if span.kind in get_args(Pose))
    from_s, to_s = STANDING if pose.kind == "n-pose" and not pose.from_s else (pose.from_s, pose.to_s)
    return CalibrationSpans(
        pose=pose.kind,  # type: ignore[arg-type]
        from_s=from_s,
        to_s=to_s,
        angles_deg=dict(pose.angles_deg),
        functional=tuple(
            Functional(motion=span.kind, from_s=span.from_s, to_s=span.to_s)  # type: ignore[arg-type]
            for span in done
            if span.kind in get_args(Motion)
        ),
    )


def joints(sensors: Mapping[Segment, SensorArrays]) -> dict[JointName, Joint]:
    """Return the joints between sensors, and the shoulder: their centres as measured on the person."""
    found: dict[JointName, Joint] = {}
    known: tuple[tuple[JointName, int], ...] = (("shoulder", 3), ("elbow", 2), ("wrist", 2))
    for joint, axes in known:
        centres: dict[Segment, Vector] = {
            name: vector(sensor.levers[joint]) for name, sensor in sensors.items() if joint in sensor.levers
        }
        if len(centres) > 1 or (joint == "shoulder" and centres):
            found[joint] = Joint(axes=axes, centre_from=centres)
    return found
