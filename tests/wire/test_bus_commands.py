"""Questions asked over a bus are answered, once, and looking runs nothing."""

import logging
import threading
from collections.abc import Callable

import pytest

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import decode
from brachium_wire.messages import Answer

pytestmark = pytest.mark.network
Connect = Callable[[], Bus]
Until = Callable[[Callable[[], object], str], None]

SESSION = keys.session("gym", "p01")


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
