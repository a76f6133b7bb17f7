"""What the measurements share: helper processes, CPU of a process, skeletons with their arrival."""

import os
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from brachium.processes import Child, Processes
from brachium.shell import Failed
from brachium_wire.bus import Inbox
from brachium_wire.codec import decode
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Skeleton

WINDOWS = 5

Heard = tuple[int, str, Skeleton]
"""Host time of arrival, key, message."""


def helpers() -> Processes:
    """Return processes that run modules of ours beside the services."""
    return Processes(command=(sys.executable, "-m"))


def pid(child: Child) -> int:
    """Return a child's process number."""
    assert child.process is not None
    return child.process.pid


def cpu_seconds(number: int) -> float:
    """Return the CPU time that a process has used so far. Raises Failed where it cannot be read."""
    path = Path(f"/proc/{number}/stat")
    if not path.exists():
        raise Failed("CPU times are read from /proc, which this system does not have: run it on Linux")
    fields = path.read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def listen(inbox: Inbox, seconds: float) -> list[Heard]:
    """Return the skeletons that arrive from now on."""
    clock, heard = HostClock(), list[Heard]()
    end_s = time.monotonic() + seconds
    while (left := end_s - time.monotonic()) > 0.0:
        inbox.wait(left)
        now_ns = clock.now_ns()
        heard += [(now_ns, key, decode(payload, Skeleton)) for key, payload in inbox.drain()]
    return heard


def shares(pids: Sequence[int], window_s: float, end: threading.Event | None = None) -> list[list[float]]:
    """Return for each process its CPU over wall time in each of several windows."""
    waiting, found = end or threading.Event(), [list[float]() for _ in pids]
    for _ in range(WINDOWS):
        begun, before = time.monotonic(), [cpu_seconds(number) for number in pids]
        waiting.wait(window_s)
        wall = time.monotonic() - begun
        for share, number, used in zip(found, pids, before, strict=True):
            share.append((cpu_seconds(number) - used) / wall)
    return found
