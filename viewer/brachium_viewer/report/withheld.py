"""What a report does not show, and why: each dash in its tables has its reason. Pure."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from brachium_viewer.metrics.both_arms import Components
from brachium_viewer.metrics.measure import Measure
from brachium_viewer.metrics.medians import FEW
from brachium_viewer.report import words
from brachium_viewer.report.groups import Group, Symmetry

LAST_BESIDE_FIRST = ("range", "peak_speed", "movement_time", "sparc")
"""Of the measures, those whose change within the session a report tells."""


class Dash(NamedTuple):
    """One number that is not shown."""

    why: str
    what: str
    where: str


def withheld(
    groups: Sequence[Group],
    symmetries: Sequence[Symmetry] = (),
    lags: Sequence[tuple[Group, Measure]] = (),
    parts: Sequence[tuple[Group, Components | None]] = (),
) -> list[tuple[str, str]]:
    """Return what is not shown, and why: (reason, what), each reason once; then what a median leaves out."""
    every = [*_of_groups(groups), *_of_comparisons(symmetries, lags, parts)]
    found = [(why, _told([one for one in every if one.why == why], len(groups))) for why in _whys(every)]
    return [*found, *(line for g in groups for line in _partly(g))]


def _whys(every: Iterable[Dash]) -> list[str]:
    return list(dict.fromkeys(one.why for one in every))


def _told(alike: Sequence[Dash], groups: int) -> str:
    """Return in words what is withheld for one reason; where, unless it is so of all groups."""
    labels: dict[str, dict[str, None]] = {}
    for one in alike:
        labels.setdefault(one.what, {})[one.where] = None
    places: dict[tuple[str, ...], list[str]] = {}
    for label, where in labels.items():
        places.setdefault(tuple(where), []).append(label)
    return "; ".join(
        ", ".join(some) + ("" if len(where) == groups else f" ({'; '.join(where)})")
        for where, some in places.items()
    )


def _where(group: Group) -> str:
    return words.movement(group.exercise.name, group.side, group.mode)


def _of_groups(groups: Sequence[Group]) -> Iterator[Dash]:
    for g in groups:
        pooled, where = g.pooled, _where(g)
        for name in words.MEASURES:
            why = pooled.medians[name].withheld
            if why and why != words.NOT_REACHED:
                yield Dash(why, words.label(name, pooled.path_of), where)
        if pooled.best_peak.withheld:
            yield Dash(pooled.best_peak.withheld, "farthest of all", where)
        if g.exercise.straightens and pooled.extension_deficit.withheld:
            yield Dash(pooled.extension_deficit.withheld, "short of straight", where)
        changes = {name: pooled.first_to_last[name] for name in LAST_BESIDE_FIRST}
        if any(one.value is not None for one in changes.values()):  # else there is no row of it
            for name, one in changes.items():
                if one.withheld:
                    label = words.MEASURES[name][0]
                    yield Dash(one.withheld, f"last {FEW} beside the first: {label}", where)


def _of_comparisons(
    symmetries: Sequence[Symmetry],
    lags: Sequence[tuple[Group, Measure]],
    parts: Sequence[tuple[Group, Components | None]],
) -> Iterator[Dash]:
    for s in symmetries:
        if s.range_change.withheld:
            yield Dash(s.range_change.withheld, "both arms: range of motion", _where(s.group))
        if s.ldlj_change.withheld:
            yield Dash(s.ldlj_change.withheld, "both arms: difference of LDLJ", _where(s.group))
    for group, lag in lags:
        if lag.withheld:
            yield Dash(lag.withheld, "farther when moved", words.movement(group.exercise.name, group.side))
    for group, found in parts:
        if found is None:
            yield Dash(words.NO_COMPONENTS, "components", _where(group))


def _partly(group: Group) -> list[tuple[str, str]]:
    """Return what is shown of most repetitions, and why not of all."""
    repetitions, pooled = group.pooled.repetitions, group.pooled
    shown = [name for name in words.MEASURES if pooled.medians[name].value is not None]
    left_out: dict[tuple[str, int], list[str]] = {}
    for name in shown:
        missing = [m.withheld for r in repetitions if (m := r.measures[name]).value is None]
        if missing:
            label = words.label(name, pooled.path_of)
            left_out.setdefault((max(missing, key=missing.count), len(missing)), []).append(label)
    found = []
    for (why, count), labels in left_out.items():
        what = ["every measure"] if len(labels) == len(shown) else labels
        where = f"in {count} of {len(repetitions)} repetitions ({_where(group)})"
        found.append((why, ", ".join([*what, where])))
    return found
