"""A node's own clock and its way to the gateway: Wi-Fi delay, and faults counted as they are injected."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_nodes.movement import Array
from brachium_nodes.sensors import generator

Wifi = Literal["none", "good", "busy"]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Delay:
    """One-way delay of a packet: base + gamma jitter, and bursts in which packets queue."""

    base_s: float
    jitter_shape: float
    jitter_scale_s: float
    burst_rate_hz: float
    """Bursts that begin in a second of sending."""
    burst_s: float
    """Shortest burst; lengths are Pareto distributed with exponent 2."""
    burst_longest_s: float


# Base delay and bursts of 802.11n in a quiet and in a busy flat, as the clock estimator was tried on.
WIFI: dict[Wifi, Delay] = {
    "none": Delay(
        base_s=0.0, jitter_shape=1.5, jitter_scale_s=0.0, burst_rate_hz=0.0, burst_s=0.0, burst_longest_s=0.0
    ),
    "good": Delay(
        base_s=0.001,
        jitter_shape=1.5,
        jitter_scale_s=0.0007,
        burst_rate_hz=0.1,
        burst_s=0.05,
        burst_longest_s=0.8,
    ),
    "busy": Delay(
        base_s=0.001,
        jitter_shape=1.5,
        jitter_scale_s=0.002,
        burst_rate_hz=0.5,
        burst_s=0.05,
        burst_longest_s=0.8,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultSettings:
    """What goes wrong on the way; probabilities a packet, each excluding the others, all off by default."""

    loss: float = 0.0
    """A packet is lost."""
    burst_loss: float = 0.0
    """A run of packets begins to be lost here."""
    burst_packets: int = 10
    swap: float = 0.0
    """A packet comes after its successor, which TCP itself never does."""
    duplicate: float = 0.0
    """A packet comes twice."""
    wifi: Wifi = "none"

    def __post_init__(self) -> None:
        """Raise ValueError for what is no probability."""
        for name in ("loss", "burst_loss", "swap", "duplicate"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} {getattr(self, name)} is no probability; give 0 to 0.95")
        total = self.loss + self.burst_loss + self.swap + self.duplicate
        if total > 0.95:
            raise ValueError(f"faults of {total:g} in sum leave too little; give at most 0.95")
        if not 1 <= self.burst_packets <= 1000:
            raise ValueError(f"bursts of {self.burst_packets} packets cannot be lost; give 1 to 1000")
        if self.wifi not in WIFI:
            raise ValueError(f"wifi {self.wifi!r} is not known; choose one of {', '.join(WIFI)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Injected:
    """What was done to one stream up to one packet, in samples. A receiver that saw all counts the same."""

    sent: int = 0
    """Each sample once, however often it was sent."""
    lost: int = 0
    swapped: int = 0
    """Samples sent after a later one."""
    duplicated: int = 0


@dataclass(frozen=True, slots=True)
class EmulatedClock:
    """A node's clock: `ticks = start + (1 + skew) true time`; its samples are equidistant in its own time."""

    rate_hz: float
    phase_s: float
    """True time of sample 0."""
    skew: float
    start_s: float
    """What the clock shows at true time 0."""

    @classmethod
    def draw(cls, rate_hz: float, skew_ppm: float, seed: int, segment: str) -> "EmulatedClock":
        """Return the clock that this seed gives to this segment's node."""
        random = generator(seed, segment, "clock")
        return cls(
            rate_hz,
            phase_s=random.uniform(0.0, 1.0 / rate_hz),
            skew=skew_ppm * 1e-6 * random.standard_normal(),
            start_s=random.uniform(5.0, 3600.0),
        )

    def sample_time_s(self, index: Integers) -> Array:
        """Return the true times at which samples (n,) are taken."""
        times: Array = self.phase_s + index.astype(np.float64) * self.period_s
        return times

    @property
    def period_s(self) -> float:
        """True time between samples."""
        return 1.0 / (self.rate_hz * (1.0 + self.skew))

    def ticks_us(self, time_s: Array) -> Integers:
        """Return what the clock shows at true times (n,), us."""
        return np.floor(1e6 * (self.start_s + time_s * (1.0 + self.skew))).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Departure:
    """One packet that arrives."""

    number: int
    time_s: float
    """True time at which it arrives; never before the packet sent before it, as with TCP."""
    injected: Injected
    """What was done to the stream so far, this packet included."""


def departures(
    first_ready_s: float, period_s: float, samples: int, faults: FaultSettings, seed: int, segment: str
) -> Iterator[Departure]:
    """Yield for ever what arrives of packets of `samples` samples that are ready once every `period_s`.

    Packet 0 is never lost or swapped: a receiver could not know of it. A burst of Wi-Fi delay holds back what
    follows it. The two packets of a swap arrive at one time; with the second the counts are complete again.
    """
    latest, losing = -inf, 0
    held: int | None = None
    done = Injected()
    for number, (delay, fate) in enumerate(_draws(faults, period_s, seed, segment)):
        latest = max(latest, first_ready_s + number * period_s + delay)
        losing = faults.burst_packets if fate == "burst" and not losing else losing
        if number and (losing or fate == "lost"):
            losing = max(losing - 1, 0)
            done = replace(done, lost=done.lost + samples)
            continue
        if number and fate == "swapped" and held is None:
            held = number
            continue
        done = replace(done, sent=done.sent + samples)
        yield Departure(number, latest, done)
        if held is not None:
            done = replace(done, sent=done.sent + samples, swapped=done.swapped + samples)
            yield Departure(held, latest, done)
            held = None
        elif fate == "duplicated":
            done = replace(done, duplicated=done.duplicated + samples)
            yield Departure(number, latest, done)


def lost_samples(
    count: int, batch: int, faults: FaultSettings, seed: int, segment: str
) -> npt.NDArray[np.bool_]:
    """Return which of a stream's first `count` samples (count,) are lost, sent `batch` at a time.

    They are those that the same faults take from the stream itself, at any rate and without Wi-Fi's bursts.
    """
    packets = -(-count // batch)
    lost = np.ones(packets, dtype=np.bool_)
    for departure in departures(0.0, 1.0, batch, faults, seed, segment):
        if departure.number < packets:
            lost[departure.number] = False
        elif departure.number > packets:  # a swapped packet comes after its successor, not later
            return np.repeat(lost, batch)[:count]
    raise AssertionError("departures never end")


def _draws(faults: FaultSettings, period_s: float, seed: int, segment: str) -> Iterator[tuple[float, str]]:
    """Yield delay in s and fate of one packet after the other."""
    wifi, random = WIFI[faults.wifi], generator(seed, segment, "link")
    kinds = np.array(["lost", "burst", "swapped", "duplicated", "fine"])
    bounds = np.cumsum([faults.loss, faults.burst_loss, faults.swap, faults.duplicate])
    while True:
        jitter = random.gamma(wifi.jitter_shape, wifi.jitter_scale_s, _CHUNK)
        burst = np.minimum(wifi.burst_s * (1.0 + random.pareto(2.0, _CHUNK)), wifi.burst_longest_s)
        begins = random.uniform(size=_CHUNK) < wifi.burst_rate_hz * period_s
        fates = kinds[np.searchsorted(bounds, random.uniform(size=_CHUNK), side="right")]
        delays = wifi.base_s + jitter + np.where(begins, burst, 0.0)
        yield from zip(delays.tolist(), fates.tolist(), strict=True)


_CHUNK = 256
