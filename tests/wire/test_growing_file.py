"""A file that grows: what waits is not lost when the disk is full, and the reserve is there for the end."""

import errno
import io
import os
import stat
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from brachium_wire import growing_file
from brachium_wire.growing_file import LEAST_RESERVE, RESERVE_STEP, GrowingFile


class SmallDisk(io.FileIO):
    """A file on a disk that has room for so many bytes, some of which only the reserve's end frees."""

    room = 0
    takes_at_once = 1 << 30

    def write(self, data: Any, /) -> int:
        whole = bytes(data)[: min(self.room, self.takes_at_once)]
        if not whole:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.room -= len(whole)
        return super().write(whole)


def small(path: Path, room: int) -> tuple[GrowingFile, SmallDisk]:
    file = GrowingFile(path)
    file.raw.close()
    file.raw = disk = SmallDisk(str(path), "wb")
    disk.room = room
    return file, disk


def test_what_was_written_is_there_when_it_was_pushed(tmp_path: Path) -> None:
    file = GrowingFile(tmp_path / "a")
    file.write(b"abc")
    assert file.tell() == 3
    assert (tmp_path / "a").read_bytes() == b""
    file.push()
    assert (tmp_path / "a").read_bytes() == b"abc"
    file.write(b"de")
    file.close()
    assert (tmp_path / "a").read_bytes() == b"abcde"
    assert file.closed
    assert file.synced == 5
    assert [p.name for p in tmp_path.iterdir()] == ["a"]  # the reserve has no name


def test_a_file_that_is_there_is_refused_and_left(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"old")
    with pytest.raises(FileExistsError):
        GrowingFile(tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"old"


@pytest.mark.parametrize("at_once", [1, 7, 1 << 20])
def test_a_full_disk_keeps_what_waits_until_there_is_room(tmp_path: Path, at_once: int) -> None:
    file, disk = small(tmp_path / "a", room=10)
    disk.takes_at_once = at_once
    file.write(b"0123456789abcdef")
    for _ in range(2):
        with pytest.raises(OSError, match="No space left"):
            file.push()
        assert (tmp_path / "a").read_bytes() == b"0123456789"
    assert file.tell() == 16
    disk.room = 100  # as when the reserve is given back
    file.write(b"end")
    file.close()
    assert (tmp_path / "a").read_bytes() == b"0123456789abcdefend"


def test_a_disk_that_stays_full_is_said_and_the_file_is_closed(tmp_path: Path) -> None:
    file, _ = small(tmp_path / "a", room=4)
    file.write(b"012345")
    with pytest.raises(OSError, match="No space left"):
        file.close()
    assert file.closed
    assert (tmp_path / "a").read_bytes() == b"0123"


def test_the_reserve_grows_in_steps_and_is_given_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    monkeypatch.setattr(os, "posix_fallocate", lambda _, at, n: asked.append(at + n), raising=False)
    file = GrowingFile(tmp_path / "a")
    assert asked[-1] == LEAST_RESERVE
    file.reserve(1)
    file.reserve(RESERVE_STEP)
    assert asked[-1] == LEAST_RESERVE + RESERVE_STEP
    file.release()
    file.reserve(10 * RESERVE_STEP)
    assert asked[-1] == LEAST_RESERVE + RESERVE_STEP
    file.close()


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="the way without it is tried here beside it")
def test_without_room_for_the_reserve_nothing_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(fd: int, at: int, size: int) -> None:
        del fd, at, size
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left"):
        GrowingFile(tmp_path / "a")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.delattr(os, "posix_fallocate")
    GrowingFile(tmp_path / "a").close()  # a system without it writes the reserve


def test_bringing_to_the_disk_holds_nobody_up_and_its_failure_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow, calls, folders = threading.Event(), [], []

    def fsync(fd: int) -> None:
        if stat.S_ISDIR(os.fstat(fd).st_mode):
            folders.append(fd)
            return
        calls.append(fd)
        assert slow.wait(60)
        if len(calls) == 2:
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(growing_file.os, "fsync", fsync)
    file = GrowingFile(tmp_path / "a")
    file.write(b"abc")
    file.push()
    file.sync()
    file.write(b"de")
    file.push()  # goes on meanwhile
    file.sync()  # nothing new while one is under way
    assert file.synced == 0
    slow.set()
    assert file._syncing is not None
    file._syncing.result(10)
    assert file.synced == 3  # what was pushed when it began, no more
    file.sync()
    assert file._syncing.exception(10) is not None
    with pytest.raises(OSError, match="Input/output"):
        file.sync()
    file.close()
    assert file.synced == 5
    assert len(calls) == 3
    assert len(folders) == (sys.platform != "win32")  # the file's name, once
