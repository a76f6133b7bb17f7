"""All nodes of a subject enter through one host: who holds which subject, by liveliness tokens."""

import threading
from collections.abc import Callable

from brachium_wire import keys
from brachium_wire.bus import Bus

KIND = "host"
_JOIN = "--"


def checked_host(host: str) -> str:
    """Return `host` if it may name the clock of a host, or raise BadKey."""
    keys.chunk(host, "host id")
    if _JOIN in host or host.startswith("-"):
        raise keys.BadKey(f"host id {host!r} cannot be used: it must not hold {_JOIN} nor begin with -")
    return host


class HostClaims:
    """The claims of one room as this host sees them, and its own. Reading them costs no round trip."""

    def __init__(self, bus: Bus, room: str, host: str) -> None:
        self._bus, self._room, self._host = bus, room, checked_host(host)
        self._lock = threading.Lock()
        self._others: dict[str, set[str]] = {}
        self._ends: dict[str, Callable[[], None]] = {}
        bus.watch_alive(keys.services(room, f"{KIND}/*/alive"), self._changed)

    def other(self, subject: str) -> str | None:
        """Return another host through which this subject comes in now."""
        with self._lock:
            return min(self._others.get(subject, ()), default=None)

    def claim(self, subject: str) -> None:
        """Say that this subject comes in here."""
        if subject not in self._ends:
            name = f"{subject}{_JOIN}{self._host}"
            self._ends[subject] = self._bus.announce(keys.alive(self._room, KIND, name))

    def release(self, subject: str) -> None:
        """Say that this subject does not come in here any more."""
        end = self._ends.pop(subject, None)
        if end is not None:
            end()

    def yields(self, subject: str) -> bool:
        """Return whether this host gives way: of two that claimed at once the first in the alphabet stays."""
        other = self.other(subject)
        return subject in self._ends and other is not None and other < self._host

    def _changed(self, key: str, alive: bool) -> None:
        subject, join, host = keys.parse(key).detail.removeprefix(f"{KIND}/").rpartition(_JOIN)
        if not join or host == self._host:
            return
        with self._lock:
            hosts = self._others.setdefault(subject, set())
            if alive:
                hosts.add(host)
            else:
                hosts.discard(host)
