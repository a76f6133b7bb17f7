"""What is kept of a person and of a session: plain values, no file. Pure.

A person is a pseudonym by the rule of keys (`wire.keys.subject_chunk`); who it is stands nowhere here.
"""

from dataclasses import dataclass, field
from typing import Any, Literal

from brachium_body.segments import Side
from brachium_viewer.marks import Ended, StopReason, When
from brachium_viewer.metrics.set_measures import SetMeasures
from brachium_wire.messages import Origin

METHOD = 3
"""Of the measures: it rises whenever one of them would give another number for the same movement."""


class StoreError(ValueError):
    """What the store refuses: one line that says what was expected, what came and what to do."""


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A person, by pseudonym."""

    pseudonym: str
    affected_side: Side | Literal["both", ""] = ""
    """Empty: not stated."""
    dominant_hand: Side | Literal["both", ""] = ""
    lengths_m: dict[str, float] = field(default_factory=dict)
    """chest_to_shoulder, upper_arm, forearm, hand."""
    notes: str = ""


@dataclass(frozen=True, kw_only=True)
class Rating:
    """Pain or effort as the patient rates it, 0 to 10."""

    kind: Literal["pain", "effort"]
    when: When
    value: int
    time_ns: int


@dataclass(frozen=True, kw_only=True)
class SetRecord:
    """One set of one exercise by one arm. `measures` has its exercise, side, mode and goal."""

    from_ns: int
    to_ns: int
    """Host time; the set is [from_ns, to_ns)."""
    measures: SetMeasures
    donning: int = 0
    """How often the sensors had been put on anew in this session before the set."""
    ended: Ended = "done"
    stop_reason: StopReason | Literal[""] = ""
    """The patient's, of a set that they stopped; empty when they gave none."""
    limit_deg: float | None = None
    wanted: int | None = None
    """Repetitions that were asked for."""

    @property
    def what(self) -> tuple[str, str, str]:
        """Return exercise, side and mode: sets that agree in them can be compared."""
        return self.measures.exercise, self.measures.side, self.measures.mode


@dataclass(frozen=True, kw_only=True)
class SessionRecord:
    """One session of one subject."""

    subject: str
    started_ns: int
    """Host time, ns since 1970."""
    origin: Origin
    """Worn when everything in it was; else what it was instead."""
    recording: str
    """Name of its file in the store's folder; empty when there is none."""
    sets: tuple[SetRecord, ...] = ()
    ratings: tuple[Rating, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    """As in the recording: the message `session`, and fusion's settings."""
    method: int = METHOD
    note: str = ""
    id: int | None = None
    """Its number in the store; None before it is there."""


@dataclass(frozen=True, kw_only=True)
class PastSet:
    """A set in a subject's history, with the session that it was in."""

    session: int
    started_ns: int
    method: int
    set: SetRecord
