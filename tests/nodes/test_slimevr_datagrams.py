"""What trackers send, written here by hand from the protocol: read back, cut, broken and made at random."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_nodes.slimevr import answers
from brachium_nodes.slimevr.datagrams import MAX_BYTES, read
from brachium_nodes.slimevr.records import (
    Acceleration,
    Battery,
    Drop,
    Features,
    Handshake,
    Heartbeat,
    Pong,
    SensorInfo,
    Signal,
    Tap,
    Trouble,
    Unused,
)
from brachium_nodes.slimevr.records import Rotation as Turn

MAC = bytes.fromhex("a1b2c3d4e5f6")
bytes_of_one = st.integers(0, 255)
numbers = st.integers(0, 2**64 - 1)


def datagram(kind: int, payload: bytes, number: int = 1) -> bytes:
    return struct.pack(">IQ", kind, number) + payload


def handshake(firmware: bytes = b"0.5.4", more: bytes = b"") -> bytes:
    return struct.pack(">7I", 4, 10, 2, 0, 0, 0, 22) + bytes([len(firmware)]) + firmware + MAC + more


def rotation(sensor: int = 0, xyzw: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> bytes:
    return struct.pack(">BB4fB", sensor, 1, *xyzw, 0)


def bundle(*parts: tuple[int, bytes]) -> bytes:
    inner = [struct.pack(">I", kind) + payload for kind, payload in parts]
    return b"".join(struct.pack(">H", len(one)) + one for one in inner)


def compact(*parts: tuple[int, bytes]) -> bytes:
    inner = [bytes([kind]) + payload for kind, payload in parts]
    return b"".join(bytes([len(one)]) + one for one in inner)


@pytest.mark.parametrize(
    ("kind", "payload", "records"),
    [
        (0, b"", [Heartbeat()]),
        (10, b"\x01\x02\x03\x04", [Pong(0x01020304)]),
        (4, struct.pack(">3fB", 1.0, 2.0, 3.0, 1), [Acceleration(1)]),
        (4, struct.pack(">3f", 1.0, 2.0, 3.0), [Acceleration(0)]),  # the oldest name no sensor
        (12, struct.pack(">ff", 3.75, 0.5), [Battery(3.75, 0.5)]),
        (12, struct.pack(">f", 0.25), [Battery(None, 0.25)]),
        (13, b"\x02\x05", [Tap(2, 5)]),
        (14, b"\x00\x07", [Trouble(0, 7)]),
        (19, b"\xff\xc4", [Signal(-60)]),
        (22, b"\x02", [Features()]),
        (20, struct.pack(">Bf", 0, 30.0), [Unused()]),
        (15, bytes([1, 1, 10, 0, 1, 1, 14, 0]) + bytes(8), [SensorInfo(1, 1, 10, True, 14, True)]),
        (15, bytes([0, 2]), [SensorInfo(0, 2)]),
        (
            15,
            bytes([0, 1, 10, 0, 0, 0, 0, 1]),
            [SensorInfo(0, 1, 10, False, 0, False)],
        ),  # a glove's flex sensor
        (1, struct.pack(">4f", 0.0, 0.0, 1.0, 0.0), [Turn(0, (0.0, 0.0, 0.0, 1.0))]),
        (16, struct.pack(">4f", 1.0, 0.0, 0.0, 0.0), [Turn(1, (0.0, 1.0, 0.0, 0.0))]),
        (17, rotation(3, (0.0, 0.6, 0.0, 0.8)), [Turn(3, pytest.approx((0.8, 0.0, 0.6, 0.0)))]),
        (17, struct.pack(">BB4fB", 0, 2, 0.0, 0.0, 0.0, 1.0, 0), [Unused()]),  # a correction
        (
            23,
            struct.pack(">B7h", 2, 0, 0, 0, 32767, 128, 0, 0),
            [Turn(2, pytest.approx((1.0, 0.0, 0.0, 0.0))), Acceleration(2)],
        ),
        (3, handshake(), [Handshake(imu=10, protocol=22, firmware="0.5.4", mac=MAC.hex())]),
        (
            3,
            handshake(more=b"\x00\x04SlimE"),
            [Handshake(imu=10, protocol=22, firmware="0.5.4", mac=MAC.hex())],
        ),
        (3, b"", [Handshake(imu=None, protocol=None, firmware="", mac=None)]),
        (3, handshake()[:30], [Handshake(imu=10, protocol=22, firmware="0", mac=None)]),
        (3, handshake(b""), [Handshake(imu=10, protocol=22, firmware="", mac=MAC.hex())]),
    ],
)
def test_each_packet_is_read_as_it_was_written(kind, payload, records):
    found = read(datagram(kind, payload, 77))
    assert (found.number, list(found.records), found.drops) == (77, records, ())


@pytest.mark.parametrize(
    ("data", "drop"),
    [
        (b"", Drop.TRUNCATED),
        (datagram(0, b"")[:11], Drop.TRUNCATED),
        (datagram(17, rotation()[:17]), Drop.TRUNCATED),
        (datagram(12, b"\0"), Drop.TRUNCATED),
        (datagram(99, b"abc"), Drop.UNKNOWN_PACKET),
        (datagram(2**24 + 17, rotation()), Drop.UNKNOWN_PACKET),
        (datagram(0, bytes(MAX_BYTES)), Drop.OVERSIZE),
        (datagram(17, rotation(0, (math.nan, 0.0, 0.0, 1.0))), Drop.NOT_FINITE),
        (datagram(17, rotation(0, (math.inf, 0.0, 0.0, 1.0))), Drop.NOT_FINITE),
        (datagram(17, rotation(0, (0.0, 0.0, 0.0, 0.0))), Drop.OUT_OF_RANGE),
        (datagram(17, rotation(0, (0.5, 0.0, 0.0, 1.0))), Drop.OUT_OF_RANGE),
        (datagram(4, struct.pack(">3f", math.nan, 0.0, 0.0)), Drop.NOT_FINITE),
        (datagram(4, struct.pack(">3f", 1e6, 0.0, 0.0)), Drop.OUT_OF_RANGE),
        (datagram(12, struct.pack(">ff", math.nan, 0.5)), Drop.NOT_FINITE),
        (datagram(12, struct.pack(">ff", 3.7, 1.5)), Drop.OUT_OF_RANGE),
        (datagram(12, struct.pack(">ff", -3.7, 0.5)), Drop.OUT_OF_RANGE),
        (datagram(100, bundle((100, bundle((0, b""))))), Drop.UNKNOWN_PACKET),
        (datagram(100, bundle((3, handshake()))), Drop.UNKNOWN_PACKET),
        (datagram(100, b"\0"), Drop.TRUNCATED),
        (datagram(100, b"\0\3abc"), Drop.TRUNCATED),
        (datagram(101, b"\0"), Drop.TRUNCATED),
    ],
)
def test_what_cannot_be_is_a_named_drop(data, drop):
    found = read(data)
    assert (found.records, found.drops) == ((), (drop,))


@pytest.mark.parametrize(("kind", "pack"), [(100, bundle), (101, compact)])
def test_what_is_sound_in_a_bundle_is_kept_beside_what_is_not(kind, pack):
    whole = pack(
        (17, rotation(0)), (99, b"x"), (17, rotation(1, (math.nan, 0.0, 0.0, 1.0))), (13, b"\x00\x01")
    )
    found = read(datagram(kind, whole))
    assert found.records == (Turn(0, (1.0, 0.0, 0.0, 0.0)), Tap(0, 1))
    assert found.drops == (Drop.UNKNOWN_PACKET, Drop.NOT_FINITE)
    cut = read(datagram(kind, whole[:-1]))
    assert cut.records == (Turn(0, (1.0, 0.0, 0.0, 0.0)),)
    assert cut.drops == (Drop.UNKNOWN_PACKET, Drop.NOT_FINITE, Drop.TRUNCATED)


@given(st.integers(0, 2**31), bytes_of_one, numbers)
def test_rotations_are_read_back_alone_and_in_bundles(seed, sensor, number):
    turn = Rotation.random(random_state=seed)
    xyzw = tuple(turn.as_quat().tolist())
    alone = read(datagram(17, rotation(sensor, xyzw), number))
    assert alone.number == number
    for one in (
        alone,
        read(datagram(100, bundle((17, rotation(sensor, xyzw))), number)),
        read(datagram(101, compact((17, rotation(sensor, xyzw))), number)),
        read(datagram(23, struct.pack(">B7h", sensor, *(round(32767 * v) for v in xyzw), 0, 0, 0), number)),
    ):
        (first, *_) = one.records
        assert isinstance(first, Turn)
        assert first.sensor == sensor
        assert (
            Rotation.from_quat(first.world_from_sensor, scalar_first=True).inv() * turn
        ).magnitude() < 2e-4
        assert math.hypot(*first.world_from_sensor) == pytest.approx(1.0, abs=1e-12)


kinds = st.one_of(
    st.sampled_from([0, 1, 3, 4, 10, 11, 12, 13, 14, 15, 16, 17, 19, 22, 23, 100, 101]),
    st.integers(0, 2**32 - 1),
)


@given(kinds, numbers, st.binary(max_size=300))
def test_whatever_comes_nothing_is_raised_and_all_is_finite(kind, number, payload):
    found = read(datagram(kind, payload, number))
    for record in found.records:
        for value in record.world_from_sensor if isinstance(record, Turn) else ():
            assert math.isfinite(value)


@given(st.binary(max_size=2000))
def test_whatever_bytes_come_nothing_is_raised(data):
    found = read(data)
    assert found.records or found.drops or data[3:4] in (b"\x64", b"\x65")  # an empty bundle holds nothing


@given(st.integers(0, 40))
def test_a_datagram_that_is_cut_anywhere_is_dropped_or_an_older_one(cut):
    whole = datagram(17, rotation())
    found = read(whole[:cut])
    assert found.drops == (() if cut >= 30 else (Drop.TRUNCATED,))


def test_what_is_said_to_a_tracker_is_what_its_firmware_looks_for():
    assert answers.WELCOME[:13] == b"\x03Hey OVR =D 5"
    assert bytes.fromhex("00000001 0000000000000000") == answers.HEARTBEAT
    assert answers.ping(7) == bytes.fromhex("0000000a 0000000000000000 00000007")
    assert answers.known(2, 1) == bytes.fromhex("0000000f 02 01")
    assert bytes.fromhex("00000016 0000000000000000 03") == answers.FEATURES
    assert max(map(len, (answers.WELCOME, answers.FEATURES, answers.ping(1)))) <= 128
    (back,) = read(answers.ping(7)).records  # a tracker returns it as it came
    assert back == Pong(7)
