"""A store on a disk that takes no writing: what only reads works, what writes says why it cannot."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from brachium_viewer.sessions import parcel
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.reading import open_to_read
from brachium_viewer.sessions.records import StoreError
from brachium_viewer.sessions.store import Store

NOBODY = 65534


@contextmanager
def as_somebody_else() -> Iterator[None]:
    """Root may write everywhere."""
    if os.geteuid():
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def locked(script: Any, write_session: Any) -> Iterator[Path]:
    """A folder of one session in which nothing can be written."""
    one = script("p01")
    one.set(2, 90.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_session(folder / "a.mcap", [one])
        with Store.open(folder) as store:
            store.add(session_from_recording(folder / "a.mcap"))
        for path in folder.iterdir():
            path.chmod(0o444)
        folder.chmod(0o555)
        yield folder
        folder.chmod(0o755)


def test_what_reads_works(locked: Path) -> None:
    with tempfile.TemporaryDirectory() as out:
        Path(out).chmod(0o777)
        with as_somebody_else(), open_to_read(locked) as store:
            assert [one.recording for one in store.sessions("p01")] == ["a.mcap"]
            assert len(store.history("p01", "elbow-flexion", "right")) == 1
            assert len(parcel.pack(store, "p01", Path(out) / "p01.zip").files) == 1
    assert sorted(path.name for path in locked.iterdir()) == ["a.mcap", "sessions.sqlite"]


def test_what_writes_says_why_it_cannot(locked: Path) -> None:
    with as_somebody_else():
        with pytest.raises(StoreError, match="cannot be opened for writing"):
            Store.open(locked)
        with open_to_read(locked) as store, pytest.raises(Exception, match="readonly"):
            store.delete("p01")


def test_rows_in_a_log_are_not_passed_over(locked: Path) -> None:
    locked.chmod(0o755)
    (locked / "sessions.sqlite-wal").write_bytes(b"x" * 64)
    (locked / "sessions.sqlite-wal").chmod(0o444)
    locked.chmod(0o555)
    with as_somebody_else(), pytest.raises(StoreError, match="copy the whole folder"):
        open_to_read(locked)


def test_a_folder_without_a_store_is_refused(locked: Path) -> None:
    locked.chmod(0o755)
    (locked / "sessions.sqlite").unlink()
    locked.chmod(0o555)
    with as_somebody_else(), pytest.raises(StoreError, match="cannot be read"):
        open_to_read(locked)
