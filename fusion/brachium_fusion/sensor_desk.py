"""The service's part of the calibration of single sensors: who asked, what runs, what was found."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from brachium_fusion.calibration_wish import checked_sensor_wish
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.sensor_guide import SensorGuide, steps_for
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_batch, encode
from brachium_wire.messages import Answer, Calibration, SensorCalibration
from brachium_wire.samples import read_samples
from brachium_wire.sensor_records import SensorProgress
from brachium_wire.topics import TOPICS

log = logging.getLogger(__name__)

Reply = Callable[[bytes], None]

SILENT_S = 10.0
"""Without a sample for so long, the sensor is gone."""


@dataclass(slots=True)
class _Run:
    guide: SensorGuide
    reply: Reply
    heard_s: float


class SensorDesk:
    """One fusion's calibrations of single sensors, one of each subject at a time."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self._runs: dict[str, _Run] = {}
        self._progress: dict[str, SensorProgress] = {}
        self._found: dict[str, dict[str, SensorCalibration]] = {}
        self.news: set[str] = set()
        """Subjects of whom there is something to tell; whoever tells it clears them."""

    def begin(self, subject: str, arguments: dict[str, Any], reply: Reply) -> None:
        """Begin what is asked for and answer when it is over. Raises ValueError."""
        segment, asked = checked_sensor_wish(arguments)
        track = self._pipeline.subjects[subject].tracks.get(segment)
        if track is None:
            there = ", ".join(self._pipeline.subjects[subject].tracks) or "none"
            raise ValueError(f"no sensor on {segment} has been heard; there is {there}")
        guide = SensorGuide(segment, track.info, steps_for(asked, track.info))
        self._end(subject, "another calibration of a sensor was asked for")
        self._runs[subject] = _Run(guide, reply, time.monotonic())
        self._tell(subject, guide.progress())

    def see(self, key: keys.Key, payload: bytes) -> None:
        """Take a batch of a sensor that is being calibrated; others do not concern it."""
        run = self._runs.get(key.subject)
        if run is None or key.topic != "imu" or key.detail != run.guide.segment:
            return
        try:
            samples = read_samples(decode_batch(payload, TOPICS["imu"].max_bytes))
        except WireError:
            return  # the pipeline counts it
        run.heard_s = time.monotonic()
        if run.guide.take(samples):
            self._tell(key.subject, run.guide.progress())
            if run.guide.over:
                self._finish(key.subject, run)

    def _tell(self, subject: str, progress: SensorProgress) -> None:
        if progress != self._progress.get(subject):
            self._progress[subject] = progress
            self.news.add(subject)

    def _finish(self, subject: str, run: _Run) -> None:
        del self._runs[subject]
        found, progress = run.guide.calibration(), run.guide.progress()
        if found is not None:
            self._found.setdefault(subject, {})[run.guide.info.node] = found
        answer = Answer(
            ok=progress.state == "done",
            reason=progress.reason,
            data={
                "segment": progress.segment,
                "node": progress.node,
                "scores": progress.scores,
                "refused": progress.refused,
                "calibration": None if found is None else msgspec.to_builtins(found),
            },
        )
        log.info("%s: sensor of %s: %s", subject, progress.segment, progress.reason or "calibrated")
        run.reply(encode(answer))

    def complete(self, subject: str, known: Calibration | None) -> Calibration:
        """Return what is told of a subject: how sensors are worn, with what is known of the sensors."""
        if known is None:
            known = Calibration(time_ns=self._pipeline.subject(subject).received_ns, state="none")
        return msgspec.structs.replace(
            known, sensor=self._progress.get(subject), sensors=dict(self._found.get(subject, {}))
        )

    def give_up(self) -> None:
        """End what has no samples any more."""
        for subject, run in list(self._runs.items()):
            if time.monotonic() - run.heard_s > SILENT_S:
                self._end(subject, "no samples arrive: switch the sensor on and ask again")

    def _end(self, subject: str, reason: str) -> None:
        run = self._runs.pop(subject, None)
        if run is not None:
            ended = msgspec.structs.replace(run.guide.progress(), state="refused", reason=reason)
            self._tell(subject, ended)
            run.reply(encode(Answer(ok=False, reason=reason)))

    def close(self) -> None:
        """Tell who still waits."""
        for subject in list(self._runs):
            self._end(subject, "fusion is stopping")
