"""ICM-42688-P: a quieter inertial sensor with FIFO and no magnetometer. The same names as every driver."""

import struct
import time

CHIPS = {0x47: "ICM-42688-P"}
_RATES = ((200, 0x7), (100, 0x8), (50, 0x9), (25, 0xA))
_PACKET = 16  # header, acceleration, rate, temperature, time stamp
_SIZE = 2048


class Driver:
    """One chip on a bus that has machine.I2C's methods."""

    big_endian = True
    magnetometer = False
    acc_step = 9.80665 / 4096  # m/s^2, at 8 g
    gyr_step = 0.017453293 / 16.4  # rad/s, at 2000 deg/s
    mag_step = None
    room = _SIZE // _PACKET
    at_once = 8

    def __init__(self, bus, address, who):
        self._bus, self._address, self.chip = bus, address, CHIPS[who]
        self._one, self._two, self._packets = bytearray(1), bytearray(2), bytearray(self.at_once * _PACKET)

    def start(self, rate_hz):
        """Reset and configure the chip; return the rate in Hz that it will really have, by its data sheet."""
        rate, code = min(_RATES, key=lambda known: abs(known[0] - rate_hz))
        self._write(0x11, 0x01)
        time.sleep_ms(5)
        self._write(0x4F, code)
        self._write(0x50, (1 << 5) | code)
        self._write(0x5F, 0x03)  # acceleration and rate go to the FIFO
        self._write(0x4E, 0x0F)
        time.sleep_ms(1)  # no register may be written while the sensors start
        self._write(0x16, 0x40)
        self.empty()
        return rate

    def empty(self):
        """Throw away what has gathered; from now on whole samples gather."""
        self._write(0x4B, 0x02)
        time.sleep_ms(1)
        self._read(0x2D)

    def gathered(self):
        """Return how many samples wait, or -1 when some were lost: then call `empty`."""
        self._bus.readfrom_mem_into(self._address, 0x2E, self._two)
        (size,) = struct.unpack(">H", self._two)
        if size > _SIZE - _PACKET or size % _PACKET:
            return -1
        return size // _PACKET

    def read(self, into):
        """Fill `into` with the oldest samples, 12 bytes each as in the registers: acceleration, rate."""
        packets, count = self._packets, len(into) // 12
        self._bus.readfrom_mem_into(self._address, 0x30, memoryview(packets)[: count * _PACKET])
        for i in range(count):
            into[12 * i : 12 * i + 12] = packets[i * _PACKET + 1 : i * _PACKET + 13]

    def field(self, into):  # noqa: ARG002 (as every driver)
        """There is no magnetometer."""
        return False

    def _read(self, register):
        self._bus.readfrom_mem_into(self._address, register, self._one)
        return self._one[0]

    def _write(self, register, value):
        self._one[0] = value
        self._bus.writeto_mem(self._address, register, self._one)
