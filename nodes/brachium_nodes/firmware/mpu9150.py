"""MPU-9150 and MPU-9250: inertial sensor with FIFO, and the AK8975 or AK8963 magnetometer behind it.

Registers and figures are those of the makers' register maps. Every driver has the same few names: chip,
big_endian, magnetometer, acc_step, gyr_step, mag_step, room (samples that fit in the FIFO), at_once (samples
that one transfer brings), start, empty, gathered, read and field; in all of these the bus may raise OSError.
"""

import struct
import time

CHIPS = {0x68: "MPU-9150", 0x71: "MPU-9250", 0x73: "MPU-9255"}
_COMPASS = 0x0C
_COMPASS_ID = 0x48
_SAMPLE = 12
_LOST_START_MS = 50  # a measurement takes 9 ms at most: what takes longer was never begun


class Driver:
    """One chip on a bus that has machine.I2C's methods."""

    big_endian = True
    magnetometer = True
    acc_step = 9.80665 / 4096  # m/s^2, at 8 g
    gyr_step = 0.017453293 / 16.4  # rad/s, at 2000 deg/s
    at_once = 16

    def __init__(self, bus, address, who):
        self._bus, self._address, self.chip = bus, address, CHIPS[who]
        self._old = self.chip == "MPU-9150"
        self._size = 1024 if self._old else 512
        self.room = self._size // _SAMPLE
        self._one, self._two = bytearray(1), bytearray(2)
        self._compass = bytearray(8)  # ST1, three axes, ST2
        self._begun = 0
        self.mag_step = (0.3, 0.3, 0.3)

    def start(self, rate_hz):
        """Reset and configure the chip; return the rate in Hz that it will really have, by its data sheet."""
        self._write(0x6B, 0x80)
        for _ in range(50):
            time.sleep_ms(2)
            if not self._read(0x6B) & 0x80:
                break
        else:
            raise OSError("the reset does not end")
        self._write(0x6B, 0x01)  # the gyroscope's oscillator: the chip's own is worse
        time.sleep_ms(10)
        divider = max(0, round(1000 / rate_hz) - 1)
        self._write(0x1A, 3 if rate_hz > 60 else 4)  # low-pass at 42 or 20 Hz
        self._write(0x19, divider)
        self._write(0x1B, 3 << 3)
        self._write(0x1C, 2 << 3)
        if not self._old:
            self._write(0x1D, 3 if rate_hz > 60 else 4)
        self._write(0x6A, 0)
        self._write(0x37, 0x02)  # the magnetometer answers on this bus
        self._start_compass()
        self.empty()
        return 1000 / (divider + 1)

    def empty(self):
        """Throw away what has gathered; from now on whole samples gather."""
        self._write(0x23, 0)
        self._write(0x6A, 0x04)
        self._write(0x6A, 0x40)
        self._write(0x23, 0x78)
        self._read(0x3A)

    def gathered(self):
        """Return how many samples wait, or -1 when some were lost: then call `empty`."""
        self._bus.readfrom_mem_into(self._address, 0x72, self._two)
        (size,) = struct.unpack(">H", self._two)
        if size > self._size - _SAMPLE or size % _SAMPLE:
            return -1  # full, or a broken transfer has left part of a sample
        return size // _SAMPLE

    def read(self, into):
        """Fill `into` with the oldest samples, 12 bytes each as in the registers: acceleration, rate.

        At most `at_once`, for what one transfer has taken out a refused second one would lose.
        """
        self._bus.readfrom_mem_into(self._address, 0x74, into)

    def field(self, into):
        """Fill 6 bytes with a new reading in the accelerometer's axes; return whether there was one.

        It was taken when the last call ended: each call has the chip measure once.
        """
        seen = self._compass
        self._bus.readfrom_mem_into(_COMPASS, 0x02, seen)
        if not seen[0] & 1:
            if time.ticks_diff(time.ticks_ms(), self._begun) > _LOST_START_MS:
                self._begin()
            return False
        x, y, z = struct.unpack("<hhh", memoryview(seen)[1:7])
        good = not seen[7] & (0x0C if self._old else 0x08)
        self._begin()
        struct.pack_into(">hhh", into, 0, y, x, -z if z > -32768 else 32767)
        return good

    def _start_compass(self):
        if self._read(0x00, _COMPASS) != _COMPASS_ID:
            raise OSError("the magnetometer does not answer")
        self._write(0x0A, 0x0F, _COMPASS)  # the factory's adjustment can be read
        time.sleep_ms(1)
        x, y, z = self._bus.readfrom_mem(_COMPASS, 0x10, 3)
        self._write(0x0A, 0x00, _COMPASS)
        time.sleep_ms(1)
        step = 0.3 if self._old else 0.15
        self.mag_step = tuple(step * ((adjust - 128) / 256 + 1) for adjust in (y, x, z))
        self._begin()

    def _begin(self):
        self._write(0x0A, 0x01 if self._old else 0x11, _COMPASS)  # once; 16 bits
        self._begun = time.ticks_ms()

    def _read(self, register, address=None):
        self._bus.readfrom_mem_into(address or self._address, register, self._one)
        return self._one[0]

    def _write(self, register, value, address=None):
        self._one[0] = value
        self._bus.writeto_mem(address or self._address, register, self._one)
