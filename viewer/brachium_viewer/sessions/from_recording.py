"""A recording's marks turned into sets, each with its measures."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from brachium_body.segments import SIDES, Side
from brachium_viewer import contents as c
from brachium_viewer.contents import Contents
from brachium_viewer.exercises import EXERCISES, exercise
from brachium_viewer.marks import (
    BadMark,
    Donning,
    Effort,
    Ended,
    ExerciseBegins,
    ExerciseEnds,
    Mark,
    Pain,
    PatientStop,
    StopReason,
    read,
)
from brachium_viewer.metrics.arm_motion import ArmMotion, arm_motion
from brachium_viewer.metrics.set_measures import set_measures
from brachium_viewer.sessions.records import Rating, SessionRecord, SetRecord, StoreError
from brachium_wire.messages import Event, Origin


@dataclass(frozen=True, kw_only=True)
class Span:
    """One set as marked."""

    begins: ExerciseBegins
    from_ns: int
    to_ns: int
    ended: Ended
    donning: int
    stop_reason: StopReason | Literal[""] = ""


def session_from_recording(
    path: Path, subject: str | None = None, without_marks: ExerciseBegins | None = None
) -> SessionRecord:
    """Return the session that a recording holds; `subject` is needed where it holds several.

    `without_marks` is what was done in a recording in which nobody marked an exercise. Raises
    recording.RecordingError for a file that is none, and StoreError when there is nothing of this subject,
    or an exercise is named although some are marked.
    """
    contents = c.load(path)
    who = the_subject(contents, path.name, subject)
    return session(contents, path.name, who, motions(contents, who), without_marks)


def the_subject(contents: Contents, name: str, wanted: str | None = None) -> str:
    """Return the subject asked for, or the only one."""
    found = sorted({who for who, _ in (*contents.arms, *contents.sensors)})
    if wanted is not None and wanted not in found and wanted in contents.events:
        raise StoreError(
            f"{name}: holds what was said of {wanted}, and no sensor or arm of theirs: nothing was measured, "
            "so there is no report and it is in no history; the file stays where it is"
        )
    if wanted is not None and wanted not in found:
        raise StoreError(f"{name}: holds no {wanted!r}; there {_are(found)}")
    if wanted is None and len(found) != 1:
        raise StoreError(f"{name}: there {_are(found)}; choose a subject")
    return wanted or found[0]


def motions(contents: Contents, subject: str) -> dict[Side, ArmMotion]:
    """Return the motion of each arm that was tracked; times count from `zero_ns`."""
    zero = zero_ns(contents, subject)
    return {
        side: arm_motion(arm.published, zero)
        for side in SIDES
        if (arm := contents.arms.get((subject, side))) is not None and len(arm.published)
    }


def zero_ns(contents: Contents, subject: str) -> int:
    """Return the instant of a subject's first skeleton, from which a session's seconds count."""
    arms = [
        int(arm.published.time_ns[0])
        for (who, _), arm in contents.arms.items()
        if who == subject and len(arm.published)
    ]
    return min(arms, default=contents.first_ns or 0)


def session(
    contents: Contents,
    name: str,
    subject: str,
    arms: dict[Side, ArmMotion],
    without_marks: ExerciseBegins | None = None,
) -> SessionRecord:
    """Return the session of a subject from what its recording holds."""
    marks = readable(contents.events.get(subject, ()))
    zero = zero_ns(contents, subject)
    end = max((zero + round(1e9 * float(m.time_s[-1])) + 1 for m in arms.values()), default=zero)
    found = spans(marks, end)
    if found and without_marks is not None:
        marked = ", ".join(dict.fromkeys(f"{one.begins.exercise} {one.begins.side}" for one in found))
        raise StoreError(f"{name}: what was done is marked in it ({marked}); name no exercise and no side")
    found = found or _unmarked(contents, subject, arms, end, without_marks)
    said = contents.sessions.get(subject)
    return SessionRecord(
        subject=subject,
        started_ns=contents.first_ns or zero,
        origin=origin(contents, subject),
        recording=name,
        sets=tuple(_set(span, arms[span.begins.side], zero) for span in found if span.begins.side in arms),
        ratings=tuple(_rating(mark, at) for at, mark in marks if isinstance(mark, Pain | Effort)),
        settings={"session": msgspec.to_builtins(said)} if said is not None else {},
    )


def readable(events: Iterable[Event]) -> list[tuple[int, Mark]]:
    """Return the marks among events in order of time; what is none, or is malformed, is left out."""
    found = []
    for event in events:
        try:
            mark = read(event)
        except BadMark:
            continue
        if mark is not None:
            found.append((event.time_ns, mark))
    return sorted(found, key=lambda one: one[0])


def spans(marks: Iterable[tuple[int, Mark]], end_ns: int) -> list[Span]:
    """Return the sets: from each begin to its end, to the next begin of the same arm, or to `end_ns`.

    A patient's stop ends what runs. Its reason is asked for afterwards: the last one before the next begin
    counts.
    """
    found: list[Span] = []
    stopped: list[int] = []
    running: dict[str, tuple[ExerciseBegins, int, int]] = {}
    donned = 0

    def close(sides: Iterable[str], at: int, how: Ended) -> list[int]:
        first = len(found)
        for side in list(sides):
            begins, from_ns, donning = running.pop(side)
            found.append(Span(begins=begins, from_ns=from_ns, to_ns=at, ended=how, donning=donning))
        return list(range(first, len(found)))

    for at, mark in marks:
        if isinstance(mark, ExerciseBegins):
            close([mark.side] if mark.side in running else [], at, "done")
            running[mark.side], stopped = (mark, at, donned), []
        elif isinstance(mark, ExerciseEnds):
            closed = close(running, at, mark.reason)
            stopped = closed if mark.reason == "patient-stop" and closed else stopped
        elif isinstance(mark, PatientStop):
            stopped = close(running, at, "patient-stop") or stopped
            for i in stopped:
                found[i] = replace(found[i], stop_reason=mark.reason)
        elif isinstance(mark, Donning):
            donned += 1
    close(running, end_ns, "stopped")
    return sorted(found, key=lambda span: span.from_ns)


def stops_between_sets(marks: Iterable[tuple[int, Mark]], sets: Sequence[SetRecord]) -> list[StopReason]:
    """Return the reasons of the patient's stops that ended no set, the last one after each set."""
    found: dict[int, StopReason] = {}
    for at, mark in marks:
        if isinstance(mark, PatientStop):
            before = max((one for one in sets if one.from_ns < at), key=lambda one: one.to_ns, default=None)
            if before is None or before.ended != "patient-stop":
                found[0 if before is None else before.to_ns] = mark.reason
    return list(found.values())


def origin(contents: Contents, subject: str) -> Origin:
    """Return where a subject's data come from: worn only when every sensor and skeleton was.

    Raises StoreError when nothing says it.
    """
    found: set[str] = {
        s.info.origin for (who, _), s in contents.sensors.items() if who == subject and s.info is not None
    }
    for (who, _), arm in contents.arms.items():
        if who == subject:
            found |= {s.origin for s in arm.published.examples}
    for word in ("emulated", "playback", "worn"):
        if word in found:
            return word
    raise StoreError(f"the recording does not say where the data of {subject} come from")


def _unmarked(
    contents: Contents,
    subject: str,
    arms: dict[Side, ArmMotion],
    end: int,
    given: ExerciseBegins | None,
) -> list[Span]:
    """Return each arm from its calibration on as one set: of what was given, or of what the session names."""
    said = contents.sessions.get(subject)
    if given is not None:
        begins = [given]
    elif said is not None and said.exercise in EXERCISES:
        begins = [ExerciseBegins(exercise=said.exercise, side=side) for side in arms]
    else:
        return []
    found = []
    for one in begins:
        if one.side not in arms:
            raise StoreError(f"the recording holds no {one.side} arm of {subject}")
        arm = contents.arms[subject, one.side]
        settled = c.calibrated(arm.published)
        if settled.any():
            first = int(arm.published.time_ns[np.argmax(settled)])
            found.append(Span(begins=one, from_ns=first, to_ns=end, ended="done", donning=0))
    return found


def _set(span: Span, motion: ArmMotion, zero: int) -> SetRecord:
    part = motion.between((span.from_ns - zero) / 1e9, (span.to_ns - zero) / 1e9)
    begins = span.begins
    return SetRecord(
        from_ns=span.from_ns,
        to_ns=span.to_ns,
        measures=set_measures(part, exercise(begins.exercise), goal_deg=begins.goal_deg, mode=begins.mode),
        donning=span.donning,
        ended=span.ended,
        stop_reason=span.stop_reason,
        limit_deg=begins.limit_deg,
        wanted=begins.repetitions,
    )


def _rating(mark: Pain | Effort, at: int) -> Rating:
    return Rating(
        kind="pain" if isinstance(mark, Pain) else "effort", when=mark.when, value=mark.value, time_ns=at
    )


def _are(names: list[str]) -> str:
    return f"are {', '.join(names)}" if names else "is nobody"
