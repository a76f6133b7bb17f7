"""Marks go through events and come back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer import marks
from brachium_wire.codec import decode_topic, encode
from brachium_wire.messages import Event

MARKS = st.one_of(
    st.builds(
        marks.ExerciseBegins,
        exercise=st.sampled_from(["elbow-flexion", "free"]),
        side=st.sampled_from(["right", "left"]),
        mode=st.sampled_from(["active", "assisted", "passive"]),
        goal_deg=st.none() | st.floats(-90, 170),
        limit_deg=st.none() | st.floats(-90, 170),
        set=st.integers(1, 9),
        repetitions=st.none() | st.integers(1, 50),
    ),
    st.builds(marks.ExerciseEnds, reason=st.sampled_from(["done", "stopped", "patient-stop"])),
    st.builds(marks.Pain, value=st.integers(0, 10), when=st.sampled_from(["before", "after"])),
    st.builds(marks.Effort, value=st.integers(0, 10), when=st.sampled_from(["before", "after"])),
    st.builds(marks.PatientStop, reason=st.sampled_from(["pain", "tired", "dizzy", "other"])),
    st.just(marks.Note()),
    st.just(marks.Donning()),
)


@given(mark=MARKS, time_ns=st.integers(1, 2**62), text=st.text(max_size=50))
def test_a_mark_goes_over_the_wire_and_comes_back(mark: marks.Mark, time_ns: int, text: str) -> None:
    message = decode_topic(encode(marks.event(mark, time_ns, text)), "event")
    assert isinstance(message, Event)
    assert (message.time_ns, message.text) == (time_ns, text)
    assert marks.read(message) == mark


def test_other_events_are_no_marks() -> None:
    assert marks.read(Event(time_ns=1, kind="changes")) is None


@pytest.mark.parametrize("value", [-1, 11])
def test_a_rating_outside_its_scale_is_refused(value: int) -> None:
    with pytest.raises(marks.BadMark, match="0 to 10"):
        marks.event(marks.Pain(value=value, when="before"), 1)


def test_broken_data_are_refused_with_the_field() -> None:
    with pytest.raises(marks.BadMark, match="side"):
        marks.read(Event(time_ns=1, kind="exercise", data={"exercise": "free", "side": "middle"}))


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        (marks.ExerciseBegins(exercise="drinking", side="left", mode="passive", limit_deg=100.5),
         "drinking, left, passive, limit 100.5 deg"),
        (marks.ExerciseBegins(exercise="free", side="right"), "free, right, active"),
        (marks.ExerciseEnds(reason="stopped"), "stopped"),
        (marks.Pain(value=3, when="before"), "3 before"),
        (marks.PatientStop(reason="dizzy"), "dizzy"),
        (marks.Donning(), ""),
    ],
)  # fmt: skip
def test_what_was_marked_is_said_in_words(mark: marks.Mark, said: str) -> None:
    event = marks.event(mark, 1)
    assert marks.in_words(event.kind, event.data) == said


def test_other_events_and_broken_data_say_nothing() -> None:
    assert marks.in_words("tap", {"strength": 3}) == ""
    assert marks.in_words("exercise", {"exercise": "free", "side": "middle"}) == ""
