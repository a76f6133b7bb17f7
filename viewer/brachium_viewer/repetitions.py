"""Where one repetition of a movement ends and the next begins, seen in one of its numbers. Pure."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

Array = npt.NDArray[np.float64]

PROMINENCE = 0.35
"""A repetition rises by this part of the whole range at least: a tremor or a second try does not."""
SHORTEST_S = 0.4
"""Between two peaks: nobody repeats an arm's exercise faster."""


class Repetition(NamedTuple):
    """From rest to rest, s."""

    from_s: float
    to_s: float


def repetitions(time: Array, values: Array) -> list[Repetition]:
    """Return the repetitions of a movement: from low to high and back, in order of time.

    `values` (n,) is any number that rises once a repetition, at growing times (n,) s; what is NaN is left
    out. A repetition runs from the last low before its peak to the first low after it, each low being where
    the value leaves, or comes back to, a tenth of the peak's height.
    """
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if len(time) < 5:
        return []
    low, high = np.percentile(values, [1.0, 99.0])
    if high <= low:
        return []
    apart = max(1, round(SHORTEST_S / float(np.median(np.diff(time)))))
    padded = np.concatenate([[values.min()], values, [values.min()]])
    peaks = find_peaks(padded, prominence=PROMINENCE * (high - low), distance=apart)[0] - 1
    found, begin = [], 0
    for i, peak in enumerate(peaks):
        end = int(peaks[i + 1]) if i + 1 < len(peaks) else len(values) - 1
        valley = int(peak) + int(np.argmin(values[peak : end + 1]))
        first, last = _around(values, begin, int(peak), valley)
        found.append(Repetition(float(time[first]), float(time[last])))
        begin = valley
    return found


def _around(values: Array, begin: int, peak: int, end: int) -> tuple[int, int]:
    """Return the rows between which the value stands above a tenth of its height on each side."""
    rise, fall = values[begin : peak + 1], values[peak : end + 1]
    start_level = rise.min() + 0.1 * (values[peak] - rise.min())
    end_level = fall.min() + 0.1 * (values[peak] - fall.min())
    below = np.flatnonzero(rise <= start_level)
    after = np.flatnonzero(fall <= end_level)
    return begin + int(below[-1]), peak + int(after[0])
