"""The performance figures: what one arm costs, how late its skeletons are, what a hundred arms cost.

Every figure is of real processes on loopback. Fusion's cost stands beside that of a bare Zenoh relay of the
same batches in the same windows: absolute figures are of one machine on one day.
"""

import json
import threading
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np

from brachium.bench_run import WINDOWS, Heard, helpers, listen, pid, shares
from brachium.checks import free_port
from brachium.commands.emulate import settings_of
from brachium.demo_network import ROOM, DemoNetwork
from brachium.processes import Processes
from brachium.shell import Failed
from brachium.way_in import TOKEN_VARIABLE
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Health

TOKEN = "bench"
FIRST_S = 30.0
"""A network that shows no skeleton after this is broken."""
SETTLE_S = 2.0
TICK_NS = 20_000_000


@dataclass(frozen=True, kw_only=True)
class OneArm:
    """One arm, three nodes at 100 Hz through the gateway, all services running, no radio delays."""

    batch: int
    """Samples in a packet."""
    first_skeleton_s: float
    """From the start of the first service to the first skeleton."""
    fusion_cpu: float
    """Fusion's CPU over wall time, of one core; median of the windows."""
    relay_cpu: float
    """A bare relay's, in the same windows."""
    fusion_cpu_windows: list[float]
    relay_cpu_windows: list[float]
    skeletons: int
    latency_p50_ms: float
    """Skeleton's arrival minus the gateway's having the last sample it needed."""
    latency_p99_ms: float
    sensor_to_skeleton_p50_ms: float
    """Skeleton's arrival minus the instant it shows."""
    sensor_to_skeleton_p99_ms: float


@dataclass(frozen=True, kw_only=True)
class ManyArms:
    """Many arms straight to the bus, three nodes at 100 Hz each, five samples a batch."""

    arms: int
    samples_sent: int
    skeletons: int
    skeletons_missing: int
    """Ticks without a skeleton between an arm's first and last."""
    poses_not_measured: int
    """Segments that were held or missing in some skeleton: samples that were lost or came too late."""
    fusion_drops: dict[str, int]
    fusion_cpu: float
    relay_cpu: float
    sender_late_ms: float
    """How late the sender was at most; much, and the machine was too busy to say anything."""


def one_arm(batch: int, window_s: float) -> OneArm:
    """Measure one arm."""
    words = ["--level=typical", "--seed=1", f"--batch={batch}", "--loss=0", "--wifi=none"]
    begun = time.monotonic()
    with (
        TemporaryDirectory() as folder,
        Processes(environment={TOKEN_VARIABLE: TOKEN}) as processes,
        helpers() as beside,
    ):
        network = DemoNetwork(folder=Path(folder) / "network", processes=processes)
        network.start(settings_of(words, TOKEN), view=False)
        with Bus.open(network.endpoint) as bus:
            inbox = bus.subscribe(keys.subjects(ROOM, "skeleton/*"))
            network.wait_ready(bus, threading.Event())
            network.move(words)
            _first(inbox)
            first_s = time.monotonic() - begun
            network.check()
            relay = beside.start("relay", ["brachium.bench_relay", network.endpoint, ROOM])
            listen(inbox, SETTLE_S)
            measured = [pid(processes.children["fuse"]), pid(relay)]
            with ThreadPoolExecutor(1) as other:
                cpu = other.submit(shares, measured, window_s)
                heard = listen(inbox, WINDOWS * window_s)
                fusion_cpu, relay_cpu = cpu.result()
            network.check()
    latency = [(at - s.received_ns) * 1e-6 for at, _, s in heard if s.received_ns is not None]
    age = [(at - s.time_ns) * 1e-6 for at, _, s in heard]
    return OneArm(
        batch=batch,
        first_skeleton_s=first_s,
        fusion_cpu=median(fusion_cpu),
        relay_cpu=median(relay_cpu),
        fusion_cpu_windows=fusion_cpu,
        relay_cpu_windows=relay_cpu,
        skeletons=len(heard),
        latency_p50_ms=float(np.percentile(latency, 50)),
        latency_p99_ms=float(np.percentile(latency, 99)),
        sensor_to_skeleton_p50_ms=float(np.percentile(age, 50)),
        sensor_to_skeleton_p99_ms=float(np.percentile(age, 99)),
    )


def many_arms(arms: int, window_s: float) -> ManyArms:
    """Measure many arms."""
    port, room = free_port(), "bench"
    endpoint, seconds = f"tcp/127.0.0.1:{port}", SETTLE_S + WINDOWS * window_s + SETTLE_S
    with TemporaryDirectory() as folder, Processes() as processes, helpers() as beside:
        logs = Path(folder)
        processes.start("router", ["router", "--room", room, "--port", str(port)], stderr=logs / "router")
        # A heading of our own and a shoulder that is followed are too much for a hundred arms on one core.
        words = ["fuse", "--filter", "vqf", "--no-keep", "--room", room, "--endpoint", endpoint]
        fuse = processes.start("fuse", words, stderr=logs / "fuse")
        with Bus.open(endpoint) as bus:
            inbox = bus.subscribe(keys.subjects(room, "skeleton/*"), 1 << 20)
            healths = bus.subscribe(keys.services(room, "fusion/*"))
            if not healths.wait(FIRST_S):
                raise Failed(f"fusion did not start within {FIRST_S:.0f} s")
            relay = beside.start("relay", ["brachium.bench_relay", endpoint, room])
            words = ["brachium.bench_crowd", endpoint, room, str(arms), str(seconds)]
            crowd = beside.start("crowd", words, stdout=logs / "crowd")
            _first(inbox)
            threading.Event().wait(SETTLE_S)
            fusion_cpu, relay_cpu = shares([pid(fuse), pid(relay)], window_s)
            assert crowd.process is not None
            if crowd.process.wait(FIRST_S + seconds) != 0:
                raise Failed("the sender of many arms failed")
            threading.Event().wait(SETTLE_S)  # the last skeletons, and one more health
            health = decode(healths.drain()[-1][1], Health)
            sent = json.loads((logs / "crowd").read_text())
            missing, not_measured, skeletons = _count(listen(inbox, 0.1))
    return ManyArms(
        arms=arms,
        samples_sent=sent["samples_sent"],
        skeletons=skeletons,
        skeletons_missing=missing,
        poses_not_measured=not_measured,
        fusion_drops={reason: n for reason, n in health.drops.items() if n},
        fusion_cpu=median(fusion_cpu),
        relay_cpu=median(relay_cpu),
        sender_late_ms=sent["late_ms"],
    )


def _count(heard: list[Heard]) -> tuple[int, int, int]:
    """Return missing ticks, poses that were not measured, and skeletons."""
    times, not_measured = defaultdict[str, list[int]](list), 0
    for _, key, skeleton in heard:
        times[key].append(skeleton.time_ns)
        not_measured += sum(pose.quality in ("held", "missing") for pose in skeleton.segments.values())
    missing = sum((t[-1] - t[0]) // TICK_NS + 1 - len(t) for t in times.values())
    return missing, not_measured, len(heard)


def _first(inbox: Inbox) -> None:
    if not inbox.wait(FIRST_S):
        raise Failed(f"no skeleton within {FIRST_S:.0f} s")
