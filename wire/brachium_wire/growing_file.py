"""A file that is written for long, on a disk that may fill up or lose its power."""

import os
import sys
import tempfile
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import IO

LEAST_RESERVE = 1 << 20
"""Bytes: holds what waits in memory when the disk is full."""
RESERVE_STEP = 1 << 18


class GrowingFile:
    """Takes what is written in memory; `push` gives it to the system, `sync` brings it to the disk.

    As long as only `push` fails, nothing is lost: what waits is written by the next one that finds room, such
    as that of the reserve. The reserve is a nameless file beside this one; it ends with the process.
    """

    def __init__(self, path: Path) -> None:
        """Create `path`; raises FileExistsError when it is there, OSError when there is no room to begin."""
        if path.exists():
            raise FileExistsError(17, "the file is there already", str(path))
        self._reserve: IO[bytes] | None = tempfile.TemporaryFile(dir=path.parent)  # noqa: SIM115 - see release
        self._reserved, self._path = 0, path
        try:
            self.reserve(0)
            self.raw = path.open("xb", buffering=0)
        except OSError:
            self.release()
            raise
        self._waiting = bytearray()
        self._size = 0
        self._syncing: Future[None] | None = None
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="sync")
        self.synced = 0
        """Bytes that are on the disk itself, whatever happens to the power."""

    @property
    def closed(self) -> bool:
        """Return whether it is closed."""
        return self.raw.closed

    def write(self, data: bytes) -> int:
        """Take bytes into memory."""
        self._waiting += data
        return len(data)

    def tell(self) -> int:
        """Return the size that the file has once all is pushed."""
        return self._size + len(self._waiting)

    def flush(self) -> None:
        """Do nothing: whoever writes decides when to `push`."""

    def push(self) -> None:
        """Give what waits to the system; raises OSError when it takes no more, and keeps the rest."""
        while self._waiting:
            done = self.raw.write(self._waiting)
            if not done:
                raise OSError(5, "the system takes nothing more", str(self.raw.name))
            self._size += done
            del self._waiting[:done]

    def sync(self) -> None:
        """Begin to bring to the disk what was pushed, unless that is under way; nobody waits for it.

        Raises OSError when the one before failed.
        """
        if self._syncing is not None:
            if not self._syncing.done():
                return
            self._syncing.result()
        self._syncing = self._thread.submit(self._sync, self._size)

    def _sync(self, size: int) -> None:
        os.fsync(self.raw.fileno())
        if not self.synced and sys.platform != "win32":  # its name, too, must be on the disk
            folder = os.open(self._path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        self.synced = size

    def reserve(self, size: int) -> None:
        """Keep so many bytes of the disk free for the file's end, beside those for what waits.

        Raises OSError without room.
        """
        while self._reserve is not None and self._reserved < LEAST_RESERVE + size:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(self._reserve.fileno(), self._reserved, RESERVE_STEP)
            else:
                self._reserve.seek(self._reserved)
                self._reserve.write(bytes(RESERVE_STEP))
                self._reserve.flush()
            self._reserved += RESERVE_STEP

    def release(self) -> None:
        """Give the reserve back."""
        if self._reserve is not None:
            self._reserve.close()
            self._reserve = None

    def close(self) -> None:
        """Write what waits, with the reserve's room if need be, bring it to the disk and close."""
        self.release()
        try:
            self.push()
            if self._syncing is not None:
                self._syncing.exception()
            self._sync(self._size)
        finally:
            self._thread.shutdown()
            self.raw.close()
