"""The gate for foreign bytes: a message or a named refusal, whatever comes."""

import contextlib
import struct
from collections.abc import Callable, Iterator
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_wire import messages
from brachium_wire.codec import MAX_DEPTH, Drop, WireError, decode, decode_batch, decode_topic, encode
from brachium_wire.messages import Message
from brachium_wire.samples import read_samples
from brachium_wire.topics import TOPICS

Q = (1.0, 0.0, 0.0, 0.0)
GOOD: dict[type[Message], dict[str, Any]] = {
    messages.SampleBatch: {
        "m": "imu/1",
        "seq": 5,
        "t": 1000,
        "dt": b"\0" * 4,
        "dev": 7,
        "ddt": b"\0" * 4,
        "rx": 2000,
        "unc": 3,
        "acc": struct.pack("<3f", 0.0, 9.81, 0.0),
        "gyr": struct.pack("<3f", 0.0, 0.0, 0.0),
    },
    messages.Info: {
        "m": "info/1",
        "node": "n",
        "rate": 100.0,
        "org": "worn",
        "host": "g",
        "mnt": list(Q),
        "cal": {"gyro_bias": [0.1, 0.0, 0.0]},
    },
    messages.Status: {
        "m": "status/1",
        "node": "n",
        "t": 1,
        "up": True,
        "rcv": 1,
        "lost": 0,
        "ooo": 0,
        "bat": 3.7,
    },
    messages.Skeleton: {
        "m": "skeleton/1",
        "t": 1,
        "side": "left",
        "org": "worn",
        "fwd": "none",
        "trunk": list(Q),
        "seg": {"hand_l": {"ql": "good", "seq": 1, "q": list(Q)}},
        "pos": {"hand": [0.0, 0.1, 0.2]},
        "ang": {"elbow_flexion": 0.5},
    },
    messages.Calibration: {"m": "calibration/1", "t": 1, "state": "done", "mnt": {"hand_l": list(Q)}},
    messages.Session: {"m": "session/1", "side": "both", "height_m": 1.8, "lengths_m": {"hand": 0.2}},
    messages.Event: {"m": "event/1", "t": 1, "kind": "note", "data": {"a": [1, 2.5, None, b"x"]}},
    messages.Snapshot: {"m": "snapshot/1", "t": 1, "settings": {"filter": "vqf"}, "state": b"\x80"},
    messages.Health: {"m": "health/1", "kind": "fusion", "id": "f", "t": 1, "up": 1.5, "waiting": ["n"]},
    messages.Command: {"m": "command/1", "args": {"seconds": 3.0}},
    messages.Answer: {"m": "answer/1", "ok": True, "data": {"x": 1}},
}
REQUIRED = [
    (kind, field.encode_name) for kind in GOOD for field in msgspec.structs.fields(kind) if field.required
]
FIELDS = [(kind, field.encode_name) for kind in GOOD for field in msgspec.structs.fields(kind)]


def refusal(value: Any, kind: type[Message]) -> Drop:
    payload = value if isinstance(value, bytes) else msgpack.packb(value)
    with pytest.raises(WireError) as error:
        decode(payload, kind)
    assert str(error.value)
    return error.value.drop


def name(value: Any) -> str:
    return value.__name__ if isinstance(value, type) else str(value)[:20]


def test_every_kind_of_message_is_tried() -> None:
    assert set(GOOD) == {kind for kind in Message.__subclasses__() if kind.__module__ == Message.__module__}


@pytest.mark.parametrize("kind", GOOD, ids=name)
def test_good_ones_are_read_and_come_back_byte_by_byte(kind: type[Message]) -> None:
    payload = msgpack.packb(GOOD[kind])
    message = decode(payload, kind)
    assert type(message) is kind
    assert decode(encode(message), kind) == message
    assert msgpack.unpackb(encode(message)) == GOOD[kind]


@pytest.mark.parametrize("kind", GOOD, ids=name)
def test_bytes_are_those_of_msgpack_itself(kind: type[Message]) -> None:
    message = decode(msgpack.packb(GOOD[kind]), kind)
    payload = encode(message)
    if len(msgspec.structs.fields(kind)) >= 15:  # the header may be that of a larger map
        payload = msgpack.packb(msgpack.unpackb(payload))
    assert payload == msgpack.packb(msgspec.to_builtins(message, builtin_types=(bytes,)))


@given(
    st.dictionaries(
        st.text(max_size=10),
        st.recursive(
            st.none()
            | st.booleans()
            | st.integers(-(2**63), 2**63 - 1)
            | st.floats(allow_nan=False, allow_infinity=False)
            | st.text(max_size=40)
            | st.binary(max_size=300),
            lambda inner: (
                st.lists(inner, max_size=17) | st.dictionaries(st.text(max_size=5), inner, max_size=6)
            ),
            max_leaves=12,
        ),
        max_size=17,
    )
)
def test_any_values_are_written_as_msgpack_writes_them(data: dict[str, Any]) -> None:
    event = messages.Event(time_ns=-5, kind="k", data=data)
    payload = encode(event)
    assert payload == msgpack.packb(msgspec.to_builtins(event, builtin_types=(bytes,)))
    assert decode(payload, messages.Event) == event


@pytest.mark.parametrize("kind", GOOD, ids=name)
def test_unknown_fields_are_ignored(kind: type[Message]) -> None:
    plain = decode(msgpack.packb(GOOD[kind]), kind)
    more = {**GOOD[kind], "new": {"anything": [1, b"x", {"y": None}]}, "zz": 3}
    assert decode(msgpack.packb(more), kind) == plain


@pytest.mark.parametrize("kind", GOOD, ids=name)
@pytest.mark.parametrize(
    "tag", [None, "", "imu/2", "imu", "answer/10", 1, [1], {"m": 1}, b"imu/1", "x" * 9000]
)
def test_another_kind_or_version_is_refused(kind: type[Message], tag: Any) -> None:
    assert refusal({**GOOD[kind], "m": tag}, kind) is Drop.WRONG_VERSION


@pytest.mark.parametrize("kind", GOOD, ids=name)
def test_no_kind_at_all_is_refused(kind: type[Message]) -> None:
    assert refusal({k: v for k, v in GOOD[kind].items() if k != "m"}, kind) is Drop.WRONG_VERSION


@pytest.mark.parametrize(("kind", "field"), REQUIRED, ids=name)
def test_a_missing_field_is_refused(kind: type[Message], field: str) -> None:
    assert refusal({k: v for k, v in GOOD[kind].items() if k != field}, kind) is Drop.WRONG_TYPE


@pytest.mark.parametrize(("kind", "field"), FIELDS, ids=name)
def test_a_field_of_another_type_is_refused(kind: type[Message], field: str) -> None:
    drops = []
    for value in (3, 2.5, "text", b"bytes", True, [1, "a"], {"a": "b"}, {"a": []}):
        try:
            decode(msgpack.packb({**GOOD[kind], field: value}), kind)
        except WireError as error:
            drops.append(error.drop)
    assert set(drops) <= {Drop.WRONG_TYPE, Drop.OUT_OF_RANGE}
    assert drops.count(Drop.WRONG_TYPE) >= 5


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_finite_is_refused_wherever_it_stands(number: float) -> None:
    for kind, value in GOOD.items():
        if kind is not messages.SampleBatch:
            for bad in with_one_float_changed(value, number):
                assert refusal(bad, kind) is Drop.NOT_FINITE
    assert (
        refusal({**GOOD[messages.Event], "data": {"a": [{"b": number}]}}, messages.Event) is Drop.NOT_FINITE
    )
    assert refusal({**GOOD[messages.Event], "unknown": number}, messages.Event) is Drop.NOT_FINITE


def with_one_float_changed(value: Any, number: float) -> Iterator[Any]:
    if isinstance(value, float):
        yield number
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from ({**value, key: changed} for changed in with_one_float_changed(inner, number))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            for changed in with_one_float_changed(inner, number):
                yield [*value[:i], changed, *value[i + 1 :]]


@pytest.mark.parametrize("number", [2**63, 2**64 - 1])
def test_integers_beyond_int64_are_refused(number: int) -> None:
    assert refusal({**GOOD[messages.Event], "t": number}, messages.Event) is Drop.OUT_OF_RANGE
    assert refusal({**GOOD[messages.Answer], "data": {"a": [number]}}, messages.Answer) is Drop.OUT_OF_RANGE
    batch = decode(msgpack.packb({**GOOD[messages.SampleBatch], "t": number}), messages.SampleBatch)
    with pytest.raises(WireError) as error:
        read_samples(batch)
    assert error.value.drop is Drop.OUT_OF_RANGE


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        (messages.Info, {"rate": 0.0}),
        (messages.Info, {"rate": -100.0}),
        (messages.Info, {"rate": 1e9}),
        (messages.Info, {"mnt": [0.0, 0.0, 0.0, 0.0]}),
        (messages.Info, {"mnt": [2.0, 0.0, 0.0, 0.0]}),
        (messages.Status, {"rcv": -1}),
        (messages.Status, {"late": -1}),
        (messages.Skeleton, {"trunk": [0.0, 0.0, 0.0, 0.0]}),
        (messages.Skeleton, {"seg": {"hand_l": {"ql": "good", "q": [1.0, 1.0, 0.0, 0.0]}}}),
        (messages.Skeleton, {"seg": {"hand_l": {"ql": "good", "sq": [0.0, 0.0, 0.0, 0.0]}}}),
        (messages.Skeleton, {"seg": {"hand_l": {"ql": "good", "sq": [1e300, 0.0, 0.0, 0.0]}}}),
        (messages.Calibration, {"mnt": {"hand_l": [0.0, 0.0, 0.5, 0.0]}}),
        (messages.Session, {"height_m": 0.0}),
        (messages.Session, {"height_m": 180.0}),
        (messages.Session, {"lengths_m": {"hand": -0.1}}),
        (messages.Session, {"lengths_m": {"hand": 19.0}}),
    ],
)
def test_what_cannot_be_true_is_refused(kind: type[Message], change: dict[str, Any]) -> None:
    assert refusal({**GOOD[kind], **change}, kind) is Drop.OUT_OF_RANGE


def test_too_large_a_message_is_not_even_looked_at() -> None:
    for topic, row in TOPICS.items():
        with pytest.raises(WireError) as error:
            decode_topic(b"\xc1" * (row.max_bytes + 1), topic)
        assert error.value.drop is Drop.OVERSIZE
        with pytest.raises(WireError) as error:
            decode_topic(b"\xc1" * row.max_bytes, topic)
        assert error.value.drop is Drop.MALFORMED


@pytest.mark.parametrize("kind", GOOD, ids=name)
def test_torn_or_lengthened_bytes_are_refused(kind: type[Message]) -> None:
    payload = msgpack.packb(GOOD[kind])
    for end in range(len(payload)):
        assert refusal(payload[:end], kind) is Drop.MALFORMED
    for tail in (b"\x00", b"\xc0", payload):
        assert refusal(payload + tail, kind) is Drop.MALFORMED


@pytest.mark.parametrize("value", [None, 1, "text", b"x", [], [1, 2], True, 2.5])
def test_what_is_no_map_is_refused(value: Any) -> None:
    assert refusal(msgpack.packb(value), messages.Event) is Drop.MALFORMED


@pytest.mark.parametrize("opening", [b"\x91", b"\x81\xa1a"], ids=["lists", "maps"])
@pytest.mark.parametrize("field", [b"data", b"zzzz"])
def test_depth_bombs_are_refused(opening: bytes, field: bytes) -> None:
    head = b"\x84\xa1m\xa7event/1\xa1t\x01\xa4kind\xa1x\xa4" + field + b"\x81\xa1a"
    for depth in (MAX_DEPTH, 100, 400, 900, 1020, 1024, 5000, 200_000):
        assert refusal(head + opening * depth + b"\xc0", messages.Event) is Drop.MALFORMED
    decode(head + opening * 5 + b"\xc0", messages.Event)


@pytest.mark.parametrize(
    "claim",
    [
        b"\xdb\xff\xff\xff\xff",
        b"\xc6\xff\xff\xff\xff",
        b"\xdd\xff\xff\xff\xff",
        b"\xdf\xff\xff\xff\xff",
        b"\xc9\xff\xff\xff\xff\x01",
        b"\xdd\x00\x01\x00\x00" + b"\xc0" * 65536,
        b"\xdd\x0f\xff\xff\xff" * 50,
    ],
)
def test_claimed_lengths_are_not_believed(claim: bytes) -> None:
    head = b"\x84\xa1m\xa7event/1\xa1t\x01\xa4kind\xa1x\xa4data\x81\xa1a"
    assert refusal(head + claim, messages.Event) is Drop.MALFORMED
    assert refusal(claim, messages.Event) is Drop.MALFORMED


def test_extension_types_and_strange_keys_are_refused() -> None:
    good = GOOD[messages.Event]
    assert refusal({**good, "data": {"a": msgpack.Timestamp(1, 2)}}, messages.Event) is Drop.MALFORMED
    assert refusal({**good, "data": {"a": msgpack.ExtType(5, b"")}}, messages.Event) is Drop.MALFORMED
    assert refusal({**good, 5: 1}, messages.Event) is Drop.MALFORMED
    assert refusal({**good, b"x": 1}, messages.Event) is Drop.WRONG_TYPE
    assert (
        refusal(msgpack.packb(good).replace(b"note", b"\xff\xfe\xfd\xfc"), messages.Event) is Drop.MALFORMED
    )


@given(st.binary(max_size=300))
def test_any_bytes_give_a_message_or_a_refusal(payload: bytes) -> None:
    for topic in TOPICS:
        with contextlib.suppress(WireError):
            decode_topic(payload, topic)


@given(st.sampled_from(list(GOOD)), st.data())
def test_good_bytes_with_some_changed_give_a_message_or_a_refusal(
    kind: type[Message], data: st.DataObject
) -> None:
    payload = bytearray(msgpack.packb(GOOD[kind]))
    for _ in range(data.draw(st.integers(1, 4))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    try:
        message = decode(bytes(payload), kind)
        if isinstance(message, messages.SampleBatch):
            read_samples(message)
    except WireError:
        return
    assert type(message) is kind
    encode(message)


JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=8,
)


@given(st.sampled_from(FIELDS), JUNK)
def test_the_right_map_with_one_strange_field_gives_a_message_or_a_refusal(
    where: tuple[type[Message], str], junk: Any
) -> None:
    kind, field = where
    try:
        message = decode(msgpack.packb({**GOOD[kind], field: junk}), kind)
    except WireError:
        return
    assert decode(encode(message), kind) == message


def outcome(read: Callable[[bytes], Message], payload: bytes) -> Message | Drop:
    try:
        return read(payload)
    except WireError as error:
        return error.drop


@given(
    st.binary(max_size=200)
    | st.builds(
        lambda field, junk: msgpack.packb({**GOOD[messages.SampleBatch], field: junk}),
        st.sampled_from([f.encode_name for f in msgspec.structs.fields(messages.SampleBatch)] + ["m", "new"]),
        JUNK,
    )
    | st.builds(
        lambda at, byte: (lambda b: b[:at] + bytes([byte]) + b[at + 1 :])(
            msgpack.packb(GOOD[messages.SampleBatch])
        ),
        st.integers(0, 120),
        st.integers(0, 255),
    )
)
def test_the_quick_way_for_batches_gives_what_the_thorough_one_gives(payload: bytes) -> None:
    limit = TOPICS["imu"].max_bytes
    quick = outcome(lambda p: decode_batch(p, limit), payload)
    thorough = outcome(lambda p: decode(p, messages.SampleBatch, limit), payload)
    if isinstance(thorough, Drop) and not isinstance(quick, Drop):
        assert thorough is Drop.MALFORMED  # in a field that is unknown: as if it were not there
        plain = msgpack.unpackb(encode(quick))
        assert decode(msgpack.packb(plain), messages.SampleBatch) == quick
    else:
        assert quick == thorough


def test_the_quick_way_refuses_by_the_same_names() -> None:
    good = GOOD[messages.SampleBatch]
    for payload, drop in (
        (msgpack.packb({**good, "m": "imu/2"}), Drop.WRONG_VERSION),
        (msgpack.packb({"m": "command/1"}), Drop.WRONG_VERSION),
        (msgpack.packb({**good, "dt": "text"}), Drop.WRONG_TYPE),
        (msgpack.packb(good) + b"\x00", Drop.MALFORMED),
        (msgpack.packb({**good, "acc": b"\x00" * 9000}), Drop.OVERSIZE),
        (b"\x91" * 5000, Drop.MALFORMED),
    ):
        assert outcome(lambda p: decode_batch(p, 8192), payload) is drop
