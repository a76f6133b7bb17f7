"""A gateway under attack, good nodes beside: what it counts, how it grows, what the good ones lose."""

import json
import socket
import threading
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from brachium.bench_gateway import ROOM, TOKEN, drops, final_statuses, start_gateway, start_router
from brachium.bench_run import cpu_seconds, helpers, pid
from brachium.hostile_frames import Enemy
from brachium.processes import Processes
from brachium.shell import Failed
from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode
from brachium_wire.messages import Health, Status

GOOD = 8
"""Nodes that do as they should, 20 batches a second each."""
ENEMY = f"crowd-{GOOD:03d}"
"""The enemy has a good node's token, and knows its name."""
HANDSHAKES = 0.02
"""Share of the frames that are handshakes: each costs a connection."""
ANSWERS_WITHIN_S = 15.0
SETTLE_S = 2.0


@dataclass(frozen=True, kw_only=True)
class HostileFigures:
    """One attack."""

    frames: int
    """Hostile frames and handshakes that were sent and that the gateway had to read."""
    connections: int
    by_kind: dict[str, int]
    gateway_alive: bool
    gateway_cpu_s: float
    rss_before_mb: float
    """Of the gateway, with the good nodes joined, before the first hostile byte."""
    rss_after_mb: float
    rss_growth_mb: float
    good_nodes: int
    good_sent: int
    good_received: int
    good_lost: int
    """Samples of good nodes that the gateway counts as lost, or that it did not count at all."""
    good_drops: dict[str, int]
    enemy_drops: dict[str, int]
    """What the gateway counted, by name, of connections that were let in."""
    gateway_drops: dict[str, int]
    """What it counted at its door, by name."""


def measure(frames: int, seed: int = 1) -> HostileFigures:
    """Attack with at least so many frames."""
    with TemporaryDirectory() as made, Processes() as processes, helpers() as beside:
        folder = Path(made)
        endpoint = start_router(processes, folder)
        with Bus.open(endpoint) as bus:
            statuses = bus.subscribe(keys.subjects(ROOM, "imu/*/status"), 1 << 16)
            healths = bus.subscribe(keys.services(ROOM, "gateway/*"))
            gateway, port = start_gateway(processes, folder, endpoint, bus, GOOD + 1)
            path = folder / "crowd"
            words = ["brachium.node_crowd", str(port), TOKEN, str(GOOD), "86400"]
            crowd = beside.start("crowd", words, stdout=path, stderr=folder / "crowd.err")
            _joined(statuses)
            before_mb, before_s = resident_mb(pid(gateway)), cpu_seconds(pid(gateway))
            enemy = Enemy(seed, TOKEN, ENEMY)
            sent, connections = attack(enemy, port, frames)
            threading.Event().wait(SETTLE_S)
            enemy_drops = _of_enemy(statuses)
            alive = gateway.alive()
            after_mb, after_s = resident_mb(pid(gateway)), cpu_seconds(pid(gateway))
            if beside.end("crowd") != 0:
                raise Failed(f"the good nodes failed: {crowd.complaint()}")
            said = json.loads(path.read_text("utf-8"))
            last = final_statuses(statuses, GOOD)
            at_door = _at_door(healths)
    received, lost = sum(s.received for s in last), sum(s.lost for s in last)
    return HostileFigures(
        frames=sent,
        connections=connections,
        by_kind=dict(sorted(enemy.sent.items())),
        gateway_alive=alive,
        gateway_cpu_s=after_s - before_s,
        rss_before_mb=before_mb,
        rss_after_mb=after_mb,
        rss_growth_mb=after_mb - before_mb,
        good_nodes=len(last),
        good_sent=said["samples_sent"],
        good_received=received,
        good_lost=max(lost, said["samples_sent"] - received),
        good_drops=drops(last),
        enemy_drops=enemy_drops,
        gateway_drops=at_door,
    )


def attack(enemy: Enemy, port: int, frames: int) -> tuple[int, int]:
    """Send at least so many frames, one connection after the other; return how many, in how many.

    Each is read to its end before the next begins, so that the gateway had to take all of it.
    """
    sent = connections = shaken = 0
    while sent < frames:
        if shaken < HANDSHAKES * sent:
            data, count = enemy.handshake(), 1
            shaken += 1
        else:
            data, count = enemy.connection()
        exchange(port, data)
        sent += count
        connections += 1
    return sent, connections


def exchange(port: int, data: bytes) -> None:
    """Send all of it and read until the gateway ends the connection. Raises Failed when it does not."""
    with socket.create_connection(("127.0.0.1", port), timeout=ANSWERS_WITHIN_S) as way:
        reading = threading.Thread(target=_drain, args=(way,))
        reading.start()
        try:
            way.sendall(data)
            way.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # cut off in the middle, as it deserves
        reading.join(ANSWERS_WITHIN_S)
        if reading.is_alive():
            raise Failed(f"the gateway left a hostile connection open for {ANSWERS_WITHIN_S:.0f} s")


def _drain(way: socket.socket) -> None:
    try:
        while way.recv(65536):
            pass
    except OSError:
        return


def resident_mb(number: int) -> float:
    """Return the memory that a process holds now."""
    for line in Path(f"/proc/{number}/status").read_text("utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    raise Failed("memory is read from /proc, which this system does not have: run it on Linux")


def _joined(statuses: Inbox) -> None:
    """Wait until every good node has told its status."""
    there: set[str] = set()
    while len(there) < GOOD:
        if not statuses.wait(ANSWERS_WITHIN_S):
            raise Failed("the good nodes did not join")
        there |= {key for key, _ in statuses.drain()}


def _of_enemy(statuses: Inbox) -> dict[str, int]:
    """Return what was dropped of the enemy's connections; each is a node that was just switched on."""
    said = [decode(payload, Status) for _, payload in statuses.drain()]
    return drops([status for status in said if status.node == ENEMY and not status.connected])


def _at_door(healths: Inbox) -> dict[str, int]:
    counts: Counter[str] = Counter()
    healths.wait(SETTLE_S)
    for _, payload in healths.drain():
        counts = Counter(decode(payload, Health).drops)
    return dict(sorted(counts.items()))
