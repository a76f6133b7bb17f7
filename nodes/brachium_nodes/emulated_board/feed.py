"""What the emulated person's sensor measures: a file of samples, each at its own true time.

A sample is 18 bytes: acceleration and angular rate as the chip's registers hold them (6 x i16, big-endian),
and the magnetic field as the magnetometer's do (3 x i16, little-endian). Before the first sample the person
stands as in it; after the last one as in that.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SAMPLE = 18


@dataclass(frozen=True, kw_only=True)
class FeedSettings:
    """Where the samples are, and when they are taken."""

    path: str
    start_us: int
    """True time of number 0, us."""
    period_ns: int
    rate_hz: float
    """As the firmware must configure it."""


class Feed:
    """The samples of one sensor, by number; `clock` is true time in us."""

    def __init__(self, settings: FeedSettings, clock: Callable[[], int]) -> None:
        self._file = Path(settings.path).open("rb")  # noqa: SIM115 (open as long as the board is on)
        self._clock, self._last = clock, -1
        self._start_us, self._period_ns = settings.start_us, settings.period_ns
        self.rate_hz = settings.rate_hz

    def since_us(self) -> int:
        """Return the time since number 0."""
        return self._clock() - self._start_us

    def due(self) -> int:
        """Return the number of the next sample: all before it were taken by now."""
        return self.since_us() * 1000 // self._period_ns + 1

    def sample(self, number: int) -> bytes:
        """Return the 18 bytes of a sample."""
        if number > self._last:
            self._last = self._file.seek(0, 2) // SAMPLE - 1  # the file may have grown
        self._file.seek(SAMPLE * max(0, min(number, self._last)))
        return self._file.read(SAMPLE)
