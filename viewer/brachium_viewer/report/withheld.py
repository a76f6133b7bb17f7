"""What a report does not show, and why: each dash in its tables has its reason. Pure."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from brachium_viewer.metrics.both_arms import Components
from brachium_viewer.metrics.measure import Measure
from brachium_viewer.metrics.medians import FEW
from brachium_viewer.report import words
from brachium_viewer.report.groups import Group, Symmetry

LAST_BESIDE_FIRST = ("range", "peak_speed", "movement_time", "sparc")
"""Of the measures, those whose change within the session a report tells."""


_NUMBER = re.compile(r"\d+(?:\.\d+)?")


class Dash(NamedTuple):
    """One number that is not shown, or not of all repetitions."""

    why: str
    what: str
    where: str
    share: str = ""
    """Of how many repetitions it is not known; empty when of all of them."""


def withheld(
    groups: Sequence[Group],
    symmetries: Sequence[Symmetry] = (),
    lags: Sequence[tuple[Group, Measure]] = (),
    parts: Sequence[tuple[Group, Components | None]] = (),
) -> list[tuple[str, str]]:
    """Return what is not shown, and why: (reason, what), each reason once, whatever its numbers.

    What is known of some repetitions says of how many it is not, whether they suffice for a median or not.
    """
    alike: dict[str, list[Dash]] = {}
    for one in (*_of_groups(groups), *_of_comparisons(symmetries, lags, parts)):
        alike.setdefault(_kind(one.why), []).append(one)
    return [(_why([one.why for one in some]), _told(some, len(groups))) for some in alike.values()]


def _kind(why: str) -> str:
    return _NUMBER.sub("#", why)


def _why(alike: Sequence[str]) -> str:
    """Return reasons that differ in their numbers alone as one: the least to the largest of each."""
    numbers = [list(dict.fromkeys(some)) for some in zip(*map(_NUMBER.findall, alike), strict=True)]
    spans = iter([(min(some, key=float), max(some, key=float)) for some in numbers])
    said = ((low if low == high else f"{low} to {high}") for low, high in spans)
    return _NUMBER.sub(lambda _: next(said), alike[0])


def _told(alike: Sequence[Dash], groups: int) -> str:
    """Return in words what is withheld for one reason; where, unless it is so of all of all groups."""
    labels: dict[str, dict[str, None]] = {}
    for one in alike:
        labels.setdefault(one.what, {})[f"{one.where}: {one.share}" if one.share else one.where] = None
    places: dict[tuple[str, ...], list[str]] = {}
    for label, where in labels.items():
        places.setdefault(tuple(where), []).append(label)
    everywhere = not any(one.share for one in alike)
    return "; ".join(
        ", ".join(some) + ("" if everywhere and len(where) == groups else f" ({'; '.join(where)})")
        for where, some in places.items()
    )


def _of_groups(groups: Sequence[Group]) -> Iterator[Dash]:
    for g in groups:
        yield from _of_measures(g)
        pooled, where = g.pooled, g.name
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


def _of_measures(group: Group) -> Iterator[Dash]:
    """Return each measure that is not shown, and each that is not known of all repetitions."""
    repetitions, pooled = group.pooled.repetitions, group.pooled
    known = [name for name in words.MEASURES if any(r.measures[name].value is not None for r in repetitions)]
    lost: dict[tuple[tuple[str, ...], int], list[str]] = {}
    for name in words.MEASURES:
        label, why = words.label(name, pooled.path_of), pooled.medians[name].withheld
        missing = [m.withheld for r in repetitions if (m := r.measures[name]).value is None]
        if name in known and missing:
            lost.setdefault((_commonest(missing), len(missing)), []).append(label)
        elif why and why != words.NOT_REACHED:
            yield Dash(why, label, group.name)
    for (whys, count), labels in lost.items():
        for label in ["every measure"] if len(labels) == len(known) else labels:
            for why in whys:
                yield Dash(why, label, group.name, f"{count} of {len(repetitions)}")


def _commonest(reasons: Sequence[str]) -> tuple[str, ...]:
    """Return those of the commonest kind, each once; they differ in their numbers alone."""
    kinds = [_kind(why) for why in reasons]
    most = max(kinds, key=kinds.count)
    return tuple(dict.fromkeys(why for why in reasons if _kind(why) == most))


def _of_comparisons(
    symmetries: Sequence[Symmetry],
    lags: Sequence[tuple[Group, Measure]],
    parts: Sequence[tuple[Group, Components | None]],
) -> Iterator[Dash]:
    for s in symmetries:
        if s.range_change.withheld:
            yield Dash(s.range_change.withheld, "both arms: range of motion", s.group.name)
        if s.ldlj_change.withheld:
            yield Dash(s.ldlj_change.withheld, "both arms: difference of LDLJ", s.group.name)
    for group, lag in lags:
        if lag.withheld:
            yield Dash(lag.withheld, "farther when moved", words.movement(group.exercise.name, group.side))
    for group, found in parts:
        if found is None:
            yield Dash(words.NO_COMPONENTS, "components", group.name)
