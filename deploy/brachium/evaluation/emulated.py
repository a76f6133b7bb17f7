"""Emulated recordings as capture folders, solved as users solve them, beside the truth."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from brachium.evaluation.loss import kept
from brachium.evaluation.solving import solved
from brachium.evaluation.trials import Trial, joints, spans
from brachium_body.angles import COLUMNS
from brachium_body.kinematics import JOINTS
from brachium_body.segments import Segment, Side, arm_segments
from brachium_fusion.capture_batches import ZERO_NS
from brachium_nodes.person import TRANSITION_S, Person
from brachium_nodes.session import ArmArrays, SensorArrays, SessionArrays, session_arrays
from brachium_wire import capture as captures
from brachium_wire.capture_settings import CaptureSettings
from brachium_wire.messages import Skeleton
from brachium_wire.tuples import quaternion

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimate:
    """What was solved, on the session's grid; NaN where nothing is known."""

    world_from_segment: dict[str, Floats]
    """By segment, (n, 4)."""
    positions: dict[str, Floats]
    """shoulder, elbow, wrist, hand in trunk axes from the chest, (n, 3) m."""
    angles: dict[str, Floats]
    """By column, (n,) rad."""
    shift: Floats
    """(n, 3) m in trunk axes."""
    warnings: tuple[str, ...] = ()


@dataclass
class Emulated:
    """One trial: its readings, its truth, and what each method makes of it, kept once it was asked for."""

    trial: Trial
    _solved: dict[str, Estimate] = field(default_factory=dict)

    @cached_property
    def begin_s(self) -> float:
        """Return when the exercise has begun, s: after standing, routine, and the way to its posture."""
        return Person(self.trial.settings()).begins_s + TRANSITION_S

    @cached_property
    def session(self) -> SessionArrays:
        """Return readings and truth on the grid of the trial's rate."""
        trial = self.trial
        return session_arrays(trial.settings(), self.begin_s + trial.seconds, raw=trial.uncalibrated)

    @property
    def truth(self) -> ArmArrays:
        """Return what the arm really does."""
        return self.session.arms[self.trial.side]

    @property
    def counts(self) -> slice:
        """Return the rows that count: those of the exercise."""
        return slice(round(self.begin_s * self.trial.rate_hz), None)

    def solved(self, method: str) -> Estimate:
        """Return what a method of METHODS makes of it."""
        if method not in self._solved:
            with TemporaryDirectory() as folder:
                self.write(Path(folder) / "capture")
                report = solved(Path(folder) / "capture", method, magnetometer=self.trial.magnetometer)
            self._solved[method] = estimate(
                report.skeletons, self.session.time_s, self.trial.side, tuple(report.warnings)
            )
        return self._solved[method]

    def sensors(self) -> dict[Segment, SensorArrays]:
        """Return the readings that are solved, by the segment that they are said to come from."""
        second = self.trial.stand_ins() if self.trial.second_set else {}
        return {
            segment: self.session.sensors[second.get(segment, segment)] for segment in self.trial.segments()
        }

    def write(self, folder: Path) -> None:
        """Write the recording as a capture folder."""
        trial, time_s = self.trial, self.session.time_s
        segments: dict[Segment, captures.CaptureSegment] = {}
        for name, sensor in self.sensors().items():
            there = kept(len(time_s), trial.loss, trial.burst, f"{trial.seed}/{name}")
            segments[name] = captures.CaptureSegment(
                t=time_s[there],
                rate_hz=trial.rate_hz,
                acc=sensor.acc[there],
                gyr=sensor.gyr[there],
                mag=sensor.mag[there] if trial.magnetometer else None,
            )
        captures.write(folder, capture_settings(self), segments)


def capture_settings(made: Emulated) -> CaptureSettings:
    """Return what a careful person would write into capture.toml."""
    trial, lengths = made.trial, made.session.lengths
    return CaptureSettings(
        side=trial.side,
        rate_hz=trial.rate_hz,
        lengths_m={
            "chest_to_shoulder": lengths.chest_to_shoulder,
            "upper_arm": lengths.upper_arm,
            "forearm": lengths.forearm,
            "hand": lengths.hand,
        },
        facing_deg=0.0 if trial.magnetometer else None,
        mounting={name: quaternion(s.nominal_mounting) for name, s in made.sensors().items()},
        calibration=spans(made.session.spans),
        joint=joints(made.sensors()),
        assumed_angles_deg=dict(trial.assumed_angles_deg),
    )


def estimate(
    skeletons: list[Skeleton], time_s: Floats, side: Side, warnings: tuple[str, ...] = ()
) -> Estimate:
    """Return skeletons of one arm as arrays on the grid `time_s` (n,), true time.

    While a segment is missing, what is assumed in its place is no estimate, and is left out.
    """
    n = len(time_s)
    row_of = {round(1e6 * t): i for i, t in enumerate(time_s.tolist())}
    worn: tuple[str, ...] = ("sternum", *arm_segments(side))
    segments: dict[str, Floats] = {name: np.full((n, 4), np.nan) for name in worn}
    positions = {j: np.full((n, 3), np.nan) for j in JOINTS}
    angles, shift = {c: np.full(n, np.nan) for c in COLUMNS}, np.full((n, 3), np.nan)
    for skeleton in skeletons:
        i = row_of.get(round(1e-3 * (skeleton.time_ns - ZERO_NS)))
        if i is None or skeleton.side != side:
            continue
        missing = any(pose.world_from_segment is None for pose in skeleton.segments.values())
        for name, pose in skeleton.segments.items():
            if pose.world_from_segment is not None:
                segments[name][i] = pose.world_from_segment
        for joint, place in skeleton.positions.items():
            if not missing or skeleton.assumed.get(joint) != "assumed":
                positions[joint][i] = place
        for column, value in skeleton.angles.items():
            if not missing or skeleton.assumed.get(column) != "assumed":
                angles[column][i] = value
        if skeleton.shoulder_shift is not None:
            shift[i] = skeleton.shoulder_shift
    return Estimate(
        world_from_segment=segments, positions=positions, angles=angles, shift=shift, warnings=warnings
    )
