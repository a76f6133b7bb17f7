"""One sensor on the bus: its frames in, batches for its segment out. Pure: bytes and times are arguments."""

from collections import Counter
from collections.abc import Callable
from itertools import chain
from math import hypot
from struct import pack

from brachium_nodes.batch_blocks import Measured
from brachium_nodes.can.grouping import Grouper, Sample, Values
from brachium_nodes.can.map_files import Quantity
from brachium_nodes.can.sensor_map import CanSensor
from brachium_nodes.can.signals import Read, ShortFrame, reader
from brachium_nodes.sample_stream import Memory, SegmentMemory, stamp
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import Info, SampleBatch, SensorCalibration, Status
from brachium_wire.samples import read_samples

Part = tuple[Quantity, tuple[str, ...], float]
"""A quantity, its signals, and what makes SI of them."""
Receive = Callable[[bytes | bytearray, int], list[SampleBatch]]
GONE_NS = 3_000_000_000
"""A sensor that was silent for so long is not connected; the status topic is stale after as long."""
HOLD_NS = 100_000_000
"""No sample waits longer for its batch to fill."""


class CanImu:
    """The memory of one sensor. Give it its frames in order of arrival, and call `tick` often."""

    def __init__(self, sensor: CanSensor, batch: int = 5) -> None:
        """`batch`: samples in a packet."""
        self.sensor, self._batch = sensor, batch
        quantities = sensor.map.quantities()
        self.raw = {"acceleration", "angular_rate"} <= quantities.keys()
        """Whether it delivers what it measures; else its orientation."""
        used: list[Quantity] = ["acceleration", "angular_rate", "field"] if self.raw else ["quaternion"]
        self._parts: dict[str, list[Part]] = {}
        for name in used:
            if (signals := quantities.get(name)) is not None:
                row = self._parts.setdefault(signals.message, [])
                row.append((name, tuple(signals.signals), signals.scale))
        self.magnetometer = self.raw and "field" in quantities
        self._inverse = not self.raw and quantities["quaternion"].inverse
        required = {quantities[n].message for n in used if n in quantities and not quantities[n].optional}
        self._grouper = None
        if sensor.key is not None:
            optional = frozenset(self._parts) - required
            keyed = sensor.before is None
            self._grouper = Grouper(sensor.key, frozenset(required), optional, keyed=keyed)
        self._reads = _readers(sensor, self._parts)
        self._memory, self._place = Memory(boot=0), SegmentMemory()
        self._restarts = 0
        self._first: float | None = None
        self._waiting: list[tuple[int, int, Sample]] = []  # number, device us, sample
        self._next = 0
        self.heard_ns: int | None = None
        """When its last whole sample came."""
        self.drops: Counter[str] = Counter()
        self._counted, self._counted_ns = 0, 0

    def receiver(self, message: str) -> Receive | None:
        """Return what takes the frames of one of its messages, with host times; None where none is wanted."""
        read = self._reads.get(message)
        if read is None:
            return None  # measured, and not asked for
        feed = self._feed(message)

        def receive(data: bytes | bytearray, now_ns: int) -> list[SampleBatch]:
            try:
                samples = feed(read(data), now_ns)
            except ShortFrame:
                self.drops["bad_frame"] += 1
                return []
            return [batch for sample in samples for batch in self._take(sample, now_ns)] if samples else []

        return receive

    def _feed(self, message: str) -> Callable[[Values, int], list[Sample]]:
        """Return what takes the numbers of a message, its key first where it has one."""
        grouper = self._grouper
        if grouper is None:
            return lambda values, now_ns: [Sample(self._next, now_ns, {message: values})]
        if message == self.sensor.before:
            return lambda values, now_ns: grouper.key(values[0], now_ns)
        if self.sensor.before is None:
            return lambda values, now_ns: grouper.member(message, values[1:], now_ns, values[0])
        return lambda values, now_ns: grouper.member(message, values, now_ns)

    def tick(self, now_ns: int) -> list[SampleBatch]:
        """Give up what waits in vain, and send what waits for its batch to fill."""
        result: list[SampleBatch] = []
        if self._grouper is not None:
            for sample in self._grouper.tick(now_ns):
                result += self._take(sample, now_ns)
        if self._waiting and now_ns - self._waiting[0][2].arrived_ns > HOLD_NS:
            result += self._flush()
        return result

    def connected(self, now_ns: int) -> bool:
        """Return whether it is heard."""
        return self.heard_ns is not None and now_ns - self.heard_ns < GONE_NS

    def info(self, host: str, calibration: SensorCalibration) -> Info:
        """Return what is known of it."""
        return Info(
            node=self.sensor.id,
            rate_hz=self.sensor.rate_hz,
            origin="worn",
            host=host,
            chip=self.sensor.map.chip,
            mounting=self.sensor.mounting,
            calibration=calibration,
            magnetometer=self.magnetometer,
            orientation_only=not self.raw,
            heading_free=not self.raw and self.sensor.heading_free,
        )

    def status(self, now_ns: int) -> Status:
        """Return how it fares. A bus asks nobody for the time: the offset is known one way only."""
        memory, elapsed_ns = self._memory, now_ns - self._counted_ns
        gained = memory.counter.received - self._counted
        rate = gained / (1e-9 * elapsed_ns) if 0 < elapsed_ns < 2 * GONE_NS else None
        self._counted, self._counted_ns = memory.counter.received, now_ns
        clock, heard = memory.clock, self.heard_ns is not None
        grouped = Counter() if self._grouper is None else self._grouper.drops
        return Status(
            node=self.sensor.id,
            time_ns=now_ns,
            connected=self.connected(now_ns),
            received=memory.counter.received,
            lost=memory.counter.lost,
            out_of_order=memory.counter.out_of_order,
            rate_hz=rate,
            clock_offset_ns=clock.offset_ns if heard else None,
            clock_uncertainty_ns=clock.uncertainty_ns(clock.newest_us) if heard else None,
            drops={str(k): n for k, n in (self.drops + memory.drops + grouped).items() if n},
        )

    def _take(self, sample: Sample, now_ns: int) -> list[SampleBatch]:
        """Number a sample; return the batches that it completes."""
        result: list[SampleBatch] = []
        if self._grouper is not None and self._grouper.restarts != self._restarts:
            self._restarts = self._grouper.restarts
            result += self._flush()
            self._memory, self._first = Memory(boot=self._restarts), None
        number, device_us = self._numbered(sample, now_ns)
        if self._waiting and number != self._waiting[-1][0] + 1:
            result += self._flush()
        self._waiting.append((number, device_us, sample))
        self.heard_ns = now_ns
        if len(self._waiting) >= self._batch:
            result += self._flush()
        return result

    def _numbered(self, sample: Sample, now_ns: int) -> tuple[int, int]:
        key, tick_s = self.sensor.key, None if self.sensor.map.key is None else self.sensor.map.key.tick_s
        if key is None:  # no clock of its own: it was when it came
            self._next += 1
            return self._next - 1, now_ns // 1000
        if self._first is None:
            self._first = sample.ticks
        number = round((sample.ticks - self._first) / key.step)
        if tick_s is None:
            return number, round(number * key.period_ns * 1e-3)
        return number, round((sample.ticks - self._first) * tick_s * 1e6)

    def _flush(self) -> list[SampleBatch]:
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return []
        device_us = [us for _, us, _ in waiting]
        offsets = pack(f"<{len(waiting)}I", *(us - device_us[0] for us in device_us))
        try:
            blocks, rows = self._blocks([sample for _, _, sample in waiting])
        except OverflowError:  # a float of 64 bits beyond those of 32
            self.drops[Drop.OUT_OF_RANGE.value] += len(waiting)
            return []
        batch = SampleBatch(
            sequence=waiting[0][0],
            time_ns=1,
            offsets=offsets,
            device_us=device_us[0],
            device_offsets=offsets,
            received_ns=1,
            uncertainty_ns=0,
            acc=blocks.get("acceleration"),
            gyr=blocks.get("angular_rate"),
            mag=blocks.get("field"),
            mag_index=rows,
            quat=blocks.get("quaternion"),
        )
        try:
            read_samples(batch)  # the one check of shapes, finiteness and ranges
            made = stamp(Measured(batch, device_us), self._memory, self._place, waiting[-1][2].arrived_ns)
        except WireError as error:
            self.drops[error.drop.value] += len(waiting)
            return []
        return [] if made is None else [made]

    def _blocks(self, samples: list[Sample]) -> tuple[dict[str, bytes], bytes | None]:
        """Return each quantity's block, and which samples have a field when not all do."""
        blocks: dict[str, bytes] = {}
        rows: bytes | None = None
        for message, parts in self._parts.items():
            having = [i for i, sample in enumerate(samples) if message in sample.members]
            values, column = [samples[i].members[message] for i in having], 0
            for name, signals, _ in parts:
                begin, column = column, column + len(signals)
                block = [row[begin:column] for row in values]
                if name == "quaternion":
                    block = [self._unit(row) for row in block]
                if block:
                    blocks[name] = pack(f"<{len(block) * len(signals)}f", *chain.from_iterable(block))
                if block and name == "field" and len(having) < len(samples):
                    rows = pack(f"<{len(having)}H", *having)
        return blocks, rows

    def _unit(self, q: Values) -> Values:
        """Return a quaternion of length 1 (16 bits leave a ten-thousandth), world from sensor."""
        length = hypot(*q)
        if abs(length - 1.0) > 0.01:
            return q  # none: refused with its batch
        turn = -1.0 if self._inverse else 1.0
        return q[0] / length, turn * q[1] / length, turn * q[2] / length, turn * q[3] / length


def _readers(sensor: CanSensor, parts: dict[str, list[Part]]) -> dict[str, Read]:
    """Return what reads each message: its key, where each carries it, and its quantities in SI."""
    key = {} if sensor.map.key is None else sensor.map.key.signals
    reads: dict[str, Read] = {}
    for message in sensor.messages.values():
        wanted = [(key[message.name], 1.0)] if message.name in key else []
        for _, names, scale in parts.get(message.name, ()):
            wanted += [(name, scale) for name in names]
        if wanted:
            reads[message.name] = reader(message, wanted)
    return reads
