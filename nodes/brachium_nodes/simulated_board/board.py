"""The line to the emulated board, a process of its own: questions of 4 bytes, answers that begin with one."""

import gc
import struct
import sys

_FILE, PPM, SHIFT_US, SEND_BUFFER, WEB_PORT = (int(word) for word in sys.argv[3:8])
_line = open(_FILE, "r+b", 0)
_asked, _status = bytearray(4), bytearray(1)
HEAP = [0, 0, 0]  # in use at most, before the firmware, and all there is


def note_heap():
    """Note how much of the heap is in use, what is not collected yet included."""
    now = gc.mem_alloc()
    if now > HEAP[0]:
        HEAP[0] = now


def ask(kind, first=0, second=0, third=0, into=None):
    """Ask, and fill `into`. Raises OSError with the number that the board answers."""
    note_heap()
    _asked[0], _asked[1], _asked[2], _asked[3] = kind, first, second, third
    _line.write(_asked)
    if not _line.readinto(_status):
        sys.exit(3)  # the board is gone
    if _status[0]:
        raise OSError(_status[0])
    if into is not None:
        got = _line.readinto(into)
        while got < len(into):
            got += _line.readinto(memoryview(into)[got:])


def tell_heap():
    """Tell the board what was noted."""
    HEAP[2] = gc.mem_alloc() + gc.mem_free()
    _line.write(b"h\0\0\0" + struct.pack("<III", *HEAP))
    _line.readinto(_status)
