"""The store: what comes back is what was put in, what was not worn is nobody's history, deleted is gone."""

import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from brachium_viewer import marks
from brachium_viewer.sessions import folder, schema
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.records import StoreError, Subject
from brachium_viewer.sessions.store import Store
from brachium_wire import keys, recording
from brachium_wire.messages import Origin


def add(where: Path, store: Store, scripts: Any, write: Any, name: str = "a.mcap", **more: Any) -> int:
    write(where / name, scripts)
    return store.add(session_from_recording(where / name, **more))


def test_a_session_comes_back_as_it_was_put_in(tmp_path: Path, script: Any, write_session: Any) -> None:
    one = script("p01")
    one.set(3, 90.0, goal_deg=80.0)
    write_session(tmp_path / "a.mcap", [one])
    session = session_from_recording(tmp_path / "a.mcap")
    assert len(session.sets[0].measures.repetitions) == 3
    with Store.open(tmp_path) as store:
        store.put_subject(Subject(pseudonym="p01", affected_side="right", lengths_m={"hand": 0.18}))
        number = store.add(session)
    with Store.open(tmp_path) as store:
        back = store.session(number)
        assert back.sets == session.sets
        assert (back.settings, back.origin, back.recording) == (session.settings, "worn", "a.mcap")
        assert store.subject("p01") == Subject(
            pseudonym="p01", affected_side="right", lengths_m={"hand": 0.18}
        )


@pytest.mark.parametrize("origin", ["emulated", "playback"])
def test_what_was_not_worn_is_in_nobodys_history(
    tmp_path: Path, script: Any, write_session: Any, origin: Origin
) -> None:
    worn, other = script("p01", "worn"), script("p01", origin)
    for one in (worn, other):
        one.set(3, 90.0)
    with Store.open(tmp_path) as store:
        first = add(tmp_path, store, [worn], write_session, "worn.mcap")
        add(tmp_path, store, [other], write_session, "other.mcap")
        assert [past.session for past in store.history("p01", "elbow-flexion", "right")] == [first]
        assert {s.origin for s in store.sessions("p01")} == {"worn", origin}


def test_deleting_leaves_nothing(tmp_path: Path, script: Any, write_session: Any) -> None:
    one, other = script("patient-77"), script("p02")
    for who in (one, other):
        who.set(2, 90.0)
    with Store.open(tmp_path) as store:
        add(tmp_path, store, [one, other], write_session, subject="patient-77")
        store.add(session_from_recording(tmp_path / "a.mcap", "p02"))
        (tmp_path / "a.html").write_text("a report of patient-77")
        assert any(b"patient-77" in path.read_bytes() for path in tmp_path.iterdir())
        store.delete("patient-77")
        for path in tmp_path.rglob("*"):
            assert b"patient-77" not in path.read_bytes(), path
        assert len(store.sessions("p02")[0].sets) == 1
    assert len(session_from_recording(tmp_path / "a.mcap").sets) == 1


def test_a_deletion_cut_short_is_finished_at_the_next_opening(
    tmp_path: Path, script: Any, write_session: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = script("patient-77")
    one.set(2, 90.0)
    with Store.open(tmp_path) as store:
        add(tmp_path, store, [one], write_session)

        def fails(*_: object) -> None:
            raise OSError("power")

        with monkeypatch.context() as patch:
            patch.setattr(folder, "remove", fails)
            with pytest.raises(OSError, match="power"):
                store.delete("patient-77")
        with pytest.raises(StoreError, match="being deleted"):
            store.put_subject(Subject(pseudonym="patient-77"))
    with Store.open(tmp_path) as store:
        assert store.subjects() == ()
    assert not list(tmp_path.glob("*.mcap"))


def test_a_recording_that_is_being_written_is_not_deleted(tmp_path: Path, script: Any) -> None:
    message = script("p01").messages[0]
    with Store.open(tmp_path) as store, recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        store.put_subject(Subject(pseudonym="p01"))
        writer.write(message[1], message[2], 1)
        writer.tick(10_000_000_000)
        with pytest.raises(StoreError, match="being written"):
            store.delete("p01")
        assert store.subject("p01") is not None


def test_a_deletion_leaves_another_recording_whose_name_begins_alike(
    tmp_path: Path, script: Any, write_session: Any
) -> None:
    one, other = script("p01"), script("p02")
    for who in (one, other):
        who.set(2, 90.0)
    with Store.open(tmp_path) as store:
        add(tmp_path, store, [one], write_session)
        write_session(tmp_path / "a.b.mcap", [other])
        store.add(session_from_recording(tmp_path / "a.b.mcap"))
        store.delete("p01")
        assert {path.name for path in tmp_path.glob("*.mcap")} == {"a.b.mcap"}


@pytest.fixture
def kept(tmp_path: Path, script: Any, write_session: Any) -> Iterator[tuple[Store, Any]]:
    """A store that keeps one session, a.mcap, and who did it."""
    one = script("p01")
    one.set(2, 90.0)
    with Store.open(tmp_path) as store:
        add(tmp_path, store, [one], write_session)
        yield store, one


def test_a_recording_whose_session_nobody_kept_is_found(
    tmp_path: Path, kept: tuple[Store, Any], write_session: Any
) -> None:
    store, one = kept
    write_session(tmp_path / "b.mcap", [one])
    known = {session.recording for session in store.sessions()}
    message = one.messages[0]
    with recording.RecordingWriter(tmp_path / "c.mcap") as writer:
        writer.write(message[1], message[2], 1)
        writer.tick(10_000_000_000)
        assert folder.in_no_session(tmp_path, known) == [tmp_path / "b.mcap"]


def test_a_store_that_cannot_be_written_is_not_called_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise sqlite3.OperationalError("attempt to write a readonly database")

    with monkeypatch.context() as patch:
        patch.setattr(schema, "_settle", refused)
        with pytest.raises(StoreError, match="cannot be opened for writing"):
            Store.open(tmp_path)
    (tmp_path / "taken" / schema.FILE).mkdir(parents=True)
    with pytest.raises(StoreError, match="cannot be opened for writing"):
        Store.open(tmp_path / "taken")


def test_a_newer_or_a_foreign_file_is_refused(tmp_path: Path) -> None:
    Store.open(tmp_path / "newer").close()
    with sqlite3.connect(tmp_path / "newer" / schema.FILE) as db:
        db.execute(f"PRAGMA user_version = {schema.VERSION + 1}")
    with pytest.raises(StoreError, match="newer Brachium"):
        Store.open(tmp_path / "newer")
    (tmp_path / "foreign").mkdir()
    with sqlite3.connect(tmp_path / "foreign" / schema.FILE) as db:
        db.execute("CREATE TABLE songs (title TEXT)")
    with pytest.raises(StoreError, match="another program"):
        Store.open(tmp_path / "foreign")
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / schema.FILE).write_bytes(b"no database" * 100)
    with pytest.raises(StoreError, match="no store"):
        Store.open(tmp_path / "none")


ADDS = """
import sys
from pathlib import Path
from brachium_viewer.sessions.records import SessionRecord
from brachium_viewer.sessions.store import Store
with Store.open(Path(sys.argv[1])) as store:
    for i in range(20):
        store.add(SessionRecord(subject=sys.argv[2], started_ns=i, origin="worn", recording=""))
"""


def test_two_processes_use_one_new_folder_at_once(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    running = [
        subprocess.Popen([sys.executable, "-c", ADDS, str(tmp_path), who], env=environment)
        for who in ("p01", "p02")
    ]
    assert [one.wait(120) for one in running] == [0, 0]
    with Store.open(tmp_path) as store:
        assert [len(store.sessions(who)) for who in ("p01", "p02")] == [20, 20]


def test_the_same_recording_measured_again_takes_the_earlier_ones_place(
    tmp_path: Path, kept: tuple[Store, Any]
) -> None:
    store, _ = kept
    store.add(session_from_recording(tmp_path / "a.mcap"))
    assert len(store.sessions("p01")) == 1


@pytest.mark.parametrize("name", ["../x", "Müller", "", "service"])
def test_a_name_that_is_no_pseudonym_is_refused(tmp_path: Path, name: str) -> None:
    with Store.open(tmp_path) as store, pytest.raises(keys.BadKey):
        store.put_subject(Subject(pseudonym=name))


def test_marks_become_sets_with_what_was_asked(tmp_path: Path, script: Any, write_session: Any) -> None:
    one = script("p01")
    one.mark(marks.Pain(value=4, when="before"))
    one.set(2, 80.0, goal_deg=70.0, repetitions=3)
    one.mark(marks.Donning())
    one.set(3, 85.0, mode="passive")
    one.mark(marks.ExerciseBegins(exercise="elbow-flexion", side="right"))
    one.move(2, 60.0)  # nobody marked its end
    found = session_from_recording(write_session(tmp_path / "a.mcap", [one]))
    assert [(s.what[2], len(s.measures.repetitions), s.donning, s.ended) for s in found.sets] == [
        ("active", 2, 0, "done"),
        ("passive", 3, 1, "done"),
        ("active", 2, 1, "stopped"),
    ]
    assert (found.sets[0].measures.goal_deg, found.sets[0].wanted) == (70.0, 3)
    assert [(r.kind, r.value, r.when) for r in found.ratings] == [("pain", 4, "before")]


def test_a_recording_without_marks_is_measured_as_told(
    tmp_path: Path, script: Any, write_session: Any
) -> None:
    one = script("p01")
    one.move(3, 80.0)
    path = write_session(tmp_path / "a.mcap", [one])
    assert session_from_recording(path).sets == ()
    told = marks.ExerciseBegins(exercise="elbow-flexion", side="right")
    assert len(session_from_recording(path, without_marks=told).sets[0].measures.repetitions) == 3
    left = marks.ExerciseBegins(exercise="elbow-flexion", side="left")
    with pytest.raises(StoreError, match="no left arm"):
        session_from_recording(path, without_marks=left)
    with pytest.raises(StoreError, match="no 'p09'"):
        session_from_recording(path, "p09")
