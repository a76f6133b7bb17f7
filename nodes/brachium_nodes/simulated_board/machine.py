"""Pins, bus, converter and watchdog of the emulated board."""

import sys

import board
import chips

_SILENCE_US = 3_200_000


class Pin:
    """A pin by its number."""

    def __init__(self, number):
        self.number = number


class ADC:
    """The converter that sees the battery: its voltage falls evenly."""

    def __init__(self, number):
        about = board.SETTINGS["battery"]
        self._from_us = board.true_us()
        self._full_v, self._fall = about["full_v"], about["fall_v_per_s"]
        self._scale_v = about["full_scale_v"]

    def read_u16(self):
        """Return the voltage, 65535 at full scale."""
        volts = self._full_v - self._fall * 1e-6 * (board.true_us() - self._from_us)
        return max(0, min(65535, int(65535 * volts / self._scale_v)))


class WDT:
    """Notes for how long nobody fed it."""

    def __init__(self):
        self._fed = board.true_us()

    def feed(self):
        """Feed it."""
        now = board.true_us()
        board.COUNTS["longest_unfed_ms"] = max(board.COUNTS["longest_unfed_ms"], (now - self._fed) // 1000)
        self._fed = now
        if board.stopped():
            raise KeyboardInterrupt  # as Ctrl-C on the serial line


def freq(hz):
    """Set the clock of the processor."""


def SoftI2C(scl, sda, freq):
    """Return the bus with the emulated chip on it."""
    return chips.bus()


def I2C(number, scl, sda, freq):
    """Return the bus with the emulated chip on it."""
    return chips.bus()


def deepsleep():
    """End."""
    sys.exit(0)
