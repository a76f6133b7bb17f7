"""Sends streams at their time through any way in; joins again when a connection breaks."""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
from typing import Protocol

import msgspec

from brachium_nodes.node_client import NodeClient, NoGateway, NotWelcome
from brachium_nodes.node_frames import NodeStatus
from brachium_nodes.node_stream import LOOK_S, Counting, NodeStream, Outgoing, Stop, StreamCount, Timeline
from brachium_nodes.pauses import Pauses

log = logging.getLogger(__name__)

STATUS_S = 1.0
JOIN_WITHIN_S = 1.0

Started = Callable[[], Coroutine[None, None, None]]


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


class Entrant:
    """One node on its way in, again and again."""

    def __init__(self, stream: NodeStream, sink: Sink, stop: Stop) -> None:
        self.stream, self.sink = stream, sink
        self._stop, self._pauses = stop, Pauses(stream.hello.node)
        self.joining = asyncio.create_task(self._join())

    def again(self) -> None:
        """Join anew: the connection broke."""
        self.joining = asyncio.create_task(self._join(self._pauses.next_s(time.monotonic())))

    async def _join(self, wait_s: float = 0.0) -> None:
        """Try to join until it works or `stop` is set. Raises NotWelcome when trying again makes no sense."""
        said = ""
        await self._rest(wait_s)
        while not self._stop.is_set():
            try:
                await self.sink.join()
                self._pauses.joined(time.monotonic())
                return
            except NoGateway as error:
                reason, wanted_s = str(error), 0.0
            except NotWelcome as error:
                if error.retry_s is None:
                    raise
                reason, wanted_s = str(error), error.retry_s
            if reason != said:
                log.warning("%s: %r", self.stream.hello.node, reason)
            said = reason
            await self._rest(self._pauses.next_s(time.monotonic(), wanted_s))

    async def _rest(self, wait_s: float) -> None:
        for _ in range(round(wait_s / LOOK_S)):
            if not self._stop.is_set():
                await asyncio.sleep(LOOK_S)


async def send_all(entrant: Entrant, timeline: Timeline, end_s: float, stop: Stop) -> StreamCount:
    """Send a stream's packets, each at its time, until it ends, `end_s` or `stop` comes; then leave.

    While there is no connection packets are dropped and counted, as a node does, and joining is tried again.
    Raises NotWelcome when trying again makes no sense.
    """
    stream, sink = entrant.stream, entrant.sink
    counting, told_s = Counting(), timeline.now_s()
    try:
        for packet in stream.packets:
            if packet.due_s > end_s or not await timeline.reach(packet.due_s, stop):
                break
            samples = len(packet.batch.offsets) // 4
            if not entrant.joining.done():
                counting.count.dropped += samples
                continue
            entrant.joining.result()
            try:
                await sink.send(packet)
                counting.sent(packet.batch.sequence, samples)
                if timeline.now_s() - told_s >= STATUS_S:
                    told_s = timeline.now_s()
                    said = stream.says(told_s)
                    await sink.tell(msgspec.structs.replace(said, dropped=counting.count.dropped))
            except ConnectionError:
                counting.count.dropped += samples
                entrant.again()
    finally:
        entrant.joining.cancel()
        await sink.leave(counting.count.next_sequence)
    return counting.count


async def send_streams(
    nodes: list[tuple[NodeStream, Sink]], timeline: Timeline, end_s: float, stop: Stop, started: Started
) -> dict[tuple[str, str], StreamCount]:
    """Join all nodes, call `started` as source time 0 begins, and send them all.

    Returns the counts by (subject, segment). Time begins when one has joined and the others had a second.
    """
    entrants = [Entrant(stream, sink, stop) for stream, sink in nodes]
    joining = [entrant.joining for entrant in entrants]
    try:
        await asyncio.wait(joining, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait(joining, timeout=JOIN_WITHIN_S)
        for task in joining:
            if task.done():
                task.result()
        if stop.is_set():
            return {(stream.subject, stream.segment): StreamCount() for stream, _ in nodes}
        timeline.start()
        async with asyncio.TaskGroup() as group:
            beside = group.create_task(started())
            sending = [group.create_task(send_all(entrant, timeline, end_s, stop)) for entrant in entrants]
            await asyncio.wait(sending)
            beside.cancel()
    except ExceptionGroup as errors:
        raise errors.exceptions[0] from None
    finally:
        for entrant in entrants:
            entrant.joining.cancel()
            await entrant.sink.leave(0)  # nothing for those that left with their count
    return {(s.subject, s.segment): t.result() for (s, _), t in zip(nodes, sending, strict=True)}


class SocketSink:
    """The way in through a gateway. The node's clock runs on while its packets wait for the start."""

    def __init__(self, url: str, token: str, stream: NodeStream, timeline: Timeline) -> None:
        self._clock_us, self._timeline = stream.clock_us, timeline
        self._client = NodeClient(
            url, token, stream.hello, lambda: stream.clock_us(timeline.elapsed_s()), stream.store
        )
        self.host: str | None = None
        """The clock that gives host time, once joined."""

    async def join(self) -> None:
        """Be let in; not before the time that the gateway named when it ended the last connection."""
        refused, self._client.refused = self._client.refused, None
        if refused is not None and refused.retry_s is not None:
            await asyncio.sleep(refused.retry_s)
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
