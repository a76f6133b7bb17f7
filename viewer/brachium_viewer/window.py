"""How fresh things are: names for ages, and what arrived on a stream during the last two seconds."""

from collections import deque
from typing import Literal

from brachium_wire.topics import TOPICS

State = Literal["live", "stale", "missing"]

WINDOW_NS = 2_000_000_000
SECOND = 1e9


class Window:
    """Counts of the last two seconds."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[int, int, float]] = deque(maxlen=4096)
        self.last_ns: int | None = None

    def add(self, now_ns: int, count: int, value: float = float("nan")) -> None:
        """Take `count` that arrived now, with a value that may be NaN."""
        self._arrivals.append((now_ns, count, value))
        self.last_ns = now_ns

    def _recent(self, now_ns: int) -> list[tuple[int, int, float]]:
        while self._arrivals and self._arrivals[0][0] <= now_ns - WINDOW_NS:
            self._arrivals.popleft()
        return list(self._arrivals)

    def rate_hz(self, now_ns: int) -> float:
        """Return counts a second: those after the first arrival of the window, over the time since it."""
        recent = self._recent(now_ns)
        if len(recent) < 2:
            return 0.0
        span_ns = max(recent[-1][0] - recent[0][0], 1)
        if now_ns - recent[-1][0] > 2 * span_ns / (len(recent) - 1):  # it paused: the pause counts
            span_ns = now_ns - recent[0][0]
        return sum(count for _, count, _ in recent[1:]) * SECOND / span_ns

    def values(self, now_ns: int) -> list[float]:
        """Return the values of the last two seconds that are known."""
        return [value for _, _, value in self._recent(now_ns) if value == value]

    def age_s(self, now_ns: int) -> float | None:
        """Return the time since the last arrival; None before the first."""
        return None if self.last_ns is None else max(0.0, (now_ns - self.last_ns) / SECOND)


def state(age_s: float | None, stale_after_s: float, missing_after_s: float) -> State:
    """Return what a value of this age is called; None: it never came."""
    if age_s is None or age_s > missing_after_s:
        return "missing"
    return "stale" if age_s > stale_after_s else "live"


def limit_s(topic: str) -> float:
    """Return after how long a topic's value is stale, by the topic table."""
    limit = TOPICS[topic].stale_after_s
    assert limit is not None
    return limit
