"""ICM-42688-P as its register map shows it."""

import struct
from collections.abc import Callable

from brachium_nodes.emulated_board.chip import ENODEV, BusError, Chip
from brachium_nodes.emulated_board.feed import Feed

_ADDRESS, _WHO = 0x68, 0x47
_RATES = {0x7: 200, 0x8: 100, 0x9: 50, 0xA: 25}


class Icm(Chip):
    """ICM-42688-P."""

    def __init__(self, feed: Feed, clock: Callable[[], int]) -> None:
        super().__init__(feed, clock, who=_WHO, room=2048, packet=16)

    def packet(self, sample: bytes) -> bytes:
        """Return what the FIFO holds of a sample."""
        return b"\x68" + sample[:12] + bytes(3)

    def fetch(self, address: int, register: int, size: int) -> bytes:
        """Read registers."""
        if address != _ADDRESS:
            raise BusError(ENODEV)
        self.gather()
        if register == 0x30:
            return self.drain(size)
        struct.pack_into(">H", self.registers, 0x2E, self.size())
        return bytes(self.registers[register : register + size])

    def store(self, address: int, register: int, value: int) -> None:
        """Write a register."""
        if address != _ADDRESS:
            raise BusError(ENODEV)
        if register == 0x11:
            self.registers = bytearray(128)
            self.registers[0x75] = _WHO
            self.switch(False)
            return
        registers = self.registers
        registers[register] = value
        if register == 0x4B and value & 2 and self.gathers:
            self.switch(True)
        elif not self.gathers and registers[0x16] == 0x40 and registers[0x4E] == 0x0F:
            rates = {_RATES.get(registers[at] & 15) for at in (0x4F, 0x50)}
            if rates != {self.feed.rate_hz} or registers[0x5F] & 3 != 3:
                raise RuntimeError(f"configured for {rates} Hz, fed with {self.feed.rate_hz:g}")
            self.switch(True)
