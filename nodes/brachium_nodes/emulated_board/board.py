"""A chip's surroundings, asked by the interpreter that runs its firmware: bus, converter, watchdog, radio.

A question is 4 bytes: a letter, and three numbers. The answer is one byte, 0 or the errno that the firmware
is to see, and after a 0 what was asked for. The interpreter waits for it, as a chip waits for its bus.
"""

import random
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from brachium_nodes.emulated_board.cell import Cell
from brachium_nodes.emulated_board.chip import EIO, ENODEV, BusError, Chip
from brachium_nodes.emulated_board.feed import Feed, FeedSettings
from brachium_nodes.emulated_board.icm import Icm
from brachium_nodes.emulated_board.mpu import Mpu
from brachium_nodes.emulated_board.settings import BoardSettings

QUESTION = 4


@dataclass(kw_only=True)
class Counts:
    """What happened on the board, for the report."""

    transactions: int = 0
    refused: int = 0
    """Transfers that the bus refused."""
    overflows: int = 0
    """How often the sensor's FIFO ran over."""
    longest_unfed_ms: int = 0
    """The longest that the watchdog waited."""
    restarts: int = 0
    """How often the firmware started the chip anew."""
    heap_size: int = 0
    """Bytes of the interpreter's memory for objects."""
    heap_peak: int = 0
    """Of these, in use at most, garbage included."""
    heap_shim: int = 0
    """Of these, what stands for the chip's own modules: machine, network, socket and time."""


def chip_of(board: BoardSettings, feed: Feed, clock: Callable[[], int]) -> Chip:
    """Return the chip that the settings name."""
    if board.chip == "ICM-42688-P":
        return Icm(feed, clock)
    old = board.chip == "MPU-9150"
    return Mpu(feed, clock, old=old, field_us=board.field_us, adjust=board.field_adjust)


@dataclass(kw_only=True)
class Board:
    """Answers questions; `clock` is true time in us, `pause` waits for ms."""

    settings: BoardSettings
    feed: FeedSettings
    clock: Callable[[], int]
    pause: Callable[[int], None]
    counts: Counts = field(default_factory=Counts)
    stopped: bool = False
    """The host wants an end: the firmware is interrupted as by Ctrl-C when it next feeds its watchdog."""

    def __post_init__(self) -> None:
        """Switch on."""
        self._feed = Feed(self.feed, self.clock)
        self._cell = Cell(self.settings.cell)
        self._random = random.Random(self.feed.start_us)
        self._drained_us = self.clock()
        self._stall_us = self.settings.stall_us
        self.reset()

    def reset(self) -> None:
        """Start the chip anew; the cell stays as empty as it is."""
        self.chip = chip_of(self.settings, self._feed, self.clock)
        self._fed_us: int | None = None

    def answer(self, question: bytes) -> bytes:
        """Return the answer to one question."""
        kind, first, second, third = struct.unpack("cBBB", question)
        try:
            return b"\0" + self._ask(kind, first, second, third)
        except BusError as error:
            return bytes([error.number])

    def _ask(self, kind: bytes, first: int, second: int, third: int) -> bytes:
        match kind:
            case b"r":
                return self._fetch(first, second, third)
            case b"w":
                return self._store(first, second, third)
            case b"a":
                return self._converter()
            case b"f":
                return self._watchdog()
            case b"s":
                return struct.pack("b", self.settings.rssi_dbm)
            case _:
                raise BusError(ENODEV)

    @property
    def watched(self) -> bool:
        """Return whether a watchdog runs."""
        return self._fed_us is not None

    def note(self, peak: int, shim: int, size: int) -> None:
        """Take what the interpreter says of its memory as it ends."""
        counts = self.counts
        counts.heap_peak = max(counts.heap_peak, peak)
        counts.heap_shim, counts.heap_size = shim, size

    def report(self) -> Counts:
        """Return what happened so far."""
        self.counts.overflows = self.chip.overflows
        return self.counts

    def _fetch(self, address: int, register: int, size: int) -> bytes:
        self._refuse()
        return self.chip.fetch(address, register, size)

    def _store(self, address: int, register: int, value: int) -> bytes:
        self._refuse()
        self.chip.store(address, register, value)
        return b""

    def _refuse(self) -> None:
        settings = self.settings
        if self._stall_us is not None and self.chip.worked_us() >= self._stall_us:
            self._stall_us = None
            self.pause(settings.stall_ms)
        self.counts.transactions += 1
        if settings.refusals and self._random.random() < settings.refusals:
            self.counts.refused += 1
            raise BusError(EIO)

    def _converter(self) -> bytes:
        now, cell = self.clock(), self.settings.cell
        self._cell.drain(1e-6 * (now - self._drained_us))
        self._drained_us = now
        volts = self._random.gauss(self._cell.volts(), cell.noise_v)
        return struct.pack("<H", max(0, min(65535, round(65535 * volts / cell.full_scale_v))))

    def _watchdog(self) -> bytes:
        now = self.clock()
        if self._fed_us is not None:
            waited = (now - self._fed_us) // 1000
            self.counts.longest_unfed_ms = max(self.counts.longest_unfed_ms, waited)
        self._fed_us = now
        return bytes([self.stopped])


def true_us() -> int:
    """Return the host's monotonic clock, us."""
    return time.monotonic_ns() // 1000


def pause_ms(milliseconds: int) -> None:
    """Wait."""
    time.sleep(1e-3 * milliseconds)
