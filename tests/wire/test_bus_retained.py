"""Retained values are the last that were put, for whoever comes early or late."""

import threading
from collections.abc import Callable
from typing import Any, cast

import pytest

from brachium_wire import keys
from brachium_wire.bus import LEASE_MS, Bus

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]
Linked = Callable[..., None]

SESSION = keys.session("gym", "p01")


def test_a_late_answer_is_waited_for_until_a_dead_line_would_have_ended_the_wait() -> None:
    waited_s: list[float] = []

    class Session:
        def get(self, _key: str, *, timeout: float, **_: Any) -> list[Any]:
            waited_s.append(timeout)
            return []

        def liveliness(self) -> "Session":
            return self

    bus = Bus(cast(Any, Session()), "tcp/127.0.0.1:1")
    assert bus.fetch(keys.everything("gym")) == []
    assert bus.alive(keys.services("gym", "*/*/alive")) == []
    assert [seconds > LEASE_MS / 1000 for seconds in waited_s] == [True, True]


def test_a_late_joiner_fetches_the_last_value_of_each_key(connect: Connect, until: Until) -> None:
    publisher = connect()
    for value in (b"1", b"2", b"3"):
        publisher.retain(SESSION, value)
    publisher.retain(keys.session("gym", "p02"), b"other")
    publisher.retain(keys.session("hall", "p01"), b"another room")
    reader = connect()
    expected = [(SESSION, b"3"), (keys.session("gym", "p02"), b"other")]
    until(lambda: sorted(reader.fetch(keys.subjects("gym", "session"))) == expected, "both last values")
    assert reader.fetch(keys.subjects("gym", "calibration")) == []


def test_subscribe_then_fetch_ends_with_the_last_value_whenever_it_joins(
    connect: Connect, until: Until
) -> None:
    publisher, reader = connect(), connect()
    publisher.retain(SESSION, b"0")
    until(lambda: reader.fetch(SESSION) == [(SESSION, b"0")], "the first value")
    done = threading.Event()

    def change() -> None:
        for value in range(1, 2001):
            publisher.retain(SESSION, b"%d" % value)
        done.set()

    changing = threading.Thread(target=change)
    changing.start()
    seen: list[bytes] = []
    inbox = reader.subscribe(SESSION)
    seen += [payload for _, payload in reader.fetch(SESSION)]
    assert len(seen) == 1

    def last_came() -> bool:
        seen.extend(payload for _, payload in inbox.drain())
        return seen[-1] == b"2000"

    until(last_came, "the last value")
    changing.join()
    assert done.is_set()


def test_a_forgotten_value_is_fetched_no_more_and_may_come_again(
    linked: Linked, connect: Connect, until: Until
) -> None:
    publisher, reader = connect(), connect()
    other = keys.session("gym", "p02")
    inbox = reader.subscribe(SESSION)
    linked(publisher, inbox, SESSION)
    publisher.retain(SESSION, b"1")
    publisher.retain(other, b"other")
    everyone = keys.subjects("gym", "session")
    until(lambda: len(reader.fetch(everyone)) == 2, "both values")
    publisher.forget(SESSION)
    until(lambda: reader.fetch(everyone) == [(other, b"other")], "the other value alone")
    publisher.forget(SESSION)  # twice is harmless
    publisher.retain(SESSION, b"2")
    until(lambda: reader.fetch(SESSION) == [(SESSION, b"2")], "the new value")
    got: list[tuple[str, bytes]] = []

    def both_came() -> bool:
        got.extend(inbox.drain())
        return len(got) >= 2

    until(both_came, "what was put: an answer may overtake it")
    assert got == [(SESSION, b"1"), (SESSION, b"2")]
    publisher.close()
    publisher.forget(SESSION)


def test_retaining_and_forgetting_from_many_threads_ends_with_what_came_last(
    connect: Connect, until: Until
) -> None:
    publisher = connect()

    def change() -> None:
        for value in range(100):
            publisher.retain(SESSION, b"%d" % value)
            publisher.forget(SESSION)

    threads = [threading.Thread(target=change) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    reader = connect()
    until(lambda: reader.fetch(SESSION) == [], "nothing")
    publisher.retain(SESSION, b"last")
    until(lambda: reader.fetch(SESSION) == [(SESSION, b"last")], "the last value")


def test_retained_values_of_many_threads_end_alike_for_early_and_late_readers(
    linked: Linked, connect: Connect, until: Until
) -> None:
    publisher, early = connect(), connect()
    inbox = early.subscribe(SESSION)
    linked(publisher, inbox, SESSION)

    def change(name: int) -> None:
        for value in range(200):
            publisher.retain(SESSION, b"%d %d" % (name, value))

    threads = [threading.Thread(target=change, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    received: list[bytes] = []

    def all_came() -> bool:
        received.extend(payload for _, payload in inbox.drain())
        return len(received) == 800

    until(all_came, "4 x 200 values")
    assert connect().fetch(SESSION) == [(SESSION, received[-1])]


def test_what_is_kept_is_what_was_put_last_though_a_thread_is_held_up_in_between(
    linked: Linked, connect: Connect, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher, early = connect(), connect()
    inbox = early.subscribe(SESSION)
    linked(publisher, inbox, SESSION)
    put, first_puts, second_is_through = publisher.put, threading.Event(), threading.Event()

    def held_up(key: str, payload: bytes) -> None:
        if payload == b"first":
            first_puts.set()
            second_is_through.wait(0.3)  # in vain, when the second has to wait for the first
        put(key, payload)

    monkeypatch.setattr(publisher, "put", held_up)

    def second() -> None:
        first_puts.wait(15.0)
        publisher.retain(SESSION, b"second")
        second_is_through.set()

    thread = threading.Thread(target=second)
    thread.start()
    publisher.retain(SESSION, b"first")
    thread.join()
    received: list[bytes] = []

    def both_came() -> bool:
        received.extend(payload for _, payload in inbox.drain())
        return len(received) == 2

    until(both_came, "both values")
    assert connect().fetch(SESSION) == [(SESSION, received[-1])]


def test_many_threads_put_first_on_the_same_keys(linked: Linked, connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox, keys.event("gym", "probe"))
    ready = threading.Barrier(8)

    def publish() -> None:
        ready.wait()
        for number in range(20):
            publisher.put(keys.event("gym", f"s{number}"), b"x")

    threads = [threading.Thread(target=publish) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    got: list[str] = []

    def all_came() -> bool:
        got.extend(key for key, _ in inbox.drain())
        return len(got) == 160

    until(all_came, "all of 8 x 20 messages")
    assert all(got.count(keys.event("gym", f"s{number}")) == 8 for number in range(20))
