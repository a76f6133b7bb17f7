"""What is put on a bus arrives, against a real router in another process."""

import threading
from collections.abc import Callable
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]
Linked = Callable[..., None]

EVENT = keys.event("gym", "p01")
SESSION = keys.session("gym", "p01")


def test_messages_arrive_whole_and_in_order(linked: Linked, connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox)
    for number in range(500):
        publisher.put(EVENT, number.to_bytes(2, "big") + b"\x00\xff" * 10)
    got: list[tuple[str, bytes]] = []

    def complete() -> bool:
        got.extend(inbox.drain())
        return len(got) >= 500

    until(complete, "500 messages")
    assert got == [(EVENT, number.to_bytes(2, "big") + b"\x00\xff" * 10) for number in range(500)]


def test_info_stays_ahead_of_the_first_batch(linked: Linked, connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.everything("gym"))
    linked(publisher, inbox)
    for number in range(50):
        publisher.retain(keys.info("gym", f"s{number}", "hand_r"), b"info")
        publisher.put(keys.imu("gym", f"s{number}", "hand_r"), b"imu")
    got: list[str] = []

    def complete() -> bool:
        got.extend(key for key, _ in inbox.drain())
        return len(got) >= 100

    until(complete, "50 infos and 50 batches")
    for number in range(50):
        assert got.index(keys.info("gym", f"s{number}", "hand_r")) < got.index(
            keys.imu("gym", f"s{number}", "hand_r")
        )


def test_a_slow_callback_stops_no_other_session(linked: Linked, connect: Connect, until: Until) -> None:
    publisher, slow, fast = connect(), connect(), connect()
    release = threading.Event()
    stuck = threading.Event()

    class Stuck:
        def __call__(self, _key: str, _alive: bool) -> None:
            stuck.set()
            release.wait(30.0)

    slow.watch_alive(keys.services("gym", "*/*/alive"), Stuck())
    full = slow.subscribe(keys.subjects("gym", "event"), capacity=8)
    inbox = fast.subscribe(keys.subjects("gym", "event"))
    try:
        publisher.announce(keys.alive("gym", "view", "v"))
        until(stuck.is_set, "a callback that hangs")
        linked(publisher, full)
        linked(publisher, inbox)
        inbox.drain()
        before = inbox.received
        for number in range(1000):
            publisher.put(EVENT, b"%d" % number)
        until(lambda: inbox.received - before >= 1000, "all messages at the fast one")
        assert inbox.dropped == 0
        until(lambda: full.dropped > 0, "the small inbox drops and counts")
    finally:
        release.set()


def test_the_stream_goes_on_after_a_router_restart(
    linked: Linked, connect: Connect, router: Any, until: Until
) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox)
    publisher.retain(SESSION, b"kept")
    publisher.announce(keys.alive("gym", "gateway", "g"))
    publisher.serve(keys.commands("gym", "zero"), lambda _key, _question: b"ok")
    router.stop()
    until(lambda: not publisher.connected() and not reader.connected(), "both see that it is gone")
    for number in range(100):
        publisher.put(EVENT, b"lost %d" % number)
    publisher.put(keys.event("gym", "p02"), b"a publisher declared while the router is away")
    publisher.retain(SESSION, b"changed while the router is away")
    inbox.drain()
    router.start()
    until(lambda: publisher.connected() and reader.connected(), "both are back")
    linked(publisher, inbox)
    linked(publisher, inbox, keys.event("gym", "p02"))
    until(lambda: reader.fetch(SESSION) == [(SESSION, b"changed while the router is away")], "retained value")
    until(lambda: reader.alive(keys.services("gym", "*/*/alive")), "token")
    until(lambda: reader.ask(keys.command("gym", "p01", "zero")) == b"ok", "answer")
