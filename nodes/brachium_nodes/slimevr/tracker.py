"""One tracker and its sensors: when its samples were taken, what was lost, what its silence means. Pure.

A tracker has no clock of its own and gives no times; it numbers its datagrams, not its samples.
"""

from collections import deque
from dataclasses import dataclass, field
from statistics import median

from brachium_nodes.clock import ONE_WAY_NS
from brachium_nodes.node_frames import Hello
from brachium_nodes.roster import Admission
from brachium_nodes.slimevr.records import Handshake, SensorInfo
from brachium_wire.messages import Quaternion, SampleBatch
from brachium_wire.samples import MAX_SAMPLES, write_samples

Address = tuple[str, int]

BUNDLED_NS = 10_000_000
"""So long a tracker's firmware may keep a sample to send it together with others."""
STEP_NS = 1000
"""Two samples of one sensor are apart by this at least, whatever their arrival."""
STILL_NS = 50_000_000
"""A sensor that sent nothing for so long may be at rest: its tracker is asked whether it is there."""
LEARN = 0.02
"""Weight of a datagram in the mean number of samples that datagrams carry."""
MAX_ASKED = 16
RECENT = 10
MAX_LOST = 100_000
"""More than a tracker sends in the 3 s after which it would be gone: such a number is none."""


class RoundTrips:
    """How long datagrams take, from pings that came back."""

    def __init__(self) -> None:
        self._asked: dict[int, int] = {}
        self._recent: deque[int] = deque(maxlen=RECENT)
        self._next_id = 0

    def ask(self, now_ns: int) -> int:
        """Return the id of a ping that leaves now."""
        self._next_id = (self._next_id + 1) & 0xFFFF_FFFF
        self._asked[self._next_id] = now_ns
        while len(self._asked) > MAX_ASKED:
            del self._asked[next(iter(self._asked))]
        return self._next_id

    def back(self, ping_id: int, now_ns: int) -> bool:
        """Take a ping that came back; return False for one that was not asked, or came twice."""
        asked_ns = self._asked.pop(ping_id, None)
        if asked_ns is None:
            return False
        self._recent.append(now_ns - asked_ns)
        return True

    @property
    def delay_ns(self) -> int:
        """What is taken off an arrival: half a usual round trip."""
        return round(median(self._recent) / 2) if self._recent else 0

    @property
    def uncertainty_ns(self) -> int:
        """Half width of a sample's time: it was kept in the tracker, then on its way for at most the worst
        round trip of late."""
        if not self._recent:
            return ONE_WAY_NS
        return BUNDLED_NS + max(self._recent) - self.delay_ns


@dataclass(slots=True, eq=False)
class Sensor:
    """One sensor of a tracker."""

    node: str
    info: SensorInfo
    admission: Admission | None = None
    hello: Hello | None = None
    """What was admitted."""
    told: str = ""
    """Why it may not stand for a segment, as it was logged last."""
    orientation: Quaternion | None = None
    """The last one since the tracker joined."""
    rotated_ns: int = 0
    """When that arrived."""
    per_datagram: float = 1.0
    """Samples that a datagram of the tracker carries, in the mean."""
    _owed: float = 0.0
    asked: int = 0
    """Since the last rotation: heartbeats asked for, answered, and datagrams of the tracker lost."""
    answered: int = 0
    lost: int = 0
    counted: int = 0
    counted_ns: int = 0
    """Samples received at the last status, and when that was."""

    def datagram(self, lost: int, carried: int, *, measured: bool) -> None:
        """Take that a datagram with `carried` samples came after `lost` datagrams that did not.

        `measured`: it carries what some sensor measured, and no mere answer.
        """
        self.lost += lost
        if measured:
            self.per_datagram += LEARN * (carried - self.per_datagram)

    def rotated(self, orientation: Quaternion, received_ns: int) -> int:
        """Take an orientation. Return how many samples are missing before it.

        Datagrams were lost, not samples: each of them that was no unanswered heartbeat will have carried as
        many samples as others do in the mean.
        """
        self._owed += max(0, self.lost - self.unanswered) * self.per_datagram
        missed = round(self._owed)
        self._owed -= missed
        self.orientation, self.rotated_ns = orientation, received_ns
        self.asked = self.answered = self.lost = 0
        return missed

    @property
    def unanswered(self) -> int:
        """Heartbeats since the last rotation that the tracker did not answer."""
        return max(0, self.asked - self.answered)

    def is_silent(self, now_ns: int) -> bool:
        """Return whether the sensor may be at rest, or its tracker gone."""
        return self.orientation is not None and now_ns - self.rotated_ns >= STILL_NS

    @property
    def rests(self) -> bool:
        """Whether no rotation can have been lost since the last one.

        A tracker sends none while its orientation stays the same (within 1e-4 of each component). What was
        lost since is then no more than the heartbeats that were not answered.
        """
        return self.orientation is not None and self.lost <= self.unanswered


@dataclass(slots=True, eq=False)
class Tracker:
    """One tracker that was let in."""

    mac: str
    handshake: Handshake
    address: Address
    heard_ns: int
    number: int | None = None
    """Of its last datagram."""
    trips: RoundTrips = field(default_factory=RoundTrips)
    sensors: dict[int, Sensor] = field(default_factory=dict)
    battery_v: float | None = None
    battery_level: float | None = None
    rssi_dbm: float | None = None
    ask_ns: int = 0
    """When it is asked next for a heartbeat and a round trip."""
    still_ns: int = 0
    """When it is asked next whether it rests."""

    def take_number(self, number: int) -> int | None:
        """Return how many datagrams were lost before this one.

        None for one that a later one overtook, or whose number cannot be.

        0 is no number: what the tracker sends back as it came carries it.
        """
        if number == 0:
            return 0
        last, lost = self.number, 0
        if last is not None:
            if not last < number <= last + MAX_LOST:
                return None
            lost = number - last - 1
        self.number = number
        return lost


def batch_of(
    sensor: Sensor,
    orientations: list[Quaternion],
    times_ns: list[int],
    *,
    missed: int,
    received_ns: int,
    uncertainty_ns: int,
) -> SampleBatch:
    """Return a batch on the sensor's segment and count it; its times never go back behind those given before.

    `dev` is the arrival, in us: the tracker has no clock.
    """
    assert sensor.admission is not None
    assert len(orientations) <= MAX_SAMPLES
    memory, place = sensor.admission.memory, sensor.admission.place
    sequence = place.next_sequence + (missed if memory.counter.next is not None else 0)
    stamps: list[int] = []
    for time_ns in times_ns:
        stamps.append(max(time_ns, (stamps[-1] if stamps else place.newest_ns) + STEP_NS))
    memory.counter.feed(sequence, len(stamps))
    place.next_sequence, place.newest_ns = sequence + len(stamps), stamps[-1]
    return write_samples(
        sequence=sequence,
        time_ns=stamps,
        device_us=[(received_ns // 1000) + (t - stamps[-1]) // 1000 for t in stamps],
        received_ns=received_ns,
        uncertainty_ns=uncertainty_ns,
        quat=orientations,
    )
