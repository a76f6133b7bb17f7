"""The store: subjects and their sessions in SQLite, in the folder that holds the recordings.

Several processes and threads may use one folder at once. Only what was worn is a person's history; sessions
of emulated wearers and of played files are kept, and shown as what they are, apart from it.
"""

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import msgspec

from brachium_viewer.sessions import folder as files
from brachium_viewer.sessions.records import PastSet, Rating, SessionRecord, SetRecord, StoreError, Subject
from brachium_viewer.sessions.schema import connect
from brachium_wire import keys


class Store:
    """One folder of sessions. Close it, or use it in a `with` block."""

    def __init__(self, folder: Path, connection: sqlite3.Connection) -> None:
        self.folder = folder
        self._connection = connection
        self._lock = threading.RLock()

    @classmethod
    def open(cls, folder: Path) -> Self:
        """Open a folder, making it when it is not there; a deletion that was cut short is finished.

        Raises StoreError when its file is of a newer Brachium or of another program.
        """
        folder.mkdir(parents=True, exist_ok=True)
        store = cls(folder, connect(folder))
        for row in store._rows("SELECT subject FROM deleting"):
            store._finish_deleting(row["subject"])
        return store

    def close(self) -> None:
        """Close the file; closing twice is harmless."""
        with self._lock:
            self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def subjects(self) -> tuple[Subject, ...]:
        """Return everybody, by pseudonym."""
        return tuple(map(_subject, self._rows("SELECT * FROM subject ORDER BY pseudonym")))

    def subject(self, pseudonym: str) -> Subject | None:
        """Return one person, or None."""
        rows = self._rows("SELECT * FROM subject WHERE pseudonym = ?", pseudonym)
        return _subject(rows[0]) if rows else None

    def put_subject(self, subject: Subject) -> None:
        """Keep a person, or change what is kept. Raises keys.BadKey for what cannot be a pseudonym."""
        keys.subject_chunk(subject.pseudonym)
        with self.together() as db:
            _refuse_deleting(db, subject.pseudonym)
            db.execute(
                "INSERT INTO subject VALUES (?, ?, ?, ?, ?) ON CONFLICT (pseudonym) DO UPDATE SET "
                "affected_side = excluded.affected_side, dominant_hand = excluded.dominant_hand, "
                "lengths_m = excluded.lengths_m, notes = excluded.notes",
                (
                    subject.pseudonym,
                    subject.affected_side,
                    subject.dominant_hand,
                    _json(subject.lengths_m),
                    subject.notes,
                ),
            )

    def add(self, session: SessionRecord) -> int:
        """Keep a session and return its number; one of the same recording takes the place of the earlier one.

        A subject that is not known yet is made. Raises StoreError when its recording is not in the folder
        (`folder.copy_of` brings one in) and keys.BadKey for what cannot be a pseudonym.
        """
        keys.subject_chunk(session.subject)
        if session.recording and not self.recording(session).is_file():
            raise StoreError(f"{session.recording}: not in {self.folder}; a session's recording lies there")
        with self.together() as db:
            _refuse_deleting(db, session.subject)
            db.execute(
                "INSERT OR IGNORE INTO subject VALUES (?, '', '', '{}', '')",
                (session.subject,),
            )
            if session.recording:
                db.execute(
                    "DELETE FROM session WHERE subject = ? AND recording = ?",
                    (session.subject, session.recording),
                )
            return _insert(db, session)

    def sessions(self, subject: str | None = None) -> tuple[SessionRecord, ...]:
        """Return sessions of whatever origin, of one subject or of all, newest first."""
        where, values = ("", ()) if subject is None else ("WHERE subject = ?", (subject,))
        rows = self._rows(f"SELECT * FROM session {where} ORDER BY started_ns DESC, id DESC", *values)
        return tuple(self._session(row) for row in rows)

    def session(self, number: int) -> SessionRecord:
        """Return one session; raises StoreError when there is none of this number."""
        rows = self._rows("SELECT * FROM session WHERE id = ?", number)
        if not rows:
            raise StoreError(f"there is no session {number} in {self.folder}")
        return self._session(rows[0])

    def recording(self, session: SessionRecord) -> Path:
        """Return where a session's recording lies. Raises StoreError for a name that leads elsewhere."""
        if Path(session.recording).name != session.recording or session.recording in (".", ".."):
            raise StoreError(
                f"{session.recording!r}: a session's recording is a file's name, without a folder"
            )
        return self.folder / session.recording

    def history(
        self, subject: str, exercise: str, side: str, mode: str = "active", before_ns: int | None = None
    ) -> tuple[PastSet, ...]:
        """Return a person's sets of an exercise that were worn, oldest first; `before_ns`: of earlier
        sessions only."""
        rows = self._rows(
            "SELECT session.id, started_ns, method, record FROM exercise_set "
            "JOIN session ON session.id = exercise_set.session "
            "WHERE subject = ? AND origin = 'worn' AND exercise = ? AND side = ? AND mode = ? "
            "AND (? IS NULL OR started_ns < ?) ORDER BY started_ns, session.id, number",
            *(subject, exercise, side, mode, before_ns, before_ns),
        )
        return tuple(
            PastSet(
                session=row["id"],
                started_ns=row["started_ns"],
                method=row["method"],
                set=msgspec.json.decode(row["record"], type=SetRecord),
            )
            for row in rows
        )

    def delete(self, subject: str) -> None:
        """Delete everything of a subject: rows, recordings, and what lies beside them.

        Others who are in the same recording stay in it. Cut short, it is finished when the store is opened.
        Raises StoreError for a subject that is not known, and while one of its recordings is being written.
        """
        known = self.subject(subject) is not None or any(files.of_subject(self.folder, subject))
        if not known:
            raise StoreError(f"there is no subject {subject!r} in {self.folder}")
        files.check_free(self.folder, subject)
        with self.together() as db:
            db.execute("INSERT OR IGNORE INTO deleting VALUES (?)", (subject,))
        self._finish_deleting(subject)

    def _finish_deleting(self, subject: str) -> None:
        with self.together() as db:
            # A second process that came for the same waits above, and finds nothing left to do.
            files.remove(self.folder, subject)
            db.execute("DELETE FROM subject WHERE pseudonym = ?", (subject,))
            db.execute("DELETE FROM deleting WHERE subject = ?", (subject,))
        with self._lock:
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # the log still has the old pages

    def _session(self, row: sqlite3.Row) -> SessionRecord:
        sets = self._rows("SELECT record FROM exercise_set WHERE session = ? ORDER BY number", row["id"])
        ratings = self._rows("SELECT * FROM rating WHERE session = ? ORDER BY time_ns", row["id"])
        return SessionRecord(
            id=row["id"],
            subject=row["subject"],
            started_ns=row["started_ns"],
            origin=row["origin"],
            recording=row["recording"],
            settings=msgspec.json.decode(row["settings"]),
            method=row["method"],
            note=row["note"],
            sets=tuple(msgspec.json.decode(one["record"], type=SetRecord) for one in sets),
            ratings=tuple(
                Rating(kind=r["kind"], when=r["moment"], value=r["value"], time_ns=r["time_ns"])
                for r in ratings
            ),
        )

    def _rows(self, question: str, *values: object) -> list[sqlite3.Row]:
        with self._lock:
            return self._connection.execute(question, values).fetchall()

    @contextmanager
    def together(self) -> Iterator[sqlite3.Connection]:
        """One transaction: what is written inside is kept whole or not at all."""
        with self._lock:
            if self._connection.in_transaction:
                yield self._connection
                return
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection
            except BaseException:
                self._connection.execute("ROLLBACK")
                raise
            self._connection.execute("COMMIT")


def _insert(db: sqlite3.Connection, session: SessionRecord) -> int:
    number = db.execute(
        "INSERT INTO session (subject, started_ns, origin, recording, settings, method, note) "
        "VALUES (?, ?, ?, ?, ?, ?, ?)",
        (
            session.subject,
            session.started_ns,
            session.origin,
            session.recording,
            _json(session.settings),
            session.method,
            session.note,
        ),
    ).lastrowid
    assert number is not None
    for i, one in enumerate(session.sets):
        db.execute(
            "INSERT INTO exercise_set VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (number, i, *one.what, one.from_ns, one.to_ns, one.donning, _json(one)),
        )
    for r in session.ratings:
        db.execute("INSERT INTO rating VALUES (?, ?, ?, ?, ?)", (number, r.kind, r.when, r.value, r.time_ns))
    return number


def _refuse_deleting(db: sqlite3.Connection, subject: str) -> None:
    if db.execute("SELECT 1 FROM deleting WHERE subject = ?", (subject,)).fetchone():
        raise StoreError(f"{subject} is being deleted; open the folder again to finish it")


def _subject(row: sqlite3.Row) -> Subject:
    return Subject(
        pseudonym=row["pseudonym"],
        affected_side=row["affected_side"],
        dominant_hand=row["dominant_hand"],
        lengths_m=msgspec.json.decode(row["lengths_m"], type=dict[str, float]),
        notes=row["notes"],
    )


def _json(value: Any) -> str:
    return msgspec.json.encode(value, enc_hook=str).decode()
