"""Does a segment move as arms do, or did its orientation jump? Pure.

A filter that finds its heading anew, a sensor that starts again or a strap that snaps show as a turn within
one or two ticks that neither the movement before nor the one after explains. A fast movement does not: what
it moved is what its speeds before and after say.
"""

from math import atan2, radians, sqrt

from brachium_wire.messages import Quaternion

ACCELERATION = 80.0
"""rad/s^2 of a segment: 90 deg in 0.34 s by the smoothest movement there is (5.77 angle / time^2). A throw
has more; a jump of 5 deg within two ticks of 20 ms is still above."""
FASTEST = 250.0
"""rad/s^2: 90 deg in 0.19 s. What stays below this over more than JUMP_TICKS is a fast movement."""
JUMP_TICKS = 3
"""A jump takes one tick, two where it falls between them; a third is for what the estimator smooths."""
NOISE = radians(0.5)
"""Of an orientation from tick to tick."""
LONGEST_TICK_NS = 25_000_000
"""With longer ones the limit would let a jump of 5 deg pass."""
STEADY = 3
"""Ticks in a row that must be as those before."""
LONGEST_EVENT_NS = 300_000_000
"""What was implausible for longer cannot be told from a jump."""

Vector = tuple[float, float, float]


class SegmentWatch:
    """One segment's orientations, tick by tick; `steady` and `jumped` say what to think of the last."""

    def __init__(self) -> None:
        self.jumped = False
        """A jump was seen and nothing has taken it back; only `forgive` does."""
        self._time_ns = 0
        self._last: Quaternion | None = None
        self._rate: Vector | None = None
        self._steady = 0
        self._before: tuple[int, Quaternion, Vector] | None = None
        """Time, orientation and rate before what is implausible."""
        self._worst = 0.0
        """Largest acceleration since, rad/s^2."""

    @property
    def steady(self) -> bool:
        """Whether the last ticks were plausible, without a break."""
        return self._steady >= STEADY

    def forgive(self) -> None:
        """Take that orientations hold from now on: the sensors were calibrated or zeroed."""
        self.jumped, self._before = False, None
        self.lose()

    def lose(self) -> None:
        """Take that the segment is not measured at this tick."""
        if self._before is not None:
            self.jumped, self._before = True, None  # it was never seen how that went on
        self._last, self._rate, self._steady = None, None, 0

    def see(self, time_ns: int, world_from_segment: Quaternion) -> None:
        """Take the orientation of the next tick."""
        elapsed_ns = time_ns - self._time_ns
        if self._last is not None and not 0 < elapsed_ns <= LONGEST_TICK_NS:
            self.lose()
        last, self._last, self._time_ns = self._last, world_from_segment, time_ns
        if last is None:
            return
        tick_s = 1e-9 * elapsed_ns
        turned = turn_between(last, world_from_segment)
        before, self._rate = self._rate, _scaled(turned, 1.0 / tick_s)
        if before is None:
            return
        acceleration = max(0.0, _distance(self._rate, before) - NOISE / tick_s) / tick_s
        if acceleration <= ACCELERATION:
            self._steady += 1
            if self._before is not None and self.steady:
                self._judge(time_ns, tick_s)
        else:
            self._steady = 0
            if self._before is None:
                self._before, self._worst = (time_ns - elapsed_ns, last, before), 0.0
            self._worst = max(self._worst, acceleration)
        if self._before is not None and time_ns - self._before[0] > LONGEST_EVENT_NS:
            self.jumped, self._before = True, None

    def _judge(self, time_ns: int, tick_s: float) -> None:
        """Decide, now that it is over, whether what was implausible was a jump."""
        assert self._before is not None
        assert self._last is not None
        assert self._rate is not None
        began_ns, orientation, rate = self._before
        self._before = None
        # The steady ticks are movement again: what they turned is taken off at the rate of the last one.
        span_s = 1e-9 * (time_ns - began_ns)
        event_s = span_s - STEADY * tick_s
        if self._worst <= FASTEST and event_s > (JUMP_TICKS + 0.5) * tick_s:
            return
        moved = turn_between(orientation, self._last)
        explained = tuple(
            0.5 * (a + b) * event_s + b * STEADY * tick_s for a, b in zip(rate, self._rate, strict=True)
        )
        if _distance(moved, explained) > ACCELERATION * event_s**2 / 4.0 + NOISE:
            self.jumped = True


def turn_between(a: Quaternion, b: Quaternion) -> Vector:
    """Return the rotation vector (rad, in world axes) that turns orientation a into b by the shorter way."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    w = bw * aw + bx * ax + by * ay + bz * az
    x = -bw * ax + bx * aw - by * az + bz * ay
    y = -bw * ay + by * aw - bz * ax + bx * az
    z = -bw * az + bz * aw - bx * ay + by * ax
    length = sqrt(x * x + y * y + z * z)
    if length < 1e-12:
        return 0.0, 0.0, 0.0
    factor = 2.0 * atan2(length, abs(w)) / length * (1.0 if w >= 0.0 else -1.0)
    return factor * x, factor * y, factor * z


def _scaled(v: Vector, factor: float) -> Vector:
    return v[0] * factor, v[1] * factor, v[2] * factor


def _distance(a: Vector, b: tuple[float, ...]) -> float:
    return sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)
