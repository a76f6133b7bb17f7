"""A node and its gateway without a socket: every frame, every refusal, every count."""

import hashlib
import struct

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_nodes import node_frames as f
from brachium_nodes.conversation import Close, Conversation, Publish, Send
from brachium_nodes.roster import NodeEntry, Roster
from brachium_wire.codec import WireError, encode
from brachium_wire.messages import Info, SampleBatch, Status
from brachium_wire.samples import read_samples

START = 1_700_000_000_000_000_000
MS = 1_000_000
TOKEN = hashlib.sha256(b"one").hexdigest()
OTHER = hashlib.sha256(b"other").hexdigest()
ENTRY = NodeEntry(
    id="n1", token_sha256=TOKEN, subject="p01", segment="forearm_r", mounting=(1.0, 0.0, 0.0, 0.0)
)


class Node:
    """A node on a wire without delay but for `way_ns`; its clock began 1 s before the host's second."""

    def __init__(self, roster: Roster, token: str = TOKEN, other_host: str | None = None) -> None:
        self.now = START
        self.talk = Conversation(lambda h: roster.admit(h, token, other_host), "gw-a", self.now)
        self.sent: list[bytes] = []
        self.closed: Close | None = None
        self.published: list[Publish] = []

    def clock_us(self) -> int:
        return (self.now - START) // 1000 + 1_000_000

    def do(self, actions: list) -> None:
        for action in actions:
            if isinstance(action, Send):
                self.sent.append(action.frame)
            elif isinstance(action, Close):
                self.closed = action
            else:
                self.published.append(action)

    def say(self, frame: object) -> None:
        payload = frame if isinstance(frame, bytes | str) else encode(frame)
        self.do(self.talk.receive(payload, self.now))

    def wait(self, ms: int) -> None:
        for _ in range(ms // 10):
            self.now += 10 * MS
            self.do(self.talk.tick(self.now))

    def hello(self, **more: object) -> "Node":
        self.say(f.Hello(**{"node": "n1", "boot": 1, "chip": "MPU-9150", "rate_hz": 100.0, **more}))
        return self

    def answer_clock(self) -> None:
        asks = [f.from_gateway(s) for s in self.sent]
        ask = next(a for a in reversed(asks) if isinstance(a, f.ClockAsk))
        self.now += MS
        at = self.clock_us()
        self.now += MS
        self.say(f.ClockAnswer(id=ask.id, came_us=at, left_us=at))

    def batch(self, sequence: int, n: int = 5, device_us: int | None = None, **more: object) -> f.Batch:
        rows = np.arange(n * 3, dtype="<f4").reshape(n, 3) / 10
        blocks = {"acc": rows.tobytes(), "gyr": rows.tobytes()} | more
        at = self.clock_us() - n * 10_000 if device_us is None else device_us
        return f.Batch(sequence=sequence, device_us=at, offsets=steps(n), **blocks)

    def of(self, kind: type) -> list:
        return [p.message for p in self.published if isinstance(p.message, kind)]

    def status(self) -> Status:
        return self.talk.status(self.now, connected=True)


def steps(n: int, us: int = 10_000) -> bytes:
    return (np.arange(n) * us).astype("<u4").tobytes()


def raw(**fields: object) -> f.Batch:
    return f.Batch(**{"sequence": 0, "device_us": 1, "offsets": steps(1)} | fields)


def still(n: int) -> dict:
    return {"acc": bytes(12 * n), "gyr": bytes(12 * n)}


def joined(**more: object) -> Node:
    node = Node(Roster((ENTRY,))).hello(**more)
    node.answer_clock()
    return node


def test_hello_is_answered_with_welcome_info_and_a_clock_question() -> None:
    node = Node(Roster((ENTRY,))).hello(firmware="0.1", magnetometer=True)
    welcome, ask = (f.from_gateway(s) for s in node.sent)
    assert welcome == f.Welcome(subject="p01", segment="forearm_r", host="gw-a", time_ns=START)
    assert isinstance(ask, f.ClockAsk)
    assert node.of(Info) == [
        Info(
            node="n1",
            rate_hz=100.0,
            origin="worn",
            host="gw-a",
            chip="MPU-9150",
            firmware="0.1",
            mounting=(1.0, 0.0, 0.0, 0.0),
            magnetometer=True,
        )
    ]
    assert node.published[0].topic == "info"


def test_batches_wait_for_the_clock_and_then_carry_host_time() -> None:
    node = Node(Roster((ENTRY,))).hello()
    node.now += 50 * MS
    node.say(node.batch(0))
    assert node.of(SampleBatch) == []
    came = node.now
    node.answer_clock()
    (batch,) = node.of(SampleBatch)
    samples = read_samples(batch)
    true = [START + (us - 1_000_000) * 1000 for us in batch.device_us + np.arange(5) * 10_000]
    assert np.abs(np.array(samples.time_ns) - true).max() <= batch.uncertainty_ns
    assert batch.uncertainty_ns < 30 * MS
    assert batch.received_ns == came
    assert samples.acc is not None
    assert samples.acc.shape == (5, 3)


def test_a_node_that_never_answers_is_used_with_a_large_uncertainty() -> None:
    node = Node(Roster((ENTRY,))).hello()
    node.now += 50 * MS
    node.say(node.batch(0))
    node.wait(1100)
    (batch,) = node.of(SampleBatch)
    assert batch.uncertainty_ns >= 50 * MS


def test_loss_order_repeats_and_the_tail_are_counted() -> None:
    node = joined()
    for sequence in (0, 5, 15, 10, 20, 20, 35):
        node.now += 100 * MS
        at = 2_000_000 + sequence * 10_000
        node.say(node.batch(sequence, device_us=at))
    node.say(f.Bye(next_sequence=47))
    status = node.talk.status(node.now, connected=False)
    assert (status.received, status.lost, status.out_of_order) == (30, 10 + 7, 5)
    assert status.drops == {"repeated": 5}
    assert node.closed == Close(1000, "bye")
    assert [b.sequence for b in node.of(SampleBatch)] == [0, 5, 15, 10, 20, 35]


def test_the_tail_is_counted_even_when_the_clock_was_never_answered() -> None:
    node = Node(Roster((ENTRY,))).hello()
    node.now += 50 * MS
    node.say(node.batch(0))
    node.say(f.Bye(next_sequence=12))
    status = node.talk.status(node.now, connected=False)
    assert (status.received, status.lost) == (5, 7)


def test_published_times_increase_and_out_of_order_ones_lie_before() -> None:
    node = joined()
    for sequence in (0, 10, 5, 15):
        node.now += 100 * MS
        node.say(node.batch(sequence, device_us=1_500_000 + sequence * 10_000))
    times = {b.sequence: read_samples(b).time_ns for b in node.of(SampleBatch)}
    ordered = [t for s in (0, 5, 10, 15) for t in times[s]]
    assert ordered == sorted(set(ordered))


@pytest.mark.parametrize(
    ("drop", "frame"),
    [
        ("malformed", b"\xc1"),
        ("malformed", "text"),
        ("malformed", msgpack.packb([1, 2])),
        ("wrong_version", msgpack.packb({"m": "batch/2"})),
        ("wrong_version", msgpack.packb({"m": 7})),
        ("wrong_version", msgpack.packb({"m": "welcome/1", "sub": "x"})),
        ("wrong_type", msgpack.packb({"m": "batch/1", "seq": "x", "t": 0, "dt": b""})),
        ("wrong_type", msgpack.packb({"m": "bye/1"})),
        ("oversize", msgpack.packb({"m": "batch/1", "x": bytes(5000)})),
        ("not_finite", msgpack.packb({"m": "status/1", "bat": float("nan")})),
        ("out_of_range", f.NodeStatus(battery_v=1e9)),
        ("out_of_range", f.NodeStatus(battery_v=-0.1)),
        ("out_of_range", f.NodeStatus(dropped=-1)),
        ("not_finite", raw(acc=b"\0\0\xc0\x7f" * 3, gyr=bytes(12))),
        ("out_of_range", raw(acc=struct.pack("<3f", 0, 600, 0), gyr=bytes(12))),
        ("out_of_range", raw(sequence=-1, **still(1))),
        ("out_of_range", raw(device_us=1 << 60, **still(1))),
        ("out_of_range", raw(device_us=1 << 45, **still(1))),
        ("out_of_range", f.ClockAnswer(id=999, came_us=1, left_us=1)),
        ("out_of_range", raw(quat=struct.pack("<4f", 2, 0, 0, 0))),
        ("wrong_shape", raw(offsets=b"", acc=b"", gyr=b"")),
        ("wrong_shape", raw(offsets=steps(2), acc=bytes(12), gyr=bytes(24))),
        ("wrong_shape", raw(offsets=steps(129, 10), quat=bytes(129 * 16))),
        ("wrong_shape", raw()),
        ("wrong_shape", raw(**still(1), mag=bytes(12), mag_index=b"\1\0")),
        ("time_backwards", raw(offsets=struct.pack("<2I", 0, 0), **still(2))),
        ("time_backwards", raw(offsets=struct.pack("<2I", 0, 5_000_000), **still(2))),
        ("time_backwards", raw(offsets=struct.pack("<1I", 5), **still(1))),
    ],
)  # fmt: skip
def test_a_bad_frame_is_counted_by_name_and_nothing_else_is_disturbed(drop: str, frame: object) -> None:
    node = joined()
    node.now += 100 * MS
    node.say(node.batch(0))
    node.say(frame)
    node.now += 100 * MS
    node.say(node.batch(5))
    assert node.status().drops == {drop: 1}
    assert node.status().received == 10
    assert node.status().lost == 0
    assert node.status().battery_v is None
    assert node.closed is None
    assert len(node.of(SampleBatch)) == 2


def test_bad_frames_before_the_clock_is_known_are_counted_too() -> None:
    node = Node(Roster((ENTRY,))).hello()
    node.now += 50 * MS
    node.say(node.batch(0))
    node.say(b"\xc1")
    node.say(raw(acc=struct.pack("<3f", 0, 1e9, 0), gyr=bytes(12)))
    node.say(node.batch(0))
    node.say(raw(sequence=5, device_us=1 << 45, **still(1)))
    assert node.of(SampleBatch) == []
    node.answer_clock()
    assert node.status().drops == {"malformed": 1, "out_of_range": 2, "repeated": 5}
    assert node.status().received == 5
    assert len(node.of(SampleBatch)) == 1


def test_a_batch_whose_clock_went_back_is_dropped() -> None:
    node = joined()
    node.now += 100 * MS
    node.say(node.batch(0))
    node.say(node.batch(5, device_us=node.clock_us() - 60_000))
    assert node.status().drops == {"time_backwards": 1}


def test_steps_become_si_in_either_byte_order() -> None:
    scales = f.Scales(acc=(0.01, 0.01, -0.02), gyr=(0.001,) * 3, mag=(0.3,) * 3)
    for order in ("<", ">"):
        node = joined(scales=scales, big_endian=order == ">", magnetometer=True)
        node.now += 100 * MS
        block = struct.pack(f"{order}6h", 100, -200, 300, 1, 2, 3)
        more = {
            "acc": block,
            "gyr": block,
            "mag": struct.pack(f"{order}3h", 10, 20, -30),
            "mag_index": b"\1\0",
        }
        node.say(node.batch(0, 2, **more))
        samples = read_samples(node.of(SampleBatch)[0])
        assert samples.acc is not None
        assert samples.mag is not None
        assert samples.acc[0] == pytest.approx([1.0, -2.0, -6.0], rel=1e-6)
        assert samples.mag[0] == pytest.approx([3.0, 6.0, -9.0], rel=1e-6)
        assert samples.mag_index == (1,)


def refusal(node: Node) -> f.Refused:
    frame = f.from_gateway(node.sent[-1])
    assert isinstance(frame, f.Refused)
    assert node.closed == Close(f.CLOSE_CODES[frame.code], frame.reason[:120])
    assert node.of(Info) == node.of(SampleBatch) == []
    return frame


@pytest.mark.parametrize("first", [b"\xc1", "text", encode(f.Bye(next_sequence=0))])
def test_whatever_is_not_a_hello_first_is_refused(first: bytes | str) -> None:
    node = Node(Roster((ENTRY,)))
    node.say(first)
    assert refusal(node).code == "bad_hello"


def test_a_second_hello_is_refused() -> None:
    node = joined().hello()
    assert node.closed is not None
    assert node.closed.code == f.CLOSE_CODES["bad_hello"]


def test_silence_is_ended() -> None:
    node = Node(Roster((ENTRY,)))
    node.wait(2900)
    assert node.closed is None
    node.wait(200)
    assert node.closed is not None
    assert node.closed.code == f.CLOSE_NO_HELLO


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"chip": ""}, "chip"),
        ({"chip": "x" * 65}, "chip"),
        ({"chip": "a\nb"}, "chip"),
        ({"rate_hz": 0.0}, "rate"),
        ({"rate_hz": 1001.0}, "rate"),
        ({"boot": -1}, "boot"),
        ({"node": "a/b"}, "node id"),
        ({"node": "*"}, "node id"),
        ({"scales": f.Scales(acc=(0.0, 1.0, 1.0))}, "scale of acc"),
    ],
)
def test_a_bad_hello_is_refused_with_the_reason(wrong: dict, said: str) -> None:
    refused = refusal(Node(Roster((ENTRY,))).hello(**wrong))
    assert refused.code == "bad_hello"
    assert said in refused.reason


def test_an_unknown_node_waits_and_joins_once_assigned() -> None:
    roster = Roster((ENTRY,))
    refused = refusal(Node(roster).hello(node="n2"))
    assert refused.code == "unknown_node"
    assert refused.retry_s is not None
    assert roster.waiting == ["n2"]
    assert roster.assign("n2", "p01", "hand_r") == ""
    assert roster.waiting == []
    node = Node(roster).hello(node="n2")
    assert node.of(Info)[0].node == "n2"


def test_an_unassigned_entry_waits_too() -> None:
    roster = Roster((NodeEntry(id="n1", token_sha256=TOKEN),))
    assert refusal(Node(roster).hello()).code == "unknown_node"


def test_a_token_opens_only_its_own_node() -> None:
    roster = Roster((ENTRY, NodeEntry(id="n2", token_sha256=OTHER, subject="p01", segment="hand_r")))
    assert refusal(Node(roster, token=OTHER).hello()).code == "wrong_token"
    assert roster.knows(OTHER)
    assert not roster.knows(hashlib.sha256(b"").hexdigest())


def test_a_taken_segment_is_refused_until_its_node_left() -> None:
    spare = NodeEntry(id="n2", token_sha256=TOKEN, subject="p01", segment="forearm_r")
    roster = Roster((ENTRY, spare))
    Node(roster).hello()
    refused = refusal(Node(roster).hello(node="n2"))
    assert refused.code == "segment_taken"
    assert "n1" in refused.reason
    roster.leave("n1")
    assert Node(roster).hello(node="n2").closed is None


def test_a_subject_of_another_host_is_refused_by_name() -> None:
    refused = refusal(Node(Roster((ENTRY,)), other_host="gw-b").hello())
    assert refused.code == "second_host"
    assert "gw-b" in refused.reason


def test_the_same_boot_goes_on_counting_over_connections() -> None:
    roster = Roster((ENTRY,))
    first = Node(roster).hello()
    first.answer_clock()
    first.now += 100 * MS
    first.say(first.batch(0))
    second = Node(roster).hello()
    second.now = first.now + 100 * MS
    second.say(second.batch(8))
    assert (second.status().received, second.status().lost) == (10, 3)


def test_after_a_restart_numbers_and_times_of_the_segment_go_on() -> None:
    roster = Roster((ENTRY,))
    first = joined_on(roster, boot=1)
    first.say(first.batch(0))
    roster.leave("n1")
    again = joined_on(roster, boot=2)
    again.say(again.batch(0))
    a, b = first.of(SampleBatch)[0], again.of(SampleBatch)[0]
    assert (a.sequence, b.sequence) == (0, 5)
    assert read_samples(b).time_ns[0] > read_samples(a).time_ns[-1]
    assert (again.status().received, again.status().lost) == (5, 0)


def joined_on(roster: Roster, boot: int) -> Node:
    node = Node(roster).hello(boot=boot)
    node.answer_clock()
    node.now += 100 * MS
    return node


def test_a_late_batch_is_published_as_late_and_fills_its_gap() -> None:
    node = joined()
    for sequence in (0, 10):
        node.now += 100 * MS
        node.say(node.batch(sequence, device_us=1_500_000 + sequence * 10_000))
    node.say(f.Batch(sequence=5, device_us=1_550_000, offsets=steps(5), **still(5), late=True))
    assert node.of(SampleBatch)[-1].late
    assert (node.status().lost, node.status().late, node.status().received) == (0, 5, 15)


def test_status_comes_every_second_with_what_the_node_said_and_a_last_one_says_gone() -> None:
    node = joined()
    node.say(f.NodeStatus(battery_v=3.9, rssi_dbm=-55.0, dropped=7))
    node.wait(3050)
    said = node.of(Status)
    assert len(said) == 3
    assert (said[-1].battery_v, said[-1].rssi_dbm, said[-1].node_dropped) == (3.9, -55.0, 7)
    assert all(s.connected for s in said)
    node.do(node.talk.lost(node.now))
    assert [s.connected for s in node.of(Status)] == [True] * 3 + [False]


def test_the_clock_is_asked_often_first_and_then_four_times_a_second() -> None:
    node = joined()
    node.wait(3000)
    early = len(node.sent)
    node.wait(4000)
    assert 20 <= early <= 27
    assert 13 <= len(node.sent) - early <= 17


@settings(max_examples=300)
@given(st.binary(max_size=300))
def test_any_bytes_are_a_frame_or_a_wire_error(payload: bytes) -> None:
    for read in (f.from_node, f.from_gateway):
        try:
            read(payload)
        except WireError:
            continue


values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.binary(max_size=60)
    | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)  # fmt: skip
names = st.sampled_from(
    ["seq", "t", "dt", "acc", "gyr", "mag", "mi", "quat", "late", "id", "t1", "t2", "next", "bat"]
)
kinds = st.sampled_from(["batch/1", "clock/1", "status/1", "bye/1", "hello/1"])


@settings(max_examples=300)
@given(kinds, st.dictionaries(names, values, max_size=8))
def test_no_frame_of_any_values_breaks_a_conversation(kind: str, fields: dict) -> None:
    node = joined()
    node.now += 100 * MS
    node.say(msgpack.packb({"m": kind, **fields}))
    for batch in node.of(SampleBatch):
        read_samples(batch)
