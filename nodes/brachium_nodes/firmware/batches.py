"""Samples on their way out: batches in memory that is taken once, the oldest dropped first and counted."""

import struct

FIELDS = 4  # magnetometer readings that fit in one batch
_HEAD = 24  # number of the first sample, its time, samples, fields, whether late
_FIRST, _TIME, _SAMPLES, _FIELDS, _LATE = 0, 8, 16, 18, 20


class Batches:
    """A bounded queue of `depth` batches of `size` samples, and the one that is being filled."""

    def __init__(self, size, depth):
        self._size = size
        self._acc, self._gyr = _HEAD + 4 * size, _HEAD + 10 * size
        self._mag, self._at = _HEAD + 16 * size, _HEAD + 16 * size + 6 * FIELDS
        self._step = self._at + 2 * FIELDS
        slots = depth + 2  # with the one that is being filled and the one that is being sent
        self._memory = bytearray(slots * self._step)
        self._free = [slot * self._step for slot in range(slots)]
        self._full = []
        self._open = self._free.pop()
        self.keeping = False  # before the first welcome nobody asks for samples
        self.connected = False
        self.dropped = self.delivered = 0  # samples
        self.wake = None  # called when there is one to send

    def _get(self, slot, where):
        return struct.unpack_from("<H", self._memory, slot + where)[0]

    def _set(self, slot, where, value):
        struct.pack_into("<H", self._memory, slot + where, value)

    def add(self, number, taken, data, first, field=None):
        """Add one sample: number, time in us, 12 bytes of `data` from `first` on, and 6 of `field`."""
        memory, slot = self._memory, self._open
        n = self._get(slot, _SAMPLES)
        if n and number != struct.unpack_from("<Q", memory, slot + _FIRST)[0] + n:
            self.close()
            slot, n = self._open, 0
        if n == 0:
            struct.pack_into("<QQ", memory, slot + _FIRST, number, taken)
        began = struct.unpack_from("<Q", memory, slot + _TIME)[0]
        struct.pack_into("<I", memory, slot + _HEAD + 4 * n, taken - began)
        at = slot + self._acc + 6 * n
        memory[at : at + 6] = data[first : first + 6]
        at = slot + self._gyr + 6 * n
        memory[at : at + 6] = data[first + 6 : first + 12]
        k = self._get(slot, _FIELDS)
        if field is not None and k < FIELDS:
            at = slot + self._mag + 6 * k
            memory[at : at + 6] = field
            self._set(slot, self._at + 2 * k, n)
            self._set(slot, _FIELDS, k + 1)
        self._set(slot, _SAMPLES, n + 1)
        if n + 1 == self._size:
            self.close()

    def close(self):
        """Hand the batch that is being filled over to whoever sends."""
        slot = self._open
        if not self._get(slot, _SAMPLES):
            return
        if not self.keeping:
            self._clear(slot)
            return
        self._set(slot, _LATE, not self.connected)
        self._full.append(slot)
        if not self._free:
            oldest = self._full.pop(0)
            self.dropped += self._get(oldest, _SAMPLES)
            self._give_back(oldest)
        self._open = self._free.pop()
        if self.wake is not None:
            self.wake()

    def _clear(self, slot):
        for where in (_SAMPLES, _FIELDS, _LATE):
            self._set(slot, where, 0)

    def next(self):
        """Return the oldest batch, which is the caller's until `sent` or `unsent`; None without one."""
        return self._full.pop(0) if self._full else None

    def sent(self, slot):
        """Take a batch back that went out."""
        self.delivered += self._get(slot, _SAMPLES)
        self._give_back(slot)

    def _give_back(self, slot):
        self._clear(slot)
        self._free.append(slot)

    def unsent(self, slot):
        """Take a batch back that may not have gone out: it is sent again."""
        self._full.insert(0, slot)

    def lost_connection(self):
        """Take that what is here now can only come late."""
        self.connected = False
        for slot in self._full:
            self._set(slot, _LATE, 1)

    def fill(self, writer, slot):
        """Write a batch as batch/1."""
        n, k, late = self._get(slot, _SAMPLES), self._get(slot, _FIELDS), self._get(slot, _LATE)
        first, began = struct.unpack_from("<QQ", self._memory, slot)
        writer.begin(5 + (2 if k else 0) + late, "batch/1")
        writer.whole("seq", first)
        writer.whole("t", began)
        self._block(writer, "dt", slot + _HEAD, 4 * n)
        self._block(writer, "acc", slot + self._acc, 6 * n)
        self._block(writer, "gyr", slot + self._gyr, 6 * n)
        if k:
            self._block(writer, "mag", slot + self._mag, 6 * k)
            self._block(writer, "mi", slot + self._at, 2 * k)
        if late:
            writer.yes("late")

    def _block(self, writer, name, at, size):
        writer.block(name, memoryview(self._memory)[at : at + size])
