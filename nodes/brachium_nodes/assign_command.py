"""`command/assign`: who a node stands for, changed while the gateway runs."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoAnswer

import msgspec

from brachium_wire import keys
from brachium_wire.bus import Bus
from brachium_wire.codec import WireError, decode, encode
from brachium_wire.messages import Answer, Command, Quaternion
from brachium_wire.topics import TOPICS

ANSWER_WITHIN_S = 2.0

Assign = Callable[[str, str, str, Quaternion | None], str]
"""Node, subject, segment and nominal mounting; returns "" or the reason why not."""


class _Wanted(msgspec.Struct):
    id: str
    segment: str
    mounting: Quaternion | None = None


def serve_assign(bus: Bus, room: str, loop: asyncio.AbstractEventLoop, assign: Assign) -> None:
    """Answer the command for every subject; `assign` runs on `loop`, questions come on Zenoh's threads."""

    def answer(key: str, question: bytes) -> bytes:
        done: Future[Answer] = Future()
        try:
            loop.call_soon_threadsafe(lambda: done.set_result(_answer(key, question, assign)))
            return encode(done.result(timeout=ANSWER_WITHIN_S))
        except (RuntimeError, NoAnswer):  # the loop is closed, or just stopped
            return encode(Answer(ok=False, reason="the gateway is ending"))

    bus.serve(keys.commands(room, "assign"), answer)


def _answer(key: str, question: bytes, assign: Assign) -> Answer:
    try:
        subject = keys.parse(key).subject
        command = decode(question, Command, TOPICS["command"].max_bytes)
        wanted = msgspec.convert(command.arguments, _Wanted)
    except (keys.BadKey, WireError, msgspec.ValidationError) as error:
        return Answer(ok=False, reason=f"assign takes id, segment and perhaps mounting: {error}")
    reason = assign(wanted.id, subject, wanted.segment, wanted.mounting)
    return Answer(ok=not reason, reason=reason)
