"""The emulated wearer: a moving person with sensors, as a pure function of settings and sample numbers.

True time counts from 0 s, when the wearer stands in neutral. Other pieces, or another order of asking, give
the same samples bit for bit: they are made in blocks of about one second that depend on the settings alone.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from heapq import merge
from math import ceil, inf

import numpy as np
import numpy.typing as npt

from brachium_body.continuation import AngleTracker
from brachium_body.segments import SEGMENTS, Segment, Side, arm_segments
from brachium_nodes.link import EmulatedClock, FaultSettings, Injected, departures
from brachium_nodes.magnetism import Surroundings
from brachium_nodes.mounting import DEFAULT_WEARING, UNDISTURBED, Worn
from brachium_nodes.movement import Array
from brachium_nodes.noise import Noise
from brachium_nodes.person import Person, PersonSettings
from brachium_nodes.sensors import CHIP, LEVELS, Chip, Errors, Level, generator
from brachium_nodes.truth import Truth, arm_truth, skeletons
from brachium_nodes.wearing import Wearing
from brachium_wire.messages import Quaternion, SensorCalibration, Skeleton


@dataclass(frozen=True, slots=True, kw_only=True)
class WearerSettings(PersonSettings):
    """A wearer: the person, the sensors and their level of error."""

    level: Level = "ideal"
    rate_hz: float = 100.0
    batch: int = 5
    """Samples in a packet."""
    mag_every: int = 1
    """The magnetometer has a value with every so many samples."""
    segments: tuple[Segment, ...] = ()
    """Which segments carry a sensor; empty: upper arm, forearm and hand of the exercising arms."""
    skew_ppm: float = 30.0
    """Standard deviation of the nodes' clock rates; crystals of this class are within 50 ppm."""
    errors: Errors | None = None
    """In place of the level's, as in `replace(LEVELS["typical"], placement_deg=15.0)`."""
    wearing: Wearing = DEFAULT_WEARING
    surroundings: Surroundings = UNDISTURBED

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be emulated."""
        PersonSettings.__post_init__(self)
        if self.level not in LEVELS:
            raise ValueError(f"level {self.level!r} is not known; choose one of {', '.join(LEVELS)}")
        if not 1.0 <= self.rate_hz <= 1000.0:
            raise ValueError(f"rate {self.rate_hz} Hz cannot be used; give 1 to 1000 Hz")
        if not 1 <= self.batch <= 256:
            raise ValueError(f"batches of {self.batch} samples cannot be used; give 1 to 256")
        if self.mag_every < 1:
            raise ValueError(f"a magnetometer with every {self.mag_every} samples cannot be; give 1 or more")
        for segment in self.segments:
            if segment not in SEGMENTS:
                raise ValueError(f"segment {segment!r} is not known; choose of {', '.join(SEGMENTS)}")

    def worn(self) -> tuple[Segment, ...]:
        """Return the segments that carry a sensor."""
        if self.segments:
            return self.segments
        sides: tuple[Side, ...] = ("right", "left") if self.arms == "both" else (self.arms,)
        return tuple(segment for side in sides for segment in arm_segments(side))


def slip_of(settings: WearerSettings) -> tuple[Segment, float]:
    """Return the segment whose strap slips and the time in s at which it does."""
    random, wearing = generator(settings.seed, "wearer", "slip"), settings.wearing
    drawn, at = settings.worn()[int(random.integers(len(settings.worn())))], float(random.uniform(10.0, 40.0))
    return wearing.slip_segment or drawn, at if wearing.slip_s is None else wearing.slip_s


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorInfo:
    """What is known of one sensor; the fields of messages.Info that the wearer decides."""

    chip: str
    rate_hz: float
    mounting: Quaternion
    """Nominal segment_from_sensor: the strap sits some degrees away from it."""
    calibration: SensorCalibration
    magnetometer: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Consecutive raw samples of one sensor, in sensor axes."""

    first: int
    """Number of the first sample."""
    time_s: Array
    """(n,) true times."""
    acc: Array
    """(n, 3) m/s^2."""
    gyr: Array
    """(n, 3) rad/s."""
    mag: Array
    """(k, 3) uT."""
    mag_index: npt.NDArray[np.int64]
    """(k,) which of the n samples `mag` belongs to."""


@dataclass(frozen=True, slots=True, eq=False)
class Packet:
    """A packet of one sensor, as it reaches the gateway."""

    segment: Segment
    send_time_s: float
    """True time at which to hand it over."""
    sequence: int
    """Number of its first sample."""
    device_us: npt.NDArray[np.int64]
    """(n,) the node's clock at each sample."""
    readings: Readings
    injected: Injected
    """What was done to this sensor's stream so far, this packet included."""


class Wearer:
    """An emulated wearer. Its methods are pure: blocks and walks are kept for speed alone."""

    def __init__(self, settings: WearerSettings) -> None:
        self.settings = settings
        seed, errors = settings.seed, settings.errors or LEVELS[settings.level]
        self.errors = errors
        self.person = Person(settings, errors.pose_error_deg, errors.tremor_deg)
        self.segments = settings.worn()
        self.slip = slip_of(settings) if errors.slip_deg else None
        """Which strap slips, and when in s."""
        self.straps: dict[Segment, Worn] = {s: self._put_on(s) for s in self.segments}
        self.chips = {s: Chip.draw(errors, seed, s) for s in self.segments}
        self.clocks = {
            s: EmulatedClock.draw(settings.rate_hz, settings.skew_ppm, seed, s) for s in self.segments
        }
        self._size = ceil(settings.rate_hz)
        self._noise = {s: Noise(errors, seed, s, settings.rate_hz) for s in self.segments}
        self._block = lru_cache(maxsize=3 * len(self.segments))(self._make_block)

    def info(self, segment: Segment) -> SensorInfo:
        """Return what is known of a segment's sensor."""
        return SensorInfo(
            chip=CHIP,
            rate_hz=self.settings.rate_hz,
            mounting=self.straps[segment].nominal,
            calibration=self.chips[segment].calibration,
        )

    def _put_on(self, segment: Segment) -> Worn:
        made, (slipping, slip_s) = self.settings, self.slip or (None, inf)
        when = slip_s if segment == slipping else inf
        return Worn.put_on(segment, self.person, self.errors, made.wearing, made.surroundings, when)

    def samples(self, segment: Segment, first: int, count: int) -> Readings:
        """Return `count` samples of a segment's sensor from number `first` on."""
        blocks = range(first // self._size, (first + count - 1) // self._size + 1)
        parts = [self._block(segment, block) for block in blocks]
        time_s, acc, gyr, mag = (np.concatenate([part[i] for part in parts]) for i in range(4))
        start = first - blocks[0] * self._size
        cut = slice(start, start + count)
        every = self.settings.mag_every
        index = np.arange(-first % every, count, every)
        return Readings(first, time_s[cut], acc[cut], gyr[cut], mag[cut][index], index)

    def packets(self, segment: Segment, faults: FaultSettings | None = None) -> Iterator[Packet]:
        """Yield for ever the packets of one segment's sensor in the order in which they arrive."""
        clock, n = self.clocks[segment], self.settings.batch
        (ready,) = clock.sample_time_s(np.array([n - 1])).tolist()
        for departure in departures(
            ready, n * clock.period_s, n, faults or FaultSettings(), self.settings.seed, segment
        ):
            readings = self.samples(segment, departure.number * n, n)
            yield Packet(
                segment,
                departure.time_s,
                readings.first,
                clock.ticks_us(readings.time_s),
                readings,
                departure.injected,
            )

    def all_packets(self, faults: FaultSettings | None = None) -> Iterator[Packet]:
        """Yield for ever the packets of all sensors by the time at which they arrive."""
        return merge(*(self.packets(s, faults) for s in self.segments), key=lambda packet: packet.send_time_s)

    def truth(self, time_s: npt.ArrayLike, side: Side) -> Truth:
        """Return what one arm really does at true times (n,) s; angles in their principal ranges."""
        t = np.atleast_1d(np.asarray(time_s, dtype=np.float64))
        return arm_truth(self.person, self.straps, t, side)

    def skeletons(
        self, time_s: npt.ArrayLike, side: Side, start_ns: int, tracker: AngleTracker
    ) -> list[Skeleton]:
        """Return the truth at true times (n,) s, in order, as messages; true time 0 is host time `start_ns`.

        `tracker` follows one arm; keep it from call to call, so that angles go on without jumps.
        """
        t = np.atleast_1d(np.asarray(time_s, dtype=np.float64))
        return skeletons(self.truth(t, side), t, side, start_ns, tracker)

    def skeleton_stream(self, side: Side, start_ns: int, first_ns: int, period_ns: int) -> Iterator[Skeleton]:
        """Yield the truth for ever, at host times first_ns + k period_ns; `start_ns` is true time 0.

        They are made about a second at a time, which costs a tenth of asking for one by one.
        """
        tracker, many = AngleTracker(), max(1, round(1e9 / period_ns))
        for block in itertools.count():
            ticks = first_ns - start_ns + period_ns * np.arange(block * many, (block + 1) * many)
            yield from self.skeletons(1e-9 * ticks, side, start_ns, tracker)

    def _make_block(self, segment: Segment, block: int) -> tuple[Array, Array, Array, Array]:
        """Return time, acc, gyr, mag of one block. It is always made whole, so no cut changes a bit."""
        index = np.arange(block * self._size, (block + 1) * self._size)
        clock = self.clocks[segment]
        t = clock.sample_time_s(index)
        acc, gyr, mag = self.straps[segment].truth(t, clock.period_s, self.person)
        white, drift = self._noise[segment].block(block)
        return t, *self.chips[segment].read(acc, gyr, mag, self.settings.rate_hz, drift, white)
