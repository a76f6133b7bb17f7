"""A batch of one sensor after its filter, with what lies between it and the batch before. Pure."""

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_wire.messages import Quality

Floats = npt.NDArray[np.float64]


class Moved:
    """Rates and forces of a batch, and of the batch before it, calibrated; joined when somebody asks."""

    __slots__ = ("_joined", "_own")

    def __init__(self, gyr: Floats, acc: Floats, before: tuple[Floats, Floats] | None) -> None:
        self._own = gyr, acc, before
        self._joined: Floats | None = None

    def rows(self) -> Floats:
        """Return gyr and acc (n + 1, 6): of the last sample before the batch, then of its own."""
        if self._joined is None:
            gyr, acc, before = self._own
            joined = np.empty((len(gyr) + 1, 6))
            joined[1:, :3], joined[1:, 3:] = gyr, acc
            joined[0, :3], joined[0, 3:] = (
                (gyr[0], acc[0]) if before is None else (before[0][-1], before[1][-1])
            )
            self._joined = joined
        return self._joined


class Carried(NamedTuple):
    """The last sample before a gap, and the missing ones as they probably were."""

    times: list[int]
    quats: Floats
    rows: Floats
    """(n, 6) gyr and acc."""

    def state(self) -> list[Any]:
        """Return it as plain values."""
        return [self.times, self.quats.ravel().tolist(), self.rows.ravel().tolist()]


@dataclass(slots=True, eq=False)
class Block:
    """A batch after the filter, and the last sample before it."""

    before_ns: int
    """0 when there is none."""
    before: Floats
    times: list[int]
    quats: Floats
    moved: Moved | None
    """None of a sensor that delivers orientation only."""
    first_sequence: int
    received_ns: int
    gap: Quality | None
    """What an instant before its first sample is: held, missing, or None where there is no gap."""
    disturbed: bool
    carried: Carried | None = None
    """Of the gap before it, when that was bridged."""

    def shows(self, time_ns: int, *, unseen: bool) -> bool:
        """Return whether something is known of an instant before the first sample."""
        if self.before_ns == 0 or time_ns < self.before_ns:
            return False
        return self.gap != "missing" or (unseen and self.carried is not None)

    def before_first(self, time_ns: int) -> tuple[int, int, Floats, Floats]:
        """Return what lies around an instant between the last sample before it and its first one: times and
        orientations."""
        if self.carried is None:
            return self.before_ns, self.times[0], self.before, self.quats[0]
        times, quats, _ = self.carried
        i = bisect_right(times, time_ns)
        if i < len(times):
            return times[i - 1], times[i], quats[i - 1], quats[i]
        return times[-1], self.times[0], quats[-1], self.quats[0]

    def state(self) -> list[Any]:
        """Return it as plain values."""
        return [
            self.before_ns,
            self.before.tolist(),
            self.times,
            self.quats.ravel().tolist(),
            None if self.moved is None else self.moved.rows().ravel().tolist(),
            self.first_sequence,
            self.received_ns,
            self.gap,
            self.disturbed,
            None if self.carried is None else self.carried.state(),
        ]


def block_of(state: list[Any]) -> Block:
    """Return the block whose state this is."""
    before_ns, before, times, quats, rows, sequence, received_ns, gap, disturbed, *carried = state
    return Block(
        before_ns,
        np.array(before),
        times,
        np.reshape(quats, (-1, 4)),
        None if rows is None else _moved(np.reshape(rows, (-1, 6))),
        sequence,
        received_ns,
        gap,
        disturbed,
        _carried(carried[0]) if carried else None,
    )


def _moved(rows: Floats) -> Moved:
    """Return what gave these rows (n + 1, 6)."""
    return Moved(rows[1:, :3], rows[1:, 3:], (rows[:1, :3], rows[:1, 3:]))


def _carried(state: list[Any] | None) -> Carried | None:
    if state is None:
        return None
    times, quats, rows = state
    return Carried(times, np.reshape(quats, (-1, 4)), np.reshape(rows, (-1, 6)))
