import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from brachium_router.config import RouterSettings, endpoint
from brachium_router.service import CannotListen, run
from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode
from brachium_wire.messages import Health
from brachium_wire.topics import TOPICS

pytestmark = pytest.mark.network

ENDS_WITHIN_S = 15.0
"""A service promises 2 s; a machine with much to do takes some times that. One that hangs is not excused."""


@pytest.fixture
def free_port(unused_port: Callable[[], int]) -> int:
    return unused_port()


@contextmanager
def running(settings: RouterSettings) -> Iterator[None]:
    stop = threading.Event()
    thread = threading.Thread(target=run, args=(settings, stop))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(ENDS_WITHIN_S)
        assert not thread.is_alive(), "the router did not end"


def test_it_shows_its_health_and_a_token(free_port):
    settings = RouterSettings(port=free_port, room="gym")
    with running(settings), Bus.open(endpoint(settings)) as bus:
        inbox = bus.subscribe(keys.services("gym"))
        assert inbox.wait(60.0)
        key, payload = inbox.drain()[0]
        health = decode(payload, Health)
        assert keys.parse(key).topic == "health"
        assert (health.kind, health.text) == ("router", endpoint(settings))
        assert health.counts["sessions"] >= 1
        assert bus.alive(keys.services("gym", "*/*/alive")) == [keys.alive("gym", "router", "router")]


def test_messages_reach_an_other_session_and_oversize_ones_do_not(free_port):
    settings = RouterSettings(port=free_port)
    with running(settings), Bus.open(endpoint(settings)) as one, Bus.open(endpoint(settings)) as other:
        key = keys.skeleton("lab", "p01", "right")
        inbox = other.subscribe(keys.subjects("lab", "skeleton/*"))
        limit = TOPICS["skeleton"].max_bytes
        sent = [b"first", b"x" * (limit + 1), b"y" * limit]
        got: list[bytes] = []
        # A subscription takes a moment to reach the publisher: repeat the first until it is heard.
        for _ in range(100):
            one.put(key, sent[0])
            if inbox.wait(0.1):
                break
        inbox.drain()
        for payload in sent:
            one.put(key, payload)
        while b"y" * limit not in got:
            assert inbox.wait(60.0)
            got += [payload for _, payload in inbox.drain()]
        assert got[-2:] == [sent[0], sent[2]]
        assert sent[1] not in got


def test_a_taken_port_is_one_line(free_port):
    settings = RouterSettings(port=free_port)
    with running(settings):
        Bus.open(endpoint(settings)).close()
        with pytest.raises(CannotListen, match="in use") as error:
            run(settings, threading.Event())
        assert "\n" not in str(error.value)
        assert "/root" not in str(error.value)


def test_a_foreign_address_is_one_line(free_port):
    with pytest.raises(CannotListen, match="no address of this machine"):
        run(RouterSettings(bind="203.0.113.7", port=free_port), threading.Event())
