"""How the network fares: arrivals and their times in; live nodes, rates, loss and latency out."""

from dataclasses import dataclass, field

from brachium_viewer.contents import outwards
from brachium_viewer.statistics import percentiles
from brachium_viewer.window import SECOND, WINDOW_NS, State, Window, limit_s, state
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Health, Info, SampleBatch, Skeleton, Status
from brachium_wire.sequence import SequenceCounter
from brachium_wire.topics import TOPICS

_NO_SERVICES = ("node", "host")
"""Tokens of sensors, which are shown as nodes, and of the claim on a subject's host time."""


@dataclass(frozen=True, kw_only=True)
class NodeHealth:
    """One sensor as seen from here. A figure that nobody told is None."""

    subject: str
    segment: str
    state: State
    node: str = ""
    origin: str = ""
    rate_hz: float
    """Samples a second that arrive here."""
    nominal_hz: float | None = None
    age_s: float | None = None
    received: int = 0
    lost: int = 0
    """By the gateway's count since the node joined; by our own where no gateway reports."""
    out_of_order: int = 0
    late: int = 0
    battery_v: float | None = None
    battery_hours: float | None = None
    rssi_dbm: float | None = None
    clock_uncertainty_ms: float | None = None
    drops: dict[str, int] = field(default_factory=dict)

    @property
    def loss(self) -> float:
        """Return the lost samples over those sent, 0 to 1."""
        sent = self.received + self.lost
        return self.lost / sent if sent else 0.0


@dataclass(frozen=True, kw_only=True)
class ArmHealth:
    """One arm's skeletons."""

    subject: str
    side: str
    state: State
    origin: str = ""
    rate_hz: float
    nominal_hz: float
    age_s: float
    latency_p50_ms: float | None = None
    """From the gateway's having the last sample to the skeleton's arrival here; same host only."""
    latency_p99_ms: float | None = None
    forward: str = ""
    quality: dict[str, str] = field(default_factory=dict)
    """By segment."""


@dataclass(frozen=True, kw_only=True)
class ServiceHealth:
    """One service: up while its token is there and its beat comes."""

    kind: str
    id: str
    up: bool
    age_s: float | None = None
    drops: dict[str, int] = field(default_factory=dict)
    text: str = ""
    alarm: str = ""


@dataclass(frozen=True, kw_only=True)
class NetworkHealth:
    """Everything that the monitor shows, at one moment."""

    live: int
    nodes: list[NodeHealth]
    arms: list[ArmHealth]
    services: list[ServiceHealth]
    waiting: list[str]
    """Nodes that asked to join and are not assigned."""
    drops: dict[str, int]
    """What this program itself could not read, by reason."""

    @property
    def headline(self) -> str:
        """Return the line that stands first everywhere."""
        return f"{self.live} of {len(self.nodes)} nodes live"


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
            self._services.setdefault((kind, name), _Service()).token = alive

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
            received=status.received if status is not None else own.received,
            lost=status.lost if status is not None else own.lost,
            out_of_order=status.out_of_order if status is not None else own.out_of_order,
            late=status.late if status is not None else self.late,
            battery_v=status.battery_v if status is not None else None,
            battery_hours=status.battery_hours if status is not None else None,
            rssi_dbm=status.rssi_dbm if status is not None else None,
            clock_uncertainty_ms=None if uncertainty is None else uncertainty / 1e6,
            drops=dict(status.drops) if status is not None else {},
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
