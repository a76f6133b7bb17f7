"""What the gateway costs: many nodes, each 20 messages a second, clock answers and status beside them."""

import json
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from brachium import node_crowd
from brachium.bench_run import WINDOWS, helpers, pid, shares
from brachium.checks import free_port
from brachium.processes import Child, Processes
from brachium.shell import Failed
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Status

TOKEN, ROOM = "bench", "bench"
READY_S, JOIN_S, SETTLE_S = 15.0, 20.0, 5.0


@dataclass(frozen=True, kw_only=True)
class GatewayFigures:
    """Many nodes through one gateway. Shares are CPU over wall time, of one core, median of the windows."""

    nodes: int
    messages_per_node_hz: float
    """Batches. Each node also answers some 4 clock questions a second, and tells its status once."""
    gateway_cpu: float
    gateway_cpu_windows: list[float]
    echo_cpu: float
    """A bare `websockets` server that echoes the same batches, in the same run."""
    echo_cpu_windows: list[float]
    samples_sent: int
    samples_received: int
    samples_lost: int
    drops: dict[str, int]
    sender_late_ms: float
    """How late the sender was at most; much, and the machine was too busy to say anything."""


def measure(nodes: int, window_s: float, settle_s: float = SETTLE_S) -> GatewayFigures:
    """Measure the echo, then the gateway, with the same load."""
    with TemporaryDirectory() as made, Processes() as processes, helpers() as beside:
        folder = Path(made)
        echo_port = free_port()
        echo = beside.start("echo", ["brachium.bench_echo", str(echo_port)], stderr=folder / "echo.err")
        echo_cpu, _ = _load(beside, folder, echo, echo_port, nodes, window_s, settle_s)
        beside.end("echo")
        endpoint = start_router(processes, folder)
        with Bus.open(endpoint) as bus:
            statuses = bus.subscribe(keys.subjects(ROOM, "imu/*/status"), 1 << 16)
            gateway, port = start_gateway(processes, folder, endpoint, bus, nodes)
            cpu, said = _load(beside, folder, gateway, port, nodes, window_s, settle_s)
            last = final_statuses(statuses, nodes)
    return GatewayFigures(
        nodes=nodes,
        messages_per_node_hz=1.0 / node_crowd.PERIOD_S,
        gateway_cpu=median(cpu),
        gateway_cpu_windows=cpu,
        echo_cpu=median(echo_cpu),
        echo_cpu_windows=echo_cpu,
        samples_sent=round(said["samples_sent"]),
        samples_received=sum(status.received for status in last),
        samples_lost=sum(status.lost for status in last),
        drops=drops(last),
        sender_late_ms=said["late_ms"],
    )


def start_router(processes: Processes, folder: Path) -> str:
    """Start a router; return where it listens."""
    port = free_port()
    processes.start("router", ["router", "--room", ROOM, "--port", str(port)], stderr=folder / "router.err")
    return f"tcp/127.0.0.1:{port}"


def start_gateway(
    processes: Processes, folder: Path, endpoint: str, bus: Bus, nodes: int
) -> tuple[Child, int]:
    """Start a gateway that knows the crowd; return it and its port once it is there."""
    site, port = folder / "site.toml", free_port()
    site.write_text(node_crowd.site_text(ROOM, nodes, TOKEN), encoding="utf-8")
    words = ["gateway", "--room", ROOM, "--endpoint", endpoint, "--port", str(port), "--discovery-port", "0"]
    gateway = processes.start("gateway", [*words, "--site", str(site)], stderr=folder / "gateway.err")
    deadline = time.monotonic() + READY_S
    while not bus.alive(keys.services(ROOM, "gateway/*/alive")):
        if not gateway.alive() or time.monotonic() > deadline:
            raise Failed(f"the gateway did not start: {gateway.complaint()}")
        threading.Event().wait(0.05)
    return gateway, port


def final_statuses(statuses: Inbox, nodes: int) -> list[Status]:
    """Return every node's last status, said after it has left."""
    last: dict[str, Status] = {}
    deadline = time.monotonic() + SETTLE_S
    while len(last) < nodes and time.monotonic() < deadline:
        statuses.wait(0.1)
        for _, payload in statuses.drain():
            status = decode(payload, Status)
            if not status.connected:
                last[status.node] = status
    if len(last) < nodes:
        raise Failed(f"of {nodes} nodes only {len(last)} have left with their counts")
    return list(last.values())


def drops(statuses: list[Status]) -> dict[str, int]:
    """Return what was dropped of all nodes, by name."""
    names = {name for status in statuses for name in status.drops}
    return {name: sum(status.drops.get(name, 0) for status in statuses) for name in sorted(names)}


def _load(
    beside: Processes, folder: Path, server: Child, port: int, nodes: int, window_s: float,
    settle_s: float,
) -> tuple[list[float], dict[str, float]]:  # fmt: skip
    """Return the server's CPU shares under the crowd, and what the crowd says it sent."""
    seconds = settle_s + WINDOWS * window_s
    path = folder / f"crowd-{port}"
    words = ["brachium.node_crowd", str(port), TOKEN, str(nodes), str(seconds)]
    crowd = beside.start(f"crowd-{port}", words, stdout=path, stderr=folder / f"crowd-{port}.err")
    threading.Event().wait(settle_s)
    (cpu,) = shares([pid(server)], window_s)
    assert crowd.process is not None
    if crowd.process.wait(JOIN_S + seconds) != 0:
        raise Failed(f"the crowd failed: {crowd.complaint()}")
    said: dict[str, float] = json.loads(path.read_text("utf-8"))
    return cpu, said
