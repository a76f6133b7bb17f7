"""What a page may ask for: one record a verb, checked here once. Pure."""

from typing import Annotated, Literal

import msgspec

from brachium_body.segments import Side
from brachium_viewer.catalogue import ENGLISH
from brachium_viewer.marks import ExerciseBegins, Mode, When

MAX_BYTES = 4096
"""A request is a few words."""

Rating = Annotated[int, msgspec.Meta(ge=0, le=10)]
Degrees = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]
Count = Annotated[int, msgspec.Meta(ge=1, le=100)]
Words = Annotated[str, msgspec.Meta(max_length=500)]


class BadRequest(ValueError):
    """What cannot be asked; `id` and `verb` as far as they can be read, and what is wrong for the log."""

    def __init__(self, wrong: str, head: "Head") -> None:
        super().__init__("the server does not know what this page asks: load the page anew")
        self.wrong, self.id, self.verb = wrong, head.id, head.verb


class Request(msgspec.Struct, frozen=True, kw_only=True, tag_field="verb"):
    """Base of all; `id` comes back with the answer."""

    id: int = 0
    language: Annotated[str, msgspec.Meta(max_length=8)] = ENGLISH
    """Of the page that asks, and so of a report that comes of it; English where there are no words of it."""


class Calibrate(Request, frozen=True, kw_only=True, tag="calibrate"):
    """Find how the sensors are worn."""

    routine: Literal["pose", "guided", "free"] = "pose"
    pose: Literal["n-pose", "table"] = "n-pose"
    seconds: Annotated[float, msgspec.Meta(ge=1.0, le=30.0)] = 3.0


class Zero(Request, frozen=True, kw_only=True, tag="zero"):
    """Set headings anew while the arms hang still."""


class WearCheck(Request, frozen=True, kw_only=True, tag="wear-check"):
    """Find which sensor sits where."""


class Plan(Request, frozen=True, kw_only=True, tag="plan"):
    """Say what is to be done next, to every screen."""

    exercise: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    side: Side
    mode: Mode = "active"
    goal_deg: Degrees | None = None
    limit_deg: Degrees | None = None
    set: Count = 1
    sets: Count = 1
    repetitions: Count | None = None

    def begins(self) -> ExerciseBegins:
        """Return the mark of the set that is meant."""
        return ExerciseBegins(
            exercise=self.exercise,
            side=self.side,
            mode=self.mode,
            goal_deg=self.goal_deg,
            limit_deg=self.limit_deg,
            set=self.set,
            sets=self.sets,
            repetitions=self.repetitions,
        )


class Exercise(Plan, frozen=True, kw_only=True, tag="exercise"):
    """Begin a set."""


class Stop(Request, frozen=True, kw_only=True, tag="stop"):
    """End the set that runs."""


class PatientStop(Request, frozen=True, kw_only=True, tag="patient-stop"):
    """End the set because the patient wants to."""

    reason: Literal["pain", "tired", "dizzy", "other"] = "other"


class Mark(Request, frozen=True, kw_only=True, tag="mark"):
    """Mark this instant."""

    text: Words = ""


class Donning(Request, frozen=True, kw_only=True, tag="donning"):
    """The sensors were put on anew."""


class Pain(Request, frozen=True, kw_only=True, tag="pain"):
    """Pain as the patient rates it."""

    value: Rating
    when: When


class Effort(Request, frozen=True, kw_only=True, tag="effort"):
    """Effort as the patient rates it."""

    value: Rating
    when: When


class Subject(Request, frozen=True, kw_only=True, tag="subject"):
    """Show a subject; with `create` one that is new."""

    subject: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    create: bool = False
    side: Literal["right", "left", "both"] = "right"
    height_m: Annotated[float, msgspec.Meta(ge=0.5, le=2.5)] | None = None


class Report(Request, frozen=True, kw_only=True, tag="report"):
    """End the session: close its recording and make its report."""


Any = (
    Calibrate
    | Zero
    | WearCheck
    | Plan
    | Exercise
    | Stop
    | PatientStop
    | Mark
    | Donning
    | Pain
    | Effort
    | Subject
    | Report
)


class Head(msgspec.Struct, frozen=True, kw_only=True):
    """What an answer needs of a request that is refused."""

    id: int = 0
    verb: str = ""


_decoder: msgspec.json.Decoder[Any] = msgspec.json.Decoder(Any)


def read(text: str) -> Any:
    """Return the request in a page's message. Raises BadRequest."""
    try:
        return _decoder.decode(text)
    except (msgspec.DecodeError, UnicodeEncodeError) as error:
        raise BadRequest(str(error), _head(text)) from None


def _head(text: str) -> Head:
    try:
        return msgspec.json.decode(text, type=Head)
    except (msgspec.DecodeError, UnicodeEncodeError):
        return Head()
