"""What a recording begins with: fusion's state of each subject, then all that is retained."""

import logging
import re
from collections.abc import Iterable

from brachium_wire import keys
from brachium_wire.bus import ANSWERED_S, Bus
from brachium_wire.codec import Drop, WireError, decode, encode
from brachium_wire.messages import Answer, Command, Snapshot
from brachium_wire.topics import TOPICS

log = logging.getLogger(__name__)


def opening(bus: Bus, room: str, subject: str | None = None) -> list[tuple[str, bytes]]:
    """Return what a recording begins with: fusion's snapshot of each subject, then all retained messages."""
    retained = []
    for row in TOPICS.values():
        if row.retained and row.recorded:
            tail = re.sub("<[a-z]+>", "*", row.pattern.removeprefix("<subject>/"))
            retained += bus.fetch(keys.subjects(room, tail, subject or "*"))
    found = _subjects(key for key, _ in retained)
    return [one for who in found if (one := _snapshot(bus, room, who)) is not None] + retained


def _subjects(names: Iterable[str]) -> list[str]:
    found = set()
    for key in names:
        try:
            found.add(keys.parse(key).subject)
        except keys.BadKey:
            continue
    return sorted(found)


def _snapshot(bus: Bus, room: str, subject: str) -> tuple[str, bytes] | None:
    """Ask fusion for its state; None when nobody answers, or not with a snapshot."""
    reply = bus.ask(keys.command(room, subject, "record"), encode(Command()), timeout_s=ANSWERED_S)
    if reply is None:
        log.info("no fusion answered for %s: the recording begins without its state", subject)
        return None
    limit = TOPICS["snapshot"].max_bytes
    try:
        answer = decode(reply, Answer, limit + 1024)
        payload = answer.data.get("snapshot")
        if not answer.ok or not isinstance(payload, bytes):
            raise WireError(Drop.MALFORMED, answer.reason or "the answer holds no snapshot")
        decode(payload, Snapshot, limit)
    except WireError as error:
        log.warning("the recording begins without fusion's state of %s: %r", subject, str(error))
        return None
    return keys.snapshot(room, subject), payload
