"""Buses on a real router, and waiting for what they bring."""

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus, Inbox

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


def _linked(publisher: Bus, inbox: Inbox, key: str = keys.event("gym", "p01")) -> None:
    """Wait until what `publisher` puts arrives, and leave the inbox empty."""

    def arrived() -> bool:
        publisher.put(key, b"probe")
        return inbox.wait(0.05)

    wait_until(arrived, "the subscription is in effect")
    newest, put_at = b"", 0.0

    def came_through() -> bool:
        """A put may be dropped while routes are made; those that arrive keep their order."""
        nonlocal newest, put_at
        if time.monotonic() - put_at > 1.0:
            newest, put_at = newest + b"last probe ", time.monotonic()
            publisher.put(key, newest)
        return newest in [payload for _, payload in inbox.drain()]

    wait_until(came_through, "the probes have come through")


@pytest.fixture
def linked() -> Callable[..., None]:
    return _linked


@pytest.fixture
def connect(router: Any) -> Iterator[Callable[[], Bus]]:
    """Open buses on the router; all are closed at the end."""
    with contextlib.ExitStack() as stack:
        yield lambda: stack.enter_context(Bus.open(router.endpoint))
