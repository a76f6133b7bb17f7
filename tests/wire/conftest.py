"""Buses on a real router, and waiting for what they bring."""

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from brachium_wire.bus import Bus

DEADLINE_S = 60.0


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
def connect(router: Any) -> Iterator[Callable[[], Bus]]:
    """Open buses on the router; all are closed at the end."""
    with contextlib.ExitStack() as stack:
        yield lambda: stack.enter_context(Bus.open(router.endpoint))
