"""What the emulated board is told: one JSON file. Its true time is the host's monotonic clock."""

import gc
import json
import os

import utime

with open("board.json") as file:
    SETTINGS = json.load(file)

COUNTS = {"transactions": 0, "refused": 0, "overflows": 0, "longest_unfed_ms": 0, "heap_peak": 0}
"""What happened on the board, for the report."""


def note_heap():
    """Note how much of the heap is in use, what is not collected yet included."""
    COUNTS["heap_peak"] = max(COUNTS["heap_peak"], gc.mem_alloc())


def true_us():
    """Return the host's monotonic clock in us."""
    return utime.ticks_us()


def stopped():
    """Return whether the host wants an end: by a file, as a signal may come while memory is collected."""
    try:
        os.stat("stop")
    except OSError:
        return False
    return True


def report():
    """Write what happened."""
    COUNTS["heap_size"] = gc.mem_alloc() + gc.mem_free()
    with open("report.json", "w") as file:
        json.dump(COUNTS, file)
