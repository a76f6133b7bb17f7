"""What every emulated inertial sensor has: registers, and a FIFO that runs over."""

from collections.abc import Callable

from brachium_nodes.emulated_board.feed import Feed


class BusError(Exception):
    """A transfer failed; `number` is the errno that MicroPython raises."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


ENODEV, EIO = 19, 5


class Chip:
    """A chip with a FIFO of `room` bytes that is filled by the feed, `packet` bytes a sample."""

    def __init__(self, feed: Feed, clock: Callable[[], int], *, who: int, room: int, packet: int) -> None:
        self.feed, self.clock = feed, clock
        self.registers = bytearray(128)
        self.registers[0x75] = who
        self._room, self._packet = room, packet
        self._first = self._end = 0  # numbers of the samples in the FIFO
        self._part = 0  # bytes of the first one that are read
        self.gathers = False
        self._begun_us: int | None = None
        self.lost = False
        self.overflows = 0

    def packet(self, sample: bytes) -> bytes:
        """Return what the FIFO holds of a sample."""
        raise NotImplementedError

    def fetch(self, address: int, register: int, size: int) -> bytes:
        """Read registers. Raises BusError."""
        raise NotImplementedError

    def store(self, address: int, register: int, value: int) -> None:
        """Write a register. Raises BusError."""
        raise NotImplementedError

    def gather(self) -> None:
        """Fill the FIFO up to now; the oldest samples fall out when there is no room."""
        if not self.gathers:
            return
        self._end = max(self._end, self.feed.due())
        if self.size() > self._room:
            self._first = self._end - self._room // self._packet - 1
            self._part = (self._end - self._first) * self._packet - self._room
            self.overflows += not self.lost
            self.lost = True

    def switch(self, on: bool) -> None:
        """Begin to gather from now on, or stop; either way the FIFO is empty then."""
        self._first = self._end = self.feed.due() if on else 0
        self.gathers, self._part, self.lost = on, 0, False
        if on and self._begun_us is None:
            self._begun_us = self.clock()

    def worked_us(self) -> int:
        """Return how long ago it first began to gather; 0 before."""
        return 0 if self._begun_us is None else self.clock() - self._begun_us

    def size(self) -> int:
        """Return how many bytes the FIFO holds."""
        return (self._end - self._first) * self._packet - self._part

    def drain(self, size: int) -> bytes:
        """Read bytes out of the FIFO; where there are none the bus reads ones."""
        got = bytearray()
        while len(got) < size and self.size():
            piece = self.packet(self.feed.sample(self._first))[self._part :][: size - len(got)]
            got += piece
            self._part += len(piece)
            if self._part == self._packet:
                self._first, self._part = self._first + 1, 0
        return bytes(got).ljust(size, b"\xff")
