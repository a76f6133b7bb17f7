"""The report's comparisons: with the last session, of both arms, of both ways. Pure.

No difference stands without the measurement's own error beside it, and within it none is shown as one.
"""

from collections.abc import Mapping, Sequence

from brachium_viewer.metrics.change import SmallestChange
from brachium_viewer.metrics.measure import Measure
from brachium_viewer.page_sections import PageTable
from brachium_viewer.report import words
from brachium_viewer.report.groups import FARTHEST, Errors, Group, Past, Symmetry, What
from brachium_viewer.report.report_tables import NONE, day, number

SMALLEST = "smallest detectable change"


def _error(smallest: SmallestChange) -> str:
    source = f"{smallest.pairs} repeated donnings" if smallest.pairs else "stated"
    return f"{smallest.value_deg:.0f} ({source})"


def comparison(groups: Sequence[Group], pasts: Sequence[Past | None]) -> PageTable | None:
    """Return this session beside the last; a change only beyond the smallest detectable one."""
    rows = []
    for group, past in zip(groups, pasts, strict=True):
        for name, change in past.changes.items() if past is not None else ():
            rows.append(
                [
                    f"{words.movement(group.exercise.name, group.side, group.mode)}: {name}",
                    f"{change.before:.0f}",
                    f"{change.now:.0f}",
                    _error(change.smallest),
                    f"{change.difference:+.0f} deg" if change.detected else words.WITHIN_ERROR,
                ]
            )
    if not rows:
        return None
    when = sorted({day(past.started_ns) for past in pasts if past is not None})
    head = [f"deg; last session: {', '.join(when)}", "last", "now", SMALLEST, "change"]
    return PageTable("Beside the last session", head, rows)


def between_arms(symmetries: Sequence[Symmetry], errors: Mapping[What, Errors]) -> PageTable | None:
    """Return one arm beside the other: with sensors of its own it differs at least as two donnings do."""
    rows = []
    for s in symmetries:
        both = (errors[group.what]["range"] for group in (s.group, s.other))
        smallest = max(both, key=lambda one: one.value_deg)
        rows.append(
            [
                f"{words.movement(s.group.exercise.name, s.group.side, s.group.mode)} over {s.other.side}",
                *(number(group.pooled.medians["range"], 0) for group in (s.group, s.other)),
                _error(smallest),
                _between(s, smallest),
                number(s.ldlj_change, 2, signed=True),
            ]
        )
    head = ["range of motion, deg", "this arm", "other arm", SMALLEST, "difference", "difference of LDLJ"]
    note = "Difference of LDLJ: above 0, this arm moved more smoothly; how far off it may be is not known."
    return PageTable("Both arms", head, rows, note) if rows else None


def _between(one: Symmetry, smallest: SmallestChange) -> str:
    """Return the difference of ranges; a part of the other's only beyond the error."""
    if one.range_change.value is None:
        return NONE
    if abs(one.range_change.value) <= smallest.value_deg:
        return words.WITHIN_ERROR
    said = f"{one.range_change.value:+.0f} deg"
    return (
        said
        if one.range_percent.value is None
        else f"{said} ({one.range_percent.value:.0f}\N{NO-BREAK SPACE}%)"
    )


def active_passive(
    lags: Sequence[tuple[Group, Measure]], groups: Sequence[Group], errors: Mapping[What, Errors]
) -> PageTable | None:
    """Return by how much less far an arm goes by itself, where it does."""
    every = {group.what: group for group in groups}
    rows = []
    for group, lag in lags:
        passive = every[*group.what[:2], "passive"]
        both = (errors[one.what][FARTHEST] for one in (group, passive))
        smallest = max(both, key=lambda one: one.value_deg)
        rows.append(
            [
                words.movement(group.exercise.name, group.side),
                *(number(one.pooled.best_peak, 0) for one in (group, passive)),
                _error(smallest),
                _lag(lag, smallest),
            ]
        )
    head = ["farthest of all, deg", "active", "passive", SMALLEST, "farther when moved"]
    return PageTable("Active against passive", head, rows) if rows else None


def _lag(lag: Measure, smallest: SmallestChange) -> str:
    if lag.value is None:
        return NONE
    if abs(lag.value) <= smallest.value_deg:
        return words.WITHIN_ERROR
    return f"{lag.value:.0f} deg" if lag.value > 0.0 else f"no: {-lag.value:.0f} deg less far"
