"""What SlimeVR trackers tell, one record a kind."""

from dataclasses import dataclass
from enum import Enum

from brachium_wire.messages import Quaternion


class Drop(Enum):
    """Why a datagram, or a packet in it, was not used. The values are the names that people see."""

    OVERSIZE = "oversize"
    TRUNCATED = "truncated"
    UNKNOWN_PACKET = "unknown_packet"
    NOT_FINITE = "not_finite"
    OUT_OF_RANGE = "out_of_range"


@dataclass(frozen=True, slots=True, kw_only=True)
class Handshake:
    """A tracker seeks a server."""

    imu: int | None
    protocol: int | None
    firmware: str
    """Empty for the oldest trackers and for telephones that stand for one."""
    mac: str | None
    """Twelve hex digits, as in a1b2c3d4e5f6."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The tracker is there: the answer to a heartbeat of ours."""


@dataclass(frozen=True, slots=True)
class Pong:
    """A ping of ours came back."""

    id: int


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """One sensor of the tracker."""

    sensor: int
    status: int
    """0 off, 1 working, 2 broken."""
    imu: int | None = None
    magnetometer: bool = False
    """It is used: the heading is that of magnetic north."""
    position: int = 0
    """Where on the body the tracker says that it is worn; positions.py. 0: it does not say."""
    rotates: bool = True
    """It measures orientation; a glove's flex sensors do not."""


@dataclass(frozen=True, slots=True)
class Rotation:
    """An orientation: world from sensor, scalar first, world z up."""

    sensor: int
    world_from_sensor: Quaternion


@dataclass(frozen=True, slots=True)
class Acceleration:
    """m/s^2 without gravity. It has no place beside an orientation on the bus: it is only counted."""

    sensor: int


@dataclass(frozen=True, slots=True)
class Battery:
    """How full the battery is, 0 to 1, and its voltage where the tracker tells it."""

    volts: float | None
    level: float


@dataclass(frozen=True, slots=True)
class Signal:
    """Received signal strength."""

    dbm: int


@dataclass(frozen=True, slots=True)
class Tap:
    """Someone tapped the tracker; what `value` means is the sensor's."""

    sensor: int
    value: int


@dataclass(frozen=True, slots=True)
class Trouble:
    """The tracker reports an error of a sensor, by the sensor's own number."""

    sensor: int
    code: int


@dataclass(frozen=True, slots=True)
class Features:
    """The tracker asks what the server can do."""


@dataclass(frozen=True, slots=True)
class Unused:
    """A packet that is known and not needed here: temperature, serial text, flex and so on."""


Record = (
    Handshake
    | Heartbeat
    | Pong
    | SensorInfo
    | Rotation
    | Acceleration
    | Battery
    | Signal
    | Tap
    | Trouble
    | Features
    | Unused
)


@dataclass(frozen=True, slots=True)
class Datagram:
    """What one datagram holds. What is sound in it stands beside the drops."""

    number: int
    """Rises by one from datagram to datagram; 0 in a handshake and in what the tracker only sends back."""
    records: tuple[Record, ...]
    drops: tuple[Drop, ...]
