"""Wearables' firmware before a whole network, quietly or with everything going wrong that can: measured."""

import os
import secrets
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from brachium.checks import free_port
from brachium.firmware_figures import SampleFigures, sample_figures
from brachium.processes import Processes
from brachium.shell import Failed
from brachium.stalling_relay import StallingRelay
from brachium.way_in import node_table
from brachium_body.segments import Segment
from brachium_nodes.emulated_board.board import Counts
from brachium_nodes.emulated_board.settings import BoardSettings
from brachium_nodes.firmware_build import build
from brachium_nodes.firmware_host import FirmwareNode, prepare, stop_all
from brachium_nodes.gateway import token_sha256
from brachium_nodes.roster import NodeEntry
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode_topic
from brachium_wire.hosttime import HostClock
from brachium_wire.messages import Info, SampleBatch

ROOM, SUBJECT = "firmware", "p01"
WORN: tuple[Segment, ...] = ("upper_arm_r", "forearm_r")
WORD = 2048
"""Bytes of this host's memory for objects that stand for 1 K on the chip."""
JOIN_S = 20.0
STOPPED_S, OUTAGE_S = 9.0, 3.0


@dataclass(frozen=True, kw_only=True)
class FirmwareFigures:
    """What a run has shown, by segment."""

    seconds: float
    rate_hz: float
    events: list[str]
    """What was done to the network, in order."""
    samples: dict[str, SampleFigures]
    boards: dict[str, Counts]
    heap_peak_k: float
    """The firmware's own, the largest of all nodes, in K of the chip's 36."""
    heap_shim_k: float
    """What stands for the chip's own modules in the same 36 K, beside it; a chip has these in its program."""
    refused_tokens: int
    """Nodes that were told 401 first."""
    skeletons: int


@dataclass(kw_only=True)
class FirmwareRun:
    """One run. `faults`: wrong token first, restarts, a stopped gateway, an outage, a bus that refuses."""

    folder: Path
    seconds: float
    rate_hz: float
    faults: bool
    processes: Processes
    router_port: int = field(default_factory=free_port)
    gateway_port: int = field(default_factory=free_port)
    relay_port: int = field(default_factory=free_port)
    events: list[str] = field(default_factory=list)

    def run(self, stop: threading.Event) -> FirmwareFigures:
        """Run and return the figures. Raises Failed, NoMicroPython or RuntimeError."""
        self.folder.mkdir(parents=True, exist_ok=True)
        made = build(self.folder / "build")
        endpoint = f"tcp/127.0.0.1:{self.router_port}"
        self._start("router")
        self._start("gateway", known=not self.faults)
        self._start("fuse")
        with (
            Bus.open(endpoint, stop=stop) as bus,
            StallingRelay(self.relay_port, self.gateway_port) as relay,
        ):
            heard = _Heard(bus)
            nodes: dict[Segment, FirmwareNode] = {s: FirmwareNode.start(self._prepare(s), made) for s in WORN}
            try:
                if self.faults:
                    self._wait(lambda: all("this node's token" in n.said() for n in nodes.values()), "401")
                    self.events.append("401")
                    self._restart("gateway")
                self._wait(lambda: len(heard.joined()) == len(WORN), "the nodes' welcome")
                self._pass(relay, stop)
            finally:
                reports: dict[Segment, Counts] = dict(zip(nodes, stop_all(nodes.values()), strict=True))
            refused = sum("this node's token" in node.said() for node in nodes.values())
            stop.wait(1.0)
            heard.drain()
        return self._figures(heard, reports, refused)

    def _pass(self, relay: StallingRelay, stop: threading.Event) -> None:
        """Let the time pass, with what goes wrong at its place."""
        begun = time.monotonic()

        def until(share: float) -> None:
            stop.wait(max(0.0, begun + share * self.seconds - time.monotonic()))

        if self.faults:
            until(0.15)
            self._restart("router")
            until(0.35)
            self.events.append(f"gateway stopped for {STOPPED_S:g} s")
            gateway = self.processes.children["gateway"].process
            assert gateway is not None
            os.kill(gateway.pid, signal.SIGSTOP)
            stop.wait(STOPPED_S)
            os.kill(gateway.pid, signal.SIGCONT)
            until(0.65)
            self.events.append(f"radio gone for {OUTAGE_S:g} s")
            relay.stall()
            stop.wait(OUTAGE_S)
            relay.go_on()
            until(0.8)
            self._restart("gateway")
        until(1.0)

    def _prepare(self, segment: Segment) -> Path:
        folder, rate_hz = self.folder / segment, self.rate_hz
        settings = WearerSettings(rate_hz=rate_hz, mag_every=1, segments=(segment,), seed=3)
        prepare(
            folder,
            segment,
            self._token,
            Wearer(settings),
            segment,
            seconds=self.seconds + 3 * JOIN_S,
            start_us=time.monotonic_ns() // 1000,
            gateway=f"ws://127.0.0.1:{self.relay_port}/node",
            board=BoardSettings(refusals=0.02 if self.faults else 0.0),
            batch=10 if rate_hz > 50.0 else 5,
            longest_pause_s=2,
        )
        return folder

    _token: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    def _start(self, name: str, *, known: bool = True) -> None:
        network = ["--room", ROOM, "--endpoint", f"tcp/127.0.0.1:{self.router_port}"]
        if name == "gateway":
            tokens = self._token if known else "another"
            entries = [
                NodeEntry(id=s, token_sha256=token_sha256(tokens), subject=SUBJECT, segment=s) for s in WORN
            ]
            site = self.folder / "site.toml"
            text = f'[room]\nid = "{ROOM}"\n\n[[subject]]\nid = "{SUBJECT}"\n\n'
            site.write_text(text + node_table(entries), encoding="utf-8")
            network += ["--port", str(self.gateway_port), "--discovery-port", "0", "--site", str(site)]
        words = ["--room", ROOM, "--port", str(self.router_port)] if name == "router" else network
        log = self.folder / f"{name}.err"
        self.processes.start(name, [name, *words], stdout=log, stderr=log)

    def _restart(self, name: str) -> None:
        self.events.append(f"{name} restarted")
        self.processes.end(name)
        self._start(name)

    def _wait(self, reached: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + JOIN_S
        while not reached():
            for child in self.processes.ended():
                raise Failed(f"{child.name} ended: {child.complaint() or 'it said nothing'}")
            if time.monotonic() > deadline:
                raise Failed(f"after {JOIN_S:g} s there is still no sign of {what}")
            time.sleep(0.05)

    def _figures(self, heard: "_Heard", reports: dict[Segment, Counts], refused: int) -> FirmwareFigures:
        samples: dict[str, SampleFigures] = {}
        for segment in WORN:
            wearer = Wearer(WearerSettings(rate_hz=self.rate_hz, mag_every=1, segments=(segment,), seed=3))
            samples[segment] = sample_figures(
                heard.batches[segment],
                heard.joined_ns[segment],
                (self.folder / segment / "samples.bin").read_bytes(),
                1.0 / wearer.clocks[segment].period_s,
            )
        return FirmwareFigures(
            seconds=self.seconds,
            rate_hz=self.rate_hz,
            events=self.events,
            samples=samples,
            boards={str(segment): report for segment, report in reports.items()},
            heap_peak_k=max((r.heap_peak - r.heap_shim) / WORD for r in reports.values()),
            heap_shim_k=max(r.heap_shim / WORD for r in reports.values()),
            refused_tokens=refused,
            skeletons=heard.skeletons,
        )


class _Heard:
    """What the network said of the nodes."""

    def __init__(self, bus: Bus) -> None:
        self._clock = HostClock()
        self._inbox: Inbox = bus.subscribe(keys.everything(ROOM), 100_000)
        self.batches: dict[str, list[SampleBatch]] = {segment: [] for segment in WORN}
        self.joined_ns: dict[str, list[int]] = {segment: [] for segment in WORN}
        self.skeletons = 0

    def joined(self) -> set[str]:
        """Return the segments whose node has joined."""
        self.drain()
        return {segment for segment, times in self.joined_ns.items() if times}

    def drain(self) -> None:
        """Take what has come."""
        for key, payload in self._inbox.drain():
            parsed = keys.parse(key)
            message = decode_topic(payload, parsed.topic)
            if isinstance(message, SampleBatch):
                self.batches[parsed.detail].append(message)
            elif isinstance(message, Info):
                self.joined_ns[parsed.detail].append(self._clock.now_ns())
            self.skeletons += parsed.topic == "skeleton"
