"""Host time: the wall clock read once at start, plus the monotonic clock since. Its jumps change nothing."""

import time
from collections.abc import Callable

import msgpack
import msgspec

from brachium_wire import keys
from brachium_wire.bus import Bus


class NoHostTime(RuntimeError):
    """Nobody told the host time that was asked for."""


class HostClock:
    """One process's host time. Every service that gives samples their time holds exactly one."""

    def __init__(self, start_ns: int | None = None, uncertainty_ns: int = 0) -> None:
        """`start_ns`: host time at zero of the monotonic clock; this host's own by default."""
        self._start_ns = time.time_ns() - time.monotonic_ns() if start_ns is None else start_ns
        self.uncertainty_ns = uncertainty_ns
        """Half width within which this clock is believed to agree with the one it follows."""

    def now_ns(self) -> int:
        """Return host time in ns."""
        return self._start_ns + time.monotonic_ns()

    def at(self, monotonic_ns: int) -> int:
        """Return the host time of a reading of the monotonic clock."""
        return self._start_ns + monotonic_ns


def tell_host_time(bus: Bus, room: str, service_id: str, now_ns: Callable[[], int]) -> None:
    """Answer everyone who asks for this service's host time, as long as the bus is open."""
    bus.serve(
        keys.host_time(room, service_id), lambda _key, _question: msgspec.msgpack.encode({"t": now_ns()})
    )


def follow_host_time(
    bus: Bus, room: str, service_id: str, *, rounds: int = 8, timeout_s: float = 1.0
) -> HostClock:
    """Return a clock that tells the host time of another service, `info.host` of its sensors.

    The quickest of `rounds` questions decides; half its round trip is the uncertainty. Raises NoHostTime.
    """
    best: tuple[int, int] | None = None
    key = keys.host_time(room, service_id)
    for _ in range(rounds):
        asked = time.monotonic_ns()
        answer = bus.ask(key, timeout_s=timeout_s)
        answered = time.monotonic_ns()
        told = _told(answer)
        if told is None:
            break
        start_ns = told - (asked + answered) // 2
        if best is None or answered - asked < best[0]:
            best = answered - asked, start_ns
    if best is None:
        raise NoHostTime(
            f"{service_id!r} in room {room!r} does not tell its host time; is that gateway running?"
        )
    return HostClock(best[1], best[0] // 2)


def _told(answer: bytes | None) -> int | None:
    if answer is None or len(answer) > 64:
        return None
    try:
        value = msgpack.unpackb(answer)
    except Exception:  # whatever foreign bytes make msgpack raise
        return None
    told = value.get("t") if isinstance(value, dict) else None
    return told if isinstance(told, int) and 0 < told < 1 << 62 else None
