"""The service's part of wear checks: who asked, what runs, what was found."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

import msgspec

from brachium_body.segments import SIDES, Side
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.wear_check import WearCheck
from brachium_fusion.wear_guide import WearGuide
from brachium_fusion.wear_passes import Outcome, plain
from brachium_wire import keys
from brachium_wire.codec import encode
from brachium_wire.messages import Answer, Calibration
from brachium_wire.sensor_records import WearProgress

log = logging.getLogger(__name__)

Reply = Callable[[bytes], None]


@dataclass(slots=True)
class _Run:
    guide: WearGuide
    reply: Reply
    examined: bool = False


class WearDesk:
    """One fusion's wear checks, one of each subject at a time. Only `_examine` runs on other threads."""

    def __init__(self, pipeline: Pipeline, room: str) -> None:
        self._pipeline, self._room = pipeline, room
        self._runs: dict[str, _Run] = {}
        self._progress: dict[str, WearProgress] = {}
        self._found: SimpleQueue[tuple[str, _Run, Outcome]] = SimpleQueue()
        self.news: set[str] = set()
        """Subjects of whom there is something to tell; whoever tells it clears them."""

    def begin(self, subject: str, arguments: dict[str, Any], reply: Reply) -> None:
        """Begin what is asked for and answer when it is over. Raises ValueError."""
        asked = checked_wear_wish(arguments)
        tracks = self._pipeline.subjects[subject].tracks
        infos = {segment: track.info for segment, track in tracks.items()}
        who = f"subject {subject!r} in room {self._room!r}"
        self._end(subject, "another wear check was asked for")
        run = self._runs[subject] = _Run(WearGuide(who, infos, asked, time.monotonic()), reply)
        self._tell(subject, run.guide.progress())

    def see(self, key: keys.Key, payload: bytes) -> None:
        """Take a message of a subject whose check runs; others do not concern it."""
        run = self._runs.get(key.subject)
        if run is not None and key.topic in ("imu", "info"):
            run.guide.take(key, payload, time.monotonic())
            self._look(key.subject, run)

    def turn(self) -> None:
        """Go on with what waits for time, and answer what was found."""
        for subject, run in self._runs.items():
            run.guide.look(time.monotonic())
            self._look(subject, run)
        while not self._found.empty():
            subject, run, outcome = self._found.get()
            if self._runs.get(subject) is run:
                self._finish(subject, run, outcome)

    def complete(self, subject: str, known: Calibration) -> Calibration:
        """Return what is told of a subject, with its wear check."""
        return msgspec.structs.replace(known, wear=self._progress.get(subject))

    def close(self) -> None:
        """Tell who still waits."""
        for subject in list(self._runs):
            self._end(subject, "fusion is stopping")

    def _look(self, subject: str, run: _Run) -> None:
        if not run.guide.complete:
            self._tell(subject, run.guide.progress())
        elif not run.examined:
            run.examined = True
            threading.Thread(target=self._examine, args=(subject, run), daemon=True).start()

    def _examine(self, subject: str, run: _Run) -> None:
        try:
            outcome = run.guide.outcome()
        except Exception:  # told, so that nobody waits for it
            log.exception("%s: the wear check could not be worked out", subject)
            refused = WearCheck(findings=(), refused="it could not be worked out; repeat the check")
            outcome = Outcome(refused, {}, ())
        self._found.put((subject, run, outcome))

    def _finish(self, subject: str, run: _Run, outcome: Outcome) -> None:
        del self._runs[subject]
        progress = run.guide.progress(outcome)
        self._tell(subject, progress)
        log.info("%s: wear check: %s", subject, progress.reason or ("fine" if progress.fine else "findings"))
        answer = Answer(ok=progress.state == "done", reason=progress.reason, data=plain(outcome))
        run.reply(encode(answer))

    def _tell(self, subject: str, progress: WearProgress) -> None:
        if progress != self._progress.get(subject):
            self._progress[subject] = progress
            self.news.add(subject)

    def _end(self, subject: str, reason: str) -> None:
        run = self._runs.pop(subject, None)
        if run is not None:
            self._tell(subject, WearProgress(state="refused", reason=reason))
            run.reply(encode(Answer(ok=False, reason=reason)))


def checked_wear_wish(arguments: dict[str, Any]) -> list[Side]:
    """Return the arms that are asked for (none: all that carry a node), or raise ValueError."""
    unknown = sorted(set(arguments) - {"side"})
    if unknown:
        raise ValueError(f"wear-check does not know {unknown[0]!r}; it takes side")
    side = arguments.get("side")
    if side not in (None, "both", *SIDES):
        raise ValueError(f"wear-check: side is right, left or both, not {side!r}")
    return [name for name in SIDES if side in (name, "both")]
