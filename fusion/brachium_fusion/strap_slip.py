"""Straps that slip during a session: which sensor turned on its segment, when, by how much. Pure, causal.

What is seen, at rests: a sensor that feels gravity elsewhere in postures that are otherwise the same
(slip_postures.py). What is not: a slip about the vertical, while every posture in which the arm rests has the
sensor at the same tilt (a turn about the length of a forearm that rests only hanging, for one); the slip of
the only sensor worn, and one after which no posture known before comes back. A habit that changes by a few
degrees in the last segment's joint alone looks like a slip of its sensor: there more rests are asked for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body.segments import part_of, side_of
from brachium_fusion.live_arm import SensorNow
from brachium_fusion.slip_postures import Turned, turned_since

Floats = npt.NDArray[np.float64]

STILL_RAD_S = 0.12
"""A sensor that turns slower rests; a hand that trembles does too."""
REST_S = 0.24
"""Of stillness of all sensors makes a rest: holds between repetitions are short."""
LONG_S = 1.0
"""Of a rest that is used."""
ANOTHER = np.radians(2.0)
"""Stillness that follows stillness is another rest only if some sensor tilted this far."""
MOVED_RAD_S = 0.3
"""... or turned this fast in between."""
KEPT_NS = 180_000_000_000
KEPT = 60
"""Rests that are remembered: three minutes of them, and no more than this."""
SURE = 12.0
"""Evidence for a slip: no single rest gives as much."""
SURE_AT_THE_END = 20.0
"""For the sensor at the arm's end, three rests."""
LEAST_RAD = np.radians(4.0)
"""Less is skin that settles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slip:
    """A sensor turned on its segment."""

    segment: str
    after_ns: int
    """At the end of this rest it still sat as before; what follows is disturbed."""
    time_ns: int
    """Beginning of the first rest in which it sat otherwise."""
    found_ns: int
    size_deg: float
    """As far as gravity shows it: at least."""
    turn: tuple[float, float, float]
    """before_from_now: rotation vector in sensor axes, rad; unknown about up while it rests one way only."""
    evidence: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rest:
    from_ns: int
    to_ns: int
    ups: list[list[float]]
    """Unit vectors, by sensor."""


class SlipWatch:
    """Watches the sensors of one arm, named from the shoulder on. `step` takes every instant."""

    def __init__(self, segments: Sequence[str]) -> None:
        self.segments = tuple(segments)
        self._rests: list[_Rest] = []
        self._from_ns, self._to_ns, self._count = 0, 0, 0
        self._force = np.zeros((len(self.segments), 3))
        """Sum of specific forces over the present stillness."""
        self._done = False
        """The present stillness is on record, or is the one before going on."""
        self._moved = True

    def step(self, now_ns: int, sensors: Mapping[str, SensorNow]) -> Slip | None:
        """Take all sensors at an instant, calibrated; return a slip when one became certain."""
        if any(s not in sensors for s in self.segments):
            return self._end()
        motions = [sensors[s].motion for s in self.segments]
        fastest = max(float(m.gyr @ m.gyr) for m in motions)
        if fastest > STILL_RAD_S**2:
            self._moved = self._moved or fastest > MOVED_RAD_S**2
            return self._end()
        if self._done:
            return None
        if not self._count:
            self._from_ns = now_ns
        self._force += np.array([m.acc for m in motions])
        self._count, self._to_ns = self._count + 1, now_ns
        return self._end() if now_ns - self._from_ns >= LONG_S * 1e9 else None

    def forget(self) -> None:
        """A pose was taken or a sensor replaced: what was felt before says nothing about now."""
        self._rests.clear()
        self._begin()
        self._done, self._moved = False, True

    def _begin(self) -> None:
        self._count, self._done = 0, False
        self._force = np.zeros((len(self.segments), 3))

    def _end(self) -> Slip | None:
        """Take the stillness that ends here, or has lasted long enough, as a rest if it is one."""
        long_enough = self._count > 1 and self._to_ns - self._from_ns >= REST_S * 1e9
        force, spent = self._force, self._to_ns - self._from_ns >= LONG_S * 1e9 and self._count > 1
        rest = None
        if long_enough:
            ups = force / np.linalg.norm(force, axis=1, keepdims=True)
            rest = _Rest(from_ns=self._from_ns, to_ns=self._to_ns, ups=ups.tolist())
        self._begin()
        self._done = spent
        if rest is None or not (self._moved or self._another(rest)):
            return None
        self._moved = False
        self._rests = [r for r in self._rests if rest.to_ns - r.to_ns <= KEPT_NS][1 - KEPT :]
        self._rests.append(rest)
        return self._judge(rest.to_ns)

    def _another(self, rest: _Rest) -> bool:
        if not self._rests:
            return True
        together = np.einsum("sx,sx->s", np.array(rest.ups), np.array(self._rests[-1].ups))
        return bool(together.min() < np.cos(ANOTHER))

    def _judge(self, now_ns: int) -> Slip | None:
        found = turned_since(np.array([r.ups for r in self._rests]))
        if found is None or np.linalg.norm(found.turn) < LEAST_RAD:
            return None
        last = found.sensor == len(self.segments) - 1
        if found.evidence < (SURE_AT_THE_END if last else SURE):
            return None
        slip = self._said(found, now_ns)
        del self._rests[: found.split]
        return slip

    def _said(self, found: Turned, now_ns: int) -> Slip:
        segment, size = self.segments[found.sensor], float(np.degrees(np.linalg.norm(found.turn)))
        before, first = self._rests[found.split - 1], self._rests[found.split]
        place = f"{side_of(segment) or ''} {part_of(segment).replace('_', ' ')}".strip()
        ago = (now_ns - first.from_ns) / 1e9
        x, y, z = found.turn.tolist()
        return Slip(
            segment=segment,
            after_ns=before.to_ns,
            time_ns=first.from_ns,
            found_ns=now_ns,
            size_deg=size,
            turn=(x, y, z),
            evidence=found.evidence,
            text=f"the sensor on the {place} has turned by at least {size:.0f} deg since {ago:.0f} s ago: "
            "tighten its strap and take the pose again",
        )

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "rests": [asdict(r) for r in self._rests],
            "still": [self._from_ns, self._to_ns, self._count],
            "force": self._force.tolist(),
            "flags": [self._done, self._moved],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the watch whose state this is would have."""
        self._rests = [_Rest(**r) for r in state["rests"]]
        self._from_ns, self._to_ns, self._count = state["still"]
        self._force = np.array(state["force"])
        self._done, self._moved = state["flags"]
