"""How a network fares at one moment, as records: what monitor and pages show."""

from dataclasses import dataclass, field

from brachium_viewer.window import State


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
    battery_level: float | None = None
    """0 to 1."""
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
