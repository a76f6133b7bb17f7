"""What works on this machine: each check returns one finding, and what to do when it is not well."""

import importlib.util
import os
import shutil
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from brachium.shell import EXTRAS

USUAL_PORTS = {"router": 7447, "gateway": 8765, "view": 9090, "web": 8080}

State = Literal["ok", "limited", "broken"]

SMALL_DISK_BYTES = 1 << 30
"""An hour of one arm takes some 50 MB; a GB leaves room for a day."""
YARDSTICK_S = 0.1
"""What the yardstick below takes on a core that serves several arms with ease."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One line of `brachium doctor`. `limited`: the rest works without it."""

    name: str
    state: State
    text: str
    to_do: str = ""


def free_port() -> int:
    """Return a port of loopback that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def python() -> Finding:
    """Return which Python this is; one too old would not have come here."""
    return Finding(name="python", state="ok", text=f"{sys.version.split()[0]} at {sys.executable}")


def packages() -> list[Finding]:
    """Return whether each extra's packages are there."""
    findings = []
    for module, extra in EXTRAS.items():
        there = importlib.util.find_spec(module) is not None
        distribution = {"rerun": "rerun-sdk", "can": "python-can"}.get(module, module)
        findings.append(
            Finding(
                name=f"extra {extra}: {distribution}",
                state="ok" if there else "limited",
                text=metadata.version(distribution) if there else "not installed",
                to_do="" if there else f"pip install 'brachium[{extra}]'",
            )
        )
    return findings


def bus() -> Finding:
    """Return whether a router and two clients on loopback hear one another."""
    import threading

    from brachium_router import service
    from brachium_router.config import RouterSettings, endpoint
    from brachium_wire import keys
    from brachium_wire.bus import Bus

    settings, stop = RouterSettings(port=free_port(), room="doctor"), threading.Event()
    router = threading.Thread(target=service.run, args=(settings, stop))
    begun = time.perf_counter()
    router.start()
    try:
        with Bus.open(endpoint(settings), timeout_s=5.0) as one:
            heard = one.subscribe(keys.services("doctor")).wait(5.0)
    except RuntimeError as error:
        return Finding(
            name="network on loopback", state="broken", text=str(error), to_do="allow TCP on 127.0.0.1"
        )
    finally:
        stop.set()
        router.join()
    took = f"a message after {time.perf_counter() - begun:.1f} s"
    if not heard:
        return Finding(
            name="network on loopback",
            state="broken",
            text="nothing was heard",
            to_do="allow TCP on 127.0.0.1",
        )
    return Finding(name="network on loopback", state="ok", text=took)


def ports() -> list[Finding]:
    """Return whether the usual ports are free."""
    return [_port(f"port {port} ({name})", port) for name, port in USUAL_PORTS.items()]


def _port(name: str, port: int) -> Finding:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            text = "taken: a service runs already, or another program has it"
            to_do = "end that program, or give --port (view: --web-port)"
            return Finding(name=name, state="limited", text=text, to_do=to_do)
    return Finding(name=name, state="ok", text="free")


def display() -> Finding:
    """Return where the live view would be shown."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return Finding(name="display", state="ok", text="the live view opens in a window")
    text = "none: the live view is a page on loopback"
    return Finding(name="display", state="limited", text=text, to_do="open the address that is printed")


def browser() -> Finding:
    """Return whether a browser for the page is found."""
    for name in ("chromium", "chromium-browser", "google-chrome", "firefox"):
        path = shutil.which(name)
        if path is not None:
            return Finding(name="browser", state="ok", text=path)
    to_do = "install Chromium to see the page here and to run the browser tests"
    return Finding(name="browser", state="limited", text="none found", to_do=to_do)


def speed() -> Finding:
    """Return how fast one core is by a fixed piece of work: rotation filters as fusion runs them."""
    import numpy as np
    from vqf import VQF

    samples = np.tile([0.01, 0.02, 9.81], (20_000, 1))
    begun = time.process_time()
    VQF(0.01).updateBatch(samples * 0.001, samples)
    for _ in range(100_000):
        pass
    took = time.process_time() - begun
    text = f"yardstick {1e3 * took:.0f} ms of CPU on one of {os.cpu_count()} cores"
    if took > YARDSTICK_S:
        return Finding(
            name="speed", state="limited", text=text, to_do="close other programs; one arm may be all"
        )
    return Finding(name="speed", state="ok", text=text)


def disk() -> Finding:
    """Return how much room there is for recordings here."""
    here = Path.cwd()
    free = shutil.disk_usage(here).free
    text = f"{free / 1e9:.1f} GB free at {here}"
    if not os.access(here, os.W_OK):
        return Finding(
            name="disk",
            state="limited",
            text=f"{here} cannot be written",
            to_do="give --out a folder of yours",
        )
    if free < SMALL_DISK_BYTES:
        return Finding(name="disk", state="limited", text=text, to_do="make room, or give --out another disk")
    return Finding(name="disk", state="ok", text=text)


Check = Callable[[], Finding | list[Finding]]
CHECKS: tuple[Check, ...] = (python, packages, bus, ports, display, browser, speed, disk)


def examine(checks: tuple[Check, ...] = CHECKS) -> list[Finding]:
    """Return the findings of all checks; one that breaks is a finding itself."""
    findings: list[Finding] = []
    for check in checks:
        try:
            found = check()
        except Exception as error:
            name = check.__name__
            found = Finding(
                name=name,
                state="broken",
                text=f"{type(error).__name__}: {error}",
                to_do="pip install -U brachium",
            )
        findings += found if isinstance(found, list) else [found]
    return findings
