"""One Shimmer3 as a node of the network: its own host, without a gateway."""

import logging
import secrets
import threading
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from brachium_body.segments import Segment
from brachium_nodes.batch_blocks import measure
from brachium_nodes.host_claim import HostClaims, checked_host
from brachium_nodes.sample_stream import Memory, SegmentMemory, stamp
from brachium_nodes.shimmer.dialogue import Device, Dialogue, Wish
from brachium_nodes.shimmer.port import PortGone, SerialPort, is_pseudo
from brachium_nodes.shimmer.protocol import BATTERY, STOP, ShimmerError
from brachium_nodes.shimmer.samples import Stream, hello
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.codec import WireError, encode
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Info, Origin, Quaternion, Status

log = logging.getLogger(__name__)

LOOK_S = 0.02
STATUS_NS = 1_000_000_000
BATTERY_NS = 30_000_000_000
SILENT_NS = 3_000_000_000
"""A device that streams and says nothing for so long is gone."""
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 30.0


class Busy(RuntimeError):
    """The subject comes in through another host; the text says which."""

    def __init__(self, subject: str, host: str | None) -> None:
        super().__init__(f"{subject} comes in through host {host}; end that one first")


@dataclass(frozen=True, kw_only=True)
class ShimmerSettings:
    """One device and where it is worn."""

    port: str
    subject: str
    segment: Segment
    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    id: str = ""
    """Names service, node and host clock; left out: `shimmer-<subject>-<segment>`."""
    mounting: Quaternion | None = None
    """Nominal segment_from_sensor, in the axes printed on the case."""
    origin: Origin | None = None
    """Left out: worn; behind a pseudo-terminal emulated."""
    wish: Wish = field(default_factory=Wish)

    @property
    def name(self) -> str:
        """Return the id."""
        return self.id or f"shimmer-{self.subject}-{self.segment}"


def run(settings: ShimmerSettings, stop: threading.Event) -> None:
    """Serve the device until `stop` is set, however often it goes and comes back.

    Raises Busy, BadKey, ValueError or NoRouter, each with one line.
    """
    checked_host(settings.name)
    keys.subject_chunk(settings.subject)
    with Bus.open(settings.endpoint, stop=stop) as bus:
        ShimmerService(bus, settings).serve(stop)


class ShimmerService:
    """Joins port, dialogue, samples and bus."""

    def __init__(self, bus: Bus, settings: ShimmerSettings) -> None:
        self._bus, self._settings = bus, settings
        self._clock = HostClock()
        self._heart = Heart(bus, settings.room, "shimmer", settings.name)
        self._claims = HostClaims(bus, settings.room, settings.name)
        self._memory, self._place = Memory(secrets.randbits(32)), SegmentMemory()
        self._stream: Stream | None = None
        self._battery_v: float | None = None
        self._counted, self._counted_ns = 0, 0
        self._drops: Counter[str] = Counter()
        tell_host_time(bus, settings.room, settings.name, self._clock.now_ns)

    def serve(self, stop: threading.Event) -> None:
        """Open the port, stream, and begin again when it breaks, until `stop` is set."""
        self._claim()
        pause_s, said = FIRST_PAUSE_S, ""
        while not stop.is_set():
            try:
                with SerialPort(self._settings.port) as port:
                    self._heart.counts["connections"] += 1
                    device = self._set_up(port, stop)
                    if device is not None:
                        pause_s, said = FIRST_PAUSE_S, ""
                        self._streaming(port, stop)
            except (PortGone, ShimmerError) as error:
                reason = str(error)
                if reason != said:
                    log.warning("%s; it is tried again until it is there", reason)
                said = self._heart.text = reason
            self._pause(pause_s, stop)
            pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)
        self._heart.beat(now=True)

    def _pause(self, seconds: float, stop: threading.Event) -> None:
        """Wait; a port that was away and is there again ends the wait."""
        away = not Path(self._settings.port).exists()
        for _ in range(round(seconds / LOOK_S)):
            if stop.wait(LOOK_S) or (away and Path(self._settings.port).exists()):
                return
            self._give_way()
            self._heart.beat()

    def _claim(self) -> None:
        subject = self._settings.subject
        if (other := self._claims.other(subject)) is not None:
            raise Busy(subject, other)
        self._claims.claim(subject)

    def _give_way(self) -> None:
        """Raise Busy for a host that was there before, and that was heard of only since."""
        if self._claims.yields(self._settings.subject):
            raise Busy(self._settings.subject, self._claims.other(self._settings.subject))

    def _set_up(self, port: SerialPort, stop: threading.Event) -> Device | None:
        """Return the device once it streams, or None when `stop` came first."""
        dialogue = Dialogue(self._settings.wish, self._clock.now_ns())
        port.write(dialogue.begin())
        while not stop.is_set():
            self._heart.beat()
            self._give_way()
            data = port.read(LOOK_S)
            now_ns = self._clock.now_ns()
            answer = dialogue.receive(data, now_ns) if data else dialogue.tick(now_ns)
            if answer:
                port.write(answer)
            if dialogue.device is not None:
                self._begin(dialogue.device)
                self._take(dialogue.rest, now_ns)
                return dialogue.device
        return None

    def _begin(self, device: Device) -> None:
        settings, before = self._settings, self._stream
        if before is not None:  # what was dropped stays counted over connections
            self._drops["skipped_bytes"] += before.reader.skipped
            self._drops["resynchronised"] += before.reader.resynchronised
            self._drops["repeated_stamp"] += before.repeated
        self._stream = Stream(
            device, before.clock if before and before.device.ticks == device.ticks else None
        )
        self._battery_v = device.battery_v
        said = hello(device, settings.name, self._memory.boot, self._origin())
        self._hello = said
        for warning in device.converted.warnings:
            log.warning("%s: %s", settings.name, warning)
        info = Info(
            node=said.node,
            rate_hz=said.rate_hz,
            origin=said.origin,
            host=settings.name,
            chip=said.chip,
            firmware=said.firmware,
            mounting=settings.mounting,
            calibration=said.calibration,
            magnetometer=said.magnetometer,
        )
        self._bus.retain(keys.info(settings.room, settings.subject, settings.segment), encode(info))
        self._heart.text = f"{device.firmware} at {device.rate_hz:.4g} Hz"
        log.info("%s streams: %s", settings.name, self._heart.text)

    def _origin(self) -> Origin:
        chosen = self._settings.origin
        return chosen or ("emulated" if is_pseudo(self._settings.port) else "worn")

    def _streaming(self, port: SerialPort, stop: threading.Event) -> None:
        settings, now_ns = self._settings, self._clock.now_ns()
        status_ns, battery_ns, heard_ns = now_ns + STATUS_NS, now_ns + BATTERY_NS, now_ns
        end = self._bus.announce(keys.alive(settings.room, "node", settings.name))
        try:
            while not stop.is_set():
                data = port.read(LOOK_S)
                now_ns = self._clock.now_ns()
                if data:
                    heard_ns = now_ns
                    self._take(data, now_ns)
                elif now_ns - heard_ns > SILENT_NS:
                    raise PortGone(f"{port.path}: the device has fallen silent")
                if now_ns >= status_ns:
                    status_ns += STATUS_NS
                    self._tell(now_ns, connected=True)
                if now_ns >= battery_ns:
                    battery_ns += BATTERY_NS
                    port.write(BATTERY.words)
                self._give_way()
                self._heart.beat()
            port.write(STOP.words)
        finally:
            self._tell(self._clock.now_ns(), connected=False)
            end()

    def _take(self, data: bytes, now_ns: int) -> None:
        assert self._stream is not None
        settings, memory = self._settings, self._memory
        for frame, received_ns in self._stream.feed(data, now_ns):
            if self._stream.restarted:
                self._stream.restarted = False
                drops = memory.drops
                memory = self._memory = Memory(secrets.randbits(32))
                memory.drops = drops
            try:
                batch = stamp(measure(frame, self._hello), memory, self._place, received_ns)
            except WireError as error:
                memory.drops[error.drop.value] += len(frame.offsets) // 4
                continue
            if batch is not None:
                self._heart.counts["samples"] += len(batch.offsets) // 4
                self._bus.put(keys.imu(settings.room, settings.subject, settings.segment), encode(batch))

    def _tell(self, now_ns: int, *, connected: bool) -> None:
        assert self._stream is not None
        settings, memory, reader = self._settings, self._memory, self._stream.reader
        counter, clock = memory.counter, memory.clock
        if reader.battery_v is not None:
            self._battery_v = reader.battery_v
        span_ns, gained = now_ns - self._counted_ns, counter.received - self._counted
        self._counted, self._counted_ns = counter.received, now_ns
        drops = Counter(skipped_bytes=reader.skipped, resynchronised=reader.resynchronised)
        drops.update(self._drops, repeated_stamp=self._stream.repeated, **memory.drops)
        status = Status(
            node=settings.name,
            time_ns=now_ns,
            connected=connected,
            received=counter.received,
            lost=counter.lost,
            out_of_order=counter.out_of_order,
            rate_hz=gained / (span_ns * 1e-9) if STATUS_NS // 2 < span_ns < 2 * STATUS_NS else None,
            battery_v=self._battery_v,
            clock_offset_ns=clock.offset_ns,
            clock_uncertainty_ns=clock.uncertainty_ns(clock.newest_us),
            drops={name: count for name, count in drops.items() if count},
        )
        self._bus.put(keys.status(settings.room, settings.subject, settings.segment), encode(status))
