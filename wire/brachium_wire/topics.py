"""Every topic once. Router rules, monitor, recorder and tests derive from this table."""

from dataclasses import dataclass
from enum import Enum

from brachium_wire import messages as m


class Urgency(Enum):
    """Priority on the bus; each has a queue of its own, and order holds only within one."""

    DATA = "data"
    CONTROL = "control"
    BACKGROUND = "background"


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """One kind of message and the promise that comes with it."""

    name: str
    pattern: str
    """Key below brachium/<room>/, for people; keys.py builds and reads them."""
    message: type[m.Message]
    rate_hz: float | None = None
    """Nominal messages a second on one key; None when it comes as it comes."""
    stale_after_s: float | None = None
    """Older than this, a value is shown as stale."""
    urgency: Urgency = Urgency.DATA
    retained: bool = False
    """The publisher answers queries on the key with the last value, for who comes late."""
    recorded: bool = True
    max_bytes: int = 8192
    """A larger payload is refused by the router and at the door."""


# `info` has the urgency of `imu`, because a sensor's info must stay ahead of its first sample.
TOPICS: dict[str, Topic] = {
    t.name: t
    for t in (
        Topic(
            name="imu",
            pattern="<subject>/imu/<segment>",
            message=m.SampleBatch,
            rate_hz=20.0,
            stale_after_s=0.5,
        ),
        Topic(name="info", pattern="<subject>/imu/<segment>/info", message=m.Info, retained=True),
        Topic(
            name="status",
            pattern="<subject>/imu/<segment>/status",
            message=m.Status,
            rate_hz=1.0,
            stale_after_s=3.0,
        ),
        Topic(
            name="skeleton",
            pattern="<subject>/skeleton/<side>",
            message=m.Skeleton,
            rate_hz=50.0,
            stale_after_s=0.5,
        ),
        Topic(
            name="calibration",
            pattern="<subject>/calibration",
            message=m.Calibration,
            retained=True,
            max_bytes=65536,
        ),
        Topic(name="session", pattern="<subject>/session", message=m.Session, retained=True, max_bytes=65536),
        Topic(name="event", pattern="<subject>/event", message=m.Event, max_bytes=65536),
        Topic(
            name="command",
            pattern="<subject>/command/<verb>",
            message=m.Command,
            urgency=Urgency.CONTROL,
            recorded=False,
            max_bytes=65536,
        ),
        Topic(
            name="truth",
            pattern="<subject>/truth/<side>",
            message=m.Skeleton,
            rate_hz=50.0,
            stale_after_s=0.5,
        ),
        # Kept in recordings only: it is the answer to the command `record`, and never put on the bus.
        Topic(name="snapshot", pattern="<subject>/snapshot", message=m.Snapshot, max_bytes=1 << 20),
        Topic(
            name="health",
            pattern="service/<kind>/<id>",
            message=m.Health,
            rate_hz=1.0,
            stale_after_s=3.0,
            max_bytes=65536,
        ),
    )
}
