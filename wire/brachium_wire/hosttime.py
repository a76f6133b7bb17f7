"""Host time: the wall clock read once at start, plus the monotonic clock since. Its jumps change nothing."""

import time


class HostClock:
    """One process's host time. Every service that gives samples their time holds exactly one."""

    def __init__(self) -> None:
        self._start_ns = time.time_ns() - time.monotonic_ns()

    def now_ns(self) -> int:
        """Return host time in ns."""
        return self._start_ns + time.monotonic_ns()

    def at(self, monotonic_ns: int) -> int:
        """Return the host time of a reading of the monotonic clock."""
        return self._start_ns + monotonic_ns
