"""The store: what comes back is what was put in, what was not worn is nobody's history, deleted is gone."""

from pathlib import Path
from typing import Any

import pytest

from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.records import Subject
from brachium_viewer.sessions.store import Store
from brachium_wire.messages import Origin


def add(folder: Path, store: Store, scripts: Any, write: Any, name: str = "a.mcap", **more: Any) -> int:
    write(folder / name, scripts)
    return store.add(session_from_recording(folder / name, **more))


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
