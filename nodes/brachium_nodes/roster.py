"""Who may join and for whom it stands. A value: no socket, no clock, no bus."""

import hmac
from collections.abc import Callable
from dataclasses import dataclass, replace

from brachium_body.segments import SEGMENTS
from brachium_nodes.node_frames import MAX_RATE_HZ, Hello, RefusalCode
from brachium_nodes.sample_stream import Memory, SegmentMemory
from brachium_wire import keys
from brachium_wire.messages import Quaternion, SensorCalibration

SLIMEVR = "slimevr-"
"""With this begin the ids of SlimeVR trackers, which have a door of their own."""
MAX_WAITING = 64
"""Unknown nodes that are remembered; more than a room holds are not a mistake but an attack."""


@dataclass(frozen=True, kw_only=True)
class NodeEntry:
    """A node that the gateway knows. Without a subject it waits to be assigned."""

    id: str
    token_sha256: str
    """Hex SHA-256 of the node's token; the token itself is kept by the node alone."""
    subject: str | None = None
    segment: str | None = None
    mounting: Quaternion | None = None
    """Nominal segment_from_sensor."""


@dataclass(frozen=True, slots=True)
class Admission:
    """A node may join."""

    entry: NodeEntry
    subject: str
    segment: str
    memory: Memory
    place: SegmentMemory
    replaces: bool
    """An older connection of the same node is still open."""
    calibration: SensorCalibration
    """What holds: the node's own, or what was fitted and has not reached it."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """A node may not join, and why."""

    code: RefusalCode
    reason: str
    retry_s: float | None = None


class Roster:
    """The node table with who is connected, who waits, and what is remembered."""

    def __init__(
        self,
        entries: tuple[NodeEntry, ...],
        join_token_sha256: str | None = None,
        calibration_of: Callable[[str, SensorCalibration], SensorCalibration] = lambda _node, own: own,
    ) -> None:
        self._calibration_of = calibration_of
        self._entries: dict[str, NodeEntry] = {}
        for entry in entries:
            if entry.id in self._entries:
                raise ValueError(f"node {entry.id!r} is in the table twice; write it once")
            self._entries[entry.id] = _checked(entry)
        if join_token_sha256 is not None:
            _check_sha256(join_token_sha256, "join_token_sha256")
        self._join = join_token_sha256
        self._waiting: dict[str, str] = {}
        self._connected: dict[str, tuple[str, str]] = {}
        self._memories: dict[str, Memory] = {}
        self._places: dict[tuple[str, str], SegmentMemory] = {}

    @property
    def waiting(self) -> list[str]:
        """Ids of nodes that asked to join and are not assigned."""
        return list(self._waiting)

    def knows(self, token_sha256: str) -> bool:
        """Return whether anyone may connect with this token; takes equally long whatever the answer."""
        known = [e.token_sha256 for e in self._entries.values()]
        if self._join is not None:
            known.append(self._join)
        return bool(sum([hmac.compare_digest(k, token_sha256) for k in known]))

    def admit(self, hello: Hello, token_sha256: str, other_host: str | None) -> Admission | Refusal:
        """Return whether the node that says hello may join.

        `other_host` is another host through which the node's subject already comes in, or None.
        """
        wrong = wrong_hello(hello)
        if wrong:
            return Refusal("bad_hello", wrong)
        entry = self._entries.get(hello.node)
        if entry is not None and not hmac.compare_digest(entry.token_sha256, token_sha256):
            return Refusal(
                "wrong_token", f"the token does not belong to node {hello.node}; give it its own token"
            )
        if entry is None or entry.subject is None or entry.segment is None:
            if hello.node not in self._waiting and len(self._waiting) < MAX_WAITING:
                self._waiting[hello.node] = token_sha256
            how = f"brachium gateway --assign {hello.node}=SUBJECT/SEGMENT"
            return Refusal(
                "unknown_node", f"node {hello.node} is not assigned to anyone; assign it with: {how}", 5.0
            )
        place = (entry.subject, entry.segment)
        holder = next((n for n, p in self._connected.items() if p == place and n != hello.node), None)
        if holder is not None:
            return Refusal(
                "segment_taken",
                f"{place[1]} of {place[0]} is held by node {holder}; switch it off first",
                5.0,
            )
        if other_host is not None:
            text = f"{entry.subject} comes in through host {other_host}; connect all nodes of a subject there"
            return Refusal("second_host", text, 5.0)
        memory = self._memories.get(hello.node)
        if memory is None or memory.boot != hello.boot:
            memory = self._memories[hello.node] = Memory(boot=hello.boot)
        replaces = hello.node in self._connected
        self._connected[hello.node] = place
        self._waiting.pop(hello.node, None)
        where = self._places.setdefault(place, SegmentMemory())
        calibration = self._calibration_of(hello.node, hello.calibration)
        return Admission(entry, entry.subject, entry.segment, memory, where, replaces, calibration)

    def subject_of(self, node: str) -> str | None:
        """Return the subject a node is assigned to."""
        entry = self._entries.get(node)
        return entry.subject if entry is not None else None

    def token_of(self, node: str) -> str | None:
        """Return the SHA-256 of the token with which a node may come, or None for one that may not."""
        entry = self._entries.get(node)
        return entry.token_sha256 if entry is not None else self._join

    def place_of(self, node: str) -> tuple[str, str] | None:
        """Return the subject and segment a node is assigned to."""
        entry = self._entries.get(node)
        if entry is None or entry.subject is None or entry.segment is None:
            return None
        return entry.subject, entry.segment

    def leave(self, node: str) -> None:
        """Take that the node's last connection is gone."""
        self._connected.pop(node, None)

    def assign(self, node: str, subject: str, segment: str, mounting: Quaternion | None = None) -> str:
        """Assign a known or waiting node. Returns "" when done, else the reason why not."""
        try:
            keys.subject_chunk(subject)
            _known_segment(segment)
        except ValueError as error:
            return str(error)
        entry = self._entries.get(node)
        if entry is None:
            token = self._waiting.get(node)
            if token is None:
                return f"node {node!r} is not known here and does not wait; switch it on first"
            entry = NodeEntry(id=node, token_sha256=token)
        holder = next((n for n, p in self._connected.items() if p == (subject, segment) and n != node), None)
        if holder is not None:
            return (
                f"{segment} of {subject} is held by node {holder}; assign that one elsewhere or switch it off"
            )
        self._entries[node] = replace(entry, subject=subject, segment=segment, mounting=mounting)
        self._waiting.pop(node, None)
        self._memories.pop(node, None)
        return ""


def _checked(entry: NodeEntry) -> NodeEntry:
    keys.chunk(entry.id, "node id")
    _check_sha256(entry.token_sha256, f"node {entry.id!r}: token_sha256")
    if (entry.subject is None) != (entry.segment is None):
        raise ValueError(f"node {entry.id!r}: give both subject and segment, or neither")
    if entry.subject is not None and entry.segment is not None:
        keys.subject_chunk(entry.subject)
        _known_segment(entry.segment)
    return entry


def _check_sha256(text: str, what: str) -> None:
    if len(text) != 64 or not set(text) <= set("0123456789abcdef"):
        raise ValueError(f"{what} must be 64 digits of lower-case hex")


def _known_segment(segment: str) -> None:
    if segment not in SEGMENTS:
        raise ValueError(f"segment {segment[:80]!r} is not known; choose one of {', '.join(SEGMENTS)}")


def wrong_hello(hello: Hello) -> str:
    """Return what is wrong with a hello, or "" when nothing is."""
    try:
        keys.chunk(hello.node, "node id")
    except keys.BadKey as error:
        return str(error)
    if not 0 <= hello.boot < 1 << 32:
        return f"boot {hello.boot} is no u32"
    for name, text in (("chip", hello.chip), ("firmware", hello.firmware)):
        if len(text) > 64 or not text.isprintable() or (name == "chip" and not text.strip()):
            return f"{name} {text[:64]!r} cannot be used: write 1 to 64 printable characters, as in MPU-9150"
    if not 1.0 <= hello.rate_hz <= MAX_RATE_HZ:
        return f"rate {hello.rate_hz:g} Hz cannot be used: 1 to {MAX_RATE_HZ:g} Hz are taken"
    for name in ("acc", "gyr", "mag"):
        scale = getattr(hello.scales, name)
        if scale is not None and not all(1e-9 < abs(step) < 10.0 for step in scale):
            return (
                f"scale of {name} {scale} cannot be used: give what one step is worth in SI units (mag: uT)"
            )
    return ""
