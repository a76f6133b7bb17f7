"""Where the way there of a repetition begins and ends, without rest and holding. Pure.

Movements are cut by their speed before their smoothness is taken (Balasubramanian et al. 2015), usually at
5 % of its peak. Here as well; but who stops on the way has not arrived, and how long an arm holds changes
nothing.
"""

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.even_grid import even, smooth
from brachium_viewer.metrics.repetitions import CUTOFF_HZ, FLOOR_DEG, LEVEL, Repetition

Floats = npt.NDArray[np.float64]

RATE_HZ = 50.0
REACH = 1.875
"""The peak speed of a minimum-jerk reach, times its length, over its height."""
SLOW = 0.05
"""Of the peak speed: slower is not yet, or no longer, under way."""
SWAY_DEG_S = 1.0
"""A resting arm sways at such speeds: of a very slow movement, slower than this is rest, too."""
MOST_SLOW = 0.25
"""And be it ever so slow, more than this part of its peak speed is movement."""
BLUR_S = 0.54
"""The low-pass adds so much to the time between two ends, in squares: smooth reaches of 0.7 to 4 s come out
at their true length within 3 %."""
AT_ONCE_S = 0.1
"""Who is on the way back so soon has not held: the turn itself is the end."""
AROUND_S = 1.5
"""Before the low and after the peak so much is filtered with them."""


class Way(NamedTuple):
    """From its begin to the arrival."""

    from_s: float
    to_s: float
    went: float
    """How far the values, low-passed, rose on it."""


def way_there(time_s: Floats, values: Floats, repetition: Repetition) -> Way | None:
    """Return the way there of a repetition; None where its begin, its end or a part of it was not seen.

    `values` (n,) deg rise on it, at growing times (n,) s, NaN where not known; their speed is that of what is
    left below CUTOFF_HZ, so that a tremor decides nothing. The way begins where the speed was last SLOW of
    its peak before the values left the lowest tenth of the range, and ends where it first is so again when
    they are in the highest tenth (each at least half of what a resting arm sways by). Both ends are then set
    off by what a minimum-jerk reach of this height and peak speed goes more slowly than that, less what the
    low-pass has added: such a reach comes out as long as it was. An arm that turns at once ends at its turn.
    """
    near = (time_s >= repetition.low_s - AROUND_S) & (time_s <= repetition.peak_s + AROUND_S)
    grid, found = even(time_s[near], values[near], RATE_HZ)
    if len(grid) < 2:
        return None
    angle = smooth(found, RATE_HZ, CUTOFF_HZ)
    speed = np.gradient(angle, 1.0 / RATE_HZ)
    low, peak = (
        min(int(np.searchsorted(grid, at_s)), len(grid) - 1) for at_s in (repetition.low_s, repetition.peak_s)
    )
    height = float(angle[peak]) - repetition.base
    band = max(LEVEL * height, 0.5 * FLOOR_DEG)
    resting = low + np.flatnonzero(angle[low : peak + 1] <= repetition.base + band)
    if not len(resting):
        return None
    leaving = int(resting[-1])
    arriving = leaving + int(np.argmax(angle[leaving : peak + 1] >= angle[peak] - band))
    fastest = float(speed[leaving : arriving + 1].max())
    if not fastest > 0.0:  # nor when it is not known throughout
        return None
    slow = min(max(SLOW, SWAY_DEG_S / fastest), MOST_SLOW)
    reach_s = REACH * height / fastest
    off = 0.5 * RATE_HZ * (reach_s - hypot(sqrt(1.0 - sqrt(slow)) * reach_s, BLUR_S))
    before = _rows_to_rest(speed[leaving::-1], slow * fastest, off)
    after = _rows_to_rest(speed[arriving:], slow * fastest, off)
    if before is None or after is None:
        return None
    rows = np.clip([leaving - before, arriving + after], 0.0, len(grid) - 1.0)
    from_s, to_s = np.interp(rows, np.arange(len(grid)), grid).tolist()
    begin, end = np.interp(rows, np.arange(len(grid)), angle).tolist()
    return Way(from_s, to_s, end - begin) if to_s > from_s else None


def _rows_to_rest(speed: Floats, slow: float, off: float) -> float | None:
    """Return after how many rows of a movement's speeds (n,) it ends: `off` rows beyond where it is slow, or
    at its turn when it goes back at once. None when neither is seen."""
    stops = np.flatnonzero(~(speed > slow))
    if not len(stops) or not np.isfinite(speed[stops[0]]):
        return None
    first = int(stops[0])
    soon = speed[first : first + 1 + round(AT_ONCE_S * RATE_HZ)]
    if not (soon < -slow).any():
        return max(0.0, _crossing(speed, first, slow) + off)
    return _crossing(speed, first + int(np.argmax(soon <= 0.0)), 0.0)


def _crossing(speed: Floats, row: int, level: float) -> float:
    """Return where speeds come down to a level between the row before this one and this one."""
    if row == 0:
        return 0.0
    before, here = float(speed[row - 1]), float(speed[row])
    return row - (level - here) / (before - here)
