"""One person's sensors: which instant can be solved, what each segment's orientation is there, and when a
calibration pose was held. Pure; every decision rests on this subject's own messages, in order of arrival, and
on changes stamped with the instant from which they hold. So a recording of them gives the same again.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from brachium_body.segments import SEGMENTS, Side
from brachium_fusion.arm_knowledge import Centres
from brachium_fusion.binding import Binding, Known
from brachium_fusion.calibrated import recalibrated
from brachium_fusion.calibrating import Calibrating
from brachium_fusion.plain_samples import plain_samples, samples_of
from brachium_fusion.pose import Alignment
from brachium_fusion.session_terms import lengths_of
from brachium_fusion.settings import Change, Settings
from brachium_fusion.timeline import Reading, Shift
from brachium_fusion.track import SegmentTrack
from brachium_wire.codec import Drop
from brachium_wire.messages import Calibration, Info, Session
from brachium_wire.samples import Samples

Floats = npt.NDArray[np.float64]

HELD_NS = 150_000_000
"""A segment this far behind the newest arrival, beyond its own batches, no longer holds the others up."""
MISSING_NS = 500_000_000
"""A segment this far behind is missing: its last orientation says nothing any more."""
HOST_GONE_NS = 2_000_000_000
"""Another host may take a subject over once the first was silent for this long."""
WAITING_BATCHES = 64
"""Batches kept for a segment whose info has not come yet."""


class Instant(NamedTuple):
    """What is known of every segment at one tick."""

    time_ns: int
    readings: dict[str, Reading | None]
    """None: the segment has a sensor, and it is missing."""
    received_ns: int
    alignment: Alignment | None
    session: Session
    shifts: Mapping[Side, Shift]
    """Of the shoulders that are followed."""


class Subject:
    """All that changes for one person. `feed` takes batches, `instants` gives what became solvable."""

    def __init__(self, settings: Settings, announce: Callable[[Calibration], None]) -> None:
        self._settings = settings
        self._period_ns = round(1e9 / settings.rate_hz)
        self._times: deque[int] | None = None
        self._between: frozenset[int] = frozenset()
        self._next_ns: int | None = None
        self._ended = False
        self._pending: list[Change] = []
        self._unclaimed: dict[str, deque[Samples]] = {}
        self._refused: dict[str, Info] = {}
        """What a second host said, for when the first is gone."""
        self._done_ns = 0
        self._begun_ns = 0
        self._host: str | None = None
        self.calibrating = Calibrating(settings.auto_pose, announce)
        self.tracks: dict[str, SegmentTrack] = {}
        self.received_ns = 0
        self.session = Session()
        self.drops: Counter[str] = Counter()
        self.revision = 0
        """Counts replacements of sensors, session and alignment."""
        self.stated: Centres = {}
        """What a capture says of joints."""
        self.binding = Binding(settings.rate_hz)
        self.frames: dict[Side, object] = {}
        """Kept by arms.py for each arm between two calibrations; follows from the rest."""

    # -- what comes in -----------------------------------------------------------------------------------

    def inform(self, segment: str, info: Info) -> None:
        """Take what is known of a segment's sensor. A changed sensor begins a new track."""
        if segment not in SEGMENTS:
            self.drops[Drop.UNKNOWN_SEGMENT.value] += 1
            return
        if self._host is not None and info.host != self._host:
            self.drops[Drop.SECOND_HOST.value] += 1
            if any(other.host != info.host for other in self._refused.values()):
                self._refused.clear()
            self._refused[segment] = info
            return
        self._host = info.host
        track = self.tracks.get(segment)
        again = track is not None and recalibrated(track.info, info)
        if track is not None and again and track.info.calibration == info.calibration:
            track.info = info
            return
        if track is not None:
            worn = info.origin == "worn" or again
            self._lose(segment, mounting=not worn or track.info.node != info.node)
            if (
                not worn
                and self.calibrating.alignment is not None
                and not self.calibrating.alignment.mounting
            ):
                self._begin_anew()
        self.tracks[segment] = SegmentTrack(info, self._settings.filter, self._settings.magnetometer)
        self.calibrating.forget(segment)
        self.revision += 1
        for samples in self._unclaimed.pop(segment, ()):
            self.feed(segment, samples)

    def _lose(self, segment: str, *, mounting: bool) -> None:
        """Forget how a new sensor is mounted; doubt the heading of one whose filter began anew."""
        track, known = self.tracks[segment], self.calibrating.alignment
        if known is None or segment not in known.mounting:
            return
        if mounting:
            rest = {s: q for s, q in known.mounting.items() if s != segment}
            self.calibrating.alignment = replace(known, mounting=rest)
        elif not track.shares_world:
            self.calibrating.alignment = replace(known, assumed=known.assumed | {segment})
        self.revision += 1

    def _begin_anew(self) -> None:
        """Nobody wears these sensors: another run of them is another wearer, who stands in a pose again."""
        if self.calibrating.alignment is not None:
            self.calibrating.begin_anew(self.next_tick_ns())
            self.revision += 1

    def _take_over(self, now_ns: int) -> None:
        """Let the second host in, once nothing came from the first for long."""
        if any(now_ns - track.last_ns <= HOST_GONE_NS for track in self.tracks.values()):
            return
        refused, self._refused = self._refused, {}
        for segment in list(self.tracks):
            self._lose(segment, mounting=segment not in refused)
        self.tracks.clear()
        self._host, self._next_ns, self.received_ns = None, None, 0
        for segment, info in refused.items():
            self.inform(segment, info)

    def feed(self, segment: str, samples: Samples) -> None:
        """Take a batch of samples of one segment."""
        if self._refused:
            self._take_over(samples.received_ns)
        track = self.tracks.get(segment)
        if track is None:
            if segment not in SEGMENTS:
                self.drops[Drop.UNKNOWN_SEGMENT.value] += len(samples)
                return
            waiting = self._unclaimed.setdefault(segment, deque(maxlen=WAITING_BATCHES))
            if len(waiting) == WAITING_BATCHES:
                self.drops[Drop.NO_INFO.value] += len(waiting[0])
            waiting.append(samples)
            return
        restarts, reboots = track.restarts, track.reboots
        if not track.feed(samples, self.drops):
            return
        self.received_ns = max(self.received_ns, samples.received_ns)
        if self._next_ns is None:
            self._next_ns, self._begun_ns = self._first_tick(track.timeline.first_ns), samples.received_ns
        if track.reboots != reboots and track.info.origin != "worn":
            self._begin_anew()
        if track.restarts != restarts:
            self._lose(segment, mounting=False)

    def apply(self, change: Change) -> None:
        """Take a change that holds from `change.from_ns` on."""
        self._pending.append(change)
        self._pending.sort(key=lambda c: c.from_ns)

    def pending(self) -> list[Change]:
        """Return the changes whose instant has not come."""
        return list(self._pending)

    def use_instants(self, times_ns: Sequence[int], between: Sequence[int] = ()) -> None:
        """Solve at these instants instead of the grid; go through those `between` without giving them."""
        self._times = deque(sorted({*times_ns, *between}))
        self._between = frozenset(between) - frozenset(times_ns)
        if len(times_ns) > 1:
            self.binding.rate_hz = 1e9 / float(np.median(np.diff(times_ns)))

    def finish(self) -> None:
        """Nothing more will come: what was waited for is missing."""
        self._ended = True

    # -- what can be solved ------------------------------------------------------------------------------

    def next_tick_ns(self) -> int:
        """Return the next instant that will be solved, 0 before the first sample."""
        return self._next_ns or 0

    def instants(self) -> Iterator[Instant]:
        """Yield every instant that can be solved now, in order."""
        solved = None
        while (now := self._next_ns) is not None:
            readings = self._readings(now)
            if readings is None:
                break
            if not any(readings.values()):
                self._next_ns = self._skip(now)
                continue
            self._next_ns, self._done_ns = self._following(now), now
            self._apply_pending(now)
            if self.calibrating.see(now, readings, self.tracks, self.session):
                self.revision += 1
            shifts: dict[Side, Shift] = {}
            if self._settings.binds:
                readings, shifts, slips = self.binding.correct(now, readings, self._known(), self.revision)
                for slip in slips:
                    self.calibrating.warn(now, slip.text)
            solved = now
            if now in self._between:
                continue
            yield Instant(
                now,
                readings,
                max(r.received_ns for r in readings.values() if r is not None),
                self.calibrating.alignment,
                self.session,
                shifts,
            )
        if solved is not None:
            for track in self.tracks.values():
                track.timeline.forget(self._next_ns or solved)

    def _readings(self, now: int) -> dict[str, Reading | None] | None:
        """Return every segment's orientation, or None while one that is alive has not come so far."""
        reached = False
        for track in self.tracks.values():
            if track.last_ns >= now:
                reached = True
            elif self._ended:
                continue
            elif self._behind(track) <= HELD_NS if track.last_ns else self._beginning():
                return None
        if not reached:
            return None
        readings: dict[str, Reading | None] = {}
        for segment, track in self.tracks.items():
            if track.last_ns >= now:
                readings[segment] = track.timeline.at(now)
            elif track.last_ns:
                gone = self._ended or self._behind(track) > MISSING_NS
                readings[segment] = None if gone else track.timeline.latest()
        return readings

    def _beginning(self) -> bool:
        """Return whether a sensor that is known and silent may still begin together with the others."""
        return self.received_ns - self._begun_ns <= HELD_NS

    def _behind(self, track: SegmentTrack) -> int:
        """Return how far a sensor is behind the newest arrival, beyond what its own batches explain."""
        return self.received_ns - track.last_ns - track.batch_ns

    def _first_tick(self, time_ns: int) -> int | None:
        if self._times is None:
            return -(-max(time_ns, self._done_ns + 1) // self._period_ns) * self._period_ns
        return self._following(0)

    def _following(self, now: int) -> int | None:
        if self._times is None:
            return now + self._period_ns
        return self._times.popleft() if self._times else None

    def _skip(self, now: int) -> int | None:
        """Return the next tick after a stretch in which nothing was measured."""
        if self._times is not None:
            return self._following(now)
        nexts = (track.timeline.next_sample_ns(now) for track in self.tracks.values())
        begins = [t for t in nexts if t is not None]
        return max(
            now + self._period_ns, -(-min(begins) // self._period_ns) * self._period_ns if begins else 0
        )

    def _known(self) -> Known:
        alignment, lengths = self.calibrating.alignment, lengths_of(self.session)
        return Known(alignment, lengths, self.stated, self.tracks, self._settings.shoulder)

    # -- changes and poses -------------------------------------------------------------------------------

    def _apply_pending(self, now: int) -> None:
        while self._pending and self._pending[0].from_ns <= now:
            change = self._pending.pop(0)
            if change.kind == "session":
                self.session = msgspec.convert(change.data, Session)
                self.revision += 1
            elif self.calibrating.change(now, change.kind, change.data):
                self.revision += 1

    # -- snapshot ----------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "next_ns": self._next_ns,
            "done_ns": self._done_ns,
            "begun_ns": self._begun_ns,
            "refused": {s: msgspec.to_builtins(info) for s, info in self._refused.items()},
            "unclaimed": {s: [plain_samples(b) for b in row] for s, row in self._unclaimed.items()},
            "host": self._host,
            "pending": [[c.from_ns, c.kind, c.data] for c in self._pending],
            "calibrating": self.calibrating.state(),
            "tracks": {s: [msgspec.to_builtins(t.info), t.state()] for s, t in self.tracks.items()},
            "received_ns": self.received_ns,
            "session": msgspec.to_builtins(self.session),
            "binding": self.binding.state(self._known(), self.revision) if self._settings.binds else {},
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the subject whose state this is would have."""
        self._next_ns, self._host = state["next_ns"], state["host"]
        self._done_ns, self._begun_ns = state["done_ns"], state["begun_ns"]
        self._refused = {s: msgspec.convert(info, Info) for s, info in state["refused"].items()}
        self._unclaimed = {
            s: deque((samples_of(b) for b in batches), WAITING_BATCHES)
            for s, batches in state["unclaimed"].items()
        }
        self._pending = [Change(*c) for c in state["pending"]]
        self.calibrating.restore(state["calibrating"])
        self.tracks = {}
        for segment, (info, track_state) in state["tracks"].items():
            track = SegmentTrack(
                msgspec.convert(info, Info), self._settings.filter, self._settings.magnetometer
            )
            track.restore(track_state)
            self.tracks[segment] = track
        self.received_ns = state["received_ns"]
        self.session = msgspec.convert(state["session"], Session)
        self.revision += 1
        if self._settings.binds:
            self.binding.restore(state["binding"], self._known(), self.revision)
