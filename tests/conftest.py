"""What all tests share: how Hypothesis judges, and a router of the product's own settings."""

import itertools
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from brachium.browser import chromium
from brachium.shell import Failed
from brachium_router import config

# Tests judge counts and orderings, never time: a busy machine must not fail them.
settings.register_profile("any-machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any-machine")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell's background job ignores Ctrl-C, and so would every command that a test interrupts.
    signal.signal(signal.SIGINT, signal.default_int_handler)

PATIENCE_S = 60.0
"""A test waits for what it asks for, not for a time: this long only when it has failed."""

_ROUTER = """
import sys, zenoh
with zenoh.open(zenoh.Config.from_json5(sys.argv[1])):
    print("ready", flush=True)
    sys.stdin.read()
"""


_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_BLOCK, _BLOCKS = 2_000, 6
_FIRST_PORT = 20_000 + _BLOCK * (_WORKER % _BLOCKS)
"""Below where systems take the ports of connections from, a block for each worker: nobody takes a port
between its being found and its being used."""
_NEXT = itertools.count(os.getpid())  # another run at the same time begins elsewhere


def _unused_port() -> int:
    for number in itertools.islice(_NEXT, _BLOCK):
        port = _FIRST_PORT + number % _BLOCK
        with socket.socket() as tcp, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            try:
                tcp.bind(("127.0.0.1", port))
                udp.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise AssertionError(f"no port from {_FIRST_PORT} to {_FIRST_PORT + _BLOCK - 1} is free")


@pytest.fixture(scope="session")
def unused_port() -> Callable[[], int]:
    """A function that returns a port of loopback, free for TCP and UDP, another one each time."""
    return _unused_port


class RouterProcess:
    """A router on loopback in a process of its own; it can be started again at the same endpoint.

    It runs with the settings of `brachium router`: those of Zenoh alone queue an eighth as much for a
    reader, and a reader that a busy machine holds up would lose what it loses in no room.
    """

    def __init__(self) -> None:
        chosen = config.RouterSettings(port=_unused_port())
        self.endpoint = config.endpoint(chosen)
        self._command = [sys.executable, "-c", _ROUTER, config.router_json5(chosen)]
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate(timeout=PATIENCE_S)
            self._process = None


def _running() -> Iterator[RouterProcess]:
    process = RouterProcess()
    process.start()
    yield process
    process.stop()


@pytest.fixture
def router() -> Iterator[RouterProcess]:
    """A router for one test, which may stop it and start it again."""
    yield from _running()


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """Where a router listens that the tests of one file share."""
    for process in _running():
        yield process.endpoint


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """The machine's Chromium; where everything must run, a missing one is a failure.

    It ends with its module: its driver keeps an event loop running, and other tests need one of their own.
    """
    with ExitStack() as stack:
        try:
            one = stack.enter_context(chromium())
        except Failed as missing:
            (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)(str(missing))
        from playwright.sync_api import expect

        expect.set_options(timeout=1000 * PATIENCE_S)
        yield one
