"""What a node under trial said on one connection: bytes with their times in, frames and faults out. Pure."""

from dataclasses import dataclass, field

from brachium_nodes import websocket_frames as ws
from brachium_nodes.batch_blocks import Measured, measure
from brachium_nodes.node_frames import (
    MAX_FRAME_BYTES,
    Batch,
    Bye,
    ClockAnswer,
    Hello,
    Kept,
    NodeStatus,
    from_node,
)
from brachium_wire.codec import WireError


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """One clock question and its answer; host times are the judge's, ns."""

    asked_ns: int
    answered_ns: int
    answer: ClockAnswer

    @property
    def round_trip_ns(self) -> int:
        """From the question's leaving to the answer's coming."""
        return self.answered_ns - self.asked_ns


@dataclass(kw_only=True)
class Heard:
    """One connection. Times are ns of the judge's clock, in the order in which things came."""

    life: int = 0
    """How often the node had been started."""
    began_ns: int = 0
    """When the upgrade was answered."""
    hello: Hello | None = None
    batches: list[tuple[int, Batch, Measured]] = field(default_factory=list)
    exchanges: list[Exchange] = field(default_factory=list)
    statuses: list[tuple[int, NodeStatus]] = field(default_factory=list)
    pongs: list[bytes] = field(default_factory=list)
    kept: bool = False
    bye: Bye | None = None
    closed: bytes | None = None
    """The payload of its close frame."""
    gone: bool = False
    """The connection has ended."""
    faults: dict[str, str] = field(default_factory=dict)
    """The first fault of each rule that looks at single frames."""
    asked: dict[int, int] = field(default_factory=dict)
    """Questions without an answer: id, and when they were asked."""
    messages: int = 0
    _reader: ws.FrameReader = field(default_factory=lambda: ws.FrameReader(MAX_FRAME_BYTES))
    _deaf: bool = False

    def take(self, data: bytes, now_ns: int) -> list[bytes]:
        """Take bytes; return the payloads of pings, which are to be answered."""
        if self._deaf:
            return []
        came, broken = self._reader.feed(data)
        pings = []
        for kind, payload in came:
            if kind == ws.PING:
                pings.append(payload)
            elif kind == ws.PONG:
                self.pongs.append(payload)
            elif kind == ws.CLOSE:
                self.closed = payload
            else:
                self._message(payload if kind == ws.BINARY else payload.decode(), now_ns)
        if broken is not None:
            self._fault("frames", str(broken))
            self._deaf = True
        return pings

    def end(self) -> None:
        """Take that the connection is gone."""
        self.gone = True

    def _fault(self, rule: str, text: str) -> None:
        self.faults.setdefault(rule, text)

    def _message(self, payload: bytes | str, now_ns: int) -> None:
        self.messages += 1
        try:
            frame = from_node(payload)
        except WireError as error:
            self._fault("hello" if self.messages == 1 else "messages", str(error))
            return
        if isinstance(frame, Hello):
            if self.messages > 1:
                self._fault("hello", "a second hello on one connection, or a message before it")
            self.hello = frame
        elif self.hello is None:
            self._fault("hello", f"the first message is {type(frame).__name__}, not hello/1")
        elif isinstance(frame, Batch):
            try:
                self.batches.append((now_ns, frame, measure(frame, self.hello)))
            except WireError as error:
                self._fault("batches", str(error))
        elif isinstance(frame, ClockAnswer):
            self._answer(frame, now_ns)
        elif isinstance(frame, NodeStatus):
            self.statuses.append((now_ns, frame))
        elif isinstance(frame, Kept):
            self.kept = True
        else:
            self.bye = frame

    def _answer(self, answer: ClockAnswer, now_ns: int) -> None:
        asked_ns = self.asked.pop(answer.id, None)
        if asked_ns is None:
            self._fault("clock answered", f"an answer to question {answer.id}, which was not asked")
        else:
            self.exchanges.append(Exchange(asked_ns=asked_ns, answered_ns=now_ns, answer=answer))
