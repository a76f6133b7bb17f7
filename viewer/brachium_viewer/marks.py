"""What a page writes into a recording beside the movement, and a report reads: the events of a session.

A mark is a wire message `event`; its kind is one of KINDS and its data are the mark's fields.
"""

from typing import Any, Literal

import msgspec

from brachium_wire.messages import Event

Mode = Literal["active", "assisted", "passive"]
When = Literal["before", "after"]
Ended = Literal["done", "stopped", "patient-stop"]
StopReason = Literal["pain", "tired", "dizzy", "other"]


class Mark(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=False):
    """Base of all marks."""


class ExerciseBegins(Mark, frozen=True, kw_only=True):
    """A set begins."""

    exercise: str
    """By exercises.EXERCISES."""
    side: Literal["right", "left"]
    mode: Mode = "active"
    goal_deg: float | None = None
    limit_deg: float | None = None
    """Not to be passed."""
    set: int = 1
    """The how manieth set of this exercise."""
    sets: int = 1
    """As many are wanted."""
    repetitions: int | None = None
    """As many are wanted in a set."""


class ExerciseEnds(Mark, frozen=True, kw_only=True):
    """The set that runs ends."""

    reason: Ended = "done"


class Pain(Mark, frozen=True, kw_only=True):
    """Pain as the patient rates it."""

    value: int
    """0 none to 10 worst."""
    when: When


class Effort(Mark, frozen=True, kw_only=True):
    """Effort as the patient rates it."""

    value: int
    """0 none to 10 all."""
    when: When


class PatientStop(Mark, frozen=True, kw_only=True):
    """The patient stopped."""

    reason: StopReason = "other"


class Note(Mark, frozen=True, kw_only=True):
    """The therapist marks an instant; the event's text is what was written."""


class Donning(Mark, frozen=True, kw_only=True):
    """The sensors were put on anew: the same movement before and after tells the measurement's own error."""


KINDS: dict[str, type[Mark]] = {
    "exercise": ExerciseBegins,
    "exercise-end": ExerciseEnds,
    "pain": Pain,
    "effort": Effort,
    "patient-stop": PatientStop,
    "mark": Note,
    "donning": Donning,
}
_KIND = {mark: kind for kind, mark in KINDS.items()}


class BadMark(ValueError):
    """The numbers of a mark that cannot be: one line that says what was expected."""


def event(mark: Mark, time_ns: int, text: str = "") -> Event:
    """Return the message of a mark. Raises BadMark for a rating outside 0 to 10."""
    if isinstance(mark, Pain | Effort) and not 0 <= mark.value <= 10:
        raise BadMark(f"{_KIND[type(mark)]} is rated from 0 to 10; came {mark.value}")
    return Event(time_ns=time_ns, kind=_KIND[type(mark)], text=text, data=msgspec.to_builtins(mark))


def read(message: Event) -> Mark | None:
    """Return the mark of an event; None for one of another kind.

    Raises BadMark when its data are not those of its kind.
    """
    kind = KINDS.get(message.kind)
    if kind is None:
        return None
    try:
        return msgspec.convert(message.data, kind)
    except msgspec.ValidationError as error:
        raise BadMark(f"event {message.kind}: {error}") from None


def in_words(kind: str, data: dict[str, Any]) -> str:
    """Return what the data of an event say, in a few words: which exercise, how much pain.

    Empty where they say nothing, for events of other kinds, and for data that are not those of their kind.
    """
    try:
        mark = read(Event(time_ns=1, kind=kind, data=data))
    except BadMark:
        return ""
    match mark:
        case ExerciseBegins():
            limits = (("goal", mark.goal_deg), ("limit", mark.limit_deg))
            degrees = [f"{name} {value:g} deg" for name, value in limits if value is not None]
            return ", ".join([mark.exercise, mark.side, mark.mode, *degrees])
        case Pain() | Effort():
            return f"{mark.value} {mark.when}"
        case ExerciseEnds() | PatientStop():
            return mark.reason
        case _:
            return ""
