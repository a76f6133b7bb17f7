"""A real router in a process of its own, on a free port of loopback."""

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from brachium_wire.bus import Bus

DEADLINE_S = 15.0

_ROUTER = """
import json, sys, zenoh
settings = {
    "mode": "router",
    "listen": {"endpoints": [sys.argv[1]]},
    "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
}
with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))):
    print("ready", flush=True)
    sys.stdin.read()
"""


class RouterProcess:
    """A router that can be stopped and started again at the same endpoint."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _ROUTER, self.endpoint],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate(timeout=DEADLINE_S)
            self._process = None


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Return as soon as `condition` holds; fail with `what` after the deadline."""
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline, f"not within {DEADLINE_S} s: {what}"
        time.sleep(0.005)


@pytest.fixture
def until() -> Callable[[Callable[[], object], str], None]:
    return wait_until


@pytest.fixture
def router() -> Iterator[RouterProcess]:
    process = RouterProcess()
    process.start()
    yield process
    process.stop()


@pytest.fixture
def connect(router: RouterProcess) -> Iterator[Callable[[], Bus]]:
    """Open buses on the router; all are closed at the end."""
    with contextlib.ExitStack() as stack:
        yield lambda: stack.enter_context(Bus.open(router.endpoint))
