"""Frames of one sample are put together by its counter or time, never by when they arrived. Pure.

Arrival serves two ends only: a counter that wraps is told apart by how long ago the last one was, and what
waits too long is given up. Where every frame carries the key, frames may come in any order. Where one frame
carries it and stands before the others, the order on the bus is the sensor's own, and a sample is taken only
between two keys that follow one another: then whatever was lost, nothing else can have come in between.
"""

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

Values = tuple[float, ...]

TIMEOUT_NS = 50_000_000
"""A sample that is not complete by then is given up: five periods at 100 Hz, and a bus delays by less."""
RESTART_NS = 2_000_000_000
"""A key that is off by more than this, twice in a row, is a sensor that started anew."""

Drop = Literal["incomplete", "late_member", "repeated_member", "conflicting_member", "no_key", "strange_key"]


class Key(NamedTuple):
    """How a sensor numbers its samples."""

    step: float
    """What is added to the counter from one sample to the next; more than 1 for a time."""
    modulus: float
    """Where it wraps."""
    period_ns: float
    """Nominal, between two samples."""


class Sample(NamedTuple):
    """One complete sample."""

    ticks: float
    """Its key, unwrapped."""
    arrived_ns: int
    """When its last frame came."""
    members: dict[str, Values]


@dataclass(slots=True)
class _Group:
    ticks: float
    since_ns: int
    last_ns: int
    members: dict[str, Values] = field(default_factory=dict)
    conflicting: bool = False


class Unwrapper:
    """Continues a counter over its wraps: of all values it may stand for, the one nearest to when it came."""

    def __init__(self, key: Key) -> None:
        self._key = key
        self._newest: float | None = None
        self._newest_ns = 0
        self._doubt: tuple[float, int] | None = None
        self.restarts = 0

    def take(self, value: float, now_ns: int) -> float | None:
        """Return the key unwrapped, or None for one that cannot be."""
        key = self._key
        if not 0 <= value < key.modulus:
            return None
        if self._newest is None:
            self._newest, self._newest_ns = value, now_ns
            return value
        expected = self._newest + (now_ns - self._newest_ns) / key.period_ns * key.step
        ticks = value + key.modulus * round((expected - value) / key.modulus)
        if abs(ticks - expected) * key.period_ns / key.step > RESTART_NS:
            return self._restarted(value, now_ns)
        self._doubt = None
        if ticks > self._newest:
            self._newest, self._newest_ns = ticks, now_ns
        return ticks

    def _restarted(self, value: float, now_ns: int) -> float | None:
        """Believe in a new start once two values agree on it."""
        before, self._doubt = self._doubt, (value, now_ns)
        if before is None or value <= before[0]:
            return None
        elapsed_ns = (value - before[0]) / self._key.step * self._key.period_ns
        if abs(elapsed_ns - (now_ns - before[1])) > TIMEOUT_NS:
            return None
        self.restarts += 1
        self._newest, self._newest_ns, self._doubt = value, now_ns, None
        return value


class Grouper:
    """One sensor's frames in, its samples out, in order. What is not used is counted by name."""

    def __init__(self, key: Key, required: frozenset[str], optional: frozenset[str], *, keyed: bool) -> None:
        """`keyed`: every frame carries the key; else one frame does that stands before the others."""
        self._required, self._all, self._keyed = required, required | optional, keyed
        self._unwrapper, self._step = Unwrapper(key), key.step
        self._open: deque[_Group] = deque()  # in order of their keys
        self._given: float | None = None  # the newest key that was given out or up
        self.drops: Counter[Drop] = Counter()

    @property
    def restarts(self) -> int:
        """How often the sensor started anew."""
        return self._unwrapper.restarts

    def key(self, value: float, now_ns: int) -> list[Sample]:
        """Take the frame with the key that stands before a sample's others."""
        ticks = self._ticks(value, now_ns)
        if ticks is None:
            return []
        if not self._open:
            if self._given is not None and self._number(ticks, self._given) <= 0:
                self.drops["repeated_member"] += 1
                return []
            self._open.append(_Group(ticks, now_ns, now_ns))
            return []
        group = self._open[0]
        ahead = self._number(ticks, group.ticks)
        if ahead == 0:
            self.drops["repeated_member"] += 1
            return []
        if ahead < 0:  # the order is not what it must be: nothing here can be told apart
            group.conflicting = True
            self.drops["late_member"] += 1
            return []
        self._open[0] = _Group(ticks, now_ns, now_ns)
        self._given = group.ticks
        whole = ahead == 1 and not group.conflicting and self._required <= group.members.keys()
        if not whole:
            self.drops["incomplete"] += 1
            return []
        return [Sample(group.ticks, group.last_ns, group.members)]

    def member(self, name: str, values: Values, now_ns: int, value: float | None = None) -> list[Sample]:
        """Take a frame with measured values, and with its key where every frame carries it."""
        group = self._group(value, now_ns)
        if group is None:
            return []
        if name in group.members:
            same = group.members[name] == values
            self.drops["repeated_member" if same else "conflicting_member"] += 1
            group.conflicting |= not same
            return []
        group.members[name], group.last_ns = values, now_ns
        return self._finished() if self._keyed else []

    def tick(self, now_ns: int) -> list[Sample]:
        """Give up what waited too long; return what was held up by it."""
        waiting = [g for g in self._open if now_ns - g.since_ns > TIMEOUT_NS]
        if not waiting:
            return []
        if not self._keyed:
            self._give_up(self._open.popleft())
            return []
        result: list[Sample] = []
        while self._open and (self._complete(self._open[0]) or now_ns - self._open[0].since_ns > TIMEOUT_NS):
            group = self._open.popleft()
            self._given = group.ticks
            result += self._judged(group)
        return result

    def _group(self, value: float | None, now_ns: int) -> _Group | None:
        """Return the open group that a member belongs to."""
        if not self._keyed:
            if not self._open:
                self.drops["no_key"] += 1
                return None
            return self._open[0]
        assert value is not None
        ticks = self._ticks(value, now_ns)
        if ticks is None:
            return None
        if self._given is not None and self._number(ticks, self._given) <= 0:
            self.drops["late_member"] += 1
            return None
        for place, group in enumerate(self._open):
            apart = self._number(ticks, group.ticks)
            if apart == 0:
                return group
            if apart < 0:
                made = _Group(ticks, now_ns, now_ns)
                self._open.insert(place, made)
                return made
        made = _Group(ticks, now_ns, now_ns)
        self._open.append(made)
        return made

    def _finished(self) -> list[Sample]:
        """Return, in order, the samples that wait for nothing any more."""
        result: list[Sample] = []
        while self._open:
            group = self._open[0]
            full = group.members.keys() == self._all
            if not full and not (len(self._open) > 1 and self._complete(group)):
                break
            self._open.popleft()
            self._given = group.ticks
            result += self._judged(group)
        return result

    def _complete(self, group: _Group) -> bool:
        return self._required <= group.members.keys()

    def _judged(self, group: _Group) -> list[Sample]:
        if group.conflicting or not self._complete(group):
            self.drops["incomplete"] += 1
            return []
        return [Sample(group.ticks, group.last_ns, group.members)]

    def _give_up(self, group: _Group) -> None:
        self._given = group.ticks
        self.drops["incomplete"] += 1

    def _ticks(self, value: float, now_ns: int) -> float | None:
        restarts = self._unwrapper.restarts
        ticks = self._unwrapper.take(value, now_ns)
        if ticks is None:
            self.drops["strange_key"] += 1
        if self._unwrapper.restarts != restarts:
            self.drops["incomplete"] += len(self._open)
            self._open.clear()
            self._given = None
        return ticks

    def _number(self, ticks: float, before: float) -> int:
        """Return how many samples `ticks` is after `before`."""
        return round((ticks - before) / self._step)
