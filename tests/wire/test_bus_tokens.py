"""Tokens say who is there; a heart shows one and beats."""

import time
from collections.abc import Callable
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode
from brachium_wire.heart import Heart
from brachium_wire.messages import Health

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]


def test_tokens_appear_and_vanish(connect: Connect, router: Any, until: Until) -> None:
    watcher = connect()
    seen: list[tuple[str, bool]] = []
    there = connect()
    first, second = keys.alive("gym", "gateway", "a"), keys.alive("gym", "fusion", "b")
    there.announce(first)
    until(lambda: watcher.alive(keys.services("gym", "*/*/alive")) == [first], "the first token")
    watcher.watch_alive(keys.services("gym", "*/*/alive"), lambda key, alive: seen.append((key, alive)))
    until(lambda: seen == [(first, True)], "the token that was there before")
    with Bus.open(router.endpoint) as other:
        end = other.announce(second)
        until(lambda: seen == [(first, True), (second, True)], "the second token")
        end()
        end()
        until(lambda: seen[2:] == [(second, False)], "the token that was ended")
        other.announce(second)
        until(lambda: len(seen) == 4, "the second token again")
    until(lambda: seen[3:] == [(second, True), (second, False)], "the token whose bus was closed")
    end()
    assert connect().alive(keys.services("gym", "*/*/alive")) == [first]


def test_heart_shows_token_and_health(connect: Connect, until: Until) -> None:
    service, reader = connect(), connect()
    inbox = reader.subscribe(keys.services("gym"))
    heart = Heart(service, "gym", "fusion", "f1")
    heart.counts["skeletons"] += 3
    heart.drops["late"] += 1
    heart.waiting.append("esp-1")
    until(lambda: reader.alive(keys.services("gym", "fusion/*/alive")), "the token")

    def heard() -> bool:
        heart.beat(now=True)
        return inbox.wait(0.05)

    until(heard, "health")
    key, payload = inbox.drain()[0]
    health = decode(payload, Health)
    assert keys.parse(key).detail == "fusion/f1"
    assert (health.kind, health.id, health.waiting) == ("fusion", "f1", ["esp-1"])
    assert (health.counts, health.drops) == ({"skeletons": 3}, {"late": 1})
    heart.end()
    until(lambda: not reader.alive(keys.services("gym", "fusion/*/alive")), "the token's end")


def test_a_heart_beats_once_in_a_second_however_often_it_is_asked() -> None:
    class Silent:
        def __init__(self) -> None:
            self.put_keys: list[str] = []

        def announce(self, _key: str) -> Callable[[], None]:
            return lambda: None

        def put(self, key: str, _payload: bytes) -> None:
            self.put_keys.append(key)

    bus = Silent()
    heart = Heart(bus, "gym", "monitor", "m")  # type: ignore[arg-type]
    start = time.monotonic()
    for _ in range(1000):
        heart.beat()
    if time.monotonic() - start < 1.0:
        assert bus.put_keys == [keys.service("gym", "monitor", "m")]
