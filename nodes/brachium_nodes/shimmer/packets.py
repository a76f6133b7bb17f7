"""Bytes of a streaming Shimmer3 to data packets: nothing that a lost byte has shifted gets through. Pure.

A packet is 0x00, a time stamp of three bytes and two bytes a channel; it has no checksum. So each is held
until what follows it begins as it must: another packet whose stamp is a whole number of samples later.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from brachium_nodes.shimmer.protocol import ACK, BATTERY_ANSWER, DATA, IN_STREAM, STATUS_ANSWER, battery_v

WRAP = 1 << 24
"""Ticks after which a stamp begins anew: 512 s."""
JITTER_TICKS = 4
"""A stamp is taken this near to its sample (0.1 ms)."""
FORGET_BYTES = 256
"""After so many skipped bytes the last good stamp says nothing any more."""
_HEAD = 4
_IN_STREAM_LENGTHS = {BATTERY_ANSWER: 5, STATUS_ANSWER: 3}


class Packet(NamedTuple):
    """One sample: stamp in ticks modulo WRAP, its channels' bytes, and when its last byte had come."""

    stamp: int
    channels: bytes
    received_ns: int


@dataclass(slots=True)
class PacketReader:
    """Takes what the port delivers, in any pieces."""

    channel_bytes: int
    period: int
    """Ticks between samples."""
    skipped: int = 0
    """Bytes that belonged to no packet."""
    resynchronised: int = 0
    """Times that the packets' beginnings were lost."""
    battery_v: float | None = None
    _buffer: bytearray = field(default_factory=bytearray)
    _held: Packet | None = None
    _last: int | None = None
    _sure: bool = False
    _astray: int = 0

    def feed(self, data: bytes, now_ns: int) -> list[Packet]:
        """Return the packets that are sure, in their order; `now_ns`: host time at which `data` was there."""
        self._buffer += data
        found: list[Packet] = []
        while self._buffer:
            first = self._buffer[0]
            if first == DATA:
                if len(self._buffer) < _HEAD or not self._packet(found, now_ns):
                    break
            elif first in (ACK, IN_STREAM) and self._sure:
                if not self._answer(found, int(first == ACK)):
                    break
            else:
                self._astray_by_one()
        return found

    def _packet(self, found: list[Packet], now_ns: int) -> bool:
        """Take the packet that begins here; return whether anything was done."""
        stamp = int.from_bytes(self._buffer[1:_HEAD], "little")
        before = self._last if self._held is None else self._held.stamp
        if before is not None and not self._follows(stamp, before):
            self._astray_by_one()
            return True
        if self._held is not None:
            self._sure = True
            self._release(found)
        size = _HEAD + self.channel_bytes
        if len(self._buffer) < size:
            return False
        self._held = Packet(stamp, bytes(self._buffer[_HEAD:size]), now_ns)
        del self._buffer[:size]
        return True

    def _follows(self, stamp: int, before: int) -> bool:
        ahead = (stamp - before) % WRAP
        apart = ahead % self.period
        return ahead >= self.period - JITTER_TICKS and min(apart, self.period - apart) <= JITTER_TICKS

    def _answer(self, found: list[Packet], begin: int) -> bool:
        """Take an answer between packets, with its acknowledgement or not; return whether anything was done.

        One byte alone would not tell it from a packet's rest.
        """
        head = self._buffer[begin : begin + 2]
        length = _IN_STREAM_LENGTHS.get(head[1]) if len(head) == 2 and head[0] == IN_STREAM else None
        if length is None:
            if len(head) < 2 and head in (b"", bytes([IN_STREAM])):
                return False
            self._astray_by_one()
            return True
        if len(self._buffer) < begin + length:
            return False
        if head[1] == BATTERY_ANSWER:
            self.battery_v = battery_v(bytes(self._buffer[begin + 2 : begin + length]))
        self._release(found)
        del self._buffer[: begin + length]
        return True

    def _release(self, found: list[Packet]) -> None:
        if self._held is not None:
            found.append(self._held)
            self._last, self._held, self._astray = self._held.stamp, None, 0

    def _astray_by_one(self) -> None:
        """Look for a beginning one byte further on: of what is held, for it does not end where it should."""
        if self._held is not None:
            held = self._held
            self._buffer[:0] = bytes([DATA]) + held.stamp.to_bytes(3, "little") + held.channels
            self._held = None
        self.resynchronised += self._sure
        self._sure = False
        del self._buffer[0]
        self.skipped += 1
        self._astray += 1
        if self._astray >= FORGET_BYTES:
            self._last = None
