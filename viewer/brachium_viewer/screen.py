"""Drawings onto Rerun's viewer, from a thread of its own, so that a slow or frozen viewer holds nobody up."""

import logging
import threading
from collections.abc import Mapping

import numpy as np
import rerun as rr

from brachium_body import rotation
from brachium_viewer import layout
from brachium_viewer.drawings import (
    Capsules,
    Degrees,
    Drawing,
    Label,
    Lane,
    Layout,
    Range,
    Signal,
    Text,
    Trail,
)
from brachium_viewer.raw_signals import joined

log = logging.getLogger(__name__)

APPLICATION = "brachium"
WHITE = (240, 240, 240, 255)
FLUSH_EVERY = 30
"""Deliveries between two waits for the viewer, so that a frozen one cannot fill the sender's memory."""


TRAIL_RADIUS = 0.005


class Mailbox:
    """What waits for the viewer: the newest drawing of each path. An older one is replaced, and counted."""

    def __init__(self) -> None:
        self._waiting: dict[str, tuple[float, Drawing]] = {}
        self._ready = threading.Condition()
        self._closed = False
        self.replaced = 0

    def put(self, seconds: float, drawings: Mapping[str, Drawing]) -> None:
        """Leave the drawings of one moment; never waits for the reader."""
        with self._ready:
            for path, drawing in drawings.items():
                before = self._waiting.get(path)
                if before is not None and isinstance(drawing, Signal) and isinstance(before[1], Signal):
                    self._waiting[path] = (seconds, joined(before[1], drawing))
                    continue
                self.replaced += before is not None
                self._waiting[path] = (seconds, drawing)
            self._ready.notify()

    def take(self) -> dict[str, tuple[float, Drawing]] | None:
        """Wait for drawings and return them by path; None after `close`."""
        with self._ready:
            self._ready.wait_for(lambda: self._waiting or self._closed)
            if self._closed and not self._waiting:
                return None
            out, self._waiting = self._waiting, {}
            return out

    def close(self) -> None:
        """Let `take` return None once nothing waits."""
        with self._ready:
            self._closed = True
            self._ready.notify_all()


class Pen:
    """Writes drawings into one Rerun recording; what never changes is written once."""

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._recording = recording
        self._lanes: dict[str, str] = {}
        self._broken: set[str] = set()
        recording.set_log_time_enabled(False)  # we say the time
        recording.set_log_tick_enabled(False)
        recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def write(self, drawings: Mapping[str, tuple[float, Drawing]]) -> None:
        """Write drawings by path, each at its second."""
        last = None
        for path, (seconds, drawing) in drawings.items():
            if seconds != last:
                self._recording.set_time(layout.TIMELINE, duration=seconds)
                last = seconds
            self._write(path, drawing)

    def _write(self, path: str, drawing: Drawing) -> None:
        log_one = self._recording.log
        match drawing:
            case Capsules():
                log_one(path, capsules(drawing))
            case Trail():
                log_one(path, rr.LineStrips3D(drawing.strips, colors=drawing.colours, radii=TRAIL_RADIUS))
            case Signal():
                time = rr.TimeColumn(layout.TIMELINE, duration=drawing.times_s)
                columns = rr.Scalars.columns(scalars=drawing.values.reshape(-1))
                self._recording.send_columns(path, [time], columns.partition([3] * len(drawing.times_s)))
            case Degrees(value=None):
                if path not in self._broken:  # a gap stays a gap: the line is not drawn across it
                    self._broken.add(path)
                    log_one(path, rr.Clear(recursive=False))
            case Degrees(value=float() as value):
                self._broken.discard(path)
                log_one(path, rr.Scalars(value))
            case Range():
                log_one(path, rr.Scalars([drawing.low, drawing.high]))
            case Lane():
                self._lane(path, drawing.quality)
            case Label():
                at = rr.Points3D(
                    [drawing.at], radii=[0.001], colors=[WHITE], labels=[drawing.text], show_labels=True
                )
                log_one(path, at)
            case Text():
                log_one(path, rr.TextDocument(drawing.markdown, media_type="text/markdown"))
            case Layout():
                layout.log_lines(self._recording, drawing)
                layout.log_raw_lines(self._recording, drawing)
                self._recording.send_blueprint(layout.blueprint(drawing), make_active=True, make_default=True)

    def _lane(self, path: str, quality: str) -> None:
        if path not in self._lanes:
            layout.log_lanes(self._recording, path)
        if self._lanes.get(path) != quality:
            self._lanes[path] = quality
            self._recording.log(path, rr.StateChange(state=quality))


class Screen:
    """The thread that writes what the mailbox holds. A frozen viewer stops this thread and no other."""

    def __init__(self, recording: rr.RecordingStream) -> None:
        self.mailbox = Mailbox()
        self.delivered = 0
        self.error: Exception | None = None
        """What ended the thread before its time."""
        self._recording = recording
        self._pen = Pen(recording)
        self._thread = threading.Thread(target=self._run, name="screen", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            while (drawings := self.mailbox.take()) is not None:
                self._pen.write(drawings)
                if self.delivered % FLUSH_EVERY == 0:
                    self._flush()
                self.delivered += 1
            self._recording.disconnect()
        except Exception as error:
            self.error = error

    def _flush(self) -> None:
        try:
            self._recording.flush()
        except (
            Exception
        ) as error:  # Rerun's own class is not public; the viewer's end is noticed by its process
            log.debug("the viewer takes nothing: %s", error)

    def close(self, wait_s: float) -> None:
        """Write what is left if the viewer takes it within `wait_s`."""
        self.mailbox.close()
        self._thread.join(wait_s)


def capsules(drawing: Capsules) -> rr.Capsules3D:
    """Return Rerun's capsules, which run along z from their origin, turned to lie between the two ends."""
    along = drawing.ends - drawing.starts
    lengths = np.linalg.norm(along, axis=1)
    return rr.Capsules3D(
        lengths=lengths,
        radii=drawing.radii,
        translations=drawing.starts,
        quaternions=np.roll(_from_z(along, lengths), -1, axis=1),
        colors=drawing.colours,
        fill_mode="solid" if (drawing.colours[:, 3] == 255).all() else "transparentfillmajorwireframe",
    )


def _from_z(along: rotation.Array, lengths: rotation.Array) -> rotation.Array:
    """Return the shortest turns (n, 4) that take z to these directions; no turn where the length is 0."""
    unit = along / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    unit[lengths == 0.0] = (0.0, 0.0, 1.0)
    half = np.concatenate([1.0 + unit[:, 2:3], -unit[:, 1:2], unit[:, 0:1], np.zeros((len(unit), 1))], axis=1)
    half[unit[:, 2] < -1.0 + 1e-12] = (0.0, 1.0, 0.0, 0.0)  # straight down: any half turn about a level axis
    return rotation.normalize(half)
