"""`command/assign` on a loop that is held up: what is answered is what was done."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future

import pytest

from brachium_nodes import assign_command
from brachium_wire import keys
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Answer, Command

QUESTION = encode(Command(arguments={"id": "n1", "segment": "hand_r"}))


class Asking:
    """A bus of which only the questions are there."""

    def serve_later(self, _key: str, asked: Callable) -> None:
        self._asked = asked

    def ask(self) -> Answer:
        replies: list[bytes] = []
        self._asked(keys.command("test", "p01", "assign"), QUESTION, replies.append)
        (reply,) = replies
        return decode(reply, Answer)


def served(loop: object, assign: Callable[..., str]) -> Asking:
    bus = Asking()
    assign_command.serve_assign(bus, "test", loop, lambda _node: True, assign)  # type: ignore[arg-type]
    return bus


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assign_command, "ANSWER_WITHIN_S", 0.0)


@pytest.mark.usefixtures("impatient")
def test_what_a_held_up_gateway_refused_is_not_carried_out_later() -> None:
    assigned: list[tuple] = []
    loop = asyncio.new_event_loop()
    try:
        answer = served(loop, lambda *words: assigned.append(words) or "").ask()
        loop.run_until_complete(asyncio.sleep(0))
    finally:
        loop.close()
    assert not answer.ok
    assert "too busy" in answer.reason
    assert assigned == []


def in_a_thread(begun: threading.Event) -> object:
    """A loop that does each work in a thread, and goes on once it has begun."""

    class Loop:
        def call_soon_threadsafe(self, work: Callable[[], None]) -> None:
            threading.Thread(target=work).start()
            assert begun.wait(60.0)

    return Loop()


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("reason", ["", "node 'n1' is not known here"])
def test_what_has_begun_is_answered_by_its_outcome_however_late(
    monkeypatch: pytest.MonkeyPatch, reason: str
) -> None:
    begun, given_up = threading.Event(), threading.Event()

    class Watched(Future):
        def cancel(self) -> bool:
            cancelled = super().cancel()
            given_up.set()
            return cancelled

    def assign(*_words: object) -> str:
        begun.set()
        assert given_up.wait(60.0)
        return reason

    monkeypatch.setattr(assign_command, "Future", Watched)
    assert served(in_a_thread(begun), assign).ask() == Answer(ok=not reason, reason=reason)


def test_a_fault_inside_is_told_to_who_asks() -> None:
    begun = threading.Event()

    def assign(*_words: object) -> str:
        begun.set()
        raise RuntimeError("no room on the disk")

    with pytest.raises(RuntimeError, match="no room on the disk"):
        served(in_a_thread(begun), assign).ask()


def test_a_closed_loop_is_a_gateway_that_ends() -> None:
    loop = asyncio.new_event_loop()
    loop.close()
    assert served(loop, lambda *_words: "").ask() == Answer(ok=False, reason="the gateway is ending")
