"""Three taps on a sensor in its raw acceleration: what a camera sees, and the samples too. Pure.

A tap of a finger is a jolt of a few milliseconds. Behind the sensor's own filter it spans two or three
samples; no movement of an arm is that short. Three in a row, with rest around them, do not come by chance.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

JOLT = 5.0
"""m/s^2 by which the acceleration leaves that around it. A firm tap shows 10 to 50 at 50 to 100 Hz."""
REST = 1.5
"""m/s^2: more than this beside the taps is movement, in which taps are not looked for."""
AROUND_S = 0.15
"""The acceleration around a sample is the median from so long before to so long after it."""
JOLT_S = 0.06
"""A jolt and its ringing are over by then."""
APART_S = (0.15, 0.8)
"""Between two of three taps."""
EVEN = 2.0
"""The longer of the two pauses is at most so many times the shorter."""
QUIET_S = 0.5
"""Rest before the first tap and after the last."""


@dataclass(frozen=True, slots=True)
class TripleTap:
    """Three taps."""

    times_ns: tuple[int, int, int]
    """Host time of the strongest sample of each: right to one sample."""


def triple_taps(times_ns: Times, acc: Floats) -> list[TripleTap]:
    """Return the triple taps in raw accelerations (n, 3) m/s^2 at times (n,) ns that grow, in order.

    Taps next to a gap are not seen, nor those less than half a second from the beginning or the end.
    """
    if len(times_ns) < 3:
        return []
    seconds = (times_ns - times_ns[0]) * 1e-9
    jolt = _jolts(seconds, acc)
    peaks = _peaks(seconds, jolt)
    found: list[TripleTap] = []
    at = 0
    while at + 3 <= len(peaks):
        three = peaks[at : at + 3]
        if _is_triple(seconds, jolt, three):
            first, second, third = (int(times_ns[i]) for i in three)
            found.append(TripleTap((first, second, third)))
            at += 3
        else:
            at += 1
    return found


def _jolts(seconds: Floats, acc: Floats) -> Floats:
    """Return by how much each sample's acceleration leaves that around it (n,): in any direction, for a tap
    across gravity hardly changes its size."""
    period = float(np.median(np.diff(seconds)))
    reach = max(1, round(AROUND_S / period))
    padded = np.pad(acc, ((reach, reach), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis=0)
    jolts: Floats = np.sqrt(((acc - np.median(windows, axis=2)) ** 2).sum(axis=1))
    return jolts


def _peaks(seconds: Floats, jolt: Floats) -> list[int]:
    """Return the strongest sample of each jolt."""
    peaks: list[int] = []
    for i in np.flatnonzero(jolt > JOLT):
        if peaks and seconds[i] - seconds[peaks[-1]] < JOLT_S:
            if jolt[i] > jolt[peaks[-1]]:
                peaks[-1] = int(i)
        else:
            peaks.append(int(i))
    return peaks


def _is_triple(seconds: Floats, jolt: Floats, three: list[int]) -> bool:
    pauses = np.diff(seconds[three])
    if pauses.min() < APART_S[0] or pauses.max() > APART_S[1] or pauses.max() > EVEN * pauses.min():
        return False
    begin, end = seconds[three[0]] - QUIET_S, seconds[three[-1]] + QUIET_S
    if begin < seconds[0] or end > seconds[-1]:
        return False
    span = (seconds >= begin) & (seconds <= end)
    if np.diff(seconds[span]).max() > JOLT_S:
        return False  # samples are missing
    beside = span.copy()
    for i in three:
        beside &= np.abs(seconds - seconds[i]) > JOLT_S
    return bool(jolt[beside].max(initial=0.0) < REST)


class TapWatch:
    """Looks for triple taps in one sensor's stream as it comes."""

    KEPT_NS = 4_000_000_000
    LOOK_NS = 250_000_000

    def __init__(self) -> None:
        self._times: list[Times] = []
        self._acc: list[Floats] = []
        self._looked_ns = self._told_ns = 0

    def feed(self, times_ns: list[int], acc: Floats) -> list[TripleTap]:
        """Take samples that came after the last ones; return the triple taps that are complete with them."""
        self._times.append(np.array(times_ns, dtype=np.int64))
        self._acc.append(acc)
        newest = times_ns[-1]
        if newest - self._looked_ns < self.LOOK_NS:
            return []
        self._looked_ns = newest
        while newest - int(self._times[0][-1]) > self.KEPT_NS:
            del self._times[0], self._acc[0]
        found = triple_taps(np.concatenate(self._times), np.concatenate(self._acc))
        new = [taps for taps in found if taps.times_ns[0] > self._told_ns]
        if new:
            self._told_ns = new[-1].times_ns[-1]
        return new
