"""Messages to bytes and back: the one gate for foreign bytes. Whatever comes in, only WireError comes out."""

from enum import Enum
from math import isfinite
from typing import TypeVar

import msgpack
import msgspec

from brachium_wire.messages import Command, Message, SampleBatch, Skeleton
from brachium_wire.plausible import fault
from brachium_wire.topics import TOPICS


class Drop(Enum):
    """Why something that came from the network was not used. The values are the names that people see."""

    OVERSIZE = "oversize"
    MALFORMED = "malformed"
    WRONG_VERSION = "wrong_version"
    WRONG_TYPE = "wrong_type"
    WRONG_SHAPE = "wrong_shape"
    NOT_FINITE = "not_finite"
    OUT_OF_RANGE = "out_of_range"
    BAD_KEY = "bad_key"
    UNKNOWN_SEGMENT = "unknown_segment"
    NO_INFO = "no_info"
    TIME_BACKWARDS = "time_backwards"
    OUT_OF_ORDER = "out_of_order"
    REPEATED = "repeated"
    LATE = "late"
    SECOND_HOST = "second_host"
    SECOND_NODE = "second_node"
    OVERFLOW = "overflow"
    DISK_FULL = "disk_full"


class WireError(ValueError):
    """The peer sent what the topic does not promise: `drop` names the reason, the text tells a person."""

    def __init__(self, drop: Drop, text: str) -> None:
        super().__init__(text)
        self.drop = drop


# Bounds for the parser, far above any message of the table: a message of a few bytes must not claim millions.
_LIMITS = {
    "max_str_len": 65536,
    "max_bin_len": 1 << 20,
    "max_array_len": 4096,
    "max_map_len": 1024,
    "max_ext_len": 0,
}

MAX_DEPTH = 16
"""Maps and lists within one another; the deepest message of the table has 4."""
_INT64 = 1 << 63

_encoder = msgspec.msgpack.Encoder()
T = TypeVar("T", bound=Message)


def encode(message: Message) -> bytes:
    """Return the message as MessagePack, in a fifth of the time of msgpack.packb.

    The bytes are those of msgpack.packb on the same map; only a kind of more than 15 fields (status) of which
    few are set, may have the 3-byte header of a map where 1 byte would do.
    """
    return _encoder.encode(message)


def unpack(payload: bytes, max_bytes: int) -> dict[str, object]:
    """Return the MessagePack map in `payload`, or raise WireError."""
    if len(payload) > max_bytes:
        raise WireError(Drop.OVERSIZE, f"message of {len(payload)} bytes; at most {max_bytes} are taken here")
    try:
        value = msgpack.unpackb(payload, raw=False, strict_map_key=True, ext_hook=_no_extension, **_LIMITS)
    except (
        Exception
    ) as error:  # msgpack raises ValueError, its own classes, UnicodeDecodeError, RecursionError
        raise WireError(Drop.MALFORMED, f"not MessagePack: {error}") from None
    if not isinstance(value, dict):
        raise WireError(Drop.MALFORMED, f"expected a MessagePack map, came {type(value).__name__}")
    return value


def decode(payload: bytes, kind: type[T], max_bytes: int = 1 << 20) -> T:
    """Return the message of type `kind` held in `payload`, or raise WireError.

    Unknown fields are ignored, another kind or version is refused.
    """
    return convert(unpack(payload, max_bytes), kind)


def decode_batch(payload: bytes, max_bytes: int) -> SampleBatch:
    """Return what `decode` returns for a batch, at a tenth of the time: sensors send thousands a second.

    One pass parses and checks types; the size bounds what it can claim. What it does not take is left to
    `decode`, which says what is wrong. Only a fault inside an unknown field, which is ignored, may pass here.
    """
    if len(payload) <= max_bytes:
        try:
            message = _batch_decoder.decode(payload)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            pass
        else:
            if type(message) is SampleBatch:
                return message
    return decode(payload, SampleBatch, max_bytes)


# msgspec insists on the tag only where a second kind could come.
_batch_decoder: msgspec.msgpack.Decoder[SampleBatch | Command] = msgspec.msgpack.Decoder(
    SampleBatch | Command
)


def decode_skeleton(payload: bytes, max_bytes: int) -> Skeleton:
    """Return what `decode` returns for a skeleton, at a fifth of the time: a session has a hundred thousand.

    As `decode_batch` does it: what is not taken here is left to `decode`.
    """
    if len(payload) <= max_bytes:
        try:
            message = _skeleton_decoder.decode(payload)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            pass
        else:
            if type(message) is Skeleton and _numbers_sound(message) and fault(message) is None:
                return message
    return decode(payload, Skeleton, max_bytes)


_skeleton_decoder: msgspec.msgpack.Decoder[Skeleton | Command] = msgspec.msgpack.Decoder(Skeleton | Command)


def _numbers_sound(skeleton: Skeleton) -> bool:
    """Return whether the floats are finite, but for the quaternions, whose lengths are checked, and the
    integers int64. The sum of numbers is finite only if every one of them is."""
    total = sum(skeleton.angles.values()) + sum(skeleton.angle_sd.values())
    for place in skeleton.positions.values():
        total += sum(place)
    for vector in (skeleton.shoulder_shift, skeleton.shoulder_shift_sd):
        if vector is not None:
            total += sum(vector)
    largest = max(skeleton.time_ns, skeleton.received_ns or 0)
    return (
        isfinite(total)
        and largest < _INT64
        and all((pose.sequence or 0) < _INT64 for pose in skeleton.segments.values())
    )


def convert(value: dict[str, object], kind: type[T]) -> T:
    """Return an unpacked map as a message of type `kind`, or raise WireError."""
    tag = kind.__struct_config__.tag
    if value.get("m") != tag:
        raise WireError(Drop.WRONG_VERSION, f"expected a message {tag!r}, came {str(value.get('m'))[:80]!r}")
    if kind is not SampleBatch:  # a batch's numbers are in blocks, checked in samples.py
        _sound(value, str(tag), MAX_DEPTH)
    try:
        message = msgspec.convert(value, kind, builtin_types=(bytes,))
    except (msgspec.ValidationError, ValueError, TypeError, OverflowError) as error:
        raise WireError(Drop.WRONG_TYPE, f"{tag}: {error}") from None
    wrong = fault(message)
    if wrong is not None:
        raise WireError(Drop.OUT_OF_RANGE, f"{tag}: {wrong}")
    return message


def decode_topic(payload: bytes, topic: str) -> Message:
    """Return the message that the topic table promises for `topic`, or raise WireError."""
    row = TOPICS[topic]
    if row.message is Skeleton:
        return decode_skeleton(payload, row.max_bytes)
    if row.message is SampleBatch:
        return decode_batch(payload, row.max_bytes)
    return decode(payload, row.message, row.max_bytes)


def _no_extension(code: int, _data: bytes) -> object:
    raise ValueError(f"extension type {code} is not used here")


def _sound(value: object, tag: str, depth: int) -> None:
    """Raise WireError for NaN, infinity, an integer beyond int64, or nesting beyond `depth`."""
    if isinstance(value, float):
        if not isfinite(value):
            raise WireError(
                Drop.NOT_FINITE, f"{tag}: holds NaN or infinity; a number that is not known is left out"
            )
    elif isinstance(value, int):
        if not -_INT64 <= value < _INT64:
            raise WireError(Drop.OUT_OF_RANGE, f"{tag}: holds {value}; integers are int64")
    elif isinstance(value, dict | list):
        if depth == 0:
            raise WireError(Drop.MALFORMED, f"{tag}: nested deeper than {MAX_DEPTH}")
        for inner in value.values() if isinstance(value, dict) else value:
            _sound(inner, tag, depth - 1)
