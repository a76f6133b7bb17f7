"""`brachium conformance` as a command: what it starts ends with it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

DEADLINE_S = 60.0
NODE = f"import os, sys, time; open(sys.argv[1], 'w').write(str(os.getpid())); time.sleep({4.0 * DEADLINE_S})"
"""It runs for longer than is waited for its end."""


def until(there: Callable[[], object]) -> bool:
    end = time.monotonic() + DEADLINE_S
    while not there() and time.monotonic() < end:
        time.sleep(0.02)
    return bool(there())


def runs(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_node_ends_with_the_trial(number: signal.Signals, tmp_path: Path) -> None:
    said = tmp_path / "node"
    words = ["conformance", "--", sys.executable, "-c", NODE, str(said)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    trial = subprocess.Popen([sys.executable, "-m", "brachium", *words], env=environment)
    try:
        assert until(lambda: said.exists() and said.read_text())
        node = int(said.read_text())
        trial.send_signal(number)
        assert trial.wait(DEADLINE_S) == 1
        assert until(lambda: not runs(node))
    finally:
        trial.kill()
        trial.wait()
