"""What a report shows, found from what a recording holds and from a person's history. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from brachium_body.ranges import FUNCTIONAL, REFERENCE, Range
from brachium_body.segments import Side
from brachium_viewer.contents import Contents
from brachium_viewer.exercises import held_against
from brachium_viewer.metrics.arm_motion import ArmMotion
from brachium_viewer.metrics.both_arms import Components, components
from brachium_viewer.metrics.set_measures import SetMeasures
from brachium_viewer.report import repetition_lines as lines
from brachium_viewer.report import words
from brachium_viewer.report.groups import (
    Errors,
    Group,
    History,
    Past,
    What,
    errors_of,
    groups,
    other_arm,
    past,
)
from brachium_viewer.report.range_chart import RangeBar
from brachium_viewer.report.report_charts import MovementLines
from brachium_viewer.sessions.from_recording import zero_ns
from brachium_viewer.sessions.records import SessionRecord

SHOWN_S = 30.0
"""Of one set, over time: more is a block of ink."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """A session, ready to be told."""

    contents: Contents
    session: SessionRecord
    motions: Mapping[Side, ArmMotion]
    groups: Sequence[Group]
    pasts: Sequence[Past | None]
    errors: Mapping[What, Errors]
    """What of each group's measures counts as a change."""
    affected: str
    """right, left, both, or empty when it is not stated."""

    @property
    def zero_ns(self) -> int:
        """Return the instant from which a motion's seconds count."""
        return zero_ns(self.contents, self.session.subject)


def build(
    contents: Contents,
    session: SessionRecord,
    motions: Mapping[Side, ArmMotion],
    history: History,
    affected: str = "",
) -> Report:
    """Return the report; only a session that was worn is put beside a history."""
    every = groups(session.sets)
    found = [history(*group.what) if session.origin == "worn" else () for group in every]
    errors = {group.what: errors_of(group, sets) for group, sets in zip(every, found, strict=True)}
    return Report(
        contents=contents,
        session=session,
        motions=motions,
        groups=every,
        pasts=[past(group, sets, errors[group.what]) for group, sets in zip(every, found, strict=True)],
        errors=errors,
        affected=affected,
    )


def of_movement(report: Report, side: Side, name: str) -> tuple[list[Group], ArmMotion]:
    """Return the modes of one exercise by one arm, and that arm's motion."""
    found = [g for g in report.groups if g.side == side and g.exercise.name == name]
    return found, report.motions[side]


def movement_lines(found: Sequence[Group], motion: ArmMotion, zero: int) -> MovementLines:
    """Return what is drawn of one exercise by one arm."""
    exercise = found[0].exercise
    own = [lines.chosen(g.pooled.repetitions) for g in found]
    first = found[0].sets[0]
    from_s = (first.from_ns - zero) / 1e9
    to_s = min((first.to_ns - zero) / 1e9, from_s + SHOWN_S)
    time_s, places = lines.over_time(motion, from_s, to_s)
    return MovementLines(
        angle=f"{words.ANGLES.get(exercise.angle, exercise.angle)}, deg",
        overlays={g.mode: lines.overlays(motion, exercise.angle, r) for g, r in zip(found, own, strict=True)},
        goal_deg=next((g.pooled.goal_deg for g in found if g.pooled.goal_deg is not None), None),
        paths=lines.paths(motion, lines.chosen([r for some in own for r in some], 12)),
        time_s=time_s,
        places=places,
    )


def range_bars(report: Report) -> list[RangeBar]:
    """Return a bar a group whose range is known."""
    bars = []
    for group, before in zip(report.groups, report.pasts, strict=True):
        other = other_arm(group, report.groups)
        now = _ends(group.pooled)
        if now is None:
            continue
        bars.append(
            RangeBar(
                label=words.movement(group.exercise.name, group.side, group.mode),
                mode=group.mode,
                now=now,
                other=None if other is None else _ends(other.pooled),
                last=None if before is None or not before.changes else _ends(before.pooled),
                reference=_span(held_against(REFERENCE, group.exercise)),
                need=_span(held_against(FUNCTIONAL, group.exercise)),
            )
        )
    return bars


def _ends(measures: SetMeasures) -> tuple[float, float] | None:
    start, peak = measures.medians["start"].value, measures.medians["peak"].value
    return None if start is None or peak is None else (start, peak)


def _span(found: Range | None) -> tuple[float, float] | None:
    return None if found is None or found.low is None or found.high is None else (found.low, found.high)


def principal_components(report: Report) -> list[tuple[Group, Components | None]]:
    """Return the principal components of each group's sets."""
    found = []
    for group in report.groups:
        motion, zero = report.motions[group.side], report.zero_ns
        spans = [((s.from_ns - zero) / 1e9, (s.to_ns - zero) / 1e9) for s in group.sets]
        rows = np.zeros(len(motion.time_s), dtype=np.bool_)
        for from_s, to_s in spans:
            rows |= (motion.time_s >= from_s) & (motion.time_s < to_s)
        found.append((group, components(motion.at(rows))))
    return found


def longest_gaps(report: Report) -> dict[str, float]:
    """Return by arm the longest time without a skeleton while one of its sets ran, s."""
    found: dict[str, float] = {}
    for one in report.session.sets:
        side = one.measures.side
        time_ns = report.contents.arms[report.session.subject, side].published.time_ns
        inside = time_ns[(time_ns >= one.from_ns) & (time_ns < one.to_ns)]
        gaps = np.diff(np.concatenate([[one.from_ns], inside, [one.to_ns]])) / 1e9
        found[side] = max(found.get(side, 0.0), float(gaps.max()))
    return found
