"""What stands for a node: its packets and when they are due, and the time at which it runs."""

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_nodes.node_frames import Batch, Hello, NodeStatus
from brachium_wire.messages import Quaternion, SensorCalibration

LOOK_S = 0.05

Stop = threading.Event


@dataclass(frozen=True, slots=True, eq=False)
class Outgoing:
    """One packet, due at `due_s` of the source's time; its samples were taken at `times_s` (n,)."""

    due_s: float
    batch: Batch
    times_s: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NodeStream:
    """One node: what it says of itself, and its packets in the order in which they arrive."""

    subject: str
    segment: str
    hello: Hello
    mounting: Quaternion | None
    packets: Iterator[Outgoing]
    clock_us: Callable[[float], int]
    """What the node's clock shows at a source time in s; linear."""
    says: Callable[[float], NodeStatus] = lambda _time_s: NodeStatus()
    """What the node says of itself at a source time in s; nothing by default."""
    store: Callable[[SensorCalibration], None] = lambda _calibration: None
    """Keeps a calibration for when the node is switched on again; by default it is gone then."""


@dataclass(slots=True, kw_only=True)
class StreamCount:
    """What was sent of one stream, in samples. A gateway that received everything counts the same."""

    sent: int = 0
    """Each sample once, however often it was sent."""
    lost: int = 0
    """Left out before the last one sent."""
    swapped: int = 0
    """Sent after a later one."""
    duplicated: int = 0
    """Sent again."""
    next_sequence: int = 0
    dropped: int = 0
    """Of the lost ones, those that had no connection."""


class Timeline:
    """The source's time against this process's monotonic clock."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._made_ns = self.start_ns = time.monotonic_ns()
        """`start_ns`: reading of the monotonic clock at source time 0."""

    def start(self) -> None:
        """Let source time 0 be now."""
        self.start_ns = time.monotonic_ns()

    @property
    def begun(self) -> bool:
        """Whether source time 0 was set, and is over."""
        return self._made_ns < self.start_ns <= time.monotonic_ns()

    @property
    def lead_s(self) -> float:
        """Seconds that passed before source time 0."""
        return (self.start_ns - self._made_ns) * 1e-9 * self.speed

    def elapsed_s(self) -> float:
        """Return the seconds since the timeline was made."""
        return (time.monotonic_ns() - self._made_ns) * 1e-9 * self.speed

    def now_s(self) -> float:
        """Return source time."""
        return (time.monotonic_ns() - self.start_ns) * 1e-9 * self.speed

    async def reach(self, due_s: float, stop: Stop) -> bool:
        """Wait until source time `due_s`; return False when `stop` came first.

        Whoever is late still lets the others have their turn, so all are late alike.
        """
        while not stop.is_set():
            wait_s = max((due_s - self.now_s()) / self.speed, 0.0)
            await asyncio.sleep(min(wait_s, LOOK_S))
            if wait_s <= LOOK_S:
                return not stop.is_set()
        return False


class Counting:
    """Counts what is sent, packet by packet."""

    def __init__(self) -> None:
        self.count = StreamCount()
        self._seen: dict[int, None] = {}

    def sent(self, sequence: int, samples: int) -> None:
        """Count a packet that was handed over."""
        c = self.count
        if sequence in self._seen:
            c.duplicated += samples
            return
        self._seen[sequence] = None
        while len(self._seen) > 1024:
            del self._seen[next(iter(self._seen))]
        c.sent += samples
        if sequence >= c.next_sequence:
            c.lost += sequence - c.next_sequence
            c.next_sequence = sequence + samples
        else:
            c.swapped += samples
            c.lost -= samples
