"""What a recording loses: recorders killed while they work, power that is lost, a disk that fills up."""

import random
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from brachium.bench_disk import FullDisk, full_disk
from brachium.bench_gateway import start_router
from brachium.bench_run import helpers
from brachium.processes import Processes
from brachium.shell import Failed
from brachium_wire import keys, recording
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode, encode
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Event, Health

ROOM, MARKED = "bench", "marked"
MARK_S = 0.005
ARMS = 5
"""Arms whose samples are recorded beside the marks."""
LEAST_S, MOST_S = 1.0, 4.0
"""A recorder works for so long before it is killed."""
START_S, READY_S = 4.0, 20.0
TAILS = ("cut", "zeroed", "random")


@dataclass(frozen=True, kw_only=True)
class RecorderFigures:
    """Losses are from the last message put before the kill to the last one in the recovered file, s."""

    kills: int
    kill_worst_s: float
    kill_median_s: float
    power_worst_s: dict[str, float]
    """By what stands behind the last byte known to be on the disk: nothing, zeros, or random bytes."""
    holes: int
    """Marks missing before the last one found, in any file."""
    full_disk: FullDisk


def measure(kills: int) -> RecorderFigures:
    """Kill that many recorders, one after the other, then fill a disk."""
    with TemporaryDirectory() as made, Processes() as processes, helpers() as beside:
        folder = Path(made)
        endpoint = start_router(processes, folder)
        seconds = kills * (MOST_S + START_S) + READY_S
        crowd = ["brachium.bench_crowd", endpoint, ROOM, str(ARMS), str(seconds)]
        with Bus.open(endpoint) as bus:
            beside.start("crowd", crowd, stdout=folder / "crowd", stderr=folder / "crowd.err")
            with Marks(bus) as marks:
                rounds = [_killed(processes, folder / str(i), endpoint, bus, marks, i) for i in range(kills)]
            beside.end("crowd")
            print("a full disk ...", file=sys.stderr, flush=True)
            disk = full_disk(processes, beside, folder, endpoint, bus, ROOM)
    lost = [one["killed"] for one, _ in rounds]
    return RecorderFigures(
        kills=kills,
        kill_worst_s=max(lost),
        kill_median_s=median(lost),
        power_worst_s={tail: max(one[tail] for one, _ in rounds) for tail in TAILS},
        holes=sum(holes for _, holes in rounds),
        full_disk=disk,
    )


class Marks:
    """Numbered messages on the bus, each with its time, until the end of the `with` block."""

    def __init__(self, bus: Bus) -> None:
        self._bus, self._clock, self._stop = bus, HostClock(), threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.last_ns = 0
        """When the last one was put."""

    def __enter__(self) -> "Marks":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        number, key = 0, keys.event(ROOM, MARKED)
        while not self._stop.wait(MARK_S):
            now_ns = self._clock.now_ns()
            self._bus.put(key, encode(Event(time_ns=now_ns, kind="mark", data={"number": number})))
            self.last_ns, number = now_ns, number + 1


def _killed(
    processes: Processes, folder: Path, endpoint: str, bus: Bus, marks: Marks, number: int
) -> tuple[dict[str, float], int]:
    """Return what one recorder lost, by what happened to its file, and the holes in it.

    What was on the disk is what its health last told, which may be a second old.
    """
    chance, name = random.Random(number), f"r{number}"
    print(f"recorder {number + 1} ...", file=sys.stderr, flush=True)
    health = bus.subscribe(keys.service(ROOM, "recorder", name))
    words = ["record", "--endpoint", endpoint, "--room", ROOM, "--out", str(folder), "--id", name]
    child = processes.start(name, words, stderr=folder.with_suffix(".err"))
    deadline = time.monotonic() + READY_S
    synced = 0
    while not synced:
        if not child.alive() or time.monotonic() > deadline:
            raise Failed(f"the recorder did not start: {child.complaint()}")
        health.wait(0.1)
        synced = max((_synced(payload) for _, payload in health.drain()), default=0)
    threading.Event().wait(chance.uniform(LEAST_S, MOST_S))
    last_ns = marks.last_ns
    assert child.process is not None
    child.process.kill()
    child.process.wait()
    processes.end(name)
    synced = max((_synced(payload) for _, payload in health.drain()), default=synced)
    (path,) = folder.glob("*.mcap")
    data = path.read_bytes()
    tails = {"cut": b"", "zeroed": bytes(len(data) - synced), "random": chance.randbytes(len(data) - synced)}
    found, holes = {}, 0
    for tail, rest in {"killed": None, **tails}.items():
        copy = folder / f"{tail}.mcap"
        copy.write_bytes(data if rest is None else data[:synced] + rest)
        recording.recover(copy)
        times, missing = _marks(copy)
        found[tail] = 1e-9 * (last_ns - times[-1]) if times else float("inf")
        holes += missing
    shutil.rmtree(folder)
    return found, holes


def _synced(payload: bytes) -> int:
    try:
        return decode(payload, Health).counts.get("bytes_on_disk", 0)
    except WireError:
        return 0


def _marks(path: Path) -> tuple[list[int], int]:
    """Return the marks' times in a recording, and how many are missing between them."""
    events = [
        decode(payload, Event) for key, payload, _ in _messages(path) if keys.parse(key).subject == MARKED
    ]
    numbers = [int(event.data["number"]) for event in events]
    missing = numbers[-1] - numbers[0] + 1 - len(numbers) if numbers else 0
    return [event.time_ns for event in events], missing


def _messages(path: Path) -> Iterator[recording.Recorded]:
    with recording.read(path) as messages:
        yield from messages
