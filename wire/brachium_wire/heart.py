"""What every service shows of itself: a liveliness token, and its health once a second."""

import time
from collections import Counter

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Health

BEAT_S = 1.0


class Heart:
    """One service's sign of life. Count into `counts` and `drops`, call `beat` often: it puts at 1 Hz."""

    def __init__(self, bus: Bus, room: str, kind: str, service_id: str) -> None:
        self._bus, self._key = bus, keys.service(room, kind, service_id)
        self._kind, self._id = kind, service_id
        self._clock = HostClock()
        self._start = self._due = time.monotonic()
        self.counts: Counter[str] = Counter()
        self.drops: Counter[str] = Counter()
        self.waiting: list[str] = []
        self.text = ""
        self.alarm = ""
        self.end = bus.announce(keys.alive(room, kind, service_id))

    def beat(self, *, now: bool = False) -> None:
        """Publish the health if a second has passed since the last time, or `now`."""
        moment = time.monotonic()
        if moment < self._due and not now:
            return
        self._due = moment + BEAT_S
        health = Health(
            kind=self._kind,
            id=self._id,
            time_ns=self._clock.now_ns(),
            uptime_s=moment - self._start,
            counts=dict(self.counts),
            drops=dict(self.drops),
            waiting=list(self.waiting),
            text=self.text,
            alarm=self.alarm,
        )
        self._bus.put(self._key, encode(health))
