"""Frames to a machine against what the arm really did, around a fault. Pure."""

from collections import Counter
from dataclasses import dataclass
from functools import cache
from math import degrees
from typing import Any

import numpy as np

from brachium.can_wearer import TRUTH_NS, wearer
from brachium.shell import Failed
from brachium_nodes.can.arm_frames import Reason
from brachium_nodes.can.joint_table import JOINTS
from brachium_wire.messages import Skeleton

BEFORE_MS, GRACE_MS = 3000.0, 50.0
WRONG_DEG = 5.0
TRUTH_S = 30.0
"""Longer than any round lasts."""
LABELS = {name: "".join(word.capitalize() for word in name.split("_")) for name in JOINTS}
"""What a joint is called in the database."""
FEWEST_FRAMES = 100
MODULUS_MS = (1 << 32) - 1


class ShowsNothing(Failed):
    """A round in which nothing was valid before the fault: the machine was too busy to be in time."""


@dataclass(frozen=True, kw_only=True)
class FaultFigures:
    """What the frames of one round said."""

    fault: str
    frames_after: int
    """Sent more than 50 ms after the fault."""
    valid_before: float
    """Share of measured joints that were valid in the 3 s before it."""
    valid_after: int
    """Joints that were valid in frames sent more than 50 ms after it."""
    wrong_after: int
    """Of those, more than 5 deg from the truth of their sample's time."""
    worst_after_deg: float | None
    last_wrong_ms: float | None
    """After the fault: the last joint that was valid and wrong."""
    last_valid_ms: float | None
    worst_before_deg: float | None


@dataclass(frozen=True, kw_only=True)
class Frames:
    """What was heard on the bus: when, and decoded."""

    at_ns: list[int]
    read: list[dict[str, Any]]


def figures(
    fault: str, heard: Frames, host_ns: int, start_ns: int, fault_ns: int, told: list[Skeleton]
) -> FaultFigures:
    """Return what frames said before and after a fault.

    Times by the monotonic clock, at whose zero it was `host_ns`; the wearer began at `start_ns`; `told` is
    what the truth topic said. Raises ShowsNothing when nothing can be learnt from the frames.
    """
    made = _Truth(host_ns + start_ns, told)
    before, after = list[float](), list[tuple[float, float]]()
    frames_after = possible = 0
    for at_ns, frame in zip(heard.at_ns, heard.read, strict=True):
        since_ms = (at_ns - fault_ns) * 1e-6
        errors = made.errors(frame, host_ns + at_ns)
        if -BEFORE_MS < since_ms < 0.0:
            possible += len(made.joints)
            before += errors
        elif since_ms > GRACE_MS:
            frames_after += 1
            after += [(since_ms, error) for error in errors]
    if not before or frames_after < FEWEST_FRAMES:
        said = Counter(frame[f"{label}Reason"] for frame in heard.read for label in made.joints.values())
        reasons = {Reason(reason).name.lower(): count for reason, count in said.items()}
        raise ShowsNothing(
            f"{fault}: nothing was valid before, or no frames came after: {frames_after}; {reasons}"
        )
    wrong = [since for since, error in after if error > WRONG_DEG]
    return FaultFigures(
        fault=fault,
        frames_after=frames_after,
        valid_before=len(before) / possible,
        valid_after=len(after),
        wrong_after=len(wrong),
        worst_after_deg=max((error for _, error in after), default=None),
        last_wrong_ms=max(wrong, default=None),
        last_valid_ms=max((since for since, _ in after), default=None),
        worst_before_deg=max(before),
    )


class _Truth:
    """What the arm really did; checked against the truth topic, which ends with the router."""

    def __init__(self, origin_ns: int, told: list[Skeleton]) -> None:
        self.joints = LABELS
        self._origin_ns = origin_ns
        self._time_ns, self._angles = _movement()
        for skeleton in told[-50:]:
            for name in JOINTS:
                apart = abs(self._at(name, skeleton.time_ns) - skeleton.angles[name])
                if degrees(apart) > 0.5:
                    raise Failed(f"the truth topic says another {name}: {degrees(apart):.2f} deg apart")

    def errors(self, frame: dict[str, Any], now_ns: int) -> list[float]:
        """Return the errors of the valid joints of a frame, deg, at the time of its sample."""
        now_ms = now_ns // 1_000_000
        sample_ms = now_ms - (now_ms - frame["SampleTime"]) % MODULUS_MS
        return [
            degrees(abs(frame[label + "Angle"] - self._at(name, sample_ms * 1_000_000)))
            for name, label in self.joints.items()
            if frame[label + "Valid"]
        ]

    def _at(self, name: str, host_ns: int) -> float:
        return float(np.interp(host_ns - self._origin_ns, self._time_ns, self._angles[name]))


@cache
def _movement() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times, ns from the wearer's start, and each joint's angle, rad; all rounds move alike."""
    stream = wearer().skeleton_stream("right", 0, 0, TRUTH_NS)
    made = [next(stream) for _ in range(round(TRUTH_S * 1e9 / TRUTH_NS))]
    times = np.array([s.time_ns for s in made])
    return times, {name: np.unwrap([s.angles[name] for s in made]) for name in JOINTS}
