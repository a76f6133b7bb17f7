"""Keys are built and read here and nowhere else.

brachium/<room>/<subject>/imu/<segment>[/info|/status]
brachium/<room>/<subject>/skeleton/<side> | truth/<side> | calibration | session | event | snapshot
brachium/<room>/<subject>/command/<verb>
brachium/<room>/service/<kind>/<id>[/alive|/time]
"""

import re
from functools import lru_cache
from typing import NamedTuple

ROOT = "brachium"
SERVICE = "service"
DEFAULT_ROOM = "lab"
"""The room of whoever names none."""
REFERENCE = ".ref"
"""What a subject's name ends in for a second set of sensors on the same person."""

# One rule for everything that becomes part of a key: Zenoh itself would accept wildcards, spaces and control
# characters, and a leading '@' hides a key from wildcards.
_CHUNK = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}\Z")


class BadKey(ValueError):
    """A name that cannot be part of a key, or a key that is not one of ours."""


def chunk(name: str, what: str = "name") -> str:
    """Return `name` if it may stand in a key, or raise BadKey saying what may."""
    if not isinstance(name, str) or not _CHUNK.match(name):
        raise BadKey(
            f"{what} {str(name)[:80]!r} cannot be used: write 1 to 64 of A-Z a-z 0-9 _ - and, not first, ."
        )
    return name


def subject_chunk(name: str) -> str:
    """Return `name` if it may name a subject; `service` is reserved."""
    if chunk(name, "subject") == SERVICE:
        raise BadKey("subject 'service' cannot be used: that name holds the services' own keys")
    return name


class Key(NamedTuple):
    """A key taken apart. `topic` is the row of the topic table, `detail` what varies within it."""

    room: str
    subject: str
    topic: str
    detail: str


@lru_cache(maxsize=4096)  # a gateway of a full room asks for it thousands of times a second
def imu(room: str, subject: str, segment: str) -> str:
    """Return the key of a segment's sensor batches."""
    return f"{_subject(room, subject)}/imu/{chunk(segment, 'segment')}"


def info(room: str, subject: str, segment: str) -> str:
    """Return the key of what is known of a segment's sensor (retained)."""
    return f"{imu(room, subject, segment)}/info"


def status(room: str, subject: str, segment: str) -> str:
    """Return the key of a sensor's status, once a second."""
    return f"{imu(room, subject, segment)}/status"


def skeleton(room: str, subject: str, side: str) -> str:
    """Return the key of one arm's skeletons."""
    return f"{_subject(room, subject)}/skeleton/{chunk(side, 'side')}"


def truth(room: str, subject: str, side: str) -> str:
    """Return the key of what an emulated wearer's arm really does."""
    return f"{_subject(room, subject)}/truth/{chunk(side, 'side')}"


def calibration(room: str, subject: str) -> str:
    """Return the key of a subject's calibration (retained)."""
    return f"{_subject(room, subject)}/calibration"


def session(room: str, subject: str) -> str:
    """Return the key of a subject's session: lengths, exercise, settings (retained)."""
    return f"{_subject(room, subject)}/session"


def event(room: str, subject: str) -> str:
    """Return the key of a subject's events."""
    return f"{_subject(room, subject)}/event"


def snapshot(room: str, subject: str) -> str:
    """Return the key under which a recording keeps fusion's state at its first moment."""
    return f"{_subject(room, subject)}/snapshot"


def command(room: str, subject: str, verb: str) -> str:
    """Return the key of a command; it is queried and answered."""
    return f"{_subject(room, subject)}/command/{chunk(verb, 'command')}"


def commands(room: str, verb: str) -> str:
    """Return the key expression on which a service answers one command for every subject."""
    return f"{ROOT}/{chunk(room, 'room')}/*/command/{chunk(verb, 'command')}"


def service(room: str, kind: str, service_id: str) -> str:
    """Return the key of a service's health."""
    place = f"{ROOT}/{chunk(room, 'room')}/{SERVICE}"
    return f"{place}/{chunk(kind, 'service kind')}/{chunk(service_id, 'service id')}"


def alive(room: str, kind: str, service_id: str) -> str:
    """Return the key of the liveliness token of a service or node."""
    return f"{service(room, kind, service_id)}/alive"


def host_time(room: str, service_id: str) -> str:
    """Return the key on which a gateway tells its host time."""
    return f"{service(room, 'gateway', service_id)}/time"


def everything(room: str) -> str:
    """Return the key expression of all topics of a room."""
    return f"{ROOT}/{chunk(room, 'room')}/**"


def subjects(room: str, tail: str, subject: str = "*") -> str:
    """Return a key expression over subjects, `tail` being `imu/*`, `skeleton/*` and so on."""
    who = subject if subject == "*" else subject_chunk(subject)
    return f"{ROOT}/{chunk(room, 'room')}/{who}/{tail}"


def services(room: str, tail: str = "*/*") -> str:
    """Return a key expression over services: `*/*` their health, `*/*/alive` their tokens."""
    return f"{ROOT}/{chunk(room, 'room')}/{SERVICE}/{tail}"


def expression(text: str) -> str:
    """Return `text` if each chunk of it may stand in a key or is a wildcard, `*` or `**`; or raise BadKey."""
    if not isinstance(text, str) or len(text) > 1024:
        raise BadKey(
            f"key expression {str(text)[:80]!r} cannot be used: expected text of at most 1024 characters"
        )
    for part in text.split("/"):
        if part not in ("*", "**"):
            chunk(part, "part of a key expression")
    return text


_SUBJECT_TOPICS = {"calibration", "session", "event", "snapshot"}
_DETAIL_TOPICS = {"skeleton", "truth", "command"}


@lru_cache(maxsize=8192)
def parse(key: str) -> Key:
    """Return the parts of a key, or raise BadKey if it is not one of ours.

    A key received may hold wildcards (Zenoh delivers a put on a wildcard under that name): they are refused.
    """
    root, *parts = key.split("/")
    if root != ROOT or len(parts) < 3:
        raise BadKey(f"key {key[:80]!r} is not of the form {ROOT}/<room>/<subject>/<topic>")
    for part in parts:
        chunk(part, "key part")
    room, subject, topic, *rest = parts
    if subject == SERVICE:
        if len(rest) == 1:
            return Key(room, SERVICE, "health", f"{topic}/{rest[0]}")
        if len(rest) == 2 and rest[1] in ("alive", "time"):
            return Key(room, SERVICE, rest[1], f"{topic}/{rest[0]}")
    elif topic == "imu" and len(rest) == 1:
        return Key(room, subject, "imu", rest[0])
    elif topic == "imu" and len(rest) == 2 and rest[1] in ("info", "status"):
        return Key(room, subject, rest[1], rest[0])
    elif (topic in _SUBJECT_TOPICS and not rest) or (topic in _DETAIL_TOPICS and len(rest) == 1):
        return Key(room, subject, topic, rest[0] if rest else "")
    raise BadKey(f"key {key!r} names no topic of the table in docs/wire.md")


def _subject(room: str, subject: str) -> str:
    return f"{ROOT}/{chunk(room, 'room')}/{subject_chunk(subject)}"
