"""A disk that fills up under a recorder, while the whole network goes on."""

import json
import random
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from brachium.bench_crowd import subjects
from brachium.checks import free_port
from brachium.processes import Child, Processes
from brachium.shell import Failed
from brachium_wire import keys, recording
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Event, Health

SIZE_MB = 4
ARMS = 1
FILLER_BYTES, FILLER_S = 3000, 0.01
"""What fills the disk in some seconds, and cannot be compressed."""
FULL_S = 40.0
"""By then the disk is full."""
SEEN_S, SETTLE_S, AFTER_S = 30.0, 3.0, 3.0
RECORDER = "full"


@dataclass(frozen=True, kw_only=True)
class FullDisk:
    """What happened when the disk was full."""

    disk: str
    """What filled up: a small file system; without the right to make one, a limit of file sizes."""
    alarm: str
    """As the recorder's health tells it."""
    on_monitor: bool
    on_page: bool
    page_stops: bool
    """The pages' own recording, on the same disk, is shown as stopped with its alarm, not as going on."""
    frames_per_s: float
    """Frames that a page got afterwards."""
    skeletons_per_s: float
    """Of all arms, on the bus, afterwards."""
    skeletons_before_per_s: float
    let_go: int
    """Messages that came afterwards and were counted."""
    opens: bool
    """The file is closed and indexed, and its index holds as many messages as the recorder counted."""
    messages: int
    exit_code: int


def full_disk(
    processes: Processes, beside: Processes, folder: Path, endpoint: str, bus: Bus, room: str
) -> FullDisk:
    """Record on a small disk until it is full, and look at what everybody else sees."""
    network = ["--endpoint", endpoint, "--room", room]
    processes.start("fuse", ["fuse", *network], stderr=folder / "fuse.err")
    port = free_port()
    shown = folder / "monitor.jsonl"
    processes.start("monitor", ["monitor", *network, "--json"], stdout=shown, stderr=folder / "monitor.err")
    crowd = ["brachium.bench_crowd", endpoint, room, str(ARMS), f"{FULL_S + 60.0}"]
    skeletons = bus.subscribe(keys.subjects(room, "skeleton/*"), 1 << 16)
    beside.start("many", crowd, stdout=folder / "many", stderr=folder / "many.err")
    if not _seen(lambda: skeletons.received > 0):
        raise Failed("no skeletons came")
    threading.Event().wait(SETTLE_S)
    with _small_disk(folder) as (disk, out, prefix):
        runner = Processes(command=(*prefix, *processes.command))
        web = ["web", *network, "--port", str(port), "--no-password", "--sessions", str(out / "sessions")]
        runner.start("web", web, stdout=folder / "web", stderr=folder / "web.err")
        if not _seen(lambda: _answers(port)):
            raise Failed("the pages are not served")
        with runner, Page(port) as page:
            health = bus.subscribe(keys.service(room, "recorder", RECORDER))
            before = _rate(skeletons)
            words = ["record", *network, "--out", str(out), "--id", RECORDER]
            recorder = runner.start("record", words, stdout=folder / "record", stderr=folder / "record.err")
            told = _alarm(health, recorder, lambda: _fill(bus, room))
            frames = page.frames
            after = _rate(skeletons)
            frames_per_s = (page.frames - frames) / AFTER_S
            on_monitor = _seen(lambda: told.alarm in shown.read_text("utf-8"))
            on_page = _seen(lambda: any(told.alarm == alarm["reason"] for alarm in page.alarms))
            page_stops = _seen(lambda: page.recording == "failed", lambda: _fill(bus, room))
            health.wait(SEEN_S)
            last = [decode(payload, Health) for _, payload in health.drain()][-1]
            code = runner.end("record")
        (path,) = out.glob("*.mcap")
        closed = recording.is_closed(path)
        with recording.read(path) as messages:
            found = sum(1 for _ in messages)
        indexed = sum(recording.counts(path).values()) if closed else 0
    for name in ("monitor", "fuse"):
        processes.end(name)
    beside.end("many")
    return FullDisk(
        disk=disk,
        alarm=told.alarm,
        on_monitor=on_monitor,
        on_page=on_page,
        page_stops=page_stops and bool(page.alarms),
        frames_per_s=frames_per_s,
        skeletons_per_s=after,
        skeletons_before_per_s=before,
        let_go=last.drops.get("disk_full", 0),
        opens=closed and indexed == found == last.counts["recorded"],
        messages=found,
        exit_code=code,
    )


class Page:
    """A screen on the pages' socket: begins a session, counts frames, keeps the newest alarms."""

    def __init__(self, port: int) -> None:
        self._port, self._stop = port, threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.frames = 0
        self.alarms: list[dict[str, Any]] = []
        self.recording = "off"

    def __enter__(self) -> "Page":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        from websockets.sync.client import connect
        from websockets.typing import Origin

        address = f"127.0.0.1:{self._port}"
        with connect(f"ws://{address}/ws", origin=Origin(f"http://{address}")) as own:
            while not self._stop.is_set():
                try:
                    said = json.loads(own.recv(timeout=0.2))
                except TimeoutError:
                    continue
                self.frames += said["kind"] == "frame"
                if said["kind"] == "state":
                    if self.recording == "off" and said["sides"]:
                        own.send(json.dumps({"verb": "mark"}))
                    self.alarms, self.recording = said["alarms"], said["recording"]["state"]


@contextmanager
def _small_disk(folder: Path) -> Iterator[tuple[str, Path, tuple[str, ...]]]:
    """Yield what it is, a folder on it, and what stands before a command that is to be held to it."""
    out = folder / "small"
    out.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE_MB}m", "tmpfs", str(out)]
    if sys.platform == "linux" and subprocess.run(mount, capture_output=True, check=False).returncode == 0:
        try:
            yield f"a file system of {SIZE_MB} MB", out, ()
        finally:
            subprocess.run(["umount", str(out)], check=False)
        return
    limit = (
        "import os, resource, sys; "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({SIZE_MB << 20}, {SIZE_MB << 20})); "
        "os.execv(sys.argv[1], sys.argv[1:])"
    )
    yield f"a file of {SIZE_MB} MB at most", out, (sys.executable, "-c", limit)


def _fill(bus: Bus, room: str) -> None:
    noise = Event(time_ns=0, kind="filler", data={"noise": random.randbytes(FILLER_BYTES)})
    bus.put(keys.event(room, subjects(ARMS)[0]), encode(noise))


def _alarm(health: Inbox, recorder: Child, fill: Callable[[], None]) -> Health:
    """Fill the disk until the recorder raises its alarm; return the health that holds it."""
    deadline = time.monotonic() + FULL_S
    while time.monotonic() < deadline:
        if not recorder.alive():
            raise Failed(f"the recorder ended: {recorder.complaint()}")
        health.wait(FILLER_S)
        for _, payload in health.drain():
            said = decode(payload, Health)
            if said.alarm:
                return said
        fill()
    raise Failed(f"the disk did not fill up within {FULL_S:.0f} s")


def _rate(inbox: Inbox) -> float:
    """Return how many messages come a second, over some seconds from now."""
    first, begun = inbox.received, time.monotonic()
    threading.Event().wait(AFTER_S)
    inbox.drain()
    return (inbox.received - first) / (time.monotonic() - begun)


def _seen(true: Callable[[], bool], meanwhile: Callable[[], None] = lambda: None) -> bool:
    """Return whether it becomes true within some seconds, doing something again and again."""
    deadline = time.monotonic() + SEEN_S
    while not true():
        if time.monotonic() > deadline:
            return False
        meanwhile()
        threading.Event().wait(FILLER_S)
    return True


def _answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1.0).close()
    except OSError:
        return False
    return True
