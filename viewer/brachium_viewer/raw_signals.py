"""What the sensors send, as lines of plots: angular rates and specific forces as the chip gave them. Pure."""

import numpy as np

from brachium_viewer.drawings import Drawing, Floats, Signal
from brachium_wire.samples import Samples
from brachium_wire.sequence import SequenceCounter

KINDS = {"gyr": "angular rate [°/s]", "acc": "specific force [m/s²]"}
"""By path, what a plot shows."""
GAP_S = 1e-6
MOST_ROWS = 4096
"""Rows of a signal that wait for a viewer; older ones go."""


class RawSignals:
    """One sensor's lines. Late samples are left aside: the lines go forwards."""

    def __init__(self) -> None:
        self._sequence = SequenceCounter()
        self._last_s = -np.inf

    def take(self, path: str, samples: Samples, offset_s: float) -> dict[str, Drawing]:
        """Return the batch's drawings by path, at its times plus `offset_s`; a gap breaks the line."""
        times_s = 1e-9 * np.array(samples.time_ns, dtype=np.float64) + offset_s
        gap = self._sequence.feed(samples.sequence, len(times_s))
        if gap < 0 or samples.late or times_s[0] <= self._last_s:
            return {}
        self._last_s = float(times_s[-1])
        values = {"gyr": None if samples.gyr is None else np.degrees(samples.gyr), "acc": samples.acc}
        return {
            f"{path}/{kind}": _signal(times_s, value, broken=gap > 0)
            for kind, value in values.items()
            if value is not None
        }


def joined(before: Signal, after: Signal) -> Signal:
    """Return one signal after the other as one."""
    times_s = np.concatenate([before.times_s, after.times_s])
    values = np.concatenate([before.values, after.values])
    return Signal(times_s[-MOST_ROWS:], values[-MOST_ROWS:])


def _signal(times_s: Floats, values: Floats, *, broken: bool) -> Signal:
    if not broken:
        return Signal(times_s, np.asarray(values, dtype=np.float64))
    nothing = np.full((1, 3), np.nan)
    return Signal(np.concatenate([times_s[:1] - GAP_S, times_s]), np.concatenate([nothing, values]))
