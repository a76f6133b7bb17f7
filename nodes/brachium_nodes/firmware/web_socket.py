"""A WebSocket to the gateway (RFC 6455): binary messages, masked in place, from one writer at a time."""

import asyncio
import os
import struct
import time

ROOM = 8  # a header of 4 bytes and the mask
LONGEST = 1024  # no message of a gateway is longer


def _mask(data, first, end, key):
    """Mask bytes with a key of 4; whole numbers of that length are quicker than a loop over bytes."""
    size = end - first
    said = int.from_bytes(memoryview(data)[first:end], "little")
    with_key = int.from_bytes((key * (size // 4 + 1))[:size], "little")
    data[first:end] = (said ^ with_key).to_bytes(size, "little")


class WebSocket:
    """One open connection. `writer` is the memory in which every message is made."""

    def __init__(self, reader, stream, writer):
        self._reader, self._stream, self._writer = reader, stream, writer
        self._lock = asyncio.Lock()  # two tasks in one stream's drain lose or repeat bytes
        self._sending = None

    async def send(self, fill, *about, kind=2):
        """Have `fill(writer, *about)` make a message and send it."""
        async with self._lock:
            writer = self._writer
            fill(writer, *about)
            data, first, size = writer.buffer, ROOM, writer.end - ROOM
            key = os.urandom(4)
            _mask(data, first, writer.end, key)
            if size < 126:
                start = 2
                struct.pack_into("BB", data, start, 0x80 | kind, 0x80 | size)
            else:
                start = 0
                struct.pack_into(">BBH", data, start, 0x80 | kind, 0xFE, size)
            data[4:8] = key
            self._sending = time.ticks_ms()
            self._stream.write(memoryview(data)[start : writer.end])
            await self._stream.drain()
            self._sending = None

    def free(self):
        """Take that whoever was sending is gone, as after an interruption."""
        self._lock = asyncio.Lock()

    def stuck_ms(self):
        """Return for how long the message that is being sent has waited to go out."""
        return 0 if self._sending is None else time.ticks_diff(time.ticks_ms(), self._sending)

    async def receive(self):
        """Return the next message, bytes. Raises OSError or EOFError when there will be none."""
        message = b""
        while True:
            first, second = await self._reader.readexactly(2)
            kind, size = first & 15, second & 127
            if size == 126:
                (size,) = struct.unpack(">H", await self._reader.readexactly(2))
            if second & 128 or size == 127 or size + len(message) > LONGEST:
                raise OSError("no gateway speaks so")
            data = await self._reader.readexactly(size) if size else b""
            if kind == 9:
                await self.send(_copy, data, kind=10)
            elif kind == 8:
                await self.send(_copy, data[:2], kind=8)
                code = struct.unpack_from(">H", data)[0] if size >= 2 else 1005
                raise EOFError("closed with %d" % code)
            elif kind < 3:
                message += data
                if first & 128:
                    return message

    def close(self):
        """End the connection without a word."""
        self._stream.s.close()  # a Stream's own close() does nothing


def _copy(writer, data):
    writer.end = writer.room + len(data)
    writer.buffer[writer.room : writer.end] = data
