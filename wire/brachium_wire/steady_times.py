"""Skeletons' times on one clock: a fusion that started again may have another one than before. Pure.

Every process reads its host's clock once and counts from there (hosttime). When the host's clock is set and
fusion starts again, the times of its skeletons go back or jump ahead. The recorder ran on: when it got them
tells how long it really was.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

JUMP_NS = 500_000_000
"""No network delivers skeletons of one clock so much out of their order; less is let be."""
EARLY_PERCENT = 10
"""Of what came with one clock, so much came as soon as it could; the rest may have waited in a network."""


class Jump(NamedTuple):
    """One clock after another."""

    after_s: float
    """From the first skeleton to the first by the new clock, as they were recorded."""
    by_s: float
    """By how much the new clock is ahead of the one before."""


@dataclass(frozen=True, slots=True, eq=False)
class SteadyTimes:
    """Of each arm (n,) times on one clock, and which skeletons have one: kept times grow."""

    time_ns: tuple[Integers, ...]
    kept: tuple[Mask, ...]
    jumps: tuple[Jump, ...]
    """Put right."""

    @property
    def left_out(self) -> int:
        """Return how many skeletons have no time: theirs went back, and nothing tells when they were."""
        return sum(int((~kept).sum()) for kept in self.kept)

    @property
    def told(self) -> str:
        """Return what was put right and left out, in a line; empty when nothing was."""
        found = []
        if self.jumps:
            count, first = len(self.jumps), self.jumps[0]
            by = f"{first.by_s:+.1f} s, {first.after_s:.1f} s into the recording"
            right = "put right by when each skeleton came"
            found.append(
                f"the clock of fusion jumped by {by}; {right}"
                if count == 1
                else f"the clock of fusion jumped {count} times, first by {by}; {right}"
            )
        if self.left_out:
            found.append(f"left out as their time had gone back: {self.left_out} skeletons")
        return "; ".join(found)


def steady_times(arms: Sequence[tuple[Integers, Integers]]) -> SteadyTimes:
    """Return the times of one subject's arms on one clock: the one that is nearest to the recorder's.

    Of each arm: the skeletons' times and when each was recorded, (n,) ns, in order of arrival.
    """
    shifts, jumps = _shifts(arms)
    times = tuple(time + shift for (time, _), shift in zip(arms, shifts, strict=True))
    return SteadyTimes(times, tuple(_growing(time) for time in times), jumps)


def _shifts(arms: Sequence[tuple[Integers, Integers]]) -> tuple[list[Integers], tuple[Jump, ...]]:
    """Return of each arm what (n,) ns is to be added to its times, and what that puts right."""
    marks = _marks(arms)
    if not marks:
        return [np.zeros_like(time) for time, _ in arms], ()
    begins = [mark.arrived_ns for mark in marks]
    spans = [np.searchsorted(begins, arrived, side="right") for _, arrived in arms]
    levels = _levels(np.concatenate([arrived - time for time, arrived in arms]), np.concatenate(spans))
    begun = min(int(arrived[0]) for _, arrived in arms if len(arrived))
    clocks, of_span, jumps = [levels[0]], [0], []
    for mark, level in zip(marks, levels[1:], strict=True):
        by = clocks[-1] - level
        if by > JUMP_NS if mark.ahead else by < -JUMP_NS:
            clocks.append(level)
            jumps.append(Jump((mark.arrived_ns - begun) / 1e9, by / 1e9))
        else:
            clocks[-1] = min(clocks[-1], level)
        of_span.append(len(clocks) - 1)
    nearest = min(clocks, key=abs)
    added = np.array([clocks[i] - nearest for i in of_span], dtype=np.int64)
    return [added[span] for span in spans], tuple(jumps)


class _Mark(NamedTuple):
    """Where the times of an arm went back, or ahead by more than had passed."""

    arrived_ns: int
    ahead: bool
    arm: int

    def again(self, before: "_Mark") -> bool:
        """Return whether the mark before is the other arm's of the same jump."""
        if self.arrived_ns == before.arrived_ns:
            return True
        alike = self.ahead == before.ahead and self.arm != before.arm
        return alike and self.arrived_ns - before.arrived_ns <= JUMP_NS


def _marks(arms: Sequence[tuple[Integers, Integers]]) -> list[_Mark]:
    """Return the marks in order of arrival; none where arrivals tell nothing of them.

    What was lost while much waited in a network goes ahead, too: whether a clock did, its level tells.
    """
    found: list[_Mark] = []
    for arm, (time, arrived) in enumerate(arms):
        step, passed = np.diff(time), np.diff(arrived)
        back, ahead = step < -JUMP_NS, step - passed > JUMP_NS
        if (passed < 0).any() or (passed[back | ahead] == 0).any():
            return []
        for rows, kind in ((back, False), (ahead, True)):
            found += [_Mark(at, kind, arm) for at in arrived[1:][rows].tolist()]
    found.sort()
    return [mark for i, mark in enumerate(found) if not i or not mark.again(found[i - 1])]


def _levels(late: Integers, spans: npt.NDArray[np.intp]) -> list[int]:
    """Return how late what came soon was in each span, ns; each holds the skeleton that begins it."""
    ends = np.cumsum(np.bincount(spans))
    parts = np.split(late[np.argsort(spans, kind="stable")], ends[:-1])
    return [int(np.sort(part)[len(part) * EARLY_PERCENT // 100]) for part in parts]


def _growing(time: Integers) -> Mask:
    """Return which (n,) are later than all before them, of the longest part in which none goes far back."""
    step = np.diff(time)
    if (step > 0).all():
        return np.ones(len(time), dtype=np.bool_)
    ends = np.concatenate([[0], np.flatnonzero(step < -JUMP_NS) + 1, [len(time)]])
    longest = int(np.argmax(np.diff(ends)))
    kept = np.zeros(len(time), dtype=np.bool_)
    part = slice(int(ends[longest]), int(ends[longest + 1]))
    top = np.maximum.accumulate(time[part])
    kept[part] = np.concatenate([[True], top[1:] > top[:-1]])
    return kept
