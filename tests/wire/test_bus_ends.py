"""How a bus begins and ends: no router, a password, a router that comes later, closing."""

import logging
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from brachium_wire import keys
from brachium_wire.bus import PASSWORD_VARIABLE, Bus, NoRouter

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]

EVENT = keys.event("gym", "p01")
SESSION = keys.session("gym", "p01")


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
