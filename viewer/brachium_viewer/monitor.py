"""The monitor in a terminal: who is live, how fast, how late, and what to do about who is waiting."""

import json
import sys
import threading
import time
from dataclasses import asdict, dataclass
from typing import TextIO

from brachium_viewer.health import Network
from brachium_viewer.health_records import ArmHealth, NetworkHealth, NodeHealth
from brachium_wire import keys
from brachium_wire.battery import is_low
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock

PERIOD_S = 1.0
_CLEAR = "\x1b[H\x1b[2J"
_COLOURS = {"live": "\x1b[32m", "stale": "\x1b[33m", "missing": "\x1b[31m", "off": "\x1b[0m"}


@dataclass(frozen=True, kw_only=True)
class MonitorSettings:
    """What to watch, and how to show it."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    json: bool = False
    """One line of JSON a second."""
    seconds: float | None = None
    """How long; None: until stopped."""
    id: str = "main"


def run(settings: MonitorSettings, stop: threading.Event, out: TextIO | None = None) -> NetworkHealth:
    """Show the room's health each second until `stop` is set or the time is over; return the last of it.

    On a terminal the block is drawn over the one before, elsewhere one follows the other.
    """
    clock, network = HostClock(), Network()
    screen: TextIO = sys.stdout if out is None else out
    colour = not settings.json and screen.isatty()
    with Bus.open(settings.endpoint, stop=stop) as bus:
        changes: list[tuple[str, bool]] = []
        bus.watch_alive(keys.services(settings.room, "*/*/alive"), lambda key, up: changes.append((key, up)))
        inbox = bus.subscribe(keys.everything(settings.room))
        heart = Heart(bus, settings.room, "monitor", settings.id)
        for key, payload in bus.fetch(keys.subjects(settings.room, "imu/*/info")):
            network.feed(key, payload, clock.now_ns())
        start = due = time.monotonic()
        while not stop.is_set() and (settings.seconds is None or time.monotonic() < start + settings.seconds):
            inbox.wait(0.1)
            for key, payload in inbox.drain():
                network.feed(key, payload, clock.now_ns())
            while changes:
                network.token(*changes.pop(0))
            heart.drops["overflow"] = inbox.dropped
            heart.beat()
            if time.monotonic() >= due + PERIOD_S:
                due += PERIOD_S
                health = network.report(clock.now_ns())
                screen.write(to_json(health) + "\n" if settings.json else block(health, colour=colour))
                screen.flush()
        return network.report(clock.now_ns())


def to_json(health: NetworkHealth) -> str:
    """Return everything as one line of JSON."""
    return json.dumps({"headline": health.headline, **asdict(health)})


def block(health: NetworkHealth, *, colour: bool = False) -> str:
    """Return what a person reads: some lines, drawn over the last ones with `colour`."""
    lines = [health.headline + _unworn(health)]
    for name in health.waiting:
        lines.append(f"waiting: {name}   assign with: brachium gateway --assign {name}=SUBJECT/SEGMENT")
    for head, rows in (
        (_NODE_HEAD, [(_node(n), n.state) for n in health.nodes]),
        (_ARM_HEAD, [(_arm(a), a.state) for a in health.arms]),
    ):
        if rows:
            widths = [
                max(map(len, column)) for column in zip(head, *(cells for cells, _ in rows), strict=True)
            ]
            lines += [
                "",
                _row(head, widths),
                *(_paint(_row(cells, widths), state, colour) for cells, state in rows),
            ]
    lines += [
        f"  {n.subject}/{n.segment} dropped {_counts(n.drops)}" for n in health.nodes if any(n.drops.values())
    ]
    lines += [
        _paint(
            f"LOW BATTERY: {n.subject}/{n.segment}: {60 * n.battery_hours:.0f} min left", "missing", colour
        )
        for n in health.nodes
        if n.battery_hours is not None and is_low(n.battery_hours)
    ]
    lines += [
        _paint(f"ALARM: {s.kind}/{s.id}: {s.alarm}", "missing", colour) for s in health.services if s.alarm
    ]
    if health.services:
        up = [f"{s.kind}/{s.id}" for s in health.services if s.up]
        down = [f"{s.kind}/{s.id}" for s in health.services if not s.up]
        lines += ["", f"services up: {', '.join(up) or 'none'}"]
        if down:
            lines.append(_paint(f"services DOWN: {', '.join(down)}", "missing", colour))
        lines += [
            f"  {s.kind}/{s.id} dropped {_counts(s.drops)}" for s in health.services if any(s.drops.values())
        ]
    if health.drops:
        lines.append(f"not readable here: {_counts(health.drops)}")
    if not health.nodes and not health.services:
        lines.append("nobody here yet: start a gateway, or: brachium emulate")
    text = "\n".join(lines) + "\n"
    return _CLEAR + text if colour else text + "\n"


def _counts(drops: dict[str, int]) -> str:
    return ", ".join(f"{n} {name}" for name, n in drops.items() if n)


def _unworn(health: NetworkHealth) -> str:
    """Return what is not a person, said beside the first line."""
    origins = {n.origin for n in health.nodes} | {a.origin for a in health.arms}
    other = sorted(origins - {"worn", ""})
    return f"   [{', '.join(o.upper() for o in other)}: not worn by a person]" if other else ""


_NODE_HEAD = (
    "subject/segment",
    "state",
    "node",
    "rate Hz",
    "loss %",
    "lost",
    "ooo",
    "late",
    "age s",
    "bat",
    "dBm",
    "clock ms",
)
_WORDS = 3
"""The first columns of both tables are words."""
_ARM_HEAD = ("subject/arm", "state", "forward", "rate Hz", "p50 ms", "p99 ms", "quality")


def _row(cells: tuple[str, ...], widths: list[int]) -> str:
    """Return words to the left, figures to the right."""
    padded = [
        cell.ljust(width) if i < _WORDS or i == len(cells) - 1 else cell.rjust(width)
        for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
    ]
    return "  ".join(padded).rstrip()


def _paint(line: str, state: str, colour: bool) -> str:
    return f"{_COLOURS[state]}{line}{_COLOURS['off']}" if colour else line


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _node(node: NodeHealth) -> tuple[str, ...]:
    nominal = "" if node.nominal_hz is None else f"/{node.nominal_hz:g}"
    return (
        f"{node.subject}/{node.segment}",
        node.state,
        node.node or "-",
        f"{node.rate_hz:.0f}{nominal}",
        f"{100.0 * node.loss:.2f}",
        str(node.lost),
        str(node.out_of_order),
        str(node.late),
        _number(node.age_s, 2),
        _battery(node),
        _number(node.rssi_dbm, 0),
        _number(node.clock_uncertainty_ms, 2),
    )


def _battery(node: NodeHealth) -> str:
    """Return the charge and the hours left as far as they are known, else the voltage."""
    said = [] if node.battery_level is None else [f"{100.0 * node.battery_level:.0f} %"]
    if node.battery_hours is not None:
        said.append(f"{node.battery_hours:.1f} h")
    elif node.battery_v is not None and not said:
        said.append(f"{node.battery_v:.2f} V")
    return " ".join(said) or "-"


def _arm(arm: ArmHealth) -> tuple[str, ...]:
    parts: dict[str, list[str]] = {}
    for segment, quality in arm.quality.items():
        parts.setdefault(quality, []).append(segment)
    quality = "; ".join(f"{q}: {', '.join(names)}" for q, names in parts.items())
    return (
        f"{arm.subject}/{arm.side}",
        arm.state,
        arm.forward or "-",
        f"{arm.rate_hz:.0f}/{arm.nominal_hz:g}",
        _number(arm.latency_p50_ms),
        _number(arm.latency_p99_ms),
        quality or "-",
    )
