"""One connection of one node, without a socket: what came and when goes in, what is to be done comes out."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from brachium_nodes import node_frames as f
from brachium_nodes.batch_blocks import MAX_DEVICE_US, Measured, measure
from brachium_nodes.kept_calibration import Keeping
from brachium_nodes.node_records import info_of, status_of
from brachium_nodes.roster import Admission, Refusal
from brachium_nodes.sample_stream import stamp
from brachium_wire.codec import Drop, WireError, encode
from brachium_wire.messages import Message, SensorCalibration, Status

HELLO_WITHIN_NS = 3_000_000_000
STATUS_NS = 1_000_000_000
ASK_NS, ASK_OFTEN_NS = 250_000_000, 125_000_000
"""Between two clock questions; the shorter one for the first seconds."""
ASK_OFTEN_FOR_NS = 3_000_000_000
MAX_ASKED = 32
"""Questions without an answer that are remembered."""
HOLD_NS = 1_000_000_000
"""So long, batches wait for the first clock answer; then arrivals alone must tell the time."""
MAX_HELD = 256


class Send(NamedTuple):
    """Send this frame to the node."""

    frame: bytes


class Close(NamedTuple):
    """Close the connection."""

    code: int
    reason: str


class Publish(NamedTuple):
    """Put this on the bus, on the key of the node's segment. Info is retained."""

    topic: Literal["info", "imu", "status"]
    message: Message


Action = Send | Close | Publish
Admit = Callable[[f.Hello], Admission | Refusal]


class Conversation:
    """The state of one connection. `admit` decides over a hello; `host` names the clock that host time is."""

    def __init__(self, admit: Admit, host: str, now_ns: int) -> None:
        self._admit, self._host, self._since_ns = admit, host, now_ns
        self.hello: f.Hello | None = None
        self.admission: Admission | None = None
        self.closed = False
        self.refused: Refusal | None = None  # why this side ended it, if it did
        self._said: f.NodeStatus = f.NodeStatus()
        self._keeping: Keeping | None = None
        self._asked: dict[int, int] = {}
        self._next_id = 0
        self.due_ns = now_ns
        """When the next clock question is due; with it, `tick` does all else that time asks for."""
        self._status_ns = now_ns
        self._counted_ns, self._counted = now_ns, 0
        self._held: list[tuple[Measured, int]] = []

    @property
    def subject(self) -> str | None:
        """Whose node this is, once it was let in."""
        return self.admission.subject if self.admission is not None else None

    def receive(self, payload: bytes | str, now_ns: int) -> list[Action]:
        """Take a WebSocket message that came at host time `now_ns`."""
        if self.closed:
            return []
        try:
            return self._take(f.from_node(payload), now_ns)
        except WireError as error:
            if self.admission is None:
                return self._refuse(Refusal("bad_hello", f"the first frame must be hello/1: {error}"))
            self._drop(error)
            return []

    def tick(self, now_ns: int) -> list[Action]:
        """Do what time asks for: clock questions, status, the end of patience. Call it when it is due."""
        if self.closed:
            return []
        if self.admission is None:
            if now_ns - self._since_ns > HELLO_WITHIN_NS:
                return self._close(f.CLOSE_NO_HELLO, "no hello within 3 s")
            return []
        actions: list[Action] = []
        if now_ns >= self.due_ns:
            actions.append(self._ask(now_ns))
        if self._held and now_ns - self._held[0][1] > HOLD_NS:
            actions += self._release()
        if now_ns >= self._status_ns:
            self._status_ns = now_ns + STATUS_NS
            actions.append(Publish("status", self.status(now_ns, connected=True)))
        return actions

    def lost(self, now_ns: int, *, oversize: bool = False) -> list[Action]:
        """Take that the connection is gone: publish what is left and a last status."""
        if self.admission is None:
            self.refused = Refusal("bad_hello", "the first frame is too large") if oversize else self.refused
            return []
        if oversize:
            self.admission.memory.drops[Drop.OVERSIZE.value] += 1
        self.closed = True
        return [*self._release(), Publish("status", self.status(now_ns, connected=False))]

    def expel(self, refusal: Refusal) -> list[Action]:
        """End the connection from this side, telling the node why."""
        return [] if self.closed else [*self._release(), *self._refuse(refusal)]

    def status(self, now_ns: int, *, connected: bool) -> Status:
        """Return how the node fares."""
        assert self.admission is not None
        assert self.hello is not None
        memory = self.admission.memory
        elapsed = now_ns - self._counted_ns
        gained = memory.counter.received - self._counted
        rate = gained / (elapsed * 1e-9) if elapsed > STATUS_NS // 2 else None
        self._counted_ns, self._counted = now_ns, memory.counter.received
        return status_of(self.hello.node, now_ns, memory, self._said, rate_hz=rate, connected=connected)

    def _greet(self, frame: f.NodeFrame, now_ns: int) -> list[Action]:
        if not isinstance(frame, f.Hello) or self.admission is not None:
            expected = "the first frame must be hello/1" if self.admission is None else "hello/1 comes once"
            return self._refuse(Refusal("bad_hello", expected))
        answer = self._admit(frame)
        if isinstance(answer, Refusal):
            return self._refuse(answer)
        self.hello, self.admission = frame, answer
        self._since_ns = self._counted_ns = now_ns
        self._counted = answer.memory.counter.received
        self._status_ns = now_ns + STATUS_NS
        welcome = f.Welcome(subject=answer.subject, segment=answer.segment, host=self._host, time_ns=now_ns)
        self._keeping = Keeping(frame.calibration, answer.calibration)
        info, *keep = self._tell_keeping()
        return [info, Send(encode(welcome)), self._ask(now_ns), *keep]

    def keep(self, calibration: SensorCalibration) -> list[Action]:
        """Take that the sensor was calibrated anew: publish it, and have the node keep it."""
        if self.closed or self._keeping is None:
            return []
        self._keeping.calibration = calibration
        return self._tell_keeping()

    def _tell_keeping(self) -> list[Action]:
        assert self.admission is not None
        assert self.hello is not None
        assert self._keeping is not None
        info = info_of(self.hello, self._host, self.admission.entry.mounting, self._keeping)
        frame = self._keeping.frame()
        return [Publish("info", info), *([] if frame is None else [Send(encode(frame))])]

    def _take(self, frame: f.NodeFrame, now_ns: int) -> list[Action]:
        if self.admission is None or self.hello is None or isinstance(frame, f.Hello):
            return self._greet(frame, now_ns)
        if isinstance(frame, f.Batch):
            return self._batch(self.admission, measure(frame, self.hello), now_ns)
        if isinstance(frame, f.ClockAnswer):
            return self._answer(frame, now_ns)
        if isinstance(frame, f.NodeStatus):
            self._said = f.checked_status(frame)
            return []
        if isinstance(frame, f.Kept):
            assert self._keeping is not None
            if self._keeping.keeper != "gateway":
                return []
            self._keeping.kept()
            return self._tell_keeping()
        assert isinstance(frame, f.Bye)
        released = self._release()
        self.admission.memory.counter.end(frame.next_sequence)
        return [*released, *self._close(1000, "bye")]

    def _batch(self, admission: Admission, measured: Measured, now_ns: int) -> list[Action]:
        known = admission.memory.clock.known
        if not known and len(self._held) < MAX_HELD and now_ns - self._since_ns < HOLD_NS:
            self._held.append((measured, now_ns))
            return []
        actions = self._release() if self._held else []
        batch = stamp(measured, admission.memory, admission.place, now_ns)
        if batch is not None:
            actions.append(Publish("imu", batch))
        return actions

    def _release(self) -> list[Action]:
        held, self._held = self._held, []
        actions: list[Action] = []
        for measured, received_ns in held:
            assert self.admission is not None
            try:
                batch = stamp(measured, self.admission.memory, self.admission.place, received_ns)
            except WireError as error:
                self._drop(error)
                continue
            if batch is not None:
                actions.append(Publish("imu", batch))
        return actions

    def _ask(self, now_ns: int) -> Send:
        often = now_ns - self._since_ns < ASK_OFTEN_FOR_NS
        self.due_ns = now_ns + (ASK_OFTEN_NS if often else ASK_NS)
        self._next_id = (self._next_id + 1) & 0xFFFF
        self._asked[self._next_id] = now_ns
        while len(self._asked) > MAX_ASKED:
            del self._asked[next(iter(self._asked))]
        return Send(encode(f.ClockAsk(id=self._next_id)))

    def _answer(self, frame: f.ClockAnswer, now_ns: int) -> list[Action]:
        assert self.admission is not None
        asked_ns = self._asked.pop(frame.id, None)
        fits = 0 <= frame.came_us <= frame.left_us < MAX_DEVICE_US
        if (
            asked_ns is None
            or not fits
            or not self.admission.memory.clock.exchange(asked_ns, frame.came_us, frame.left_us, now_ns)
        ):
            raise WireError(Drop.OUT_OF_RANGE, "clock/1: id, t1 and t2 do not fit a question that was asked")
        return self._release()

    def _drop(self, error: WireError) -> None:
        assert self.admission is not None
        self.admission.memory.drops[error.drop.value] += 1

    def _refuse(self, refusal: Refusal) -> list[Action]:
        self.refused = refusal
        frame = f.Refused(code=refusal.code, reason=refusal.reason, retry_s=refusal.retry_s)
        return [Send(encode(frame)), *self._close(f.CLOSE_CODES[refusal.code], refusal.reason)]

    def _close(self, code: int, reason: str) -> list[Action]:
        self.closed = True
        return [Close(code, reason.encode()[:120].decode(errors="ignore"))]  # RFC 6455 5.5: at most 123 bytes
