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


def serve_assign(
    bus: Bus, room: str, loop: asyncio.AbstractEventLoop, mine: Callable[[str], bool], assign: Assign
) -> None:
    """Answer the command for every subject; `assign` runs on `loop`, questions come on Zenoh's threads.

    A node that is not `mine` is left to the service whose it is.
    """

    def asked(key: str, question: bytes, reply: Callable[[bytes], None]) -> None:
        try:
            command = decode(question, Command, TOPICS["command"].max_bytes)
            wanted = msgspec.convert(command.arguments, _Wanted)
            subject = keys.parse(key).subject
        except (keys.BadKey, WireError, msgspec.ValidationError) as error:
            text = f"assign takes id, segment and perhaps mounting: {error}"
            reply(encode(Answer(ok=False, reason=text)))
            return
        if mine(wanted.id):
            reply(encode(_done(wanted, subject)))

    def _done(wanted: _Wanted, subject: str) -> Answer:
        done: Future[str] = Future()

        def work() -> None:
            if not done.set_running_or_notify_cancel():
                return
            try:
                done.set_result(assign(wanted.id, subject, wanted.segment, wanted.mounting))
            except Exception as error:  # told to who asks
                done.set_exception(error)

        try:
            loop.call_soon_threadsafe(work)
        except RuntimeError:  # the loop is closed
            return Answer(ok=False, reason="the gateway is ending")
        try:
            reason = done.result(timeout=ANSWER_WITHIN_S)
        except NoAnswer:
            # What was begun is answered by its outcome; what was not is never carried out behind a refusal.
            reason = "the gateway is too busy, or ending" if done.cancel() else done.result()
        return Answer(ok=not reason, reason=reason)

    bus.serve_later(keys.commands(room, "assign"), asked)
