"""The tables of a store, and how the file that holds them is opened."""

import sqlite3
from pathlib import Path

from brachium_viewer.sessions.records import StoreError

FILE = "sessions.sqlite"
APPLICATION = 0x42524348
"""Marks a SQLite file as ours ("BRCH")."""
VERSION = 1
"""Of the tables below; a file with a greater one is of a newer Brachium and is refused."""
BUSY_S = 10.0
"""So long a process waits for another one that writes."""

TABLES = """
CREATE TABLE subject (
    pseudonym TEXT PRIMARY KEY,
    affected_side TEXT NOT NULL,
    dominant_hand TEXT NOT NULL,
    lengths_m TEXT NOT NULL,
    notes TEXT NOT NULL
) STRICT;
CREATE TABLE session (
    id INTEGER PRIMARY KEY,
    subject TEXT NOT NULL REFERENCES subject ON DELETE CASCADE,
    started_ns INTEGER NOT NULL,
    origin TEXT NOT NULL CHECK (origin IN ('worn', 'emulated', 'playback')),
    recording TEXT NOT NULL,
    settings TEXT NOT NULL,
    method INTEGER NOT NULL,
    note TEXT NOT NULL
) STRICT;
CREATE UNIQUE INDEX session_of_recording ON session (subject, recording) WHERE recording <> '';
CREATE TABLE exercise_set (
    session INTEGER NOT NULL REFERENCES session ON DELETE CASCADE,
    number INTEGER NOT NULL,
    exercise TEXT NOT NULL,
    side TEXT NOT NULL,
    mode TEXT NOT NULL,
    from_ns INTEGER NOT NULL,
    to_ns INTEGER NOT NULL,
    donning INTEGER NOT NULL,
    record TEXT NOT NULL,
    PRIMARY KEY (session, number)
) STRICT;
CREATE INDEX set_of_exercise ON exercise_set (exercise, side, mode);
CREATE TABLE rating (
    session INTEGER NOT NULL REFERENCES session ON DELETE CASCADE,
    kind TEXT NOT NULL,
    moment TEXT NOT NULL,
    value INTEGER NOT NULL CHECK (value BETWEEN 0 AND 10),
    time_ns INTEGER NOT NULL
) STRICT;
CREATE TABLE deleting (subject TEXT PRIMARY KEY) STRICT;
"""
"""`record` and `settings` are JSON. `deleting` names subjects whose deletion has begun: it is finished by
whoever opens the store next."""


class Unwritable(StoreError):
    """The file is there or not, but nothing can be written where it lies."""


def connect(folder: Path) -> sqlite3.Connection:
    """Open the folder's file, making its tables when it is new.

    Raises StoreError for a file that is not a store or cannot be written, or one of a newer Brachium.
    """
    path = folder / FILE
    try:
        connection = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None, check_same_thread=False)
    except sqlite3.OperationalError as error:
        raise _not_open(path, error) from None
    try:
        connection.row_factory = sqlite3.Row
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # what is deleted is overwritten
        _settle(connection, path)
    except sqlite3.OperationalError as error:  # it may well be one: locked, not to be written, a broken disk
        connection.close()
        raise _not_open(path, error) from None
    except sqlite3.DatabaseError as error:
        connection.close()
        raise StoreError(f"{path}: no store of sessions ({error}); choose another folder") from None
    except StoreError:
        connection.close()
        raise
    return connection


def connect_to_read(folder: Path) -> sqlite3.Connection:
    """Open the folder's file where nothing can be written, not even the log that readers share.

    Raises StoreError where there is none, or where rows lie in a log that cannot be read so.
    """
    path = folder / FILE
    log = path.with_name(path.name + "-wal")
    ways = ["mode=ro"] if log.is_file() and log.stat().st_size else ["mode=ro", "mode=ro&immutable=1"]
    said = ""
    for way in ways:
        try:
            connection = sqlite3.connect(
                f"{path.resolve().as_uri()}?{way}", uri=True, isolation_level=None, check_same_thread=False
            )
        except sqlite3.OperationalError as error:
            said = str(error)
            continue
        connection.row_factory = sqlite3.Row
        try:
            _tables(connection, path)
        except sqlite3.OperationalError as error:
            connection.close()
            said = str(error)
            continue
        except (sqlite3.DatabaseError, StoreError) as error:
            connection.close()
            raise StoreError(str(error)) from None
        return connection
    raise StoreError(f"{path}: cannot be read ({said}); copy the whole folder to where you may write")


def _not_open(path: Path, error: sqlite3.OperationalError) -> StoreError:
    kind = getattr(error, "sqlite_errorcode", 0) & 0xFF  # not every one is of the library
    unwritable = kind in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN)
    return (Unwritable if unwritable else StoreError)(
        f"{path}: cannot be opened for writing ({error}); give it back its rights, or choose another folder"
    )


def _settle(connection: sqlite3.Connection, path: Path) -> None:
    connection.execute("BEGIN IMMEDIATE")  # two processes may come to a new folder at once
    try:
        if not _tables(connection, path):
            for statement in TABLES.split(";"):
                connection.execute(statement)
            connection.execute(f"PRAGMA application_id = {APPLICATION}")
            connection.execute(f"PRAGMA user_version = {VERSION}")
    except BaseException:
        connection.execute("ROLLBACK")
        raise
    connection.execute("COMMIT")


def _tables(connection: sqlite3.Connection, path: Path) -> int:
    """Return how many tables there are; raises StoreError when they are none of ours, or newer ones."""
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    owner = int(connection.execute("PRAGMA application_id").fetchone()[0])
    tables = int(connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])
    if tables and owner != APPLICATION:
        raise StoreError(f"{path}: a SQLite file of another program; choose another folder")
    if version > VERSION:
        raise StoreError(
            f"{path}: written by a newer Brachium (tables of version {version}; "
            f"this one knows {VERSION}); update Brachium"
        )
    return tables
