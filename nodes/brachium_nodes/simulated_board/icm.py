"""ICM-42688-P as its register map shows it."""

import struct

from chips import ENODEV, Chip


_RATES = {0x7: 200, 0x8: 100, 0x9: 50, 0xA: 25}


class Icm(Chip):
    """ICM-42688-P."""

    def __init__(self):
        super().__init__(0x47, 2048, 16)
        self._made = bytearray(16)
        self._made[0] = 0x68

    def packet(self, sample):
        """Return what the FIFO holds of a sample."""
        self._made[1:13] = sample[:12]
        return self._made

    def fetch(self, address, register, data):
        """Read registers."""
        if address != 0x68:
            raise OSError(ENODEV)
        self.gather()
        if register == 0x30:
            return self.drain(data)
        struct.pack_into(">H", self._registers, 0x2E, self.size())
        data[:] = self._registers[register : register + len(data)]
        return None

    def store(self, address, register, value):
        """Write a register."""
        if address != 0x68:
            raise OSError(ENODEV)
        registers = self._registers
        if register == 0x11:
            self._registers = bytearray(128)
            self._registers[0x75] = 0x47
            return self.switch(False)
        registers[register] = value
        if register == 0x4B and value & 2 and self._first is not None:
            self.switch(True)
        elif self._first is None and registers[0x16] == 0x40 and registers[0x4E] == 0x0F:
            rates = _RATES[registers[0x4F] & 15], _RATES[registers[0x50] & 15]
            if rates != (self._feed.rate_hz, self._feed.rate_hz) or registers[0x5F] & 3 != 3:
                raise RuntimeError("configured for %s Hz, fed with %s" % (rates, self._feed.rate_hz))
            self.switch(True)
        return None
