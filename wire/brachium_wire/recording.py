"""Recordings: the bus bytes unchanged in an MCAP file, one channel a key, in order of arrival.

A file that was not closed holds all but the last half second after a kill, and all but the last two seconds
after a loss of power: `read` reads it up to the cut, `recover` turns it into a closed, indexed one. On a full
disk `write` or `tick` raises OSError; `close` then still writes what waits, index and footer, for which room
was kept.
"""

import os
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self, cast

from mcap.reader import make_reader
from mcap.writer import Writer

from brachium_wire import keys, schema
from brachium_wire.growing_file import GrowingFile
from brachium_wire.reading import DAMAGE, MAGIC, PROFILE, Reading, Recorded, RecordingError
from brachium_wire.topics import TOPICS

__all__ = [
    "BeingWritten",
    "Reading",
    "Recorded",
    "RecordingError",
    "RecordingWriter",
    "RecoverReport",
    "counts",
    "is_being_written",
    "is_closed",
    "is_recording",
    "read",
    "recover",
]

ENCODING = "msgpack"
FLUSH_NS = 200_000_000
"""Half a second may be lost to a kill: the way to here and a busy machine have the rest of it."""
SYNC_NS = 500_000_000
"""Two seconds may be lost with the power: a slow disk may take as long again, and longer."""
INDEX_BYTES, INDEX_BYTES_A_KEY = 100, 10
"""Of each chunk in the index at the file's end, at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverReport:
    """What `recover` found: messages a key, and whether anything had to be done."""

    path: Path
    messages: dict[str, int]
    recovered: bool
    """False: the file had been closed and is untouched."""
    warning: str = ""
    """Where the file was cut or damaged."""


class BeingWritten(RecordingError):
    """Another process writes the recording."""


def _lock(file: IO[bytes]) -> bool:
    """Take the file for this process alone, until it closes it or dies; False when another has it."""
    if sys.platform != "win32":  # there, a file that is open cannot be replaced at all
        import fcntl

        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
    return True


class RecordingWriter:
    """Writes one recording. Use it in a `with` block: closing writes the index and the footer."""

    def __init__(self, path: Path, metadata: Mapping[str, str] | None = None) -> None:
        """Create `path`; raises FileExistsError when it is there: a recording is never overwritten."""
        self.path = path
        self.counts: Counter[str] = Counter()
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._last_ns = 0
        self._flush_due: int | None = None
        self._sync_due: int | None = None
        self._index_bytes = 0
        self._file = GrowingFile(path)
        _lock(self._file.raw)
        self._writer: Any = cast(Any, Writer)(self._file)  # not fully typed
        self._writer.start(profile=PROFILE)
        self._writer.add_metadata(PROFILE, dict(metadata or {}))
        self._file.push()
        self._file.sync()

    @property
    def synced(self) -> int:
        """Return how many bytes of the file are on the disk itself, whatever happens to the power."""
        return self._file.synced

    def write(self, key: str, payload: bytes, log_time_ns: int) -> None:
        """Append one message; a time that does not grow becomes 1 ns after the last, so that file order is
        arrival order.

        Raises keys.BadKey for a key that is not of the topic table.
        """
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._register(key)
        log_time_ns = self._last_ns = max(log_time_ns, self._last_ns + 1)
        self._writer.add_message(
            channel, log_time_ns, payload, publish_time=log_time_ns, sequence=self.counts[key]
        )
        self.counts[key] += 1
        self.tick(log_time_ns)

    def tick(self, time_ns: int) -> None:
        """Bring to the file what is 0.2 s old, and to the disk each 0.5 s; call it when idle too.

        Raises OSError when the disk takes no more: close it then, and write no more.
        """
        if self._flush_due is None or self._sync_due is None:
            self._flush_due, self._sync_due = time_ns + FLUSH_NS, time_ns + SYNC_NS
        if time_ns >= self._flush_due:
            before = self._file.tell()
            self._writer.flush()
            if self._file.tell() > before:
                self._index_bytes += INDEX_BYTES + INDEX_BYTES_A_KEY * len(self._channels)
                self._file.reserve(self._index_bytes)
            self._file.push()
            self._flush_due = time_ns + FLUSH_NS
        if time_ns >= self._sync_due:
            self._file.sync()
            self._sync_due = time_ns + SYNC_NS

    def close(self) -> None:
        """Write index and footer and close. Closing twice is harmless."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
        finally:
            self._file.close()

    def _register(self, key: str) -> int:
        topic = TOPICS.get(keys.parse(key).topic)
        if topic is None:
            raise keys.BadKey(f"key {key!r} is of no topic that can be recorded")
        name = str(topic.message.__struct_config__.tag)
        if name not in self._schemas:
            text = schema.text(topic.message).encode()
            self._schemas[name] = self._writer.register_schema(name, ENCODING, text)
        return int(self._writer.register_channel(key, ENCODING, self._schemas[name]))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read(path: Path) -> Reading:
    """Return an iterator of `Recorded`, also over a file that was cut or damaged (see `Reading.warning`).

    Raises RecordingError for a file that is no recording of ours, and FileNotFoundError.
    """
    return Reading(path)


def is_recording(path: Path) -> bool:
    """Return whether `path` is a file that `read` can read."""
    if not path.is_file():
        return False
    try:
        read(path).close()
    except RecordingError:
        return False
    return True


def is_closed(path: Path) -> bool:
    """Return whether the file ends as a closed one does, without reading it."""
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        if file.tell() < 2 * len(MAGIC):
            return False
        file.seek(-len(MAGIC), os.SEEK_END)
        return file.read() == MAGIC


def is_being_written(path: Path) -> bool:
    """Return whether another process has the recording open for writing."""
    with path.open("rb") as file:
        return not _lock(file)


def recover(path: Path) -> RecoverReport:
    """Rewrite a recording that was not closed into a closed and indexed one, in its place.

    Raises RecordingError when it is no recording, or while another process still writes it, and OSError
    without room for it; the file is then as it was.
    """
    with path.open("rb") as held, read(path) as reading:
        if not _lock(held):
            raise BeingWritten(f"{path}: is being written; recover it when the recorder has ended")
        if is_closed(path):
            counts = Counter(message.key for message in reading)
            return RecoverReport(path=path, messages=dict(counts), recovered=False, warning=reading.warning)
        fresh = path.with_name(path.name + ".recovering")
        fresh.unlink(missing_ok=True)  # of a recovery that was itself cut short
        try:
            with RecordingWriter(fresh, {**reading.metadata, "recovered": "true"}) as writer:
                for message in reading:
                    writer.write(*message)
        except OSError:
            fresh.unlink(missing_ok=True)
            raise
        fresh.replace(path)
    return RecoverReport(path=path, messages=dict(writer.counts), recovered=True, warning=reading.warning)


def counts(path: Path) -> dict[str, int]:
    """Return the messages a key of a closed recording, from its index, without reading them."""
    with path.open("rb") as file:
        try:
            found = make_reader(file).get_summary()
        except DAMAGE as error:
            raise RecordingError(f"{path}: not closed or damaged ({error})") from None
    if found is None or found.statistics is None:
        raise RecordingError(f"{path}: holds no index")
    numbers = found.statistics.channel_message_counts
    return {channel.topic: numbers.get(number, 0) for number, channel in found.channels.items()}
