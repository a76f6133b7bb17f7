"""Data packets of a Shimmer3 as a node's batches: numbers, times and SI. Pure."""

from struct import unpack

import numpy as np

from brachium_nodes.node_frames import Batch, Hello
from brachium_nodes.shimmer.dialogue import Device
from brachium_nodes.shimmer.packets import Packet, PacketReader
from brachium_nodes.shimmer.ticks import TickCounter, microseconds
from brachium_wire.messages import Origin

LARGEST = 32
"""Samples in one batch."""


class Stream:
    """One device's samples from the start of its streaming on. `clock`: what counted its stamps before."""

    def __init__(self, device: Device, clock: TickCounter | None = None) -> None:
        self.device = device
        self.reader = PacketReader(channel_bytes=len(device.formats), period=device.ticks)
        self.clock = clock or TickCounter(device.ticks)
        self._resumed = clock is not None
        self.restarted = clock is None
        """The device's clock is not the one of the connection before, as far as is known by now."""
        self.repeated = 0
        """Samples whose stamp was no later than the one before."""

    def feed(self, data: bytes, now_ns: int) -> list[tuple[Batch, int]]:
        """Return what came as batches without gaps, each with the host time at which it was there."""
        batches: list[tuple[Batch, int]] = []
        rows: list[tuple[int, int, bytes]] = []
        received_ns = now_ns
        for packet in self.reader.feed(data, now_ns):
            if not self._follow(packet):
                self.repeated += 1
                continue
            if rows and (self.clock.number != rows[-1][0] + 1 or len(rows) == LARGEST):
                batches.append((self._batch(rows), received_ns))
                rows = []
            rows.append((self.clock.number, microseconds(self.clock.ticks), packet.channels))
            received_ns = packet.received_ns
        if rows:
            batches.append((self._batch(rows), received_ns))
        return batches

    def _follow(self, packet: Packet) -> bool:
        if self._resumed:
            self._resumed = False
            if not self.clock.same_clock(packet.stamp, packet.received_ns):
                self.clock, self.restarted = TickCounter(self.device.ticks), True
        return self.clock.follow(packet.stamp, packet.received_ns)

    def _batch(self, rows: list[tuple[int, int, bytes]]) -> Batch:
        device, converted = self.device, self.device.converted
        steps = np.array([self._steps(channels) for _, _, channels in rows], dtype=np.float64)
        at = device.places
        first_us = rows[0][1]
        return Batch(
            sequence=rows[0][0],
            device_us=first_us,
            offsets=np.array([us - first_us for _, us, _ in rows], dtype="<u4").tobytes(),
            acc=converted.acc(steps[:, at[device.accelerometer]]).astype("<f4").tobytes(),
            gyr=converted.gyr(steps[:, at["gyr"]]).astype("<f4").tobytes(),
            mag=converted.mag(steps[:, at["mag"]]).astype("<f4").tobytes(),
        )

    def _steps(self, channels: bytes) -> list[int]:
        formats = self.device.formats
        return [unpack(formats[i : i + 2], channels[i : i + 2])[0] for i in range(0, len(formats), 2)]


def hello(device: Device, node: str, boot: int, origin: Origin) -> Hello:
    """Return what the device says of itself, as a node."""
    return Hello(
        node=node,
        boot=boot,
        chip="shimmer3",
        rate_hz=device.rate_hz,
        firmware=device.firmware,
        magnetometer=True,
        calibration=device.converted.calibration,
        origin=origin,
    )
