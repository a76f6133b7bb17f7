"""As much MessagePack as a node needs: maps written into one buffer that is kept, small maps read."""

import struct


class Writer:
    """Writes one map after another into the same memory, behind room for a frame's header."""

    def __init__(self, size, room):
        self.buffer = bytearray(room + size)
        self.room = self.end = room

    def begin(self, fields, kind):
        """Begin a map with so many fields, its `m` not counted."""
        self.end = self.room
        self._pack("B", 0x80 | (fields + 1))
        self.text("m", kind)

    def _pack(self, form, *values):
        struct.pack_into(form, self.buffer, self.end, *values)
        self.end += struct.calcsize(form)

    def _word(self, text):
        data = text.encode()
        if len(data) < 32:
            self._pack("B", 0xA0 | len(data))
        else:
            self._pack("BB", 0xD9, len(data))
        self._raw(data)

    def _raw(self, data):
        self.buffer[self.end : self.end + len(data)] = data
        self.end += len(data)

    def text(self, key, value):
        """Write a field of text, of at most 255 bytes."""
        self._word(key)
        self._word(value)

    def whole(self, key, value):
        """Write a field that is a whole number, 0 or more."""
        self._word(key)
        if value < 0x80:
            self._pack("B", value)
        elif value < 0x10000:
            self._pack(">BH", 0xCD, value)
        elif value < 0x100000000:
            self._pack(">BI", 0xCE, value)
        else:
            self._pack(">BII", 0xCF, value >> 32, value & 0xFFFFFFFF)

    def real(self, key, value):
        """Write a field that is a number."""
        self._word(key)
        self._pack(">Bf", 0xCA, value)

    def yes(self, key):
        """Write a field that is true."""
        self._word(key)
        self._pack("B", 0xC3)

    def block(self, key, data):
        """Write a field of bytes."""
        self._word(key)
        self._pack(">BH", 0xC5, len(data))
        self._raw(data)

    def group(self, key, fields):
        """Begin a field that is a map of its own."""
        self._word(key)
        self._pack("B", 0x80 | fields)

    def reals(self, key, values):
        """Write a field that is a row of numbers, or rows of rows."""
        self._word(key)
        self._row(values)

    def _row(self, values):
        self._pack("B", 0x90 | len(values))
        for value in values:
            if isinstance(value, (list, tuple)):
                self._row(value)
            else:
                self._pack(">Bf", 0xCA, value)


_DEEPEST = 6  # maps and lists within one another


def read_map(message):
    """Return a message's map, or {} for what is none."""
    try:
        value, end = _read(message, 0, 0)
    except (ValueError, IndexError, TypeError):
        return {}
    return value if isinstance(value, dict) and end == len(message) else {}


def _read(data, at, depth):
    kind = data[at]
    at += 1
    if kind < 0x80:
        return kind, at
    if kind >= 0xE0:
        return kind - 256, at
    if kind < 0x90 and depth < _DEEPEST:
        values = {}
        for _ in range(kind & 15):
            key, at = _read(data, at, _DEEPEST)
            values[key], at = _read(data, at, depth + 1)
        return values, at
    if kind < 0xA0 and depth < _DEEPEST:  # in a field that is not known here
        values = []
        for _ in range(kind & 15):
            value, at = _read(data, at, depth + 1)
            values.append(value)
        return values, at
    if 0xA0 <= kind < 0xC0 or kind in (0xD9, 0xDA):
        size = kind & 31
        if kind >= 0xC0:
            size = int.from_bytes(data[at : at + kind - 0xD8], "big")
            at += kind - 0xD8
        if at + size > len(data):
            raise ValueError
        return bytes(data[at : at + size]).decode(), at + size
    if 0xCA <= kind < 0xD4:
        size = 4 << (kind - 0xCA) if kind < 0xCC else 1 << (kind & 3)
        return struct.unpack_from(">" + "fdBHIQbhiq"[kind - 0xCA], data, at)[0], at + size
    if 0xC2 <= kind < 0xC4:
        return kind == 0xC3, at
    if kind == 0xC0:
        return None, at
    raise ValueError
