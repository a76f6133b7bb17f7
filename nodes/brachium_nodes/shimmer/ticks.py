"""A Shimmer3's time stamps as a clock that never wraps, and its samples' numbers. Pure."""

from dataclasses import dataclass

from brachium_nodes.shimmer.packets import WRAP
from brachium_nodes.shimmer.protocol import TICK_HZ

SAME_CLOCK_TICKS = TICK_HZ // 4
"""After an outage the clock went on if it is this near to where it should be; by chance one in 1024 is."""


def microseconds(ticks: int) -> int:
    """Return ticks in whole us: 1e6 / 32768 = 15625 / 512."""
    return ticks * 15625 // 512


@dataclass(slots=True)
class TickCounter:
    """Counts on from stamp to stamp. `number` is the sample's: what is missing has numbers too."""

    period: int
    ticks: int = -1
    number: int = 0
    _received_ns: int = 0

    def follow(self, stamp: int, received_ns: int) -> bool:
        """Take the next sample's stamp; return False, and take nothing, when it is no later than the last.

        How often the stamp wrapped meanwhile is told from the times of arrival.
        """
        if self.ticks < 0:
            self.ticks, self._received_ns = stamp, received_ns
            return True
        ahead = (stamp - self.ticks) % WRAP
        elapsed = (received_ns - self._received_ns) * TICK_HZ / 1e9
        ahead += WRAP * max(0, round((elapsed - ahead) / WRAP))
        samples = round(ahead / self.period)
        if samples < 1 or (ahead > WRAP // 2 and elapsed < WRAP // 4):
            return False
        self.ticks += ahead
        self.number += samples
        self._received_ns = received_ns
        return True

    def same_clock(self, stamp: int, received_ns: int) -> bool:
        """Return whether a stamp after an outage is what this clock shows if it went on meanwhile."""
        elapsed = (received_ns - self._received_ns) * TICK_HZ / 1e9
        apart = (stamp - self.ticks - round(elapsed)) % WRAP
        return self.ticks >= 0 and min(apart, WRAP - apart) <= SAME_CLOCK_TICKS
