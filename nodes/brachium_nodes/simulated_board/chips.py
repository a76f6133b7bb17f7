"""Inertial sensors as their registers show them, on a bus that sometimes refuses: machine.I2C's methods."""

import random
import time

import board
from feed import Feed

ENODEV, EIO = 19, 5


def bus():
    """Return the bus with the chip that the settings name."""
    if board.SETTINGS["chip"] == "ICM-42688-P":
        from icm import Icm

        return Icm()
    from mpu import Mpu

    return Mpu()


class Chip:
    """A chip with a FIFO of `room` bytes that is filled by the feed, and nothing else on the bus."""

    def __init__(self, who, room, packet):
        self._feed = Feed()
        self._registers = bytearray(128)
        self._registers[0x75] = who
        self._room, self._packet = room, packet
        self._stall_us = board.SETTINGS["stall_us"]
        self._refusals = board.SETTINGS["refusals"]
        self._first = self._end = None  # numbers of the samples in the FIFO; None: it is off
        self._part = 0  # bytes of the first one that are read
        self._lost = False

    def readfrom_mem(self, address, register, size):
        """Return `size` bytes."""
        data = bytearray(size)
        self.readfrom_mem_into(address, register, data)
        return data

    def readfrom_mem_into(self, address, register, data):
        """Fill `data`, or raise OSError before anything was read."""
        self._refuse()
        self.fetch(address, register, data)

    def writeto_mem(self, address, register, data):
        """Write, or raise OSError before anything was written."""
        self._refuse()
        self.store(address, register, data[0])

    def _refuse(self):
        if self._stall_us is not None and self._feed.since_us() >= self._stall_us:
            self._stall_us = None
            time.sleep_ms(board.SETTINGS["stall_ms"])
        board.COUNTS["transactions"] += 1
        board.note_heap()
        if self._refusals and random.random() < self._refusals:
            board.COUNTS["refused"] += 1
            raise OSError(EIO)

    def gather(self):
        """Fill the FIFO up to now; the oldest samples fall out when there is no room."""
        if self._first is None:
            return
        self._end = max(self._end, self._feed.due())
        if (self._end - self._first) * self._packet - self._part > self._room:
            self._first = self._end - self._room // self._packet - 1
            self._part = (self._end - self._first) * self._packet - self._room
            if not self._lost:
                board.COUNTS["overflows"] += 1
            self._lost = True

    def switch(self, on):
        """Begin to gather from now on, or stop; either way the FIFO is empty then."""
        self._first = self._end = self._feed.due() if on else None
        self._part, self._lost = 0, False

    def size(self):
        """Return how many bytes the FIFO holds."""
        return 0 if self._first is None else (self._end - self._first) * self._packet - self._part

    def drain(self, data):
        """Read bytes out of the FIFO."""
        at, size = 0, len(data)
        while at < size and self.size():
            whole = self.packet(self._feed.sample(self._first))
            now = min(size - at, self._packet - self._part)
            data[at : at + now] = whole[self._part : self._part + now]
            at += now
            self._part += now
            if self._part == self._packet:
                self._first, self._part = self._first + 1, 0
        while at < size:
            data[at] = 0xFF
            at += 1
