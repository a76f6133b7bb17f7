"""The chip's time: microseconds that are some ppm off and wrap at 2^30, as those of MicroPython's ports do.

Milliseconds are left as they are: the interpreter's own scheduler reads them behind this module's back.
"""

import board
import utime

_WRAP = 1 << 30


def __getattr__(name):
    return getattr(utime, name)


def ticks_us():
    """Return microseconds, modulo 2^30."""
    true = utime.ticks_us()
    return (true + true * board.PPM // 1_000_000 + board.SHIFT_US) % _WRAP


def ticks_diff(end, start):
    """Return end - start of two microseconds, between -2^29 and 2^29, or of two milliseconds."""
    if end >= _WRAP or start >= _WRAP:
        return utime.ticks_diff(end, start)
    return (end - start + _WRAP // 2) % _WRAP - _WRAP // 2
