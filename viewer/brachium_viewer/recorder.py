"""The recorder: everything a room says, on disk in order of arrival, beginning with fusion's state.

When the disk takes no more it closes the file with all that came until then, raises an alarm in its health
and counts what it lets go. It does not begin anew by itself, even when there is room again: one recording is
one file with one beginning, and whoever makes room begins the next one.
"""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from brachium_viewer.recording_opening import opening
from brachium_wire import keys, recording
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus, Inbox
from brachium_wire.codec import Drop
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock
from brachium_wire.topics import TOPICS

log = logging.getLogger(__name__)

CAPACITY = 65536
"""Messages that may wait for the disk: minutes of a usual room."""


@dataclass(frozen=True, kw_only=True)
class RecordSettings:
    """What to record, and where."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    subject: str | None = None
    """Only this subject, and the services; None: everybody in the room."""
    folder: Path = Path("recordings")
    seconds: float | None = None
    """How long; None: until stopped."""
    id: str = "main"


@dataclass(frozen=True, kw_only=True)
class RecordReport:
    """What a recording holds, as found in the closed file, and what is not in it."""

    path: Path
    messages: dict[str, int]
    """Messages a topic."""
    dropped: dict[str, int] = field(default_factory=dict)
    """Messages that came and were not recorded, by reason."""
    missing: dict[str, int] = field(default_factory=dict)
    """Messages a key that were written and are not in the closed file: none, or the disk is at fault."""
    ended: str = ""
    """Why the recording ended before it was told to; empty when it did not."""


class Recorder:
    """Sorts what arrives into what is recorded and what is dropped, and counts both."""

    def __init__(
        self,
        writer: recording.RecordingWriter,
        subject: str | None = None,
        on_end: Callable[[str], None] = log.error,
    ) -> None:
        """`on_end` is told once why the disk takes no more."""
        self.writer = writer
        self._subject, self._on_end = subject, on_end
        self.received: Counter[str] = Counter()
        self.drops: Counter[str] = Counter()
        self.ended = ""
        """Why the disk takes no more; empty while it does."""

    def take(self, key: str, payload: bytes, now_ns: int) -> None:
        """Record one message, or count why not."""
        try:
            parsed = keys.parse(key)
        except keys.BadKey:
            self.drops[Drop.BAD_KEY.value] += 1
            return
        row = TOPICS.get(parsed.topic)
        if row is None or not row.recorded:
            return
        if self._subject is not None and parsed.subject not in (self._subject, keys.SERVICE):
            return
        if len(payload) > row.max_bytes:
            self.drops[Drop.OVERSIZE.value] += 1
            return
        if self.ended:
            self.drops[Drop.DISK_FULL.value] += 1
            return
        self.received[key] += 1
        try:
            self.writer.write(key, payload, now_ns)
        except OSError as error:
            self._end(error)

    def tick(self, now_ns: int) -> None:
        """Bring to the disk what is due."""
        if not self.ended:
            try:
                self.writer.tick(now_ns)
            except OSError as error:
                self._end(error)

    def _end(self, error: OSError) -> None:
        """Close the file now, so that whatever happens next it is whole."""
        path = self.writer.path
        try:
            self.writer.close()
            kept = "what came until then"
        except OSError:
            kept = "what came until then but for its index and at most half a second"
        self.ended = (
            f"the disk takes no more ({error.strerror}); {path.name} holds {kept}. "
            f"Make room in {path.parent}, then record anew"
        )
        self._on_end(self.ended)

    def report(self) -> RecordReport:
        """Compare what was received with what the closed file holds."""
        found = _found(self.writer.path)
        missing = {key: n - found.get(key, 0) for key, n in self.received.items() if n != found.get(key, 0)}
        topics: Counter[str] = Counter()
        for key, n in found.items():
            topics[keys.parse(key).topic] += n
        return RecordReport(
            path=self.writer.path,
            messages=dict(topics),
            dropped=dict(self.drops),
            missing=missing,
            ended=self.ended,
        )


def run(
    settings: RecordSettings, stop: threading.Event, on_end: Callable[[str], None] = log.error
) -> RecordReport:
    """Record the room until `stop` is set or the time is over, and say what the file holds.

    `on_end` is told at once when the disk takes no more. Raises BadKey before anything is touched, NoRouter,
    and OSError when the disk has no room to begin.
    """
    keys.service(settings.room, "recorder", settings.id)
    if settings.subject is not None:
        keys.subject_chunk(settings.subject)  # it becomes part of a file's name
    settings.folder.mkdir(parents=True, exist_ok=True)
    recover_folder(settings.folder)
    clock = HostClock()
    with Bus.open(settings.endpoint, stop=stop) as bus:
        # Subscribed before anything is asked for: what comes in the meantime waits in the inbox.
        inbox = bus.subscribe(keys.everything(settings.room), CAPACITY)
        with _create(settings) as writer:
            heart = Heart(bus, settings.room, "recorder", settings.id)  # alive means that there is a file
            recorder = Recorder(writer, settings.subject, on_end)
            heart.text = writer.path.name
            for key, payload in opening(bus, settings.room, settings.subject):
                recorder.take(key, payload, clock.now_ns())
            log.info("recording to %s", writer.path)
            _record(recorder, inbox, heart, clock, settings.seconds, stop)
    report = recorder.report()
    for key, n in report.missing.items():
        log.error("%s: %d messages of %s were received and are not in the file", report.path, n, key)
    return report


def recover_folder(folder: Path) -> list[recording.RecoverReport]:
    """Close, index and count the recordings in a folder that a crash left open; others are left alone."""
    reports = []
    for path in sorted(folder.glob("*.mcap")):
        if recording.is_closed(path):
            continue
        try:
            report = recording.recover(path)
        except recording.BeingWritten as error:
            log.info("%s", error)
            continue
        except (recording.RecordingError, OSError) as error:
            log.warning("%s", error)
            continue
        log.warning("%s had not been closed: recovered %d messages", path, sum(report.messages.values()))
        reports.append(report)
    return reports


def _found(path: Path) -> dict[str, int]:
    """Return the messages a key of a file, closed or not."""
    if recording.is_closed(path):
        return recording.counts(path)
    with recording.read(path) as messages:
        return Counter(message.key for message in messages)


def _create(settings: RecordSettings) -> recording.RecordingWriter:
    """Create the next free file of the folder."""
    started = datetime.now(UTC)
    stem = f"{settings.subject or settings.room}-{started:%Y-%m-%dT%H-%M-%SZ}"
    metadata = {"room": settings.room, "started": started.isoformat(timespec="seconds")}
    for number in range(1, 1000):
        path = settings.folder / (f"{stem}.mcap" if number == 1 else f"{stem}-{number}.mcap")
        try:
            return recording.RecordingWriter(path, metadata)
        except FileExistsError:
            continue
    raise FileExistsError(f"{settings.folder / stem}.mcap and 998 more are there already")


def _record(
    recorder: Recorder,
    inbox: Inbox,
    heart: Heart,
    clock: HostClock,
    seconds: float | None,
    stop: threading.Event,
) -> None:
    end = None if seconds is None else time.monotonic() + seconds
    while not stop.is_set() and (end is None or time.monotonic() < end):
        inbox.wait(0.1)
        _drain(recorder, inbox, heart, clock)
        heart.beat()
    _drain(recorder, inbox, heart, clock)
    heart.beat(now=True)


def _drain(recorder: Recorder, inbox: Inbox, heart: Heart, clock: HostClock) -> None:
    for key, payload in inbox.drain():
        recorder.take(key, payload, clock.now_ns())
    recorder.tick(clock.now_ns())
    if inbox.dropped:
        recorder.drops[Drop.OVERFLOW.value] = inbox.dropped
    if recorder.ended and not heart.alarm:
        heart.alarm = recorder.ended
        heart.beat(now=True)
    heart.counts["recorded"] = sum(recorder.received.values())
    heart.counts["bytes_on_disk"] = recorder.writer.synced
    for name, n in recorder.drops.items():
        heart.drops[name] = n
