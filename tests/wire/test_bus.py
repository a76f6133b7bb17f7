"""The session on the bus against a real router in another process."""

import logging
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from typing import Any, cast

import pytest

from brachium_wire import keys
from brachium_wire.bus import LEASE_MS, PASSWORD_VARIABLE, Bus, Inbox, NoRouter
from brachium_wire.codec import decode
from brachium_wire.heart import Heart
from brachium_wire.messages import Answer, Health

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]

EVENT = keys.event("gym", "p01")
SESSION = keys.session("gym", "p01")


def linked(publisher: Bus, inbox: Inbox, until: Until, key: str = EVENT) -> None:
    """Wait until what `publisher` puts arrives, and leave the inbox empty."""

    def arrived() -> bool:
        publisher.put(key, b"probe")
        return inbox.wait(0.05)

    until(arrived, "the subscription is in effect")
    newest, put_at = b"", 0.0

    def came_through() -> bool:
        """A put may be dropped while routes are made; those that arrive keep their order."""
        nonlocal newest, put_at
        if time.monotonic() - put_at > 1.0:
            newest, put_at = newest + b"last probe ", time.monotonic()
            publisher.put(key, newest)
        return newest in [payload for _, payload in inbox.drain()]

    until(came_through, "the probes have come through")


def test_messages_arrive_whole_and_in_order(connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox, until)
    for number in range(500):
        publisher.put(EVENT, number.to_bytes(2, "big") + b"\x00\xff" * 10)
    got: list[tuple[str, bytes]] = []

    def complete() -> bool:
        got.extend(inbox.drain())
        return len(got) >= 500

    until(complete, "500 messages")
    assert got == [(EVENT, number.to_bytes(2, "big") + b"\x00\xff" * 10) for number in range(500)]


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


def test_info_stays_ahead_of_the_first_batch(connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.everything("gym"))
    linked(publisher, inbox, until)
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


def test_a_forgotten_value_is_fetched_no_more_and_may_come_again(connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    other = keys.session("gym", "p02")
    inbox = reader.subscribe(SESSION)
    linked(publisher, inbox, until, SESSION)
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
    connect: Connect, until: Until
) -> None:
    publisher, early = connect(), connect()
    inbox = early.subscribe(SESSION)
    linked(publisher, inbox, until, SESSION)

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
    connect: Connect, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher, early = connect(), connect()
    inbox = early.subscribe(SESSION)
    linked(publisher, inbox, until, SESSION)
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


def test_many_threads_put_first_on_the_same_keys(connect: Connect, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox, until, keys.event("gym", "probe"))
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


def test_a_question_is_answered(connect: Connect, until: Until) -> None:
    server, asker = connect(), connect()
    server.serve(keys.commands("gym", "zero"), lambda key, question: f"{key} ".encode() + question)
    key = keys.command("gym", "p01", "zero")
    until(lambda: asker.ask(key, b"now") == f"{key} now".encode(), "the answer")
    assert asker.ask(key) == f"{key} ".encode()
    assert asker.ask(keys.command("gym", "p01", "record")) is None


def test_an_answer_may_come_later_from_another_thread(connect: Connect, until: Until) -> None:
    server, asker = connect(), connect()
    pending: list[threading.Timer] = []

    def asked(_key: str, question: bytes, reply: Callable[[bytes], None]) -> None:
        pending.append(threading.Timer(0.1, reply, args=(b"later " + question,)))
        pending[-1].start()

    server.serve_later(keys.commands("gym", "calibrate"), asked)
    key = keys.command("gym", "p01", "calibrate")
    until(lambda: asker.ask(key, b"x", timeout_s=10.0) == b"later x", "the answer")
    for timer in pending:
        timer.join()


def test_a_handler_that_fails_answers_so_and_goes_on(
    connect: Connect, until: Until, caplog: pytest.LogCaptureFixture
) -> None:
    server, asker = connect(), connect()

    def answer(_key: str, question: bytes) -> bytes:
        if question == b"bad":
            raise RuntimeError("first line\nsecond line")
        return b"good"

    server.serve(keys.commands("gym", "zero"), answer)
    key = keys.command("gym", "p01", "zero")
    with caplog.at_level(logging.CRITICAL, "brachium_wire.bus"):
        until(lambda: asker.ask(key, b"bad"), "an answer all the same")
        said = asker.ask(key, b"bad")
    assert said is not None
    refusal = decode(said, Answer)
    assert not refusal.ok
    assert refusal.reason == "failed inside: first line second line; see the service's log"
    assert asker.ask(key, b"good") == b"good"


def test_looking_for_retained_values_never_runs_a_command(connect: Connect, until: Until) -> None:
    server, asker = connect(), connect()
    asked: list[str] = []
    server.serve(keys.commands("gym", "calibrate"), lambda key, _: (asked.append(key), b"ok")[1])
    server.retain(SESSION, b"value")
    probe = keys.command("gym", "p01", "calibrate")
    until(lambda: asker.ask(probe) == b"ok", "the command is served")
    asked.clear()
    until(lambda: asker.fetch(keys.everything("gym")) == [(SESSION, b"value")], "the retained value")
    assert asker.fetch(keys.subjects("gym", "command/calibrate")) == []
    with pytest.raises(keys.BadKey):
        asker.ask("brachium/gym/*/command/calibrate")
    assert asked == []


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


def test_a_slow_callback_stops_no_other_session(connect: Connect, until: Until) -> None:
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
        linked(publisher, full, until)
        linked(publisher, inbox, until)
        inbox.drain()
        before = inbox.received
        for number in range(1000):
            publisher.put(EVENT, b"%d" % number)
        until(lambda: inbox.received - before >= 1000, "all messages at the fast one")
        assert inbox.dropped == 0
        until(lambda: full.dropped > 0, "the small inbox drops and counts")
    finally:
        release.set()


def test_the_stream_goes_on_after_a_router_restart(connect: Connect, router: Any, until: Until) -> None:
    publisher, reader = connect(), connect()
    inbox = reader.subscribe(keys.subjects("gym", "event"))
    linked(publisher, inbox, until)
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
    linked(publisher, inbox, until)
    linked(publisher, inbox, until, keys.event("gym", "p02"))
    until(lambda: reader.fetch(SESSION) == [(SESSION, b"changed while the router is away")], "retained value")
    until(lambda: reader.alive(keys.services("gym", "*/*/alive")), "token")
    until(lambda: reader.ask(keys.command("gym", "p01", "zero")) == b"ok", "answer")


def test_no_router_is_said_within_the_deadline(router: Any) -> None:
    router.stop()
    start = time.monotonic()
    with pytest.raises(NoRouter, match="start one with: brachium router"):
        Bus.open(router.endpoint, timeout_s=0.5)
    assert time.monotonic() - start < 10.0


@pytest.mark.parametrize(
    ("password", "said"), [("one", "the room's password is wrong"), (None, "has a password, set")]
)
def test_a_password_may_be_why_no_router_answers(
    router: Any, monkeypatch: pytest.MonkeyPatch, password: str | None, said: str
) -> None:
    router.stop()
    monkeypatch.delenv(PASSWORD_VARIABLE, raising=False)
    with pytest.raises(NoRouter, match=said) as error:
        Bus.open(router.endpoint, timeout_s=0.0, password=password)
    assert PASSWORD_VARIABLE in str(error.value)


@pytest.mark.parametrize(
    "endpoint", ["", "nonsense", "tcp/127.0.0.1", "tcp/:7447", "http://x:1", "tcp/a b:1", "x" * 70000]
)
def test_an_endpoint_that_cannot_be_is_refused_at_once(endpoint: str) -> None:
    with pytest.raises(NoRouter, match="cannot be used: write it as tcp/<host>:<port>") as error:
        Bus.open(endpoint, timeout_s=None)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 200


def test_stop_ends_the_wait_for_a_router(router: Any, caplog: pytest.LogCaptureFixture) -> None:
    router.stop()
    stop = threading.Event()
    said: list[BaseException] = []

    def wait() -> None:
        try:
            Bus.open(router.endpoint, stop=stop, timeout_s=None)
        except NoRouter as error:
            said.append(error)

    waiting = threading.Thread(target=wait)
    with caplog.at_level(logging.CRITICAL, "brachium_wire.bus"):
        waiting.start()
        stop.set()
        waiting.join(15.0)
    assert not waiting.is_alive()
    assert "stopped while waiting" in str(said[0])


def test_a_router_that_comes_later_is_found(router: Any, caplog: pytest.LogCaptureFixture) -> None:
    router.stop()
    opened: list[Bus] = []

    def wait() -> None:
        opened.append(Bus.open(router.endpoint, timeout_s=None))

    waiting = threading.Thread(target=wait)
    with caplog.at_level(logging.CRITICAL, "brachium_wire.bus"):
        waiting.start()
        router.start()
        waiting.join(15.0)
    assert opened[0].connected()
    opened[0].close()


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
def test_a_key_that_is_not_ours_never_reaches_the_session(connect: Connect, until: Until, key: str) -> None:
    publisher, reader = connect(), connect()
    for attempt in (publisher.put, publisher.retain):
        with pytest.raises(keys.BadKey):
            attempt(key, b"x")
    inbox = reader.subscribe(keys.everything("gym"))
    linked(publisher, inbox, until)


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


def test_closing_twice_and_using_a_closed_bus_to_put_is_harmless(connect: Connect) -> None:
    bus = connect()
    bus.put(EVENT, b"x")
    end = bus.announce(keys.alive("gym", "view", "v"))
    bus.close()
    bus.close()
    bus.put(EVENT, b"x")
    bus.put(keys.event("gym", "new"), b"x")
    bus.retain(SESSION, b"x")
    end()
    assert not bus.connected()


def test_a_callback_may_close_and_go_on_putting(connect: Connect, until: Until) -> None:
    bus, other = connect(), connect()
    failed: list[BaseException] = []
    finished = threading.Event()

    def changed(_key: str, _alive: bool) -> None:
        try:
            bus.close()
            bus.put(EVENT, b"x")
        except BaseException as error:
            failed.append(error)
        finished.set()

    bus.watch_alive(keys.services("gym", "*/*/alive"), changed)
    other.announce(keys.alive("gym", "view", "v"))
    until(finished.is_set, "the callback")
    assert failed == []


@pytest.mark.parametrize("ending", ["pass", "raise SystemExit(3)", "raise RuntimeError('on purpose')"])
def test_a_process_with_an_open_subscription_ends(router: Any, ending: str) -> None:
    program = f"""
        import sys, threading
        sys.path[:0] = {[p for p in sys.path if p]!r}
        from brachium_wire import keys
        from brachium_wire.bus import Bus
        with Bus.open({router.endpoint!r}) as bus:
            bus.subscribe(keys.everything("gym")).on_arrival(lambda: None)
            bus.serve(keys.commands("gym", "zero"), lambda key, question: question)
            bus.announce(keys.alive("gym", "view", "v"))
            bus.watch_alive(keys.services("gym", "*/*/alive"), lambda key, alive: None)
            bus.retain(keys.session("gym", "p01"), b"x")
            {ending}
    """
    ended = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, timeout=30, check=False
    )
    assert ended.returncode == {"p": 0, "r": 1}[ending[0]] or ended.returncode == 3
    assert b"Error" not in ended.stderr or b"on purpose" in ended.stderr
