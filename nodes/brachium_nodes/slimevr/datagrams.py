"""What a SlimeVR tracker says: bytes of one datagram to records. Whatever comes in, nothing is raised.

All numbers are big-endian. A datagram is a u32 type, a u64 number and a payload; a bundle holds several
packets without numbers. Fields that later versions of the protocol appended are ignored, those that early
ones did not have yet are None. The layout is that of the trackers' firmware, protocol 22.
"""

from collections.abc import Callable, Iterator
from math import isfinite, sqrt
from struct import Struct, unpack_from

from brachium_nodes.slimevr.records import (
    Acceleration,
    Battery,
    Datagram,
    Drop,
    Features,
    Handshake,
    Heartbeat,
    Pong,
    Record,
    Rotation,
    SensorInfo,
    Signal,
    Tap,
    Trouble,
    Unused,
)
from brachium_wire.plausible import LENGTH_TOLERANCE

MAX_BYTES = 1472
"""What fits one Ethernet frame; trackers send no more."""
MAX_VOLTS = 20.0
MAX_ACCELERATION = 500.0
_HEADER = Struct(">IQ")
_Q15 = 1.0 / 32768.0


class _Refused(Exception):
    def __init__(self, drop: Drop) -> None:
        self.drop = drop


def read(data: bytes) -> Datagram:
    """Return the records of a datagram, and why what else is in it was not used."""
    if len(data) > MAX_BYTES:
        return Datagram(0, (), (Drop.OVERSIZE,))
    if len(data) < _HEADER.size:
        return Datagram(0, (), (Drop.TRUNCATED,))
    kind, number = _HEADER.unpack_from(data)
    payload = data[_HEADER.size :]
    records: list[Record] = []
    drops: list[Drop] = []
    for part in _parts(kind, payload):
        try:
            records += _records(part)
        except _Refused as refused:
            drops.append(refused.drop)
    return Datagram(number, tuple(records), tuple(drops))


_Part = tuple[int, bytes] | Drop
BUNDLE, COMPACT_BUNDLE, HANDSHAKE = 100, 101, 3


def _parts(kind: int, payload: bytes) -> Iterator[_Part]:
    """Yield each packet of a datagram; a bundle's end that is cut off is one drop."""
    if kind not in (BUNDLE, COMPACT_BUNDLE):
        yield kind, payload
        return
    length_bytes, type_bytes = (2, 4) if kind == BUNDLE else (1, 1)
    at = 0
    while at < len(payload):
        begin = at + length_bytes
        at = begin + int.from_bytes(payload[at:begin], "big")
        if begin + type_bytes > at or at > len(payload):
            yield Drop.TRUNCATED
            return
        inner = int.from_bytes(payload[begin : begin + type_bytes], "big")
        # A bundle within a bundle would nest without end, and nobody joins inside one.
        nested = inner in (BUNDLE, COMPACT_BUNDLE, HANDSHAKE)
        yield Drop.UNKNOWN_PACKET if nested else (inner, payload[begin + type_bytes : at])


def _records(part: _Part) -> list[Record]:
    if isinstance(part, Drop):
        raise _Refused(part)
    kind, payload = part
    reader = _READERS.get(kind)
    if reader is None:
        raise _Refused(Drop.UNKNOWN_PACKET)
    least, make = reader
    if len(payload) < least:
        raise _Refused(Drop.TRUNCATED)
    return make(payload)


def _handshake(data: bytes) -> list[Record]:
    imu = int.from_bytes(data[4:8], "big") if len(data) >= 8 else None
    protocol = int.from_bytes(data[24:28], "big") if len(data) >= 28 else None
    length = data[28] if len(data) > 28 else 0
    firmware, mac = data[29 : 29 + length], data[29 + length : 35 + length]
    known = len(mac) == 6 and any(mac)
    text = "".join(c for c in firmware.decode("utf-8", "replace") if c.isprintable())
    return [Handshake(imu=imu, protocol=protocol, firmware=text[:64], mac=mac.hex() if known else None)]


def _sensor_info(data: bytes) -> list[Record]:
    sensor, status = data[0], data[1] & 3
    return [
        SensorInfo(
            sensor=sensor,
            status=status,
            imu=data[2] if len(data) > 2 else None,
            magnetometer=len(data) > 4 and bool(data[4] & 1),
            position=data[6] if len(data) > 6 else 0,
            rotates=len(data) <= 7 or data[7] == 0,
        )
    ]


def _rotation(sensor: int, x: float, y: float, z: float, w: float) -> Rotation:
    length = sqrt(x * x + y * y + z * z + w * w) if all(map(isfinite, (x, y, z, w))) else None
    if length is None:
        raise _Refused(Drop.NOT_FINITE)
    if not abs(length - 1.0) <= LENGTH_TOLERANCE:
        raise _Refused(Drop.OUT_OF_RANGE)
    return Rotation(sensor, (w / length, x / length, y / length, z / length))


def _rotation_data(data: bytes) -> list[Record]:
    sensor, kind, *xyzw = unpack_from(">BB4f", data)
    # Kind 2 is a correction of an earlier orientation; no firmware of today sends it with sense.
    return [_rotation(sensor, *xyzw)] if kind == 1 else [Unused()]


def _packed(data: bytes) -> list[Record]:
    sensor, *steps = unpack_from(">B7h", data)
    return [_rotation(sensor, *(_Q15 * s for s in steps[:4])), Acceleration(sensor)]


def _acceleration(data: bytes) -> list[Record]:
    xyz = unpack_from(">3f", data)
    if not all(map(isfinite, xyz)):
        raise _Refused(Drop.NOT_FINITE)
    if max(map(abs, xyz)) > MAX_ACCELERATION:
        raise _Refused(Drop.OUT_OF_RANGE)
    return [Acceleration(data[12] if len(data) > 12 else 0)]


def _battery(data: bytes) -> list[Record]:
    volts, level = unpack_from(">ff", data) if len(data) >= 8 else (None, *unpack_from(">f", data))
    if not isfinite(level) or not (volts is None or isfinite(volts)):
        raise _Refused(Drop.NOT_FINITE)
    if not 0.0 <= level <= 1.0 or not (volts is None or 0.0 <= volts <= MAX_VOLTS):
        raise _Refused(Drop.OUT_OF_RANGE)
    return [Battery(volts, level)]


def _old_rotation(sensor: int) -> Callable[[bytes], list[Record]]:
    return lambda data: [_rotation(sensor, *unpack_from(">4f", data))]


def _unused(_data: bytes) -> list[Record]:
    return [Unused()]


_READERS: dict[int, tuple[int, Callable[[bytes], list[Record]]]] = {
    0: (0, lambda _: [Heartbeat()]),
    1: (16, _old_rotation(0)),
    HANDSHAKE: (0, _handshake),
    4: (12, _acceleration),
    10: (4, lambda data: [Pong(int.from_bytes(data[:4], "big"))]),
    12: (4, _battery),
    13: (2, lambda data: [Tap(data[0], data[1])]),
    14: (2, lambda data: [Trouble(data[0], data[1])]),
    15: (2, _sensor_info),
    16: (16, _old_rotation(1)),
    17: (18, _rotation_data),
    19: (2, lambda data: [Signal(int.from_bytes(data[1:2], "big", signed=True))]),
    22: (0, lambda _: [Features()]),
    23: (15, _packed),
    # serial text, magnetometer accuracy, temperature, user action, settings taken, flex, position, raw values
    **dict.fromkeys((11, 18, 20, 21, 24, 26, 27, 105), (0, _unused)),
}
"""By type: the bytes that must be there, and what reads them."""
