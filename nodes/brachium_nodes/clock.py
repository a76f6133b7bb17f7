"""When was it, in host time? One node's clock against the host's, from messages that took unknown times.

Every arrival of device time x at host time h says that the offset h - x is at most that large, every question
sent at h that the node had at x that it is at least that large. The line that keeps below the ones and above
the others with the smallest sum of gaps (Moon, Skelly and Towsley, INFOCOM 1999, here for both directions
with one slope) is the node's clock.
"""

import numpy as np
import numpy.typing as npt

from brachium_nodes.clock_line import Below, between

Integers = npt.NDArray[np.int64]

WINDOW_US = 60_000_000
SETTLE_US = 3_000_000
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


class NodeClock:
    """Host time of one node. Feed it arrivals and exchanges; Published times grow with device time."""

    def __init__(self) -> None:
        self._ups, self._downs = Below(MAX_SLOPE), Below(MAX_SLOPE)
        """Device time in us and host time less it in ns, both against the first; of questions negated."""
        self._quickest: tuple[int, int, int] | None = None
        """Round trip of an exchange, its device time and offset."""
        self.known = False
        """Whether an exchange was answered; before that only arrivals speak."""
        self._begun = False
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
        if not self._begun:
            self._begin(device_us, host_ns)
        self._ups.add(device_us - self._origin_us, host_ns - device_us * 1000 - self._origin_ns)
        if self._fit_us is None or host_ns - self._fit_host_ns >= REFIT_NS:
            self._refit(device_us, host_ns)

    def exchange(self, asked_ns: int, came_us: int, left_us: int, answered_ns: int) -> bool:
        """Take a question sent at `asked_ns` and answered at `answered_ns` (host) that the node had from
        `came_us` to `left_us` (its own clock). Returns False when these cannot be: nothing is taken then.
        """
        round_trip = (answered_ns - asked_ns) - (left_us - came_us) * 1000
        backwards = bool(self._downs) and came_us - self._origin_us < self._downs.newest
        if left_us < came_us or round_trip < 0 or backwards:
            return False
        if not self._begun:
            self._begin(came_us, answered_ns - (left_us - came_us) * 1000)
        down, up = asked_ns - came_us * 1000, answered_ns - left_us * 1000
        self._downs.add(came_us - self._origin_us, self._origin_ns - down)
        if self._quickest is None or (not self._settled and round_trip <= self._quickest[0]):
            self._quickest = round_trip, came_us, (down + up) // 2 - self._origin_ns
            self.known, self._fit_us = True, None  # the quickest so far: use it at once
        self.arrival(left_us, answered_ns)
        return True

    def host_ns(self, device_us: Integers) -> Integers:
        """Return host times (n,) of device times (n,), strictly growing where these do."""
        return np.array(self.host_times(device_us.tolist()), dtype=np.int64)

    def host_times(self, device_us: list[int]) -> list[int]:
        """Return the same of a few growing ones: lists are quicker then."""
        origin_us, origin_ns, since_us = self._origin_us, self._origin_ns, self._correction_us
        offset, slope = self._intercept, self._slope
        end_us = since_us + self._correction_span_us
        if since_us <= device_us[0] and device_us[-1] <= end_us:
            fading = self._correction_ns / self._correction_span_us
            offset += self._correction_ns + fading * (since_us - origin_us)
            slope -= fading
        elif device_us[0] < end_us:
            return [us * 1000 + origin_ns + round(self._exact_ns(us)) for us in device_us]
        return [us * 1000 + origin_ns + int(offset + slope * (us - origin_us)) for us in device_us]

    def publish(self, device_us: int) -> None:
        """Take that host times up to this device time are given away: later estimates join on to them."""
        if self._published_us is None or device_us > self._published_us:
            self._published_us = device_us

    def uncertainty_ns(self, device_us: int) -> int:
        """Return the half width within which the host time of `device_us` is believed to lie."""
        uncertain = abs(self._gap_ns) / 2
        if self._fit_us is not None:
            uncertain += (DRIFT if self._settled else MAX_SLOPE) * abs(device_us - self._fit_us)
        fade = 1.0 - (device_us - self._correction_us) / self._correction_span_us
        if fade > 0.0:
            uncertain += abs(self._correction_ns) * min(fade, 1.0)
        return round(uncertain)

    def _begin(self, device_us: int, host_ns: int) -> None:
        self._begun = True
        self._origin_us, self._origin_ns = device_us, host_ns - device_us * 1000

    def _refit(self, device_us: int, host_ns: int) -> None:
        oldest = device_us - self._origin_us - WINDOW_US
        self._ups.forget(oldest)
        self._downs.forget(oldest)
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
        if self._quickest is None:
            self._fit_us = device_us
            self._intercept = float(min(y for _, y in self._ups.edge()))
            self._slope, self._gap_ns = 0.0, 2.0 * ONE_WAY_NS
            return True
        if self._downs.span >= SETTLE_US:
            self._intercept, self._slope, self._gap_ns = between(self._ups, self._downs, MAX_SLOPE)
            self._fit_us, self._settled = device_us, True
            return True
        if self._settled:
            return False  # nobody answers any more: the last line stands and grows uncertain
        round_trip, self._fit_us, offset = self._quickest
        self._intercept, self._slope, self._gap_ns = float(offset), 0.0, float(round_trip)
        return True
