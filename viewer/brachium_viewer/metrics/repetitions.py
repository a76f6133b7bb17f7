"""Where one repetition of a movement ends and the next begins, seen in one of its numbers. Pure.

The same function counts live, over what has come so far, and in the report, over all of it: the number on the
page while a set runs is the one the report would give if it ended now. A later, larger repetition may turn
an earlier, small one into a try.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.even_grid import even, smooth

Floats = npt.NDArray[np.float64]

RATE_HZ = 25.0
CUTOFF_HZ = 1.6
"""Nobody repeats an arm's exercise twice a second, and tremor (4 Hz and more) is left out."""
SHARE = 0.5
"""A repetition goes, there and back, at least this part of what the set's larger ones go; less is a try."""
TRY_SHARE = 0.15
"""Less than this part is no movement at all."""
LIFTED = 3
"""So many small movements on top of a large rise are repetitions of an arm that was lifted first; fewer are a
repetition whose top is not still."""
LEVEL = 0.1
"""A repetition begins and ends at this part of its height."""
FLOOR_DEG = 3.5
"""Of an angle: a resting arm sways and a tracker wanders by less."""


class Repetition(NamedTuple):
    """From rest to rest, s."""

    from_s: float
    to_s: float
    peak_s: float
    """When it was highest."""
    base_s: float
    """When it was at its base: the higher of the lows before and after. A first repetition may come up from
    a hanging arm, and a last one end in it; neither is how far the exercise went."""
    base: float
    """The value at its base, low-passed."""
    low_s: float
    """When it was lowest before it rose."""


@dataclass(frozen=True, kw_only=True)
class MovementSet:
    """What was done of one exercise."""

    repetitions: tuple[Repetition, ...]
    tries: tuple[Repetition, ...]
    """Movements that went less than half the way there or back, in order of time."""


class _Swing(NamedTuple):
    """A rise and the fall after it: rows of the turning points, and the smaller of the two heights."""

    low: int
    peak: int
    end: int
    height: float


def movement_set(time_s: Floats, values: Floats, floor: float = 0.0) -> MovementSet:
    """Return the repetitions of a movement from low to high and back, and the tries.

    `values` (n,) is any number that rises once a repetition, at growing times (n,) s; what is NaN is left
    out. What rises by less than `floor` is no movement.
    """
    grid, raw = even(time_s, values, RATE_HZ)
    smoothed = smooth(raw, RATE_HZ, CUTOFF_HZ)
    known = np.isfinite(smoothed)
    t, v = grid[known], smoothed[known]
    if len(v) < 5 or not np.ptp(v) > floor:
        return MovementSet(repetitions=(), tries=())
    highest = max((s.height for s in _swings(v, max(floor, 0.05 * np.ptp(v)))), default=0.0)
    found = _swings(v, max(floor, TRY_SHARE * highest))
    rises = _swings(v, max(floor, SHARE * _highest(v)))
    enough = SHARE * _typical(_heights(found, rises))
    whole = [s for s in _swings(v, max(floor, enough)) if s.height >= enough] if found else []
    spans = [_repetition(t, v, swing) for swing in whole]
    tries = [_repetition(t, v, s) for s in found if not any(_within(t[s.peak], r) for r in spans)]
    return MovementSet(repetitions=tuple(spans), tries=tuple(tries))


def repetitions(time_s: Floats, values: Floats, floor: float = 0.0) -> list[Repetition]:
    """Return the repetitions alone, as `movement_set` finds them."""
    return list(movement_set(time_s, values, floor).repetitions)


def _highest(v: Floats) -> float:
    """Return how far the largest rise goes, there and back, whatever lies between."""
    before, after = np.minimum.accumulate(v), np.minimum.accumulate(v[::-1])[::-1]
    return float(np.max(v - np.maximum(before, after)))


def _heights(found: list[_Swing], rises: list[_Swing]) -> list[float]:
    """Return how far each movement goes: of a large rise with fewer than LIFTED tops the rise itself."""
    tops = [[s for s in found if rise.low <= s.peak < rise.end] for rise in rises]
    whole = [(rise, on) for rise, on in zip(rises, tops, strict=True) if len(on) < LIFTED]
    within = {s for _, on in whole for s in on}
    return [rise.height for rise, _ in whole] + [s.height for s in found if s not in within]


def _typical(heights: list[float]) -> float:
    """Return the middle of those that are at least half of nearly the largest one."""
    if not heights:
        return 0.0
    large = float(np.percentile(heights, 90.0))
    return float(np.median([h for h in heights if h >= 0.5 * large]))


def _swings(v: Floats, least: float) -> list[_Swing]:
    """Return the rises of at least `least` that were followed by a fall of at least `least`."""
    turns = _turning_points(v, least)
    swings = []
    for low, peak, end in zip(turns[0::2], turns[1::2], turns[2::2], strict=False):
        rise, fall = v[peak] - v[low], v[peak] - v[end]
        swings.append(_Swing(low, peak, end, float(min(rise, fall))))
    return swings


def _turning_points(v: Floats, least: float) -> list[int]:
    """Return rows low, high, low, ... between which the value changes by `least` or more."""
    turns, low, high, rising = [], 0, 0, False
    for i, value in enumerate(v.tolist()):
        if rising:
            if value > v[high]:
                high = i
            elif v[high] - value >= least:
                turns.append(high)
                low, rising = i, False
        elif value < v[low]:
            low = i
        elif value - v[low] >= least:
            turns.append(low)
            high, rising = i, True
    if not rising and turns:
        turns.append(low)
    return turns


def _repetition(t: Floats, v: Floats, swing: _Swing) -> Repetition:
    returning = swing.end == len(v) - 1  # it may go on falling
    base = swing.low if returning or v[swing.low] >= v[swing.end] else swing.end
    level = v[base] + LEVEL * (v[swing.peak] - v[base])
    before = np.flatnonzero(v[swing.low : swing.peak + 1] <= level)
    after = np.flatnonzero(v[swing.peak : swing.end + 1] <= level)
    first = swing.low + int(before[-1]) if len(before) else swing.low
    last = swing.peak + int(after[0]) if len(after) else swing.end
    return Repetition(
        from_s=float(t[first]),
        to_s=float(t[last]),
        peak_s=float(t[swing.peak]),
        base_s=float(t[base]),
        base=float(v[base]),
        low_s=float(t[swing.low]),
    )


def _within(instant: float, span: Repetition) -> bool:
    return span.from_s <= instant <= span.to_s
