"""The report's tables: what was done, change within the session, components, data quality. Pure."""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

from brachium_viewer.figures import SegmentFigures
from brachium_viewer.metrics.both_arms import Components
from brachium_viewer.metrics.measure import Measure
from brachium_viewer.metrics.medians import FEW, values
from brachium_viewer.page_sections import PageTable
from brachium_viewer.report import words
from brachium_viewer.report.groups import Group
from brachium_viewer.report.withheld import LAST_BESIDE_FIRST
from brachium_viewer.sessions.records import Rating

NONE = "\N{EN DASH}"
FULL = 0.97
"""From so much on a measure's coverage is not printed beside it."""
TRY = "A try is a movement that went less than half as far as the others; it is no repetition."


def date(time_ns: int) -> str:
    """Return the day and minute of a host time, UTC."""
    return f"{datetime.fromtimestamp(time_ns / 1e9, UTC):%Y-%m-%d %H:%M} UTC"


def day(time_ns: int) -> str:
    """Return the day of a host time, UTC."""
    return f"{datetime.fromtimestamp(time_ns / 1e9, UTC):%Y-%m-%d}"


def number(measure: Measure, digits: int, *, signed: bool = False) -> str:
    """Return a value, with its coverage where it is not whole; that a goal was not reached; or a dash."""
    if measure.value is None:
        return "not reached" if measure.withheld == words.NOT_REACHED else NONE
    value = round(measure.value, digits) + 0.0  # no minus zero
    shown = f"{value:+.{digits}f}" if signed and value else f"{value:.{digits}f}"
    return shown if measure.coverage >= FULL else f"{shown} ({100 * measure.coverage:.0f}\N{NO-BREAK SPACE}%)"


def done(groups: Sequence[Group]) -> PageTable:
    """Return what was done: a row a group of sets."""
    rows = []
    for group in groups:
        wanted = sum(one.wanted or 0 for one in group.sets)
        made = len(group.pooled.repetitions)
        goal = group.pooled.goal_deg
        ended = {words.ended(one.ended, one.stop_reason) for one in group.sets} - {""}
        seconds = sum(one.to_ns - one.from_ns for one in group.sets) / 1e9
        rows.append(
            [
                words.movement(group.exercise.name, group.side),
                group.mode,
                str(len(group.sets)),
                f"{made} of {wanted}" if wanted else str(made),
                str(group.pooled.tries) if group.exercise.single else NONE,
                NONE if goal is None else f"{goal:.0f}",
                number(group.pooled.best_peak, 0),
                f"{seconds / 60:.1f}",
                ", ".join([*_limits(group), *sorted(ended)]),
            ]
        )
    head = ["", "mode", "sets", "repetitions", "tries", "goal, deg", "farthest of all, deg", "min", ""]
    return PageTable("What was done", head, rows, TRY if any(g.exercise.single for g in groups) else "")


def _limits(group: Group) -> list[str]:
    """Return of each limit that was set how many repetitions went beyond it."""
    sign = 1.0 if group.exercise.rises else -1.0
    tops: dict[float, list[float]] = {}
    for one in group.sets:
        if one.limit_deg is not None:
            tops.setdefault(one.limit_deg, []).extend(values(one.measures.repetitions, "peak"))
    return [
        f"limit {limit:.0f} deg: passed in {sum(sign * top > sign * limit for top in found)} of {len(found)}"
        for limit, found in sorted(tops.items())
    ]


def within_session(groups: Sequence[Group]) -> PageTable | None:
    """Return the last five repetitions beside the first five; None when no group has as many."""
    names = LAST_BESIDE_FIRST
    rows = []
    for g in groups:
        cells = [g.pooled.first_to_last[name] for name in names]
        if any(cell.value is not None for cell in cells):
            shown = [number(c, words.MEASURES[n][1], signed=True) for n, c in zip(names, cells, strict=True)]
            rows.append([g.name, *shown])
    if not rows:
        return None
    head = ["", *(f"{words.MEASURES[n][0]}, {groups[0].pooled.medians[n].unit}" for n in names)]
    note = f"Median of the last {FEW} repetitions minus that of the first {FEW}, over all sets."
    return PageTable(f"Last {FEW} repetitions beside the first {FEW}", head, rows, note)


def principal(found: Sequence[tuple[Group, Components | None]]) -> PageTable | None:
    """Return how much of the movement of all joint angles the first components explain."""
    rows = []
    for group, parts in found:
        if parts is None:
            continue
        first = sorted(zip(parts.directions[0], parts.names, strict=True), key=lambda one: -abs(one[0]))[:3]
        rows.append(
            [
                group.name,
                *[*(f"{100 * share:.0f}" for share in parts.explained[:3]), NONE][:3],
                ", ".join(
                    f"{name.replace('_', ' ')} {weight:+.2f}" for weight, name in first if abs(weight) >= 0.1
                ),
            ]
        )
    head = ["variance explained, %", "1st", "2nd", "3rd", "the first one's directions"]
    return PageTable("Principal components of the joint angles", head, rows) if rows else None


def ratings(found: Iterable[Rating]) -> list[str]:
    """Return pain and effort before and after, one line each."""
    lines = []
    kept = list(found)
    for kind in ("pain", "effort"):
        said = [f"{r.value} {r.when}" for r in kept if r.kind == kind]
        if said:
            lines.append(f"{kind} (0 to 10): {', '.join(said)}")
    return lines


def quality(
    segments: dict[str, SegmentFigures], batteries: dict[str, float | None], gaps: dict[str, float]
) -> PageTable:
    """Return each sensor's samples and battery; one that delivered nothing has no share that was lost."""
    rows = []
    for who, s in segments.items():
        level = batteries.get(who)
        counts = [str(s.received), f"{s.loss_percent:.2f}", str(s.out_of_order)]
        rows.append(
            [
                who.split("/", 1)[1].replace("_", " "),
                s.node or NONE,
                *(counts if s.received or s.lost else ["none", NONE, NONE]),
                NONE if level is None else f"{100 * level:.0f}",
            ]
        )
    longest = "; ".join(f"{side} arm {gap:.1f} s" for side, gap in gaps.items())
    note = f"Longest time without a skeleton while a set ran: {longest}." if gaps else ""
    return PageTable(
        "Data quality", ["", "node", "samples", "lost %", "out of order", "battery %"], rows, note
    )
