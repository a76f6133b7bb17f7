"""A guided calibration: a pose, then movements, one after another, each until enough of it was seen. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import radians
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from brachium_fusion.motion_record import MotionRecord
from brachium_fusion.pose import Alignment
from brachium_fusion.pose_watch import HeldPose, Moving, PoseWatch, PoseWish
from brachium_fusion.sensor_to_segment import SensorRecord, Span, align_segments
from brachium_fusion.timeline import Reading
from brachium_fusion.track import SegmentTrack

Motion = Literal["elbow-flexion", "pronation", "free"]
MOTIONS: tuple[Motion, ...] = get_args(Motion)

WORDS: dict[str, str] = {
    "n-pose": "stand or sit still, the arms hanging, palms at the thighs",
    "table": "lay the forearm on a table, the elbow at a right angle, the thumb up, and keep still",
    "given": "hold the pose that was measured, and keep still",
    "elbow-flexion": "bend and straighten the elbow slowly, five times, then hold still",
    "pronation": "with the elbow bent, turn the palm up and down, five times, then hold still",
    "free": "move the arm freely: reach, bend, turn, raise it forwards and sideways",
}
"""What to do, for each step."""

RECORD_NS = 40_000_000
"""Rows are this far apart: movement of arms is far slower."""
ENOUGH_RAD: dict[Motion, float] = {
    "elbow-flexion": radians(500.0),
    "pronation": radians(400.0),
    "free": radians(900.0),
}
"""The forearm's turning, all added up, that makes a movement: five times there and back, not quite."""
REST_NS = 800_000_000
"""Of stillness ends a movement of which enough was seen."""
FREE_S, ONLY_FREE_S = 10.0, 30.0
"""Free movement takes so long; longer where no other movement is asked for."""
LONGEST_NS: dict[Motion, int] = {
    "elbow-flexion": 30_000_000_000,
    "pronation": 30_000_000_000,
    "free": 60_000_000_000,
}
PLENTY = 2.0
"""So many times what is enough ends a movement even of one who does not hold still."""
LEAST = 0.3
"""Less than this part of what is wanted is no movement: refused."""
POSE_SHARE, FITTING = 0.2, 0.95
"""Progress after the pose, and while the alignment is worked out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidedWish:
    """What was asked for."""

    pose: PoseWish
    motions: tuple[Motion, ...] = MOTIONS


class Told(NamedTuple):
    """What the person should do now, and how far it has come."""

    step: str
    progress: float
    words: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRequest:
    """All that an alignment is found from; `fit` finds it, wherever there is time for it."""

    from_ns: int
    records: Mapping[str, SensorRecord]
    times_ns: Sequence[int]
    spans: Sequence[Span]
    facing_deg: float | None = None

    def fit(self) -> dict[str, Any]:
        """Return the data of the change `align`."""
        rate_hz = 1e9 / float(np.median(np.diff(self.times_ns)))
        alignment = align_segments(self.records, self.spans, rate_hz, facing_deg=self.facing_deg)
        return align_change(alignment) | {
            "from_ns": self.from_ns,
            "spans": [
                [s.kind, self.times_ns[s.first], self.times_ns[s.end - 1], dict(s.angles_deg)]
                for s in self.spans
            ],
        }


def align_change(alignment: Alignment) -> dict[str, Any]:
    """Return the data of the change `align`, without numbers that are none."""
    scores = {name: value for name, value in alignment.scores.items() if np.isfinite(value)}
    return {"alignment": replace(alignment, scores=scores).state()}


@dataclass(slots=True)
class _Step:
    """The movement that is seen now."""

    index: int = -1
    """-1: the pose."""
    first: int = 0
    begun_ns: int = 0
    turned: float = 0.0
    still_since_ns: int = 0
    told: float = -1.0


@dataclass(slots=True)
class Guided:
    """One guided calibration as it runs."""

    wish: GuidedWish
    _watch: PoseWatch = field(init=False)
    _record: MotionRecord = field(default_factory=MotionRecord)
    _spans: list[Span] = field(default_factory=list)
    _step: _Step = field(default_factory=_Step)
    _last_ns: int = 0

    def __post_init__(self) -> None:
        """Begin with the pose."""
        self._watch = PoseWatch(self.wish.pose)

    def forget(self, segment: str) -> None:
        """Leave aside what a sensor showed that is not there any more."""
        self._watch.forget(segment)
        self._record.forget(segment)

    def see(
        self, now: int, live: Mapping[str, Reading], tracks: Mapping[str, SegmentTrack]
    ) -> Told | Moving | FitRequest | str | None:
        """Take the sensors that are there at an instant.

        Return what to do now or who moves when that changed, in the end what to find the alignment from, or
        why it was refused.
        """
        if now - self._last_ns < RECORD_NS:
            return None
        since_s = 1e-9 * (now - self._last_ns) if self._last_ns else 0.0
        self._last_ns = now
        self._record.take(now, live, tracks)
        if self._step.index < 0:
            return self._pose(now, live, tracks)
        return self._movement(now, live, tracks, since_s)

    def _pose(
        self, now: int, live: Mapping[str, Reading], tracks: Mapping[str, SegmentTrack]
    ) -> Told | Moving | FitRequest | str | None:
        held = self._watch.see(now, live, {s: tracks[s].still_since_ns for s in live})
        if not isinstance(held, HeldPose):
            return held
        count = max(len(quats) for quats in held.world_from_sensor.values())
        end = len(self._record.times_ns)
        pose = self.wish.pose
        self._spans.append(Span(kind=pose.pose, first=end - count, end=end, angles_deg=dict(pose.angles_deg)))
        return self._next(now)

    def _next(self, now: int) -> Told | FitRequest:
        index = self._step.index + 1
        if index >= len(self.wish.motions):
            return self._request()
        self._step = _Step(index=index, first=len(self._record.times_ns), begun_ns=now)
        return self._told(0.0)

    def _request(self) -> FitRequest:
        return FitRequest(
            from_ns=self.wish.pose.from_ns, records={}, times_ns=self._record.times_ns, spans=self._spans
        )

    def _movement(
        self, now: int, live: Mapping[str, Reading], tracks: Mapping[str, SegmentTrack], since_s: float
    ) -> Told | FitRequest | str | None:
        step, motion = self._step, self.wish.motions[self._step.index]
        forearms = [s for s in live if s.startswith("forearm")]
        step.turned += max((self._turned(s, now, tracks[s], since_s) for s in forearms), default=0.0)
        seen = min(1.0, step.turned / ENOUGH_RAD[motion])
        if motion == "free":
            wanted_s = ONLY_FREE_S if len(self.wish.motions) == 1 else FREE_S
            seen = min(seen, 1e-9 * (now - step.begun_ns) / wanted_s)
        still = all(now - tracks[s].still_since_ns >= REST_NS for s in live)
        late = now - step.begun_ns >= LONGEST_NS[motion]
        plenty = step.turned >= PLENTY * ENOUGH_RAD[motion]
        if (seen >= 1.0 and (still or plenty or motion == "free")) or (late and seen >= LEAST):
            end = len(self._record.times_ns)
            self._spans.append(Span(kind=motion, first=step.first, end=end))
            return self._next(now)
        if late:
            return f"hardly any movement was seen while waiting for: {WORDS[motion]}; ask again"
        if seen >= step.told + 0.1:
            return self._told(seen)
        return None

    def _turned(self, segment: str, now: int, track: SegmentTrack, since_s: float) -> float:
        """Return by how much a sensor turned since the last instant, rad."""
        motion = track.timeline.motion_at(now)
        if motion is not None:
            return since_s * float(np.linalg.norm(motion.gyr))
        return self._record.turned(segment) if track.info.orientation_only else 0.0

    def _told(self, seen: float) -> Told:
        step = self._step
        step.told = seen
        motion = self.wish.motions[step.index]
        share = (FITTING - POSE_SHARE) / len(self.wish.motions)
        return Told(motion, POSE_SHARE + share * (step.index + seen), WORDS[motion])

    def complete(
        self, request: FitRequest, tracks: Mapping[str, SegmentTrack], facing_deg: float | None
    ) -> FitRequest:
        """Return the request with what the sensors did."""
        return replace(request, records=self._record.records(tracks), facing_deg=facing_deg)

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "motions": list(self.wish.motions),
            "watch": self._watch.state(),
            "record": self._record.state(),
            "spans": [asdict(span) for span in self._spans],
            "step": asdict(self._step),
            "last_ns": self._last_ns,
        }

    @staticmethod
    def from_state(state: dict[str, Any]) -> "Guided":
        """Return the guided calibration whose state this is."""
        watch = PoseWatch.from_state(state["watch"])
        guided = Guided(GuidedWish(pose=watch.wish, motions=tuple(state["motions"])))
        guided._watch = watch
        guided._record.restore(state["record"])
        guided._spans = [Span(**span) for span in state["spans"]]
        guided._step, guided._last_ns = _Step(**state["step"]), state["last_ns"]
        return guided
