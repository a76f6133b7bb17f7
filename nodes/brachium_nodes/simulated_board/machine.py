"""Pins, bus, converter and watchdog of the emulated board."""

import sys

import board


class Pin:
    """A pin by its number."""

    def __init__(self, number):
        pass


class ADC:
    """The converter that sees the battery."""

    def __init__(self, number):
        self._two = bytearray(2)

    def read_u16(self):
        """Return the voltage, 65535 at full scale."""
        board.ask(97, into=self._two)
        return self._two[0] | self._two[1] << 8


class WDT:
    """The watchdog; it barks on the board's side."""

    def __init__(self):
        self._one = bytearray(1)

    def feed(self):
        """Feed it."""
        board.ask(102, into=self._one)
        if self._one[0]:
            raise KeyboardInterrupt  # as Ctrl-C on the serial line


class SoftI2C:
    """The bus with the emulated chip on it."""

    def __init__(self, scl, sda, freq):
        pass

    def readfrom_mem(self, address, register, size):
        """Return `size` bytes."""
        data = bytearray(size)
        self.readfrom_mem_into(address, register, data)
        return data

    def readfrom_mem_into(self, address, register, data):
        """Fill `data`, or raise OSError before anything was read."""
        board.ask(114, address, register, len(data), data)

    def writeto_mem(self, address, register, data):
        """Write, or raise OSError before anything was written."""
        board.ask(119, address, register, data[0])


def I2C(number, scl, sda, freq):
    """Return the bus with the emulated chip on it."""
    return SoftI2C(scl, sda, freq)


def freq(hz):
    """Set the clock of the processor."""


def unique_id():
    """Return the chip's own number."""
    return b"\xe5\x3f\x21"


def reset():
    """Start anew."""
    board.ask(122)
    sys.exit(0)


def deepsleep():
    """End."""
    sys.exit(0)
