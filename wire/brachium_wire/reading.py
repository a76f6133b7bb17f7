"""Reading a recording from its beginning to its end, or to where it was cut or damaged."""

import logging
import struct
from collections.abc import Generator, Iterator
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Header, Metadata
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk

log = logging.getLogger(__name__)

PROFILE = "brachium"
MAGIC = b"\x89MCAP0\r\n"
# What a damaged file can make its parser raise.
DAMAGE = (McapError, zstandard.ZstdError, ValueError, struct.error, KeyError, OverflowError, MemoryError)


class RecordingError(ValueError):
    """The file is no recording of ours, or somebody still writes it: one line that says what to do."""


class Recorded(NamedTuple):
    """One message as it came: key, bus bytes, and the host time in ns at which it was written."""

    key: str
    payload: bytes
    log_time_ns: int


class Reading:
    """An iterator over the messages of a recording, in order of arrival.

    `metadata` is there from the start; `warning` and `closed` are final when the iteration has ended.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata: dict[str, str] = {}
        self.warning = ""
        self.closed = False
        """Whether the file's proper end was reached."""
        self._channels: dict[int, str] = {}
        self._bad_chunks = self._unnamed = 0
        self._size = path.stat().st_size
        self._file = path.open("rb")
        try:
            self._records = iter(
                StreamReader(self._file, emit_chunks=True, record_size_limit=self._size).records
            )
            self._check_header()
        except BaseException:
            self._file.close()
            raise
        self._messages = self._read()

    def __iter__(self) -> Iterator[Recorded]:
        return self

    def __next__(self) -> Recorded:
        return next(self._messages)

    def close(self) -> None:
        """Close the file before the end."""
        self._messages.close()
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _check_header(self) -> None:
        if self._file.peek(len(MAGIC))[: len(MAGIC)] != MAGIC:
            raise RecordingError(f"{self.path}: not a recording (an MCAP file); made by: brachium record")
        try:
            header, first = next(self._records), next(self._records, None)
        except (*DAMAGE, StopIteration):
            raise RecordingError(
                f"{self.path}: a recording cut before its first message; nothing can be read"
            ) from None
        if not isinstance(header, Header) or header.profile != PROFILE:
            profile = header.profile if isinstance(header, Header) else ""
            raise RecordingError(
                f"{self.path}: an MCAP file of another program (profile {profile!r}), not a recording"
            )
        if isinstance(first, Metadata):
            self.metadata = {str(name): str(value) for name, value in first.metadata.items()}

    def _read(self) -> Generator[Recorded, None, None]:
        try:
            with self._file:
                for record in self._records:
                    if isinstance(record, Chunk):
                        yield from self._unpack(record)
            self.closed = True
        except DAMAGE as error:
            where = self._size if self._file.closed else self._file.tell()
            log.debug("%s: %s near byte %d", self.path, error, where)
        self._conclude()

    def _unpack(self, chunk: Chunk) -> Iterator[Recorded]:
        try:
            records = breakup_chunk(chunk, validate_crc=True)
        except DAMAGE:
            self._bad_chunks += 1
            return
        for record in records:
            if isinstance(record, Channel):
                self._channels[record.id] = record.topic
            elif isinstance(record, McapMessage):
                key = self._channels.get(record.channel_id)
                if key is None:
                    self._unnamed += 1
                else:
                    yield Recorded(key, record.data, record.log_time)

    def _conclude(self) -> None:
        said = []
        if not self.closed:
            said.append("not closed: read up to the cut")
        if self._bad_chunks:
            said.append(f"{self._bad_chunks} damaged blocks left out")
        if self._unnamed:
            said.append(
                f"{self._unnamed} messages left out, because the block that named their key is damaged"
            )
        if said:
            self.warning = f"{self.path}: {'; '.join(said)}"
