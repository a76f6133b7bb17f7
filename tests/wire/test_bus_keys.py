"""Keys that are not ours never reach the session."""

from collections.abc import Callable
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]
Linked = Callable[..., None]


def test_a_wildcard_put_by_another_client_is_received_and_refused_by_parse(
    connect: Connect, router: Any, until: Until
) -> None:
    import zenoh

    from brachium_wire.bus import client_config

    reader = connect()
    inbox = reader.subscribe(keys.everything("gym"))
    with zenoh.open(client_config(router.endpoint)) as evil:

        def arrived() -> bool:
            evil.put("brachium/gym/*/event", b"x")
            return inbox.wait(0.05)

        until(arrived, "the evil put")
    key, _ = inbox.drain()[0]
    assert key == "brachium/gym/*/event"
    with pytest.raises(keys.BadKey):
        keys.parse(key)


@pytest.mark.parametrize(
    "key",
    [
        "brachium/gym/*/event",
        "brachium/gym/p01/" + "x" * 70000,
        "other/gym/p01/event",
        "",
        keys.alive("gym", "view", "v"),
    ],
)
def test_a_key_that_is_not_ours_never_reaches_the_session(linked: Linked, connect: Connect, key: str) -> None:
    publisher, reader = connect(), connect()
    for attempt in (publisher.put, publisher.retain):
        with pytest.raises(keys.BadKey):
            attempt(key, b"x")
    inbox = reader.subscribe(keys.everything("gym"))
    linked(publisher, inbox)


def test_a_key_expression_that_is_not_ours_never_reaches_the_session(connect: Connect) -> None:
    bus = connect()
    evil = "brachium/" + "x" * 70000
    attempts: list[Callable[[], object]] = [
        lambda: bus.subscribe(evil),
        lambda: bus.fetch(evil),
        lambda: bus.serve(evil, lambda _k, q: q),
        lambda: bus.ask(evil),
        lambda: bus.announce(evil),
        lambda: bus.alive(evil),
        lambda: bus.watch_alive(evil, lambda _k, _a: None),
        lambda: bus.fetch("brachium/gym/p01/session?x=1"),
    ]
    for attempt in attempts:
        with pytest.raises(keys.BadKey):
            attempt()
    assert bus.fetch(keys.everything("gym")) == []
