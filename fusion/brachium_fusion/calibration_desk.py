"""The service's part of calibrations: who waits for an answer, fits in a thread, and what is kept on disk."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from typing import Any

from brachium_fusion.guided import LONGEST_NS, FitRequest, align_change
from brachium_fusion.kept import Kept, same_sensors
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.pose import Alignment
from brachium_fusion.pose_watch import POSE_PATIENCE_S
from brachium_wire.codec import encode
from brachium_wire.messages import Answer, Calibration, Info

log = logging.getLogger(__name__)

Reply = Callable[[bytes], None]

FIT_S = 30.0
"""An alignment is found within this, on a busy machine."""


class CalibrationDesk:
    """One fusion's calibrations. Only `_fit` runs on other threads."""

    def __init__(self, pipeline: Pipeline, room: str, kept: Kept | None) -> None:
        self._pipeline, self._room, self._kept = pipeline, room, kept
        self._waiting: dict[str, list[tuple[float, Reply]]] = {}
        self._found: SimpleQueue[tuple[str, dict[str, Any]]] = SimpleQueue()
        self._looked_at: set[str] = set()
        """Subjects of whom nothing is kept, or what is kept was used or is of other sensors."""

    def wait(self, subject: str, wish: Mapping[str, Any], reply: Reply) -> None:
        """Answer when the calibration is over."""
        longest_s = wish["seconds"] + POSE_PATIENCE_S + 5.0
        if wish.get("motions"):
            longest_s += FIT_S + sum(1e-9 * LONGEST_NS[motion] for motion in wish["motions"])
        self._waiting.setdefault(subject, []).append((time.monotonic() + longest_s, reply))

    def changes(self) -> list[tuple[str, dict[str, Any]]]:
        """Begin the fits that wait; return the `align` changes due now: found, or kept from another day."""
        for subject, request in self._pipeline.fits():
            threading.Thread(target=self._fit, args=(subject, request), daemon=True).start()
        due = []
        while not self._found.empty():
            due.append(self._found.get())
        return due + self._remembered()

    def _fit(self, subject: str, request: FitRequest) -> None:
        try:
            found = request.fit()
        except Exception:  # told, so that nobody waits for it
            log.exception("%s: the alignment could not be worked out", subject)
            refused = {"alignment": "it could not be worked out; ask again"}
            found = align_change(Alignment(refused=refused)) | {"from_ns": request.from_ns}
        self._found.put((subject, found))

    def _remembered(self) -> list[tuple[str, dict[str, Any]]]:
        """Return the kept calibrations of subjects whose sensors are all there by now."""
        if self._kept is None:
            return []
        due = []
        for name in self._pipeline.subjects.keys() - self._looked_at:
            subject = self._pipeline.subjects[name]
            kept = None if subject.calibrating.alignment is not None else self._kept.load(self._room, name)
            if kept is None:
                self._looked_at.add(name)
                continue
            infos = self._infos(name)
            if not kept["sensors"].keys() <= infos.keys():
                continue
            self._looked_at.add(name)
            if same_sensors(kept["sensors"], infos):
                log.info("%s: calibration of the same sensors taken from %s", name, self._kept.folder)
                due.append((name, {"alignment": kept["alignment"], "kept": True}))
            else:
                log.info("%s: other sensors than the kept calibration's: calibrate again", name)
        return due

    def _infos(self, subject: str) -> dict[str, Info]:
        return {segment: track.info for segment, track in self._pipeline.subjects[subject].tracks.items()}

    def finished(self, subject: str, news: Calibration) -> None:
        """Keep what was found, and answer who asked."""
        alignment = self._pipeline.subjects[subject].calibrating.alignment
        infos = self._infos(subject)
        self._looked_at.add(subject)
        worn = {s: info for s, info in infos.items() if s in news.mounting}
        on_a_person = bool(worn) and all(info.origin == "worn" for info in worn.values())
        if self._kept is not None and news.state == "done" and alignment is not None and on_a_person:
            self._kept.save(self._room, subject, worn, alignment.state(), news.time_ns)
        answer = Answer(
            ok=news.state == "done",
            reason=news.reason,
            data={
                "forward": news.forward,
                "scores": news.scores,
                "warnings": news.warnings,
                "refused": news.refused,
            },
        )
        for _, reply in self._waiting.pop(subject, ()):
            reply(encode(answer))

    def give_up(self) -> None:
        """Answer who waited in vain."""
        now = time.monotonic()
        for subject, replies in list(self._waiting.items()):
            for entry in [r for r in replies if r[0] < now]:
                replies.remove(entry)
                entry[1](encode(Answer(ok=False, reason="no samples arrive: nothing to calibrate from")))
            if not replies:
                del self._waiting[subject]

    def close(self) -> None:
        """Tell who still waits."""
        for replies in self._waiting.values():
            for _, reply in replies:
                reply(encode(Answer(ok=False, reason="fusion is stopping")))
        self._waiting.clear()
