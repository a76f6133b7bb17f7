"""The set that runs: counted live by the measure that the report uses. Pure."""

from dataclasses import dataclass

import numpy as np

from brachium_viewer.exercises import exercise
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.metrics.arm_motion import MEASURED
from brachium_viewer.metrics.repetitions import FLOOR_DEG, MovementSet, movement_set
from brachium_wire.messages import Skeleton

EVERY_S = 0.2
"""Counting anew so often is often enough for an eye."""
LIMIT_HELD_S = 0.1
"""Beyond its limit for less, an angle may be a jolt."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """What a page shows of the running set. Angles in deg as people read them."""

    repetitions: int
    tries: int
    angle_deg: float | None
    """Now; None while it is not measured."""
    last_deg: float | None
    """How far the last repetition went."""
    best_deg: float | None
    """How far the best one went."""
    over_limit: bool
    """The angle is beyond what must not be passed."""
    done: bool
    """As many repetitions as were wanted."""
    seconds: float


class RunningSet:
    """One set from its first mark on; give it every skeleton of its arm."""

    def __init__(self, begins: ExerciseBegins, from_ns: int) -> None:
        self.begins, self.from_ns = begins, from_ns
        self._exercise = exercise(begins.exercise)
        self._sign = 1.0 if self._exercise.rises else -1.0
        self._times: list[float] = []
        self._values: list[float] = []
        self._counted_s = -EVERY_S
        self._found = MovementSet(repetitions=(), tries=())
        self._tops: list[float] = []
        self._over_since: float | None = None

    def feed(self, skeleton: Skeleton) -> None:
        """Take one skeleton; those of another arm or from before the set are left out."""
        now = (skeleton.time_ns - self.from_ns) / 1e9
        if skeleton.side != self.begins.side or now < 0 or (self._times and now <= self._times[-1]):
            return
        name = self._exercise.angle
        measured = name in skeleton.angles and skeleton.assumed.get(name, "good") in MEASURED
        value = self._sign * float(np.degrees(skeleton.angles[name])) if measured else np.nan
        self._times.append(now)
        self._values.append(value)
        self._watch_limit(now, value)
        if now - self._counted_s >= EVERY_S:
            self._counted_s = now
            times, values = np.array(self._times), np.array(self._values)
            self._found = movement_set(times, values, FLOOR_DEG)
            peaks = [r.peak_s for r in self._found.repetitions]
            self._tops = [float(top) for top in np.interp(peaks, times, values)] if peaks else []

    def progress(self) -> Progress:
        """Return where the set stands."""
        now = self._values[-1] if self._values else np.nan
        known = [self._sign * top for top in self._tops if np.isfinite(top)]
        wanted = self.begins.repetitions
        over = self._over_since is not None and self._times[-1] - self._over_since >= LIMIT_HELD_S
        return Progress(
            repetitions=len(self._found.repetitions),
            tries=len(self._found.tries),
            angle_deg=self._sign * now if np.isfinite(now) else None,
            last_deg=known[-1] if known else None,
            best_deg=(max(known) if self._exercise.rises else min(known)) if known else None,
            over_limit=over,
            done=wanted is not None and len(self._found.repetitions) >= wanted,
            seconds=self._times[-1] if self._times else 0.0,
        )

    def _watch_limit(self, now: float, value: float) -> None:
        limit = self.begins.limit_deg
        if limit is None or not value > self._sign * limit:
            self._over_since = None
        elif self._over_since is None:
            self._over_since = now
