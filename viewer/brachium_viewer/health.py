"""How the network fares: arrivals and their times in; live nodes, rates, loss and latency out."""

from typing import Any

from brachium_viewer.contents import outwards
from brachium_viewer.health_records import ArmHealth, NetworkHealth, NodeHealth, ServiceHealth
from brachium_viewer.statistics import percentiles
from brachium_viewer.window import SECOND, WINDOW_NS, Window, limit_s, state
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Health, Info, SampleBatch, Skeleton, Status
from brachium_wire.sequence import SequenceCounter
from brachium_wire.topics import TOPICS

_NO_SERVICES = ("node", "host")
"""Tokens of sensors, which are shown as nodes, and of the claim on a subject's host time."""


class Network:
    """Takes what arrives, with its time, and says how it fares. Times are of one clock, ns."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[str, str], _Node] = {}
        self._arms: dict[tuple[str, str], _Arm] = {}
        self._services: dict[tuple[str, str], _Service] = {}
        self.drops: dict[str, int] = {}

    def feed(self, key: str, payload: bytes, now_ns: int) -> None:
        """Take one message; what is none of ours is counted and left."""
        try:
            parsed = keys.parse(key)
            if parsed.topic not in ("imu", "info", "status", "skeleton", "health"):
                return
            message = decode_topic(payload, parsed.topic)
        except (keys.BadKey, WireError) as error:
            reason = error.drop.value if isinstance(error, WireError) else "bad_key"
            self.drops[reason] = self.drops.get(reason, 0) + 1
            return
        who = (parsed.subject, parsed.detail)
        if isinstance(message, SampleBatch):
            self._nodes.setdefault(who, _Node()).batch(message, now_ns)
        elif isinstance(message, Info):
            self._nodes.setdefault(who, _Node()).info = message
        elif isinstance(message, Status):
            self._nodes.setdefault(who, _Node()).status = message
        elif isinstance(message, Skeleton):
            self._arms.setdefault(who, _Arm(message)).skeleton(message, now_ns)
        elif isinstance(message, Health):
            kind, _, name = parsed.detail.partition("/")
            service = self._services.setdefault((kind, name), _Service())
            service.health, service.heard_ns, service.token = message, now_ns, True

    def token(self, key: str, alive: bool) -> None:
        """Take a liveliness change; keys that are no service's token are left."""
        try:
            parsed = keys.parse(key)
        except keys.BadKey:
            return
        kind, _, name = parsed.detail.partition("/")
        if parsed.topic == "alive" and kind not in _NO_SERVICES:
            service = self._services.setdefault((kind, name), _Service())
            if alive and not service.token:
                service.health = service.heard_ns = None  # said by the one that went before it
            service.token = alive

    def report(self, now_ns: int) -> NetworkHealth:
        """Return how everything fares at `now_ns`."""
        nodes = [node.report(*who, now_ns) for who, node in sorted(self._nodes.items(), key=outwards)]
        services = [service.report(*who, now_ns) for who, service in sorted(self._services.items())]
        waiting = {
            name
            for service in self._services.values()
            if service.token and service.health is not None
            for name in service.health.waiting
        }
        return NetworkHealth(
            live=sum(node.state == "live" for node in nodes),
            nodes=nodes,
            arms=[arm.report(*who, now_ns) for who, arm in sorted(self._arms.items())],
            services=services,
            waiting=sorted(waiting),
            drops=dict(self.drops),
        )


_COUNTS = ("received", "lost", "out_of_order", "late")
_FIGURES = ("battery_v", "battery_level", "battery_hours", "rssi_dbm")
"""What a gateway's status says of a node, as it stands there."""


class _Node:
    def __init__(self) -> None:
        self.info: Info | None = None
        self.status: Status | None = None
        self.window, self.sequence, self.late = Window(), SequenceCounter(), 0

    def batch(self, batch: SampleBatch, now_ns: int) -> None:
        count = len(batch.offsets) // 4
        self.sequence.feed(batch.sequence, count)
        self.late += count if batch.late else 0
        self.window.add(now_ns, count)

    def report(self, subject: str, segment: str, now_ns: int) -> NodeHealth:
        age_s = self.window.age_s(now_ns)
        status, info, own = self.status, self.info, self.sequence
        found = state(age_s, limit_s("imu"), limit_s("status"))
        if status is not None and not status.connected:
            found = "missing"
        told: dict[str, Any] = (
            {"received": own.received, "lost": own.lost, "out_of_order": own.out_of_order, "late": self.late}
            if status is None
            else {name: getattr(status, name) for name in (*_COUNTS, *_FIGURES)}
        )
        uncertainty = status.clock_uncertainty_ns if status is not None else None
        return NodeHealth(
            subject=subject,
            segment=segment,
            state=found,
            node=info.node if info is not None else status.node if status is not None else "",
            origin=info.origin if info is not None else "",
            rate_hz=self.window.rate_hz(now_ns),
            nominal_hz=info.rate_hz if info is not None else None,
            age_s=age_s,
            clock_uncertainty_ms=None if uncertainty is None else uncertainty / 1e6,
            drops=dict(status.drops) if status is not None else {},
            **told,
        )


class _Arm:
    def __init__(self, skeleton: Skeleton) -> None:
        self.last, self.window = skeleton, Window()

    def skeleton(self, skeleton: Skeleton, now_ns: int) -> None:
        self.last = skeleton
        latency = float("nan")
        # Another host's clock makes nonsense of the difference: only a plausible one is a latency.
        if skeleton.received_ns is not None and 0 <= now_ns - skeleton.received_ns < 10 * WINDOW_NS:
            latency = (now_ns - skeleton.received_ns) / 1e6
        self.window.add(now_ns, 1, latency)

    def report(self, subject: str, side: str, now_ns: int) -> ArmHealth:
        p50, p99 = percentiles(self.window.values(now_ns))
        age_s = self.window.age_s(now_ns)
        return ArmHealth(
            subject=subject,
            side=side,
            state=state(age_s, limit_s("skeleton"), limit_s("status")),
            origin=self.last.origin,
            rate_hz=self.window.rate_hz(now_ns),
            nominal_hz=TOPICS["skeleton"].rate_hz or 0.0,
            age_s=age_s or 0.0,
            latency_p50_ms=p50,
            latency_p99_ms=p99,
            forward=self.last.forward,
            quality={name: pose.quality for name, pose in self.last.segments.items()},
        )


class _Service:
    def __init__(self) -> None:
        self.health: Health | None = None
        self.heard_ns: int | None = None
        self.token = False

    def report(self, kind: str, name: str, now_ns: int) -> ServiceHealth:
        age_s = None if self.heard_ns is None else max(0.0, (now_ns - self.heard_ns) / SECOND)
        return ServiceHealth(
            kind=kind,
            id=name,
            up=self.token and (age_s is None or age_s <= limit_s("health")),
            age_s=age_s,
            drops=dict(self.health.drops) if self.health is not None else {},
            text=self.health.text if self.health is not None else "",
            alarm=self.health.alarm if self.health is not None and self.token else "",
        )
