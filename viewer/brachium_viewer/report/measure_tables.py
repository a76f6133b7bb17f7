"""The report's measures: a row a group, in tables of as many columns as a sheet has room for. Pure."""

from collections.abc import Callable, Sequence

from brachium_viewer.metrics.set_measures import SHOULDER, SHOULDER_OR_TRUNK
from brachium_viewer.page_sections import PageTable
from brachium_viewer.report import words
from brachium_viewer.report.groups import Group
from brachium_viewer.report.report_tables import NONE, number

HOW_FAR = ("start", "peak", "range", "movement_time", "time_to_goal", "hold_time")
HOW_IT_WENT = (
    "peak_speed",
    "mean_speed",
    "sparc",
    "ldlj",
    "hand_path",
    "straightness",
    "shoulder_shift",
    "trunk_lean",
)
"""Every measure is in one of both. There are no more columns than these: whatever was done only makes rows,
so that nothing falls off a sheet."""

Column = tuple[str, Callable[[Group], str]]
"""What stands above it, and what it says of a group."""


def measures(groups: Sequence[Group]) -> list[PageTable]:
    """Return the medians of the repetitions: a row a group."""
    far = [_measure(name, groups) for name in HOW_FAR]
    if any(g.exercise.straightens for g in groups):
        far.append((_head("short of straight", "deg"), _deficit))
    far.append((_head("measured", "%"), _measured))
    went = [_measure(name, groups) for name in HOW_IT_WENT]
    if _point(groups) is None:
        went.insert(HOW_IT_WENT.index("hand_path"), ("point", lambda group: group.pooled.path_of or NONE))
    return [
        _table("How far and how long: median of the repetitions", far, groups),
        _table("How it went: median of the repetitions", went, groups),
    ]


def _point(groups: Sequence[Group]) -> str | None:
    """Return what all paths are of; None when they are not of the same point."""
    found = {g.pooled.path_of for g in groups} - {""}
    return None if len(found) > 1 else next(iter(found), "")


def _table(title: str, columns: Sequence[Column], groups: Sequence[Group]) -> PageTable:
    rows = [[group.name, *(said(group) for _, said in columns)] for group in groups]
    return PageTable(title, ["", *(head for head, _ in columns)], rows)


def _measure(name: str, groups: Sequence[Group]) -> Column:
    label, digits = words.label(name, _point(groups) or ""), words.MEASURES[name][1]
    if name == "shoulder_shift":
        word = min((g.pooled.shoulder_word for g in groups), key=[SHOULDER_OR_TRUNK, SHOULDER].index)
        label = f"{word}, {label}"
    unit = groups[0].pooled.medians[name].unit
    return _head(label, unit), lambda group: number(group.pooled.medians[name], digits)


def _head(label: str, unit: str) -> str:
    return label if unit == "1" else f"{label}, {unit}"


def _deficit(group: Group) -> str:
    return number(group.pooled.extension_deficit, 0) if group.exercise.straightens else ""


def _measured(group: Group) -> str:
    share = group.pooled.measured
    return NONE if share is None else f"{100.0 * share:.0f}"
