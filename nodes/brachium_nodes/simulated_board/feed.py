"""What the emulated person's sensor measures: a file of samples, each at its own true time.

A sample is 18 bytes: acceleration and angular rate as the chip's registers hold them (6 x i16, big-endian),
and the magnetic field as the magnetometer's do (3 x i16, little-endian). Before the first sample the person
stands as in it; after the last one as in that.
"""

import board

SAMPLE = 18


class Feed:
    """The samples of one sensor, by number; number 0 is taken at `start_us` of true time."""

    def __init__(self):
        about = board.SETTINGS["feed"]
        self._file = open(about["path"], "rb")
        self._last = -1
        self._start_us, self._period_ns = about["start_us"], about["period_ns"]
        self.rate_hz = about["rate_hz"]
        self._sample = bytearray(SAMPLE)

    def due(self):
        """Return the number of the next sample: all before it were taken by now."""
        return self.since_us() * 1000 // self._period_ns + 1

    def since_us(self):
        """Return the time since number 0."""
        return board.true_us() - self._start_us

    def sample(self, number):
        """Return 18 bytes, valid until the next call."""
        if number > self._last:
            self._last = self._file.seek(0, 2) // SAMPLE - 1  # the file may have grown
        self._file.seek(SAMPLE * max(0, min(number, self._last)))
        self._file.readinto(self._sample)
        return self._sample
