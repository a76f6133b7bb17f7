"""One subject's arms: sensors that share a joint correct one another's orientation at each instant. Pure."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.lengths import ArmLengths
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.arm_knowledge import Centres, arm_knowledge
from brachium_fusion.live_arm import LiveArm, SensorNow
from brachium_fusion.pose import Alignment
from brachium_fusion.timeline import Reading
from brachium_fusion.track import SegmentTrack

Floats = npt.NDArray[np.float64]


class Known(NamedTuple):
    """On what an arm's estimators rest; they begin anew when it changes."""

    alignment: Alignment | None
    lengths: ArmLengths
    stated: Centres
    tracks: Mapping[str, SegmentTrack]


class Binding:
    """The estimators of both arms."""

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        """Of the instants."""
        self._revision = -1
        self._arms: dict[Side, tuple[Any, LiveArm]] = {}

    def correct(
        self, now: int, readings: dict[str, Reading | None], known: Known, revision: int
    ) -> dict[str, Reading | None]:
        """Return the readings at an instant, corrected where a joint tells more."""
        self._refresh(known, revision)
        if not self._arms:
            return readings
        result = dict(readings)
        for _, arm in self._arms.values():
            sensors = _sensors(now, arm, readings, known)
            for segment, turned in arm.step(now, sensors).items():
                reading = readings[segment]
                assert reading is not None
                q = rotation.multiply(_heading(known.alignment, segment, -1.0), turned)
                result[segment] = reading._replace(before=q, after=q, fraction=0.0)
        return result

    def _refresh(self, known: Known, revision: int) -> None:
        """Let arms about which something else is known now begin anew."""
        if revision == self._revision:
            return
        self._revision = revision
        for side in SIDES:
            knowledge = arm_knowledge(side, known.alignment, known.lengths, known.stated)
            segments = arm_segments(side)
            raw = {s for s in segments if s in known.tracks and not known.tracks[s].info.orientation_only}
            magnetometers = frozenset(s for s in raw if known.tracks[s].magnetometer)
            headings = [
                0.0 if known.alignment is None else known.alignment.heading.get(s, 0.0) for s in segments
            ]
            basis = (knowledge.plain(), sorted(magnetometers), headings)
            if len(raw) < 2:
                self._arms.pop(side, None)
            elif side not in self._arms or self._arms[side][0] != basis:
                self._arms[side] = basis, LiveArm(segments, knowledge, self.rate_hz, magnetometers)

    def state(self, known: Known, revision: int) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        self._refresh(known, revision)
        return {side: arm.state() for side, (_, arm) in self._arms.items()}

    def restore(self, state: dict[str, Any], known: Known, revision: int) -> None:
        """Go on as the arms whose state this is would have."""
        self._refresh(known, revision)
        for side, (_, arm) in self._arms.items():
            arm.restore(state[side])


def _sensors(
    now: int, arm: LiveArm, readings: Mapping[str, Reading | None], known: Known
) -> dict[str, SensorNow]:
    sensors = {}
    for segment in arm.segments:
        reading = readings.get(segment)
        motion = None if reading is None else known.tracks[segment].timeline.motion_at(now)
        if reading is None or motion is None:
            continue
        q = rotation.slerp(reading.before, reading.after, reading.fraction)
        sensors[segment] = SensorNow(rotation.multiply(_heading(known.alignment, segment, 1.0), q), motion)
    return sensors


def _heading(alignment: Alignment | None, segment: str, sign: float) -> Floats:
    turn = 0.0 if alignment is None else alignment.heading.get(segment, 0.0)
    return rotation.about(2, sign * turn)
