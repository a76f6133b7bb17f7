"""Sets are told apart by their marks, and a patient's stop keeps its reason."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from brachium_viewer import marks as m
from brachium_viewer.contents import Contents, load
from brachium_viewer.sessions.from_recording import (
    readable,
    session_from_recording,
    spans,
    stops_between_sets,
    the_subject,
)
from brachium_viewer.sessions.records import SetRecord, StoreError

RIGHT, LEFT = (m.ExerciseBegins(exercise="elbow-flexion", side=side) for side in ("right", "left"))


def ends(*found: tuple[int, m.Mark]) -> list[tuple[str, int, int, str, str]]:
    return [(s.begins.side, s.from_ns, s.to_ns, s.ended, s.stop_reason) for s in spans(found, 100)]


def test_a_set_lasts_to_its_end_to_the_next_begin_of_its_arm_or_to_the_recordings() -> None:
    assert ends((1, RIGHT), (5, m.ExerciseEnds()), (6, RIGHT), (9, RIGHT), (10, LEFT)) == [
        ("right", 1, 5, "done", ""),
        ("right", 6, 9, "done", ""),
        ("right", 9, 100, "stopped", ""),
        ("left", 10, 100, "stopped", ""),
    ]


def test_a_stop_has_the_reason_that_was_told_last_before_the_next_set() -> None:
    stop, over = m.PatientStop(), m.ExerciseEnds(reason="patient-stop")
    dizzy, pain = m.PatientStop(reason="dizzy"), m.PatientStop(reason="pain")
    expected = [("right", 1, 5, "patient-stop", "dizzy"), ("right", 20, 30, "done", "")]
    after = ((20, RIGHT), (30, m.ExerciseEnds()), (31, pain))
    for stopped in (((5, over), (5, stop), (9, dizzy)), ((5, stop), (6, over), (9, dizzy)), ((5, dizzy),)):
        assert ends((1, RIGHT), *stopped, *after) == expected
    assert ends((1, RIGHT), (1, LEFT), (4, over), (5, pain)) == [
        ("right", 1, 4, "patient-stop", "pain"),
        ("left", 1, 4, "patient-stop", "pain"),
    ]
    assert ends((1, RIGHT), (5, over)) == [("right", 1, 5, "patient-stop", "")]


def test_a_stop_while_no_set_runs_is_told_by_itself(
    script: Any, write_session: Callable[..., Path], tmp_path: Path
) -> None:
    one = script()
    one.mark(m.PatientStop())
    one.now_s += 1.0
    one.mark(m.PatientStop(reason="tired"))
    for reason in ("dizzy", None):
        one.mark(m.ExerciseBegins(exercise="elbow-flexion", side="right"))
        one.move(2, 90.0)
        one.mark(m.ExerciseEnds(reason="patient-stop" if reason else "done"))
        one.now_s += 1.0
        one.mark(m.PatientStop(reason=reason or "pain"))
        one.now_s += 1.0
    path = write_session(tmp_path / "a.mcap", [one])
    session = session_from_recording(path)
    assert [(s.ended, s.stop_reason) for s in session.sets] == [("patient-stop", "dizzy"), ("done", "")]
    assert msgspec.json.decode(msgspec.json.encode(session.sets[0]), type=SetRecord) == session.sets[0]
    marks = readable(load(path).events["p01"])
    assert stops_between_sets(marks, session.sets) == ["tired", "pain"]


def test_a_rating_alone_is_no_session_and_says_so() -> None:
    contents = Contents(events={"p09": [m.event(m.Pain(value=4, when="before"), 1)]})
    with pytest.raises(StoreError, match="holds what was said of p09, and no sensor"):
        the_subject(contents, "a.mcap", "p09")
    with pytest.raises(StoreError, match="holds no 'p08'"):
        the_subject(contents, "a.mcap", "p08")
