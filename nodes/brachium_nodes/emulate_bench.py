"""Emulated sensors on a table, not worn: they join uncalibrated, and hands do what fusion asks for."""

import asyncio
import itertools
import secrets
from collections.abc import Callable, Iterator
from math import inf
from threading import Event

import numpy as np

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_nodes.bench_hands import MISTAKES, Hands, Mistake
from brachium_nodes.direct_node import DirectHost, DirectSink
from brachium_nodes.emulate import EmulateReport, EmulateSettings
from brachium_nodes.emulated_flash import with_flash
from brachium_nodes.emulated_nodes import node_id, outgoing
from brachium_nodes.emulated_power import EmulatedPower
from brachium_nodes.link import Injected
from brachium_nodes.node_frames import Hello
from brachium_nodes.node_stream import LOOK_S, NodeStream, Outgoing, StreamCount, Timeline
from brachium_nodes.noise import Noise
from brachium_nodes.sending import Sink, SocketSink, send_streams
from brachium_nodes.sensors import GRAVITY
from brachium_nodes.wearer import Packet, Readings, Wearer
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.heart import Heart
from brachium_wire.messages import Calibration
from brachium_wire.sensor_records import SensorStep

EXERCISE = "sensor-calibration"
EXERCISES: dict[str, Mistake] = {"-".join(filter(None, (EXERCISE, mistake))): mistake for mistake in MISTAKES}
"""By name, what the hands do wrong."""

STEP_S = 0.001
"""Of the central difference that gives angular rate."""


def run(settings: EmulateSettings, mistake: Mistake, stop: Event) -> EmulateReport:
    """Emulate until `seconds` are over or `stop` is set; return what was sent.

    Raises as emulate.run does, and ValueError for many wearers and for firmware, whose board plays what was
    written before.
    """
    if settings.wearers != 1 or settings.firmware:
        raise ValueError(f"{EXERCISE} is done with one wearer's emulated nodes; leave the others out")
    with Bus.open(settings.endpoint, stop=stop) as bus:
        return asyncio.run(_Bench(settings, mistake, bus, stop).run())


class _Bench:
    def __init__(self, settings: EmulateSettings, mistake: Mistake, bus: Bus, stop: Event) -> None:
        self._settings, self._bus, self._stop = settings, bus, stop
        self._mistake: Mistake = mistake
        (self._subject,) = settings.subjects()
        self._timeline = Timeline(settings.speed)
        self._heart = Heart(bus, settings.room, "emulate", settings.id)
        self._wearer = Wearer(settings.wearer)
        topic = keys.calibration(settings.room, self._subject)
        self._inbox: Inbox = bus.subscribe(topic)
        self._asked: tuple[str, SensorStep] | None = None
        """Whose sensor is to do which step."""
        for _, payload in bus.fetch(topic):
            self._hear(payload)

    async def run(self) -> EmulateReport:
        settings, boot = self._settings, secrets.randbits(32)
        host = None
        if settings.direct:
            host = DirectHost(self._bus, settings.room, settings.id, self._timeline)
        streams = [
            with_flash(self._stream(segment, boot), settings.flash) for segment in self._wearer.segments
        ]
        nodes: list[tuple[NodeStream, Sink]] = [
            (
                stream,
                SocketSink(settings.gateway, settings.token, stream, self._timeline)
                if host is None
                else DirectSink(host, stream),
            )
            for stream in streams
        ]
        end_s = inf if settings.seconds is None else settings.seconds
        counts = await send_streams(nodes, self._timeline, end_s, self._stop, self._listen)
        self._heart.beat(now=True)
        report: dict[str, dict[str, StreamCount]] = {}
        for (subject, segment), count in counts.items():
            report.setdefault(subject, {})[segment] = count
        return EmulateReport(streams=report)

    async def _listen(self) -> None:
        while not self._stop.is_set():
            for _, payload in self._inbox.drain():
                self._hear(payload)
            self._heart.beat()
            await asyncio.sleep(LOOK_S)

    def _hear(self, payload: bytes) -> None:
        try:
            message = decode_topic(payload, "calibration")
        except WireError:
            return
        assert isinstance(message, Calibration)
        told = message.sensor
        self._asked = (told.segment, told.step) if told is not None and told.state == "running" else None

    def _stream(self, segment: Segment, boot: int) -> NodeStream:
        wearer, clock = self._wearer, self._wearer.clocks[segment]
        info, seed = wearer.info(segment), wearer.settings.seed
        return NodeStream(
            subject=self._subject,
            segment=segment,
            hello=Hello(
                node=node_id(self._subject, segment),
                boot=boot,
                chip=info.chip,
                rate_hz=info.rate_hz,
                firmware="emulated",
                magnetometer=info.magnetometer,
                origin="emulated",
            ),
            mounting=info.mounting,
            packets=bench_packets(
                wearer, segment, Hands(seed, segment, self._mistake), self._step_of(segment)
            ),
            clock_us=lambda time_s: int(clock.ticks_us(np.array([time_s]))[0]),
            says=EmulatedPower.draw(seed, segment).status,
        )

    def _step_of(self, segment: str) -> Callable[[], SensorStep | None]:
        def step() -> SensorStep | None:
            return self._asked[1] if self._asked is not None and self._asked[0] == segment else None

        return step


def bench_packets(
    wearer: Wearer, segment: Segment, hands: Hands, asked: Callable[[], SensorStep | None]
) -> Iterator[Outgoing]:
    """Yield for ever the packets of one chip in these hands, made as they are due.

    `asked()` is what the hands are told to do at that moment; the chip, its noise and its clock are the
    wearer's.
    """
    made, clock, chip = wearer.settings, wearer.clocks[segment], wearer.chips[segment]
    noise, n = Noise(wearer.errors, made.seed, segment, made.rate_hz), made.batch
    for first in itertools.count(0, n):
        t = clock.sample_time_s(np.arange(first, first + n))
        hands.follow(asked(), float(t[0]) - STEP_S)
        before, at, after = (hands.orientations(t + step) for step in (-STEP_S, 0.0, STEP_S))
        turn = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(before), after))
        sensor_from_world = rotation.inverse(at)
        white, drift = noise.span(first, n)
        acc, gyr, mag = chip.read(
            rotation.rotate(sensor_from_world, -GRAVITY),
            turn / (2.0 * STEP_S),
            rotation.rotate(sensor_from_world, hands.field(t)),
            made.rate_hz,
            drift,
            white,
        )
        index = np.arange(-first % made.mag_every, n, made.mag_every)
        readings = Readings(first, t, acc, gyr, mag[index], index)
        due_s = float(t[-1]) + STEP_S
        yield outgoing(Packet(segment, due_s, first, clock.ticks_us(t), readings, Injected()))
