"""When was it, in host time? One node's clock against the host's, from messages that took unknown times.

Every arrival of device time x at host time h says that the offset h - x is at most that large, every question
sent at h that the node had at x that it is at least that large. The line that keeps below the ones and above
the others with the smallest sum of gaps (Moon, Skelly and Towsley, INFOCOM 1999, here for both directions
with one slope) is the node's clock.
"""

from collections import deque

import numpy as np
import numpy.typing as npt

Integers = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

WINDOW_US = 60_000_000
SETTLE_US = 5_000_000
"""Until exchanges span this long the quickest one speaks alone: a slope needs a baseline."""
REFIT_NS = 1_000_000_000
MAX_SLOPE = 0.2
"""ns per us, that is 200 ppm: no crystal is worse."""
DRIFT = 0.02
"""ns per us by which the offset is believed to wander between fits (20 ppm)."""
MAX_SLEW = 50.0
"""ns per us by which published time is hurried or held back to meet a new estimate."""
JUMP_NS = 50_000_000.0
"""A published time that is late by more than this leaps forward; it never leaps back."""
ONE_WAY_NS = 50_000_000
"""Stated uncertainty while no exchange was answered: the base delay cannot be seen."""
_BUCKET_US = 50_000


class NodeClock:
    """Host time of one node. Feed it arrivals and exchanges; Published times grow with device time."""

    def __init__(self) -> None:
        self._ups: deque[tuple[int, int]] = deque()
        self._downs: deque[tuple[int, int]] = deque()
        self._exchanges: deque[tuple[int, int, int]] = deque()
        self._origin_us = 0
        self._origin_ns = 0
        self._intercept, self._slope = 0.0, 0.0
        self._gap_ns = 0.0
        self._fit_us: int | None = None
        self._fit_host_ns = 0
        self._correction_ns, self._correction_us, self._correction_span_us = 0.0, 0, 1.0
        self._published_us: int | None = None
        self._settled = False

    @property
    def known(self) -> bool:
        """Whether an exchange was answered; before that only arrivals speak."""
        return bool(self._exchanges)

    @property
    def skew_ppm(self) -> float:
        """How much slower than the host's the node's clock runs."""
        return self._slope * 1e3

    @property
    def newest_us(self) -> int:
        """The newest device time that was published, or the first one known."""
        return self._published_us if self._published_us is not None else self._origin_us

    @property
    def offset_ns(self) -> int:
        """Host time minus device time at the newest sample."""
        return int(self.host_ns(np.array([self.newest_us]))[0]) - self.newest_us * 1000

    def arrival(self, device_us: int, host_ns: int) -> None:
        """Take that a sample of device time `device_us` had arrived at `host_ns`."""
        offset = host_ns - device_us * 1000
        if not self._ups and not self._downs:
            self._origin_us, self._origin_ns = device_us, offset
        # Only the quickest of each short span can touch the line.
        if self._ups and self._ups[-1][0] // _BUCKET_US == device_us // _BUCKET_US:
            if offset < self._ups[-1][1]:
                self._ups[-1] = (device_us, offset)
        else:
            self._ups.append((device_us, offset))
        self._refit(device_us, host_ns)

    def exchange(self, asked_ns: int, came_us: int, left_us: int, answered_ns: int) -> bool:
        """Take a question sent at `asked_ns` and answered at `answered_ns` (host) that the node had from
        `came_us` to `left_us` (its own clock). Returns False when these cannot be: nothing is taken then.
        """
        round_trip = (answered_ns - asked_ns) - (left_us - came_us) * 1000
        backwards = bool(self._downs) and came_us < self._downs[-1][0]
        if left_us < came_us or round_trip < 0 or backwards:
            return False
        down, up = asked_ns - came_us * 1000, answered_ns - left_us * 1000
        if not self._ups and not self._downs:
            self._origin_us, self._origin_ns = came_us, up
        self._downs.append((came_us, down))
        self._exchanges.append((came_us, (down + up) // 2, round_trip))
        if not self._settled and round_trip <= min(e[2] for e in self._exchanges):
            self._fit_us = None  # the quickest so far: use it at once
        self.arrival(left_us, answered_ns)
        return True

    def host_ns(self, device_us: Integers) -> Integers:
        """Return host times (n,) of device times (n,), strictly growing where these do."""
        elapsed = (device_us - self._origin_us).astype(np.float64)
        fade = np.clip(1.0 - (device_us - self._correction_us) / self._correction_span_us, 0.0, 1.0)
        offset = self._intercept + self._slope * elapsed + self._correction_ns * fade
        return device_us * 1000 + self._origin_ns + np.rint(offset).astype(np.int64)

    def publish(self, device_us: int) -> None:
        """Take that host times up to this device time are given away: later estimates join on to them."""
        self._published_us = max(device_us, self._published_us or 0)

    def uncertainty_ns(self, device_us: int) -> int:
        """Return the half width within which the host time of `device_us` is believed to lie."""
        fade = min(max(1.0 - (device_us - self._correction_us) / self._correction_span_us, 0.0), 1.0)
        age = abs(device_us - self._fit_us) if self._fit_us is not None else 0
        drift = DRIFT if self._settled else MAX_SLOPE
        return round(abs(self._gap_ns) / 2 + abs(self._correction_ns) * fade + drift * age)

    def _refit(self, device_us: int, host_ns: int) -> None:
        if self._fit_us is not None and host_ns - self._fit_host_ns < REFIT_NS:
            return
        oldest = device_us - WINDOW_US
        for points in (self._ups, self._downs):
            while points and points[0][0] < oldest:
                points.popleft()
        while len(self._exchanges) > 1 and self._exchanges[0][0] < oldest:
            self._exchanges.popleft()
        joined_us = self._published_us
        before = 0.0 if joined_us is None else self._exact_ns(joined_us)
        if not self._estimate(device_us):
            return
        self._fit_host_ns = host_ns
        self._correction_ns = 0.0
        if joined_us is not None:
            ahead = before - self._exact_ns(joined_us)
            if ahead > -JUMP_NS:
                self._correction_ns, self._correction_us = ahead, joined_us
                self._correction_span_us = max(REFIT_NS / 1000, abs(ahead) / MAX_SLEW)

    def _exact_ns(self, device_us: int) -> float:
        """Published offset at `device_us`, ns, against the first one."""
        fade = min(max(1.0 - (device_us - self._correction_us) / self._correction_span_us, 0.0), 1.0)
        return self._intercept + self._slope * (device_us - self._origin_us) + self._correction_ns * fade

    def _estimate(self, device_us: int) -> bool:
        """Set line and gap; return whether there was anything to estimate from."""
        if not self._exchanges:
            self._fit_us = device_us
            self._intercept = float(min(offset for _, offset in self._ups) - self._origin_ns)
            self._slope, self._gap_ns = 0.0, 2.0 * ONE_WAY_NS
            return True
        if self._downs and self._downs[-1][0] - self._downs[0][0] >= SETTLE_US:
            ups = self._points(self._ups)
            downs = self._points(self._downs)
            self._intercept, self._slope, self._gap_ns = between(ups, downs)
            self._fit_us, self._settled = device_us, True
        elif not self._settled:
            came_us, offset, round_trip = min(self._exchanges, key=lambda e: e[2])
            self._intercept, self._slope, self._gap_ns = (
                float(offset - self._origin_ns),
                0.0,
                float(round_trip),
            )
            self._fit_us = came_us
        else:
            return False  # nobody answers any more: the last line stands and grows uncertain
        return True

    def _points(self, points: deque[tuple[int, int]]) -> Floats:
        rows = np.array(points, dtype=np.int64)
        return np.column_stack([rows[:, 0] - self._origin_us, rows[:, 1] - self._origin_ns]).astype(
            np.float64
        )


def between(ups: Floats, downs: Floats) -> tuple[float, float, float]:
    """Return intercept, slope and gap of the middle line between points above (n, 2) and points below (m, 2).

    For a slope b the upper line touches at min(y - b x), the lower at max(y - b x); the sum of all gaps, each
    side weighted alike, is convex in b and its best slope is found by narrowing a grid. The gap is negative
    when no line keeps them apart.
    """
    middle = float(np.mean(ups[:, 0]))
    x_up, y_up = ups[:, 0] - middle, ups[:, 1]
    x_down, y_down = downs[:, 0] - middle, downs[:, 1]

    def touching(slopes: Floats) -> tuple[Floats, Floats]:
        upper = np.min(y_up - slopes[:, None] * x_up, axis=1)
        return upper, np.max(y_down - slopes[:, None] * x_down, axis=1)

    lean = -float(np.mean(x_down))
    low, high = -MAX_SLOPE, MAX_SLOPE
    for _ in range(6):
        slopes = np.linspace(low, high, 17)
        upper, lower = touching(slopes)
        best = int(np.argmax(upper - lower + slopes * lean))
        low, high = float(slopes[max(best - 1, 0)]), float(slopes[min(best + 1, 16)])
    slope = (low + high) / 2
    above, below = (float(line[0]) for line in touching(np.array([slope])))
    return (above + below) / 2 - slope * middle, slope, above - below
