"""Where a shoulder is shown when its displacement is no longer known, or known again: it does not jump. Pure.

Positions carry the shoulder's displacement. Where that ends, the shoulder is where the trunk carries it,
and goes there within some two seconds from where it was last seen; where it begins again, likewise.
Until it is there its place, and that of all below it, is assumed.
"""

from collections.abc import Sequence
from math import exp, hypot
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_fusion.rows import Row

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Vector = tuple[float, float, float]

RETURN_S = 0.5
"""Time constant: half a decimetre is gone at a speed at which shoulders move."""
THERE_M = 0.001
NOWHERE: Vector = (0.0, 0.0, 0.0)


class _Seen(NamedTuple):
    time_ns: int
    known: bool
    shown: Vector
    """Displacement, trunk axes."""
    off: Vector
    """Of it what is neither measured nor the trunk's."""


class ShoulderReturn:
    """What was last shown of each arm, by subject and side."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, str], _Seen] = {}

    def follow(self, rows: Sequence[Row], shift: Floats | None) -> tuple[Floats | None, Mask | None]:
        """Return displacements (n, 3) m, trunk axes, and where (n,) they are assumed.

        Rows come in order of time. `shift` (n, 3) is NaN where nothing is known, None if it is so in all of
        them. (None, None): no arm was ever displaced.
        """
        if shift is None and not self._seen:
            return None, None
        told = np.full((len(rows), 3), np.nan).tolist() if shift is None else shift.tolist()
        shown, assumed = np.zeros((len(rows), 3)), np.zeros(len(rows), dtype=np.bool_)
        for i, row in enumerate(rows):
            known = told[i][0] == told[i][0]
            arm, last = (row.subject, row.side), self._seen.get((row.subject, row.side))
            if last is None and not known:
                continue
            target = _vector(told[i]) if known else NOWHERE
            now = _following(last, row.time_ns, known, target)
            self._seen[arm] = now
            shown[i], assumed[i] = now.shown, now.off != NOWHERE
        return shown, assumed

    def state(self, subject: str) -> dict[str, Any]:
        """Return the memory of one subject's arms, as plain values."""
        return {side: list(seen) for (who, side), seen in self._seen.items() if who == subject}

    def restore(self, subject: str, state: dict[str, Any]) -> None:
        """Go on as the arms whose memory this is would have."""
        for side, (time_ns, known, shown, off) in state.items():
            self._seen[subject, side] = _Seen(time_ns, known, _vector(shown), _vector(off))


def _following(last: _Seen | None, time_ns: int, known: bool, target: Vector) -> _Seen:
    if last is None:
        return _Seen(time_ns, known, target, NOWHERE)
    from_where = last.off
    if known != last.known:
        from_where = (last.shown[0] - target[0], last.shown[1] - target[1], last.shown[2] - target[2])
    left = exp(-1e-9 * max(0, time_ns - last.time_ns) / RETURN_S)
    off = (left * from_where[0], left * from_where[1], left * from_where[2])
    if hypot(*off) < THERE_M:
        off = NOWHERE
    return _Seen(time_ns, known, (target[0] + off[0], target[1] + off[1], target[2] + off[2]), off)


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = values
    return (x, y, z)
