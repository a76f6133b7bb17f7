"""Many skeletons at once are what `decode` makes of each: the same taken, the same refused, equal numbers."""

import math
from collections import Counter
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_wire import skeleton_columns
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Skeleton
from brachium_wire.skeleton_columns import SkeletonCollector, SkeletonColumns

Q = [1.0, 0.0, 0.0, 0.0]
ANGLES = ("elbow_flexion", "isb_plane", "trunk_flexion")
JOINTS = ("elbow", "hand")

ANY = st.sampled_from(
    [0.0, -0.0, 0, 1, 127, 128, -1, -33, 70_000, -70_000, 2**40, 2**63, math.nan, math.inf, -math.inf, 1e300,
     1.7e308, 1e-310, 0.1, True, None, "x"]
)  # fmt: skip
USUAL = st.floats(-3.0, 3.0, width=32)
NUMBER = st.one_of(*[USUAL] * 12, ANY)
WHOLE = st.one_of(*[st.integers(0, 300)] * 6, st.integers(-(2**63), 2**64 - 1), ANY)

MORE = st.recursive(
    NUMBER,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["q", "seg", "more"]), inner),
    max_leaves=6,
)
"""What a field holds that is not known here."""


@st.composite
def turn(draw: st.DrawFn) -> list[Any]:
    """Four numbers, mostly of length 1, and sometimes just at what is taken for it."""
    if draw(st.integers(0, 9)) == 0:
        return draw(st.lists(NUMBER, min_size=4, max_size=4))
    length = draw(st.sampled_from([1.0, 1.0, 1.0, 1.05, 1.0500001, 0.95, 0.9499999]))
    about = draw(st.floats(-3.0, 3.0))
    return [length * math.cos(about), 0.0, length * math.sin(about), draw(st.sampled_from([0, 0.0]))]


@st.composite
def skeleton_map(draw: st.DrawFn) -> dict[str, Any]:
    """A skeleton as a map: mostly sound, of few forms."""
    rich = draw(st.booleans())
    quality = draw(st.sampled_from(["good", "good", "held", "nonsense"]))
    value: dict[str, Any] = {
        "m": "skeleton/1",
        "t": draw(st.one_of(st.integers(10**18, 2 * 10**18), WHOLE)),
        "side": "right",
        "org": "worn",
        "fwd": "elbow",
        "trunk": draw(turn()),
        "seg": {"hand_r": {"ql": quality, "seq": draw(WHOLE), "q": draw(turn())}},
        "pos": {joint: draw(st.lists(NUMBER, min_size=3, max_size=3)) for joint in JOINTS[: 1 + rich]},
        "ang": {name: draw(NUMBER) for name in ANGLES[: 1 + 2 * rich]},
    }
    if rich:
        value["seg"]["sternum"] = {"ql": "good", "sq": draw(turn())}
        value["shift"] = draw(st.lists(NUMBER, min_size=3, max_size=3))
        value["angsd"] = {"isb_plane": draw(NUMBER)}
        value["aq"] = {"isb_plane": "assumed"}
    if draw(st.booleans()):
        value["rx"] = draw(WHOLE)
    if draw(st.integers(0, 4)) == 0:
        inside = draw(st.sampled_from([value, value["seg"]["hand_r"]]))
        inside["more"] = draw(MORE)
    return value


@st.composite
def payloads(draw: st.DrawFn) -> bytes:
    """One message: a skeleton in doubles or floats, with a byte changed now and then, or anything."""
    if draw(st.integers(0, 19)) == 0:
        return draw(st.binary(max_size=40))
    value, single = draw(skeleton_map()), draw(st.integers(0, 3)) == 0
    try:
        payload = msgpack.packb(value, use_single_float=single)
    except OverflowError:  # one of them is no float32
        payload = msgpack.packb(value)
    if draw(st.integers(0, 9)) == 0:
        at = draw(st.integers(0, len(payload) - 1))
        payload = payload[:at] + bytes([draw(st.integers(0, 255))]) + payload[at + 1 :]
    return payload


def one_by_one(messages: list[bytes]) -> tuple[list[tuple[int, Skeleton]], Counter[str]]:
    """Return the skeletons with their places, and the refusals, as `decode` has them."""
    taken, refused = [], Counter[str]()
    for i, payload in enumerate(messages):
        try:
            found = decode_topic(payload, "skeleton")
        except WireError as error:
            refused[error.drop.value] += 1
        else:
            assert isinstance(found, Skeleton)
            taken.append((i, found))
    return taken, refused


def collected(messages: list[bytes]) -> tuple[SkeletonColumns, Counter[str]]:
    collector = SkeletonCollector()
    for i, payload in enumerate(messages):
        collector.take(payload, 1000 + i)
    return collector.columns(), collector.refused


def assert_same(columns: SkeletonColumns, taken: list[tuple[int, Skeleton]]) -> None:
    skeletons = [skeleton for _, skeleton in taken]
    assert columns.arrived_ns.tolist() == [1000 + i for i, _ in taken]
    assert columns.time_ns.tolist() == [s.time_ns for s in skeletons]
    received = [s.received_ns for s in skeletons if s.received_ns is not None]
    assert columns.received_ns[columns.received].tolist() == received
    unknown = (math.nan, math.nan, math.nan)
    names = [*ANGLES, "not_there"]
    angles = np.array([[s.angles.get(name, math.nan) for name in names] for s in skeletons], dtype=float)
    np.testing.assert_array_equal(columns.angles_rad(names), angles.reshape(-1, len(names)))
    for joint in JOINTS:
        places = np.array([s.positions.get(joint, unknown) for s in skeletons], dtype=float)
        np.testing.assert_array_equal(columns.positions_m(joint), places.reshape(-1, 3))
    shift = np.array([s.shoulder_shift or unknown for s in skeletons], dtype=float).reshape(-1, 3)
    np.testing.assert_array_equal(columns.shoulder_shift_m(), shift)
    sd = np.array([s.shoulder_shift_sd or unknown for s in skeletons], dtype=float).reshape(-1, 3)
    np.testing.assert_array_equal(columns.shoulder_shift_sd_m(), sd)
    for which, skeleton in zip(columns.form.tolist(), skeletons, strict=True):
        assert words(columns.examples[which]) == words(skeleton)


def words(s: Skeleton) -> tuple[Any, ...]:
    qualities = {name: pose.quality for name, pose in s.segments.items()}
    return s.side, s.origin, s.forward, s.assumed, qualities, set(s.angles), set(s.positions)


@given(messages=st.lists(payloads(), max_size=24), block=st.sampled_from([1, 5, 512]))
@settings(max_examples=100, deadline=None)
def test_what_is_taken_and_refused_is_what_decode_takes_and_refuses(
    messages: list[bytes], block: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(skeleton_columns, "BLOCK", block)
        patch.setattr(skeleton_columns, "KEPT", 2)
        columns, refused = collected(messages)
    taken, thorough = one_by_one(messages)
    assert refused == thorough
    assert_same(columns, taken)


def plain(i: int, **more: Any) -> bytes:
    value = {
        "m": "skeleton/1", "t": 10**18 + i, "side": "left", "org": "worn", "fwd": "none", "trunk": Q,
        "seg": {"hand_l": {"ql": "good", "seq": i, "q": Q, "sq": Q}},
        "pos": {"hand": [0.1 * i, 0.0, 0.5]}, "ang": {"elbow_flexion": 0.001 * i}, **more,
    }  # fmt: skip
    return bytes(msgpack.packb(value))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"ang": {"elbow_flexion": math.nan}}, "not_finite"),
        ({"pos": {"hand": [0.0, -math.inf, 0.0]}}, "not_finite"),
        ({"trunk": [1.0, 0.0, 0.0, 0.4]}, "out_of_range"),
        ({"seg": {"hand_l": {"ql": "good", "seq": 5, "q": Q, "sq": [1e300, 0.0, 0.0, 0.0]}}}, "out_of_range"),
        ({"seg": {"hand_l": {"ql": "good", "seq": 5, "q": [math.nan, *Q[1:]], "sq": Q}}}, "not_finite"),
        ({"t": 2**63}, "out_of_range"),
        ({"side": "best"}, "wrong_type"),
        ({"m": "skeleton/2"}, "wrong_version"),
    ],
)
def test_a_bad_one_among_its_like_is_refused_by_name_and_costs_no_other(
    change: dict[str, Any], reason: str
) -> None:
    messages = [plain(i) for i in range(1000)]
    messages[600] = plain(600, **change)
    columns, refused = collected(messages)
    assert refused == {reason: 1}
    assert columns.arrived_ns.tolist() == [1000 + i for i in range(1000) if i != 600]
    assert_same(columns, one_by_one(messages)[0])


def test_a_name_that_a_message_holds_twice_counts_as_decode_counts_it() -> None:
    """The last one holds, also where only the first would be unsound, or names another joint."""
    for first, second in (({"hand": [math.nan, 0.0, 0.0]}, {"hand": [1.0, 2.0, 3.0]}),
                          ({"hand": [1.0, 2.0, 3.0]}, {"elbow": [4.0, 5.0, 6.0]}),
                          ({"hand": [1.0, 2.0, 3.0]}, {"hand": [math.nan, 5.0, 6.0]})):  # fmt: skip
        one = plain(5)
        at = one.index(b"\xa3pos")
        twice = one[:at] + b"\xa3pos" + msgpack.packb(first) + b"\xa3pos" + msgpack.packb(second)
        end = one.index(b"\xa3ang")
        payload = bytes([one[0] + 1]) + twice[1:] + one[end:]
        messages = [plain(4), payload, payload, plain(6)]
        columns, refused = collected(messages)
        taken, thorough = one_by_one(messages)
        assert refused == thorough
        assert_same(columns, taken)


def test_one_form_holds_many_and_decode_is_asked_once_for_each(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bytes] = []
    thorough = skeleton_columns.decode_skeleton

    def counting(payload: bytes, max_bytes: int) -> Skeleton:
        asked.append(payload)
        return thorough(payload, max_bytes)

    monkeypatch.setattr(skeleton_columns, "decode_skeleton", counting)
    columns, _ = collected([plain(i) for i in range(2000)])
    assert len(columns) == 2000
    assert len(columns.examples) == len(asked) == 3  # the sequence numbers take one, two and three bytes


@pytest.mark.parametrize("more", [0.5, 300, [0.1, 200, {"x": 1.0}], {"q": {"q": [1.0]}, "seg": [2.0]}])
def test_numbers_in_fields_that_are_not_known_make_no_form_of_their_own(more: Any) -> None:
    def times(value: Any, i: int) -> Any:
        if isinstance(value, list):
            return [times(inner, i) for inner in value]
        if isinstance(value, dict):
            return {name: times(inner, i) for name, inner in value.items()}
        return value * (1 + i % 200)

    messages = [plain(200, more=times(more, i), t=10**18 + i) for i in range(1000)]
    columns, refused = collected(messages)
    assert refused == {}
    assert len(columns.examples) <= 9  # a whole number takes one byte, two or four
    assert_same(columns, one_by_one(messages)[0])


@pytest.mark.parametrize(
    "more",
    [b"\x81\x90\x01", b"\x81\x80\x01", b"\x81\xa2\xff\xfe\x01", b"\xa2\xff\xfe", b"\xd4\xff\x00",
     b"\xd4\x05\x00", b"\x81\xcb\x7f\xf8\0\0\0\0\0\0\x01", 900 * b"\x91" + b"\x01"],
    ids=["list as key", "map as key", "key no text", "no text", "no time", "extension", "NaN as key", "deep"],
)  # fmt: skip
def test_whatever_a_field_holds_that_is_not_known_the_others_are_taken(more: bytes) -> None:
    one = plain(1)
    odd = bytes([one[0] + 1]) + one[1:] + b"\xa4more" + more
    messages = [plain(0), odd, plain(2), odd]
    columns, refused = collected(messages)
    assert refused == {}
    assert_same(columns, one_by_one(messages)[0])


def test_one_nested_deeper_than_any_parser_goes_is_malformed(monkeypatch: pytest.MonkeyPatch) -> None:
    one = plain(1)
    payload = bytes([one[0] + 1]) + one[1:] + b"\xa4more" + 3000 * b"\x91" + b"\x01"
    known = skeleton_columns.decode_skeleton(one, 8192)
    monkeypatch.setattr(skeleton_columns, "decode_skeleton", lambda *_: known)  # newer Pythons go as deep
    columns, refused = collected([plain(0), payload])
    assert refused == {"malformed": 1}
    assert len(columns) == 1


def test_too_large_and_empty_ones_are_refused() -> None:
    columns, refused = collected([b"", plain(1), plain(2, more=b"x" * 9000)])
    assert refused == {"malformed": 1, "oversize": 1}
    assert len(columns) == 1


def test_nothing_is_columns_too() -> None:
    columns, refused = collected([])
    assert (len(columns), refused) == (0, {})
    assert columns.angles_rad(ANGLES).shape == (0, 3)
    with pytest.raises(IndexError):
        _ = columns.last
