"""What stands for a node: its packets and when they are due, sent at their time through any way in."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import dataclass
from typing import Protocol

import msgspec
import numpy as np
import numpy.typing as npt

from brachium_nodes.node_client import NodeClient, NoGateway, NotWelcome
from brachium_nodes.node_frames import Batch, Hello, NodeStatus
from brachium_wire.messages import Quaternion

log = logging.getLogger(__name__)

LOOK_S = 0.05
RETRY_S = 0.5
STATUS_S = 1.0
JOIN_WITHIN_S = 1.0

Stop = threading.Event
Started = Callable[[], Coroutine[None, None, None]]


@dataclass(frozen=True, slots=True, eq=False)
class Outgoing:
    """One packet, due at `due_s` of the source's time; its samples were taken at `times_s` (n,)."""

    due_s: float
    batch: Batch
    times_s: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NodeStream:
    """One node: what it says of itself, and its packets in the order in which they arrive."""

    subject: str
    segment: str
    hello: Hello
    mounting: Quaternion | None
    packets: Iterator[Outgoing]
    clock_us: Callable[[float], int]
    """What the node's clock shows at a source time in s; linear."""


@dataclass(slots=True, kw_only=True)
class StreamCount:
    """What was sent of one stream, in samples. A gateway that received everything counts the same."""

    sent: int = 0
    """Each sample once, however often it was sent."""
    lost: int = 0
    """Left out before the last one sent."""
    swapped: int = 0
    """Sent after a later one."""
    duplicated: int = 0
    """Sent again."""
    next_sequence: int = 0
    dropped: int = 0
    """Of the lost ones, those that had no connection."""


class Sink(Protocol):
    """A way in for one node."""

    async def join(self) -> None:
        """Be let in; raises NoGateway or NotWelcome."""

    async def send(self, packet: Outgoing) -> None:
        """Send a packet; raises ConnectionError."""

    async def tell(self, status: NodeStatus) -> None:
        """Send a status; raises ConnectionError."""

    async def leave(self, next_sequence: int) -> None:
        """Leave, so that the other side's counts are final."""


class Timeline:
    """The source's time against this process's monotonic clock."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._made_ns = self.start_ns = time.monotonic_ns()
        """`start_ns`: reading of the monotonic clock at source time 0."""

    def start(self) -> None:
        """Let source time 0 be now."""
        self.start_ns = time.monotonic_ns()

    @property
    def lead_s(self) -> float:
        """Seconds that passed before source time 0."""
        return (self.start_ns - self._made_ns) * 1e-9 * self.speed

    def elapsed_s(self) -> float:
        """Return the seconds since the timeline was made."""
        return (time.monotonic_ns() - self._made_ns) * 1e-9 * self.speed

    def now_s(self) -> float:
        """Return source time."""
        return (time.monotonic_ns() - self.start_ns) * 1e-9 * self.speed

    async def reach(self, due_s: float, stop: Stop) -> bool:
        """Wait until source time `due_s`; return False when `stop` came first."""
        while not stop.is_set():
            wait_s = (due_s - self.now_s()) / self.speed
            if wait_s <= 0.0:
                return True
            await asyncio.sleep(min(wait_s, LOOK_S))
        return False


class Counting:
    """Counts what is sent, packet by packet."""

    def __init__(self) -> None:
        self.count = StreamCount()
        self._seen: dict[int, None] = {}

    def sent(self, sequence: int, samples: int) -> None:
        """Count a packet that was handed over."""
        c = self.count
        if sequence in self._seen:
            c.duplicated += samples
            return
        self._seen[sequence] = None
        while len(self._seen) > 1024:
            del self._seen[next(iter(self._seen))]
        c.sent += samples
        if sequence >= c.next_sequence:
            c.lost += sequence - c.next_sequence
            c.next_sequence = sequence + samples
        else:
            c.swapped += samples
            c.lost -= samples


async def send_all(
    stream: NodeStream, sink: Sink, joining: asyncio.Task[None], timeline: Timeline, end_s: float, stop: Stop
) -> StreamCount:
    """Send a stream's packets, each at its time, until it ends, `end_s` or `stop` comes; then leave.

    While there is no connection packets are dropped and counted, as a node does, and joining is tried again.
    Raises NotWelcome when trying again makes no sense.
    """
    counting, told_s = Counting(), timeline.now_s()
    try:
        for packet in stream.packets:
            if packet.due_s > end_s or not await timeline.reach(packet.due_s, stop):
                break
            samples = len(packet.batch.offsets) // 4
            if not joining.done():
                counting.count.dropped += samples
                continue
            joining.result()
            try:
                await sink.send(packet)
                counting.sent(packet.batch.sequence, samples)
                if timeline.now_s() - told_s >= STATUS_S:
                    told_s = timeline.now_s()
                    await sink.tell(NodeStatus(dropped=counting.count.dropped))
            except ConnectionError:
                counting.count.dropped += samples
                joining = asyncio.create_task(join(stream, sink, stop))
    finally:
        joining.cancel()
        await sink.leave(counting.count.next_sequence)
    return counting.count


async def join(stream: NodeStream, sink: Sink, stop: Stop) -> None:
    """Try to join until it works or `stop` is set. Raises NotWelcome when trying again makes no sense."""
    said = ""
    while not stop.is_set():
        try:
            return await sink.join()
        except NoGateway as error:
            reason, wait_s = str(error), RETRY_S
        except NotWelcome as error:
            if error.retry_s is None:
                raise
            reason, wait_s = str(error), max(error.retry_s, RETRY_S)
        if reason != said:
            log.warning("%s: %s", stream.hello.node, reason)
        said = reason
        for _ in range(round(wait_s / LOOK_S)):
            if not stop.is_set():
                await asyncio.sleep(LOOK_S)
    return None


async def send_streams(
    nodes: list[tuple[NodeStream, Sink]], timeline: Timeline, end_s: float, stop: Stop, started: Started
) -> dict[tuple[str, str], StreamCount]:
    """Join all nodes, call `started` as source time 0 begins, and send them all.

    Returns the counts by (subject, segment). Time begins when one has joined and the others had a second.
    """
    joining = [asyncio.create_task(join(stream, sink, stop)) for stream, sink in nodes]
    try:
        await asyncio.wait(joining, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait(joining, timeout=JOIN_WITHIN_S)
        for task in joining:
            if task.done():
                task.result()
        timeline.start()
        async with asyncio.TaskGroup() as group:
            beside = group.create_task(started())
            sending = [
                group.create_task(send_all(stream, sink, task, timeline, end_s, stop))
                for (stream, sink), task in zip(nodes, joining, strict=True)
            ]
            await asyncio.wait(sending)
            beside.cancel()
    except ExceptionGroup as errors:
        raise errors.exceptions[0] from None
    finally:
        for task in joining:
            task.cancel()
    return {(s.subject, s.segment): t.result() for (s, _), t in zip(nodes, sending, strict=True)}


class SocketSink:
    """The way in through a gateway. The node's clock runs on while its packets wait for the start."""

    def __init__(self, url: str, token: str, stream: NodeStream, timeline: Timeline) -> None:
        self._clock_us, self._timeline = stream.clock_us, timeline
        self._client = NodeClient(url, token, stream.hello, lambda: stream.clock_us(timeline.elapsed_s()))
        self.host: str | None = None
        """The clock that gives host time, once joined."""

    async def join(self) -> None:
        """Be let in."""
        self.host = (await self._client.join()).host

    async def send(self, packet: Outgoing) -> None:
        """Send a packet, its stamps moved by the time that passed before source time 0."""
        shift_us = self._clock_us(self._timeline.lead_s) - self._clock_us(0.0)
        batch = msgspec.structs.replace(packet.batch, device_us=packet.batch.device_us + shift_us)
        await self._client.send(batch)

    async def tell(self, status: NodeStatus) -> None:
        """Send a status."""
        await self._client.send(status)

    async def leave(self, next_sequence: int) -> None:
        """Say bye and wait for the close."""
        await self._client.leave(next_sequence)
