"""Our host time in LSL's. Both tick with this machine's monotonic clock: one comparison holds. Pure."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

ROUNDS = 32
STEP_NS = 5_000_000
"""A host whose time is off by more than this began anew; less is how well its time was asked for."""


@dataclass(frozen=True, slots=True)
class LslClock:
    """Host time and LSL's at one moment."""

    host_ns: int
    lsl_s: float
    uncertainty_ns: int
    """Half width within which the two are believed to be of the same moment."""

    def lsl(self, host_ns: int) -> float:
        """Return LSL's time, s, at a host time."""
        return self.lsl_s + (host_ns - self.host_ns) * 1e-9

    def host(self, lsl_s: float) -> int:
        """Return the host time, ns, at a time of LSL."""
        return self.host_ns + round((lsl_s - self.lsl_s) * 1e9)

    def agrees(self, other: "LslClock") -> bool:
        """Return whether both say the same, as far as each knows."""
        off_ns = abs(other.host(self.lsl_s) - self.host_ns)
        return off_ns <= STEP_NS + self.uncertainty_ns + other.uncertainty_ns


def compare(
    host_now_ns: Callable[[], int],
    lsl_now_s: Callable[[], float],
    uncertainty_ns: int = 0,
    rounds: int = ROUNDS,
) -> LslClock:
    """Return the two clocks as the quickest of `rounds` looks at them shows them.

    `uncertainty_ns` is that of the host time itself.
    """
    looks: Iterable[tuple[int, float, int]] = (
        (host_now_ns(), lsl_now_s(), host_now_ns()) for _ in range(rounds)
    )
    before, lsl_s, after = min(looks, key=lambda look: look[2] - look[0])
    return LslClock((before + after) // 2, lsl_s, (after - before) // 2 + uncertainty_ns)
