"""The emulated wearer's sensors as nodes: what each says of itself, and its packets as frames."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np

from brachium_nodes.emulated_power import EmulatedPower
from brachium_nodes.link import EmulatedClock, FaultSettings
from brachium_nodes.node_frames import Batch, Hello
from brachium_nodes.node_stream import NodeStream, Outgoing
from brachium_nodes.wearer import Packet, Wearer


def node_id(subject: str, segment: str) -> str:
    """Return the id under which an emulated segment joins."""
    return f"emu-{subject}-{segment}"


def node_streams(subject: str, wearer: Wearer, faults: FaultSettings, boot: int) -> list[NodeStream]:
    """Return the nodes of one wearer, as just switched on."""
    streams = []
    for segment in wearer.segments:
        info, clock = wearer.info(segment), wearer.clocks[segment]
        hello = Hello(
            node=node_id(subject, segment),
            boot=boot,
            chip=info.chip,
            rate_hz=info.rate_hz,
            firmware="emulated",
            magnetometer=info.magnetometer,
            calibration=info.calibration,
            origin="emulated",
        )
        streams.append(
            NodeStream(
                subject=subject,
                segment=segment,
                hello=hello,
                mounting=info.mounting,
                packets=map(outgoing, wearer.packets(segment, faults)),
                clock_us=_reader(clock),
                says=EmulatedPower.draw(wearer.settings.seed, segment).status,
            )
        )
    return streams


def _reader(clock: EmulatedClock) -> Callable[[float], int]:
    return lambda time_s: int(clock.ticks_us(np.array([time_s]))[0])


def outgoing(packet: Packet) -> Outgoing:
    """Return a packet of the emulated wearer as the frame that its node sends."""
    readings, ticks = packet.readings, packet.device_us
    whole = len(readings.mag) == len(ticks)
    batch = Batch(
        sequence=packet.sequence,
        device_us=int(ticks[0]),
        offsets=(ticks - ticks[0]).astype("<u4").tobytes(),
        acc=readings.acc.astype("<f4").tobytes(),
        gyr=readings.gyr.astype("<f4").tobytes(),
        mag=readings.mag.astype("<f4").tobytes() if len(readings.mag) else None,
        mag_index=None if whole or not len(readings.mag) else readings.mag_index.astype("<u2").tobytes(),
    )
    return Outgoing(packet.send_time_s, batch, readings.time_s)


def alike(streams: list[NodeStream], subjects: tuple[str, ...]) -> list[NodeStream]:
    """Return the nodes of one subject for many, who move alike: samples are made once, for load tests."""
    out = []
    for stream in streams:
        for subject, packets in zip(subjects, itertools.tee(stream.packets, len(subjects)), strict=True):
            hello = msgspec.structs.replace(stream.hello, node=node_id(subject, stream.segment))
            out.append(replace(stream, subject=subject, hello=hello, packets=packets))
    return out
