import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from brachium.checks import free_port
from brachium.processes import Processes

ROOT = Path(__file__).parents[2]
PARTS = ("body", "wire", "nodes", "router", "fusion", "viewer", "deploy")


@pytest.fixture(autouse=True, scope="session")
def _children_see_the_source() -> Iterator[None]:
    """Child processes import what this one imports: the tree, or the wheel when the tree is not there."""
    folders = [str(ROOT / part) for part in PARTS if (ROOT / part).is_dir()]
    with pytest.MonkeyPatch.context() as patch:
        if folders:
            patch.setenv("PYTHONPATH", os.pathsep.join(folders))
        else:
            patch.delenv("PYTHONPATH", raising=False)
        yield


@pytest.fixture(autouse=True)
def _signals() -> Iterator[None]:
    """Put back what a command that ran in this process hears of signals."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def brachium(*words: str, timeout_s: float = 60.0) -> subprocess.CompletedProcess[str]:
    """Run one command to its end."""
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "brachium", *words],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


@pytest.fixture(name="brachium", scope="session")
def _brachium() -> Callable[..., subprocess.CompletedProcess[str]]:
    return brachium


@pytest.fixture
def processes() -> Iterator[Processes]:
    with Processes() as children:
        yield children


@pytest.fixture
def router_endpoint(processes: Processes) -> str:
    """A router of its own on loopback, in room `lab`."""
    port = free_port()
    processes.start("router", ["router", "--port", str(port)])
    return f"tcp/127.0.0.1:{port}"
