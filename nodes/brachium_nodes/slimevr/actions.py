"""What the trackers' rules want done; the service does it."""

from dataclasses import dataclass
from typing import Literal

from brachium_nodes.slimevr.tracker import Address
from brachium_wire.messages import Message


@dataclass(frozen=True, slots=True)
class Send:
    """Send this datagram."""

    address: Address
    data: bytes


@dataclass(frozen=True, slots=True)
class Publish:
    """Put this on the bus, at this segment of this subject; info is retained."""

    topic: Literal["info", "imu", "status", "event"]
    subject: str
    segment: str
    message: Message


@dataclass(frozen=True, slots=True)
class Joined:
    """A node stands for a segment of this subject from now on."""

    node: str
    subject: str
    segment: str


@dataclass(frozen=True, slots=True)
class Left:
    """A node does so no more, and why."""

    node: str
    subject: str
    reason: str


@dataclass(frozen=True, slots=True)
class Told:
    """Something that the log shall show."""

    text: str


Action = Send | Publish | Joined | Left | Told
