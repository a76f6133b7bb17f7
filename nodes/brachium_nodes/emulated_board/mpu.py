"""MPU-9150 and MPU-9250 as their register maps show them, each with its magnetometer."""

import struct
from collections.abc import Callable

from brachium_nodes.emulated_board.chip import ENODEV, BusError, Chip
from brachium_nodes.emulated_board.feed import Feed

_ADDRESS, _COMPASS, _COMPASS_ID = 0x68, 0x0C, 0x48
_RESET_US = 5000


class Mpu(Chip):
    """MPU-9150 with AK8975, or MPU-9250 with AK8963: single measurements that take `field_us`."""

    def __init__(
        self, feed: Feed, clock: Callable[[], int], *, old: bool, field_us: int, adjust: tuple[int, ...]
    ) -> None:
        super().__init__(feed, clock, who=0x68 if old else 0x71, room=1024 if old else 512, packet=12)
        self._measure = 0x01 if old else 0x11
        self._field_us = field_us
        self._compass = bytearray(20)
        self._compass[0] = _COMPASS_ID
        self._compass[16:19] = bytes(adjust)
        self._measuring: int | None = None
        self._measured = 0
        self.registers[0x6B] = 0x40
        self._reset_us: int | None = None

    def packet(self, sample: bytes) -> bytes:
        """Return what the FIFO holds of a sample."""
        return sample[:12]

    def fetch(self, address: int, register: int, size: int) -> bytes:
        """Read registers."""
        if address == _COMPASS and self.registers[0x37] & 2:
            return self._fetch_compass(register, size)
        if address != _ADDRESS:
            raise BusError(ENODEV)
        self.gather()
        if self._reset_us is not None and self.clock() - self._reset_us > _RESET_US:
            self.registers[0x6B], self._reset_us = 0x40, None
        if register == 0x74:
            return self.drain(size)
        struct.pack_into(">H", self.registers, 0x72, self.size())
        self.registers[0x3A] = 0x10 if self.lost else 0
        return bytes(self.registers[register : register + size])

    def store(self, address: int, register: int, value: int) -> None:
        """Write a register."""
        if address == _COMPASS and self.registers[0x37] & 2:
            if register == 0x0A:
                self._compass[10] = value
                self._measuring = self.clock() if value == self._measure else None
                self._measured = self.feed.due()  # the sample that is taken while it measures
            return
        if address != _ADDRESS:
            raise BusError(ENODEV)
        if register == 0x6B and value & 0x80:
            who = self.registers[0x75]
            self.registers = bytearray(128)
            self.registers[0x75], self.registers[0x6B] = who, 0xC0
            self._reset_us = self.clock()
            self.switch(False)
            return
        self.registers[register] = value
        if register in (0x23, 0x6A):
            self._set_fifo(restart=register == 0x6A and bool(value & 4))

    def _set_fifo(self, *, restart: bool) -> None:
        registers = self.registers
        wanted = registers[0x23] == 0x78 and registers[0x6A] & 0x40 and not registers[0x6B] & 0x40
        if restart or not wanted:
            self.switch(False)
            registers[0x6A] &= 0xFB
        elif not self.gathers:
            rate_hz = 1000 / (1 + registers[0x19])
            if rate_hz != self.feed.rate_hz:
                raise RuntimeError(f"configured for {rate_hz:g} Hz, fed with {self.feed.rate_hz:g}")
            self.switch(True)

    def _fetch_compass(self, register: int, size: int) -> bytes:
        compass = self._compass
        if self._measuring is not None and self.clock() - self._measuring >= self._field_us:
            compass[3:9] = self.feed.sample(self._measured)[12:18]
            compass[2], compass[10], self._measuring = 1, 0, None
        hidden = register >= 16 and compass[10] != 0x0F
        data = bytes(size) if hidden else bytes(compass[register : register + size])
        if register + size > 3 and register < 9:
            compass[2] = 0
        return data
