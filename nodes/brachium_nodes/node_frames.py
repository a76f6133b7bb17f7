"""What a node and its gateway say to each other: MessagePack maps, one binary WebSocket message each.

docs/node-protocol.md explains every field to someone who writes a node in another language.
"""

from typing import Literal

import msgspec

from brachium_wire import codec
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import Message, Origin, SensorCalibration, Vector

MAX_FRAME_BYTES = 4096
"""A larger message closes the connection with 1009."""
MAX_FRAME_SAMPLES = 128
"""Samples in one batch: as float32 on the bus they must stay below the 8192 bytes of the topic `imu`."""
MAX_SPAN_US = 4_000_000
"""From the first to the last sample of one batch."""
MAX_RATE_HZ = 1000.0

RefusalCode = Literal[
    "bad_hello", "unknown_node", "wrong_token", "segment_taken", "second_host", "replaced", "reassigned"
]


class Scales(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What one step of an i16 block is worth on each axis; a block without a scale is f32 in SI units."""

    acc: Vector | None = None
    """m/s^2"""
    gyr: Vector | None = None
    """rad/s"""
    mag: Vector | None = None
    """uT"""


class Hello(Message, frozen=True, kw_only=True, tag="hello/1"):
    """Node to gateway, the first frame: who it is and what it delivers."""

    node: str = msgspec.field(name="id")
    boot: int
    """Any number that differs after a restart (u32): the same one means that clock and sequence went on."""
    chip: str
    rate_hz: float = msgspec.field(name="rate")
    firmware: str = msgspec.field(name="fw", default="")
    magnetometer: bool = msgspec.field(name="mag", default=False)
    orientation_only: bool = msgspec.field(name="ori", default=False)
    scales: Scales = msgspec.field(name="sc", default_factory=Scales)
    big_endian: bool = msgspec.field(name="be", default=False)
    """Byte order of the i16 blocks, as the chip's registers deliver it; everything else is little-endian."""
    calibration: SensorCalibration = msgspec.field(name="cal", default_factory=SensorCalibration)
    origin: Origin = msgspec.field(name="org", default="worn")


class Batch(Message, frozen=True, kw_only=True, tag="batch/1"):
    """Node to gateway: 1 to n samples in sensor axes, uncalibrated."""

    sequence: int = msgspec.field(name="seq")
    """Number of the first sample; every sample that was measured has one, sent or not."""
    device_us: int = msgspec.field(name="t")
    """The node's clock at the first sample, us."""
    offsets: bytes = msgspec.field(name="dt")
    """n x u32: us from `t` to each sample; the first is 0."""
    acc: bytes | None = None
    gyr: bytes | None = None
    mag: bytes | None = None
    mag_index: bytes | None = msgspec.field(name="mi", default=None)
    """k x u16: which samples `mag` belongs to; absent when it has one row a sample."""
    quat: bytes | None = None
    late: bool = False


class ClockAnswer(Message, frozen=True, kw_only=True, tag="clock/1"):
    """Node to gateway: its clock when the question came and when this answer left, us."""

    id: int
    came_us: int = msgspec.field(name="t1")
    left_us: int = msgspec.field(name="t2")


class NodeStatus(Message, frozen=True, kw_only=True, tag="status/1"):
    """Node to gateway, about once a second; what it cannot measure is left out."""

    battery_v: float | None = msgspec.field(name="bat", default=None)
    battery_hours: float | None = msgspec.field(name="bath", default=None)
    rssi_dbm: float | None = msgspec.field(name="rssi", default=None)
    dropped: int | None = msgspec.field(name="drop", default=None)


class Bye(Message, frozen=True, kw_only=True, tag="bye/1"):
    """Node to gateway, its last frame: the sequence number that would have come next."""

    next_sequence: int = msgspec.field(name="next")


class Kept(Message, frozen=True, kw_only=True, tag="kept/1"):
    """Node to gateway: the calibration it was told is stored, and its next hello will bring it."""


class Welcome(Message, frozen=True, kw_only=True, tag="welcome/1"):
    """Gateway to node: it may send now, and for whom it stands."""

    subject: str = msgspec.field(name="sub")
    segment: str = msgspec.field(name="seg")
    host: str
    time_ns: int = msgspec.field(name="t")
    """Host time, for the node's own log only; samples carry the node's clock."""


class ClockAsk(Message, frozen=True, kw_only=True, tag="clock/1"):
    """Gateway to node: what is your clock? To be answered at once."""

    id: int


class Keep(Message, frozen=True, kw_only=True, tag="keep/1"):
    """Gateway to node: the sensor's calibration, to be stored in place of the one that is there."""

    calibration: str = msgspec.field(name="cal")
    """The JSON text of what hello's `cal` holds; at most 800 characters."""


class Refused(Message, frozen=True, kw_only=True, tag="refused/1"):
    """Gateway to node, before it closes: why, and when it makes sense to try again."""

    code: RefusalCode
    reason: str = msgspec.field(name="why")
    retry_s: float | None = msgspec.field(name="retry", default=None)
    """Seconds to wait; absent: not before something is changed."""


CLOSE_CODES: dict[RefusalCode, int] = {
    "bad_hello": 4400,
    "wrong_token": 4401,
    "unknown_node": 4404,
    "segment_taken": 4409,
    "second_host": 4421,
    "replaced": 4410,
    "reassigned": 4411,
}
"""WebSocket close code of each refusal; 4408: no hello in time."""
CLOSE_NO_HELLO = 4408

NodeFrame = Hello | Batch | ClockAnswer | NodeStatus | Kept | Bye
GatewayFrame = Welcome | ClockAsk | Keep | Refused

_FROM_NODE: dict[str, type[Message]] = {
    "hello/1": Hello,
    "batch/1": Batch,
    "clock/1": ClockAnswer,
    "status/1": NodeStatus,
    "kept/1": Kept,
    "bye/1": Bye,
}
_FROM_GATEWAY: dict[str, type[Message]] = {
    "welcome/1": Welcome,
    "clock/1": ClockAsk,
    "keep/1": Keep,
    "refused/1": Refused,
}


_STATUS_BOUNDS = {
    "battery_v": (0.0, 10.0),
    "battery_hours": (0.0, 100_000.0),
    "rssi_dbm": (-200.0, 50.0),
    "dropped": (0, 1 << 48),
}
"""What a node can truly say of itself: one cell or two, years, any radio, a count."""


def checked_status(status: NodeStatus) -> NodeStatus:
    """Return `status`, or raise WireError when a node says of itself what cannot be."""
    for name, (low, high) in _STATUS_BOUNDS.items():
        value = getattr(status, name)
        if value is not None and not low <= value <= high:
            raise WireError(
                Drop.OUT_OF_RANGE, f"status/1: {name} {value:g} is not within {low:g} to {high:g}"
            )
    return status


_often = msgspec.msgpack.Decoder(Batch | ClockAnswer)


def from_node(payload: bytes | str) -> NodeFrame:
    """Return the frame that a node sent, or raise WireError.

    Batches and clock answers come by thousands a second: one pass parses them and checks types. Their numbers
    are checked where they are used. What that pass does not take is left to the other, which says why.
    """
    if isinstance(payload, bytes) and len(payload) <= MAX_FRAME_BYTES:
        try:
            often: Batch | ClockAnswer = _often.decode(payload)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            pass
        else:
            return often
    frame = _decode(payload, _FROM_NODE)
    assert isinstance(frame, Hello | Batch | ClockAnswer | NodeStatus | Kept | Bye)
    return frame


def from_gateway(payload: bytes | str) -> GatewayFrame:
    """Return the frame that a gateway sent, or raise WireError."""
    frame = _decode(payload, _FROM_GATEWAY)
    assert isinstance(frame, Welcome | ClockAsk | Keep | Refused)
    return frame


def _decode(payload: bytes | str, kinds: dict[str, type[Message]]) -> Message:
    if isinstance(payload, str):
        raise WireError(Drop.MALFORMED, "text frame; frames are binary MessagePack maps")
    value = codec.unpack(payload, MAX_FRAME_BYTES)
    name = value.get("m")
    kind = kinds.get(name) if isinstance(name, str) else None
    if kind is None:
        raise WireError(Drop.WRONG_VERSION, f"frame {name!r}; expected one of {', '.join(kinds)}")
    return codec.convert(value, kind)
