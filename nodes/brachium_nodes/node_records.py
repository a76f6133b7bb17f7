"""What the room is told of a node: from its hello, its own words and what was counted. Pure."""

from brachium_nodes.kept_calibration import Keeping
from brachium_nodes.node_frames import Hello, NodeStatus
from brachium_nodes.sample_stream import Memory
from brachium_wire.messages import Info, Quaternion, Status


def info_of(hello: Hello, host: str, mounting: Quaternion | None, keeping: Keeping) -> Info:
    """Return what is known of a node's sensor."""
    return Info(
        node=hello.node,
        rate_hz=hello.rate_hz,
        origin=hello.origin,
        host=host,
        chip=hello.chip,
        firmware=hello.firmware,
        mounting=mounting,
        calibration=keeping.calibration,
        kept=keeping.keeper,
        magnetometer=hello.magnetometer,
        orientation_only=hello.orientation_only,
    )


def status_of(
    node: str, now_ns: int, memory: Memory, said: NodeStatus, *, rate_hz: float | None, connected: bool
) -> Status:
    """Return how a node fares: what it said last, and what was counted of it."""
    clock = memory.clock
    return Status(
        node=node,
        time_ns=now_ns,
        connected=connected,
        received=memory.counter.received,
        lost=memory.counter.lost,
        out_of_order=memory.counter.out_of_order,
        late=memory.late,
        rate_hz=rate_hz,
        battery_v=said.battery_v,
        battery_hours=said.battery_hours,
        rssi_dbm=said.rssi_dbm,
        node_dropped=said.dropped,
        clock_offset_ns=clock.offset_ns if clock.known else None,
        clock_skew_ppm=clock.skew_ppm if clock.known else None,
        clock_uncertainty_ns=clock.uncertainty_ns(clock.newest_us) if clock.known else None,
        drops=dict(memory.drops),
    )
