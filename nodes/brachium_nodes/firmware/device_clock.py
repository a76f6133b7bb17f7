"""The node's clock, and when the samples were taken that a sensor's FIFO hands over in bunches."""

import time

FRACTION = 8  # bits below a microsecond
LEARN_US, ANEW_US = 4_000_000, 16_000_000


class DeviceClock:
    """Microseconds since the node was switched on. ticks_us wraps after 18 minutes; this does not.

    It must be read at least every 8 minutes.
    """

    def __init__(self):
        self._last = time.ticks_us()
        self._now = 1_000_000

    def now(self):
        """Return the time in us."""
        ticks = time.ticks_us()
        self._now += time.ticks_diff(ticks, self._last)
        self._last = ticks
        return self._now


class SampleClock:
    """Times of samples that the sensor takes by an oscillator of its own, some percent off the node's.

    All that is seen of it is how many samples had gathered when the FIFO's count was read: the newest of them
    was taken before that moment, the next one will be after it. Each reading narrows the phase; over seconds
    the period is learned.
    """

    def __init__(self, rate_hz):
        self.nominal = self.period = int((1_000_000 << FRACTION) / rate_hz)
        self.number = 0  # of the next sample
        self._phase = None  # when it is due after `_at`, in us and fractions
        self._at = 0
        self._newest = 0
        self._learning = None

    def read(self, before, after, count):
        """Take that `count` samples had gathered between two readings of the clock: `take` each then."""
        period = self.period
        if self._phase is None:
            self._at, self._phase = after, -(count * period) + period // 2
            return
        self._phase -= (after - self._at) << FRACTION
        self._at = after
        following = self._phase + count * period
        early = -((after - before) << FRACTION)
        if following < early:
            self._phase += early - following
        elif following > period:
            self._phase += period - following

    def take(self):
        """Return when the next sample was taken, in us; times grow from sample to sample."""
        taken = self._at + (self._phase >> FRACTION)
        self._phase += self.period
        self.number += 1
        self._newest = taken if taken > self._newest else self._newest + 1
        return self._newest

    def count(self, elapsed):
        """Return how many samples are taken in that many us, none begun left out."""
        return (elapsed << FRACTION) // self.period + 1

    def due_between(self, before, after):
        """Return whether a sample may be taken between two readings of the clock, or too near to tell."""
        if self._phase is None:
            return False
        near = self.period // 8
        first = ((before - self._at) << FRACTION) - self._phase - near
        last = ((after - self._at) << FRACTION) - self._phase + near
        return first // self.period != last // self.period

    def skip(self, now):
        """Take that all samples up to now are lost; return how many those were."""
        if self._phase is None:
            return 0
        due = ((now - self._at) << FRACTION) - self._phase
        lost = due // self.period + 1 if due >= 0 else 0
        self._phase += lost * self.period
        self.number += lost
        self._learning = None
        return lost

    def learn(self):
        """Set the period by what the last seconds have shown. Call it now and then."""
        if self._phase is None:
            return
        due = self._at + (self._phase >> FRACTION)
        if self._learning is None:
            self._learning = self.number, due
            return
        number, since = self._learning
        if due - since < LEARN_US:
            return
        seen = ((due - since) << FRACTION) // (self.number - number)
        if abs(seen - self.nominal) < self.nominal // 16:
            self.period = seen
        if due - since >= ANEW_US:
            self._learning = self.number, due
