"""Nodes without a gateway: a process that is its own host puts its samples on the bus itself."""

from collections.abc import Callable

import numpy as np

from brachium_nodes.host_claim import HostClaims
from brachium_nodes.node_client import NotWelcome
from brachium_nodes.node_frames import NodeStatus
from brachium_nodes.node_stream import NodeStream, Outgoing, Timeline
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import encode
from brachium_wire.hosttime import HostClock, tell_host_time
from brachium_wire.messages import Info, SampleBatch, Status
from brachium_wire.sequence import SequenceCounter

UNCERTAINTY_NS = 1000
"""The stamps are whole us, and nothing lies between the node and its host."""


class DirectHost:
    """The host of all nodes of this process: one clock, one claim a subject.

    Host time is source time from `origin_ns` on; by default the wall clock's at the timeline's start.
    """

    def __init__(
        self, bus: Bus, room: str, host: str, timeline: Timeline, origin_ns: int | None = None
    ) -> None:
        self.bus, self.room, self.host = bus, room, host
        self.claims = HostClaims(bus, room, host)
        self._timeline, self._origin_ns, self._clock = timeline, origin_ns, HostClock()
        tell_host_time(bus, room, host, self.now_ns)

    @property
    def origin_ns(self) -> int:
        """Host time at source time 0."""
        return self._clock.at(self._timeline.start_ns) if self._origin_ns is None else self._origin_ns

    def now_ns(self) -> int:
        """Return host time."""
        return self.origin_ns + round(self._timeline.now_s() * 1e9)


class DirectSink:
    """The way in for one node of this host."""

    def __init__(self, host: DirectHost, stream: NodeStream) -> None:
        self._host, self._stream = host, stream
        self._counter = SequenceCounter(next=0)
        self._end: Callable[[], None] | None = None
        self._said = NodeStatus()

    async def join(self) -> None:
        """Claim the subject, show the node, publish its info."""
        host, stream = self._host, self._stream
        other = host.claims.other(stream.subject)
        if other is not None:
            text = f"{stream.subject} comes in through host {other}; end that one first"
            raise NotWelcome("second_host", text, 5.0)
        host.claims.claim(stream.subject)
        self._end = host.bus.announce(keys.alive(host.room, "node", stream.hello.node))
        hello = stream.hello
        info = Info(
            node=hello.node,
            rate_hz=hello.rate_hz,
            origin=hello.origin,
            host=host.host,
            chip=hello.chip,
            firmware=hello.firmware,
            mounting=stream.mounting,
            calibration=hello.calibration,
            magnetometer=hello.magnetometer,
            orientation_only=hello.orientation_only,
        )
        host.bus.retain(keys.info(host.room, stream.subject, stream.segment), encode(info))

    async def send(self, packet: Outgoing) -> None:
        """Publish a packet with the times at which its samples were taken."""
        frame, host = packet.batch, self._host
        times = np.rint(packet.times_s * 1e9).astype(np.int64) + host.origin_ns
        repeated = self._counter.repeated
        self._counter.feed(frame.sequence, len(times))
        if self._counter.repeated > repeated:
            return
        batch = SampleBatch(
            sequence=frame.sequence,
            time_ns=int(times[0]),
            offsets=(times - times[0]).astype("<u4").tobytes(),
            device_us=frame.device_us,
            device_offsets=frame.offsets,
            received_ns=host.now_ns(),
            uncertainty_ns=UNCERTAINTY_NS,
            acc=frame.acc,
            gyr=frame.gyr,
            mag=frame.mag,
            mag_index=frame.mag_index,
            quat=frame.quat,
            late=frame.late,
        )
        host.bus.put(keys.imu(host.room, self._stream.subject, self._stream.segment), encode(batch))

    async def tell(self, status: NodeStatus) -> None:
        """Publish the node's status."""
        self._said = status
        self._status(connected=True)

    async def leave(self, next_sequence: int) -> None:
        """Publish a last status with final counts and take the token away."""
        if self._end is None:
            return
        self._counter.end(next_sequence)
        self._status(connected=False)
        self._end()
        self._end = None

    def _status(self, *, connected: bool) -> None:
        counter, host, said = self._counter, self._host, self._said
        status = Status(
            node=self._stream.hello.node,
            time_ns=host.now_ns(),
            connected=connected,
            received=counter.received,
            lost=counter.lost,
            out_of_order=counter.out_of_order,
            battery_v=said.battery_v,
            battery_hours=said.battery_hours,
            rssi_dbm=said.rssi_dbm,
            node_dropped=said.dropped,
            clock_uncertainty_ns=UNCERTAINTY_NS,
            drops={"repeated": counter.repeated} if counter.repeated else {},
        )
        host.bus.put(keys.status(host.room, self._stream.subject, self._stream.segment), encode(status))
