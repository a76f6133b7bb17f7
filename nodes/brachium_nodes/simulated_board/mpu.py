"""MPU-9150 and MPU-9250 as their register maps show them, each with its magnetometer."""

import struct

import board
from chips import ENODEV, Chip


class Mpu(Chip):
    """MPU-9150 with AK8975, or MPU-9250 with AK8963: single measurements that take `field_us`."""

    def __init__(self):
        old = board.SETTINGS["chip"] == "MPU-9150"
        super().__init__(0x68 if old else 0x71, 1024 if old else 512, 12)
        self._measure = 0x01 if old else 0x11
        self._compass = bytearray(20)
        self._compass[0] = 0x48
        self._compass[16:19] = bytes(board.SETTINGS["field_adjust"])
        self._measuring = self._measured = None
        self._registers[0x6B] = 0x40
        self._reset_us = None

    def packet(self, sample):
        """Return what the FIFO holds of a sample."""
        return memoryview(sample)[:12]

    def fetch(self, address, register, data):
        """Read registers."""
        if address == 0x0C and self._registers[0x37] & 2:
            return self._fetch_compass(register, data)
        if address != 0x68:
            raise OSError(ENODEV)
        self.gather()
        if self._reset_us is not None and board.true_us() - self._reset_us > 5000:
            self._registers[0x6B], self._reset_us = 0x40, None
        if register == 0x74:
            return self.drain(data)
        struct.pack_into(">H", self._registers, 0x72, self.size())
        self._registers[0x3A] = 0x10 if self._lost else 0
        data[:] = self._registers[register : register + len(data)]
        return None

    def store(self, address, register, value):
        """Write a register."""
        registers = self._registers
        if address == 0x0C and registers[0x37] & 2:
            if register == 0x0A:
                self._compass[10] = value
                self._measuring = board.true_us() if value == self._measure else None
                self._measured = self._feed.due()  # the sample that is taken while it measures
            return
        if address != 0x68:
            raise OSError(ENODEV)
        if register == 0x6B and value & 0x80:
            who = registers[0x75]
            self._registers = bytearray(128)
            self._registers[0x75], self._registers[0x6B] = who, 0xC0
            self._reset_us = board.true_us()
            self.switch(False)
            return
        registers[register] = value
        if register in (0x23, 0x6A):
            gathers = registers[0x23] == 0x78 and registers[0x6A] & 0x40 and not registers[0x6B] & 0x40
            if (value & 4 and register == 0x6A) or not gathers:
                self.switch(False)
                registers[0x6A] &= 0xFB
            elif self._first is None:
                rate_hz = 1000 / (1 + registers[0x19])
                if rate_hz != self._feed.rate_hz:
                    raise RuntimeError("configured for %s Hz, fed with %s" % (rate_hz, self._feed.rate_hz))
                self.switch(True)

    def _fetch_compass(self, register, data):
        compass = self._compass
        if self._measuring is not None and board.true_us() - self._measuring >= board.SETTINGS["field_us"]:
            compass[3:9] = self._feed.sample(self._measured)[12:18]
            compass[2], compass[10], self._measuring = 1, 0, None
        adjust = 16 <= register and compass[10] != 0x0F
        data[:] = bytes(len(data)) if adjust else compass[register : register + len(data)]
        if register + len(data) > 3 and register < 9:
            compass[2] = 0
