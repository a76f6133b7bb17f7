"""Many nodes in one process, cheap enough to load a gateway: 20 batches a second each, clock answers, status.

python -m brachium.node_crowd PORT TOKEN NODES SECONDS

It prints what was sent as JSON. A server that only echoes gets the same frames: nobody welcomes it there.
"""

import asyncio
import base64
import os
import random
import struct
import sys
import time
from functools import partial
from typing import cast

from brachium.shell import print_json, stop_on_signals
from brachium.way_in import node_table
from brachium_body.segments import SEGMENTS
from brachium_nodes.gateway import PATH, token_sha256
from brachium_nodes.node_frames import Batch, Bye, ClockAnswer, ClockAsk, Hello, NodeStatus, from_gateway
from brachium_nodes.roster import NodeEntry
from brachium_nodes.websocket_frames import BINARY, masked
from brachium_wire.codec import WireError, encode
from brachium_wire.samples import write_samples

RATE_HZ, SAMPLES = 100.0, 5
PERIOD_S = SAMPLES / RATE_HZ
JOINING_AT_ONCE = 32
FIRST_SEQUENCE, FIRST_US = 1 << 20, 1 << 33
"""Numbers so large that all that follow have the same width in MessagePack."""
LEAVE_WITHIN_S = 2.0


def entries(nodes: int, token: str) -> list[NodeEntry]:
    """Return the nodes' rows of the gateway's table, seven segments a subject."""
    return [
        NodeEntry(
            id=f"crowd-{number:03d}",
            token_sha256=token_sha256(token),
            subject=f"c{number // len(SEGMENTS):03d}",
            segment=SEGMENTS[number % len(SEGMENTS)],
        )
        for number in range(nodes)
    ]


def site_text(room: str, nodes: int, token: str) -> str:
    """Return the site file that lets these nodes in."""
    table = entries(nodes, token)
    subjects = sorted({entry.subject for entry in table if entry.subject})
    rows = "".join(f'[[subject]]\nid = "{subject}"\n\n' for subject in subjects)
    return f'[room]\nid = "{room}"\n\n{rows}{node_table(table)}'


def device_us() -> int:
    """Return what the nodes' clocks show."""
    return FIRST_US + time.monotonic_ns() // 1000


class _Frame:
    """A batch as bytes, in which number and time are written anew each time."""

    def __init__(self) -> None:
        still = [[0.1, -0.2, 9.8]] * SAMPLES
        made = write_samples(
            sequence=0, time_ns=range(1, 1 + SAMPLES), device_us=range(SAMPLES), received_ns=1,
            uncertainty_ns=0, acc=still, gyr=still, mag=still[:1] * SAMPLES,
        )  # fmt: skip
        step = round(1e6 / RATE_HZ)
        batch = Batch(
            sequence=FIRST_SEQUENCE,
            device_us=FIRST_US,
            offsets=struct.pack(f"<{SAMPLES}I", *(step * k for k in range(SAMPLES))),
            acc=made.acc,
            gyr=made.gyr,
            mag=made.mag and made.mag[:12],
            mag_index=struct.pack("<H", 0),
        )
        self._bytes = bytearray(encode(batch))
        self._sequence_at = self._bytes.index(struct.pack(">BI", 0xCE, FIRST_SEQUENCE)) + 1
        self._time_at = self._bytes.index(struct.pack(">BQ", 0xCF, FIRST_US)) + 1

    def fill(self, sequence: int, taken_us: int) -> bytes:
        """Return the batch with these."""
        struct.pack_into(">I", self._bytes, self._sequence_at, sequence)
        struct.pack_into(">Q", self._bytes, self._time_at, taken_us)
        return bytes(self._bytes)


class CrowdNode(asyncio.Protocol):
    """One node. `next_sequence` is what it would send next, `sent` how many samples went out."""

    def __init__(self, node: str, token: str, port: int) -> None:
        self._node, self._token, self._port = node, token, port
        self._frame = _Frame()
        self._rest = b""
        self._transport: asyncio.Transport | None = None
        loop = asyncio.get_running_loop()
        self.shaken: asyncio.Future[None] = loop.create_future()
        self.gone: asyncio.Future[None] = loop.create_future()
        self.sent = 0
        self.next_sequence = FIRST_SEQUENCE
        self._number = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Ask for the upgrade."""
        self._transport = cast(asyncio.Transport, transport)
        key = base64.b64encode(os.urandom(16)).decode()
        self._transport.write(
            f"GET {PATH} HTTP/1.1\r\nHost: 127.0.0.1:{self._port}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
            f"Authorization: Bearer {self._token}\r\n\r\n".encode()
        )

    def connection_lost(self, exc: Exception | None) -> None:
        """Note it."""
        del exc
        self._transport = None
        for waiting in (self.shaken, self.gone):
            if not waiting.done():
                waiting.set_result(None)

    def data_received(self, data: bytes) -> None:
        """Read the gateway's frames, all of them short and whole."""
        came_us = device_us()
        data = self._rest + data
        if not self.shaken.done():
            head, end, data = data.partition(b"\r\n\r\n")
            if not end:
                self._rest = head
                return
            self.shaken.set_result(None)
            hello = Hello(node=self._node, boot=1, chip="MPU-9150", rate_hz=RATE_HZ, magnetometer=True)
            self.send(encode(hello))
        while len(data) >= 2:
            size, head_size = data[1], 2
            if size == 126:
                size, head_size = int.from_bytes(data[2:4], "big"), 4
            if len(data) < head_size + size:
                break
            self._heard(data[0] & 15, data[head_size : head_size + size], came_us)
            data = data[head_size + size :]
        self._rest = data

    def send(self, payload: bytes, kind: int = BINARY) -> None:
        """Send a masked frame; nothing when there is no connection."""
        if self._transport is None:
            return
        key, size = random.randbytes(4), len(payload)
        length = bytes([0x80 | size]) if size < 126 else struct.pack(">BH", 0xFE, size)
        self._transport.write(bytes([0x80 | kind]) + length + key + masked(payload, key))

    def measure(self, taken_us: int, *, status: bool) -> None:
        """Send the next batch, taken from `taken_us` on, and once in a while how it fares."""
        self.send(self._frame.fill(self.next_sequence, taken_us))
        self.next_sequence += SAMPLES
        self.sent += SAMPLES
        if status:
            self.send(encode(NodeStatus(battery_v=3.9, rssi_dbm=-50.0, dropped=0)))

    async def leave(self) -> None:
        """Say bye and wait for the close."""
        self.send(encode(Bye(next_sequence=self.next_sequence)))
        await asyncio.wait([self.gone], timeout=LEAVE_WITHIN_S)
        if self._transport is not None:
            self._transport.abort()

    def _heard(self, kind: int, payload: bytes, came_us: int) -> None:
        if kind == 9:
            self.send(payload, 10)
        elif kind == 8 and self._transport is not None:
            self.send(payload[:2], 8)
            self._transport.close()
        elif kind == BINARY and len(payload) < 40:  # what is longer is no question, but an echo
            try:
                said = from_gateway(payload)
            except WireError:
                return
            if isinstance(said, ClockAsk):
                self.send(encode(ClockAnswer(id=said.id, came_us=came_us, left_us=device_us())))


def _itself(node: CrowdNode) -> CrowdNode:
    return node


async def crowd(port: int, token: str, nodes: int, stop_s: float) -> dict[str, float]:
    """Let them all join, send for `stop_s`, leave, and return what was sent."""
    loop, stop = asyncio.get_running_loop(), stop_on_signals()
    members: list[CrowdNode] = []
    for first in range(0, nodes, JOINING_AT_ONCE):
        for number in range(first, min(first + JOINING_AT_ONCE, nodes)):
            node = CrowdNode(f"crowd-{number:03d}", token, port)
            await loop.create_connection(partial(_itself, node), "127.0.0.1", port)
            members.append(node)
        await asyncio.wait([member.shaken for member in members[first:]], timeout=LEAVE_WITHIN_S)
    start, late, turn, end = loop.time(), 0.0, 0, stop_s / PERIOD_S * nodes
    begun_us = device_us() - round(1e6 * PERIOD_S)
    while turn < end and not stop.is_set():
        due = start + turn * PERIOD_S / nodes
        await asyncio.sleep(max(0.0, due - loop.time()))
        late = max(late, loop.time() - due)
        taken_us = begun_us + round(turn * PERIOD_S / nodes * 1e6)
        members[turn % nodes].measure(taken_us, status=turn // nodes % round(1 / PERIOD_S) == 0)
        turn += 1
    await asyncio.gather(*(member.leave() for member in members))
    return {"samples_sent": sum(member.sent for member in members), "late_ms": 1e3 * late, "nodes": nodes}


if __name__ == "__main__":
    print_json(asyncio.run(crowd(int(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))))
