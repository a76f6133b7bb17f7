"""One subject's arms: sensors that share a joint correct one another's orientation at each instant. Pure."""

from collections.abc import Mapping
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body.lengths import ArmLengths
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.arm_knowledge import Centres, arm_knowledge
from brachium_fusion.live_arm import LiveArm
from brachium_fusion.live_shoulder import RestMean
from brachium_fusion.pose import Alignment
from brachium_fusion.strap_slip import Slip
from brachium_fusion.timeline import Motion, Reading, SensorNow, Shift, at_instant
from brachium_fusion.track import STILL_RAD_S, SegmentTrack

Floats = npt.NDArray[np.float64]
Readings = dict[str, Reading | None]


class Known(NamedTuple):
    """On what an arm's estimators rest; they begin anew when it changes."""

    alignment: Alignment | None
    lengths: ArmLengths
    stated: Centres
    tracks: Mapping[str, SegmentTrack]
    shoulder: bool
    """Follow the shoulder."""


class Bound(NamedTuple):
    """What the joints make of an instant."""

    readings: Readings
    shifts: dict[Side, Shift]
    slips: list[Slip]
    """Straps that were found to have slipped at this instant."""


class Binding:
    """The estimators of both arms."""

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        """Of the instants."""
        self._revision = -1
        self._arms: dict[Side, tuple[Any, LiveArm]] = {}
        self._rests: dict[str, RestMean] = {}
        self._slipped: set[str] = set()

    def correct(self, now: int, readings: Readings, known: Known, revision: int) -> Bound:
        """Return the readings at an instant, corrected where a joint tells more; a sensor whose strap slipped
        is disturbed until the next calibration."""
        self._refresh(known, revision)
        if not self._rests:
            return Bound(readings, {}, [])
        followed = _bridged(now, readings, known)
        motions = self._motions(now, followed, known)
        result, shifts, slips = dict(readings), dict[Side, Shift](), list[Slip]()
        for side, (_, arm) in self._arms.items():
            if not arm.segments:
                continue
            sensors = {
                segment: SensorNow(_turned(known.alignment, segment, followed[segment]), motions[segment])
                for segment in arm.segments
                if segment in motions
            }
            found = arm.step(now, sensors, self._rests)
            if found.shift is not None and not any(readings[s] is None for s in arm.shoulder_segments):
                shifts[side] = found.shift
            if found.slip is not None:
                slips.append(found.slip)
                self._slipped.add(found.slip.segment)
            for segment, turned in found.world_from_sensor.items():
                reading = readings[segment]
                if reading is None:
                    continue
                q = _about_up(-_turn(known.alignment, segment), turned)
                result[segment] = reading._replace(before=q, after=q, fraction=0.0)
        for segment in self._slipped:
            reading = result.get(segment)
            if reading is not None and reading.quality == "good":
                result[segment] = reading._replace(quality="disturbed")
        return Bound(result, shifts, slips)

    def heading_sd(self, side: Side) -> tuple[float | None, float | None]:
        """Return the standard deviation of the heading across elbow and wrist, rad; None: not estimated."""
        if side not in self._arms:
            return None, None
        arm = self._arms[side][1]
        return arm.heading_sd("elbow"), arm.heading_sd("wrist")

    def _motions(self, now: int, readings: Readings, known: Known) -> dict[str, Motion]:
        """Return the motion of every raw sensor that is there, and note who is still."""
        motions = {}
        for segment, rest in self._rests.items():
            motion = None
            if readings.get(segment) is not None:
                motion = known.tracks[segment].timeline.motion_at(now, unseen=True)
            if motion is None:
                rest.see(np.zeros(3), still=False)
            else:
                motions[segment] = motion
                rest.see(motion.gyr, still=float(motion.gyr @ motion.gyr) <= STILL_RAD_S**2)
        return motions

    def _refresh(self, known: Known, revision: int) -> None:
        """Let arms about which something else is known now begin anew."""
        if revision == self._revision:
            return
        self._revision = revision
        raw = {s: t for s, t in known.tracks.items() if not t.info.orientation_only}
        magnetometers = frozenset(s for s, track in raw.items() if track.magnetometer)
        turns = {} if known.alignment is None else known.alignment.heading
        for side in SIDES:
            segments = arm_segments(side)
            knowledge = arm_knowledge(side, known.alignment, known.lengths, known.stated, magnetometers)
            if not known.shoulder:
                knowledge = knowledge.without_shoulder()
            basis = (
                knowledge.plain(),
                [(s, s in raw, s in magnetometers, turns.get(s, 0.0)) for s in ("sternum", *segments)],
            )
            if sum(s in raw for s in segments) < 2:
                self._arms.pop(side, None)
            elif side not in self._arms or self._arms[side][0] != basis:
                arm = LiveArm(segments, knowledge, self.rate_hz, magnetometers, frozenset(raw))
                self._arms[side] = basis, arm
                self._slipped -= set(segments)
        worn = {s for _, arm in self._arms.values() for s in arm.segments if s in raw}
        self._rests = {s: self._rests.get(s) or RestMean() for s in sorted(worn)}

    def state(self, known: Known, revision: int) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        self._refresh(known, revision)
        return {
            "arms": {side: arm.state() for side, (_, arm) in self._arms.items()},
            "slipped": sorted(self._slipped),
            "rests": {segment: rest.state() for segment, rest in self._rests.items()},
        }

    def restore(self, state: dict[str, Any], known: Known, revision: int) -> None:
        """Go on as the arms whose state this is would have."""
        self._refresh(known, revision)
        for side, (_, arm) in self._arms.items():
            arm.restore(state["arms"][side])
        self._slipped = set(state["slipped"])
        for segment, rest in self._rests.items():
            rest.restore(state["rests"][segment])


def _bridged(now: int, readings: Readings, known: Known) -> Readings:
    """Return the readings with those in gaps that are bridged but not shown: who follows a sensor sample by
    sample goes on through them."""
    if None not in readings.values():
        return readings
    return {
        s: known.tracks[s].timeline.at(now, unseen=True) if reading is None else reading
        for s, reading in readings.items()
    }


def _turned(alignment: Alignment | None, segment: str, reading: Reading | None) -> Floats:
    """Return the orientation (4,) at the instant, its heading as the pose set it."""
    assert reading is not None
    return _about_up(_turn(alignment, segment), at_instant(reading))


def _turn(alignment: Alignment | None, segment: str) -> float:
    return 0.0 if alignment is None else alignment.heading.get(segment, 0.0)


def _about_up(angle: float, q: Floats) -> Floats:
    """Return rotation.multiply(about(2, angle), q) of one rotation (4,), at a tenth of the time."""
    if angle == 0.0:
        return q
    c, s = cos(0.5 * angle), sin(0.5 * angle)
    w, x, y, z = q.tolist()
    return np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
