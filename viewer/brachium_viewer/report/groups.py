"""What a report is about: sets by exercise, arm and mode, beside each other and the past. Pure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from brachium_body.segments import Side
from brachium_viewer.exercises import Exercise, exercise
from brachium_viewer.metrics.both_arms import difference, symmetry
from brachium_viewer.metrics.change import Change, SmallestChange, smallest_change
from brachium_viewer.metrics.measure import Measure
from brachium_viewer.metrics.set_measures import SetMeasures, loss_between, together
from brachium_viewer.report import words
from brachium_viewer.sessions.records import METHOD, PastSet, SetRecord

FARTHEST = "farthest of all"
COMPARED = ("range", FARTHEST)
"""What is compared with the last session: the only measures whose smallest detectable change is known."""

What = tuple[str, str, str]
Errors = Mapping[str, SmallestChange]
"""By COMPARED: what is shown as a change, and what is within measurement error."""

History = Callable[[str, str, str], Sequence[PastSet]]
"""A person's worn sets of an exercise, side and mode before this session, oldest first."""


@dataclass(frozen=True, kw_only=True)
class Group:
    """The sets of one exercise by one arm in one mode, and all of them as one."""

    exercise: Exercise
    side: Side
    mode: str
    sets: tuple[SetRecord, ...]
    pooled: SetMeasures

    @property
    def name(self) -> str:
        """Return what was done by which arm, and how where it was not active."""
        return words.movement(self.exercise.name, self.side, "" if self.mode == "active" else self.mode)

    @property
    def what(self) -> What:
        """Return exercise, side and mode."""
        return self.exercise.name, self.side, self.mode


@dataclass(frozen=True, kw_only=True)
class Past:
    """A group's last session that can be compared, or its last one when none can."""

    started_ns: int
    pooled: SetMeasures
    changes: dict[str, Change]
    """By COMPARED; empty when the measures were made by another method, or here or there were withheld."""
    method: int


def groups(sets: Sequence[SetRecord]) -> list[Group]:
    """Return the groups in the order in which they were begun; the modes of one exercise and arm follow one
    another."""
    order = list(dict.fromkeys(one.what[:2] for one in sets))
    whats = sorted(dict.fromkeys(one.what for one in sets), key=lambda what: order.index(what[:2]))
    return [_group([one for one in sets if one.what == what]) for what in whats]


def _group(sets: list[SetRecord]) -> Group:
    first = sets[0].measures
    row = exercise(first.exercise)
    side: Side = "left" if first.side == "left" else "right"
    return Group(
        exercise=row,
        side=side,
        mode=first.mode,
        sets=tuple(sets),
        pooled=together([one.measures for one in sets], row),
    )


def compared(measures: SetMeasures, name: str) -> Measure:
    """Return one of COMPARED."""
    return measures.medians["range"] if name == "range" else measures.best_peak


def past(group: Group, found: Sequence[PastSet], errors: Errors) -> Past | None:
    """Return a group's last session that can be compared; else its last one, or None when there is none."""
    sessions: dict[int, list[PastSet]] = {}
    for one in reversed(found):
        sessions.setdefault(one.session, []).insert(0, one)
    pasts = [_past(group, sets, errors) for sets in sessions.values()]
    return next((one for one in pasts if one.changes), next(iter(pasts), None))


def _past(group: Group, sets: Sequence[PastSet], errors: Errors) -> Past:
    pooled = together([one.set.measures for one in sets], group.exercise)
    changes = {}
    if sets[0].method == METHOD:
        for name in COMPARED:
            now, before = compared(group.pooled, name).value, compared(pooled, name).value
            if now is not None and before is not None:
                changes[name] = Change(now=now, before=before, smallest=errors[name])
    return Past(started_ns=sets[0].started_ns, pooled=pooled, changes=changes, method=sets[0].method)


def errors_of(group: Group, found: Sequence[PastSet]) -> Errors:
    """Return the smallest detectable changes: from this person's repeated donnings, in the sets found and in
    this session, or the stated one."""
    sessions: dict[int, list[SetRecord]] = {}
    for one in found:
        if one.method == METHOD:
            sessions.setdefault(one.session, []).append(one.set)
    every = [*sessions.values(), list(group.sets)]
    return {
        name: smallest_change([pair for sets in every for pair in donning_pairs(sets, name)])
        for name in COMPARED
    }


def donning_pairs(sets: Sequence[SetRecord], name: str) -> list[tuple[float, float]]:
    """Return a measure before and after each donning between two sets, in order, of one session."""
    pairs = []
    for before, after in pairwise(sets):
        a, b = compared(before.measures, name).value, compared(after.measures, name).value
        if before.donning != after.donning and a is not None and b is not None:
            pairs.append((a, b))
    return pairs


def other_arm(group: Group, every: Sequence[Group]) -> Group | None:
    """Return the same exercise in the same mode by the other arm."""
    return next(
        (g for g in every if (g.exercise, g.mode) == (group.exercise, group.mode) and g.side != group.side),
        None,
    )


@dataclass(frozen=True, kw_only=True)
class Symmetry:
    """One arm beside the other in one exercise."""

    group: Group
    other: Group
    range_percent: Measure
    """The first one's range over the other's."""
    range_change: Measure
    """The first one's range less the other's, deg."""
    ldlj_change: Measure
    """The first one's LDLJ less the other's: above 0, it moved more smoothly."""


def symmetries(every: Sequence[Group], affected: str) -> list[Symmetry]:
    """Return each exercise that both arms did: the affected arm over the other; right over left when neither
    or both are."""
    first = affected if affected in ("right", "left") else "right"
    found = []
    for group in every:
        other = other_arm(group, every)
        if group.side != first or other is None:
            continue
        ours, theirs = group.pooled.medians, other.pooled.medians
        found.append(
            Symmetry(
                group=group,
                other=other,
                range_percent=symmetry(ours["range"], theirs["range"]),
                range_change=difference(ours["range"], theirs["range"]),
                ldlj_change=difference(ours["ldlj"], theirs["ldlj"]),
            )
        )
    return found


def lags(every: Sequence[Group]) -> list[tuple[Group, Measure]]:
    """Return, for each exercise and arm done both ways, by how much less far it goes by itself (below 0:
    farther)."""
    passive = {(g.exercise.name, g.side): g for g in every if g.mode == "passive"}
    return [
        (g, loss_between(g.pooled, passive[key].pooled, rises=g.exercise.rises))
        for g in every
        if g.mode == "active" and (key := (g.exercise.name, g.side)) in passive
    ]
