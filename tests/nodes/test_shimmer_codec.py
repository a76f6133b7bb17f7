"""Shimmer3's bytes: time stamps that wrap, byte orders, lost and foreign bytes, answers between packets."""

import random
from struct import pack

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.shimmer import protocol as p
from brachium_nodes.shimmer.calibration import conversions, nominal, stored
from brachium_nodes.shimmer.dialogue import Dialogue, Wish
from brachium_nodes.shimmer.packets import WRAP, PacketReader
from brachium_nodes.shimmer.ticks import TickCounter, microseconds

PERIOD = 640
CHANNEL_BYTES = 18
S = 1_000_000_000


def packet(number, start=0, body=None):
    stamp = (start + PERIOD * number) % WRAP
    body = random.Random(number).randbytes(CHANNEL_BYTES) if body is None else body
    return b"\x00" + stamp.to_bytes(3, "little") + body


@given(st.integers(0, WRAP - 1), st.lists(st.integers(1, 40), min_size=1, max_size=30))
def test_packets_come_out_whole_however_the_port_cuts_them(start, cuts):
    data = b"".join(packet(n, start) for n in range(40))
    reader, found, at = PacketReader(CHANNEL_BYTES, PERIOD), [], 0
    for cut in [*cuts, len(data)]:
        found += reader.feed(data[at : at + cut], at)
        at += cut
    assert [f.channels for f in found] == [packet(n)[4:] for n in range(39)]
    assert [f.stamp for f in found] == [(start + PERIOD * n) % WRAP for n in range(39)]
    assert reader.skipped == reader.resynchronised == 0


def damaged(seed, damage, every=12, count=1200):
    """Return a stream with one damage in each `every` packets, and the numbers of those damaged."""
    chance, out, hit = random.Random(seed), b"", set()
    for number in range(count):
        one = packet(number, start=5)
        if number and number % every == 0:
            one = damage(one, chance)
            hit.add(number)
        out += one
    return out, hit


def lose_some(one, chance):
    first = chance.randrange(len(one))
    return one[:first] + one[first + chance.randint(1, 8) :]


def add_some(one, chance):
    at = chance.randrange(len(one))
    return one[:at] + chance.randbytes(chance.randint(1, 30)) + one[at:]


def lose_all(one, chance):
    del one, chance
    return b""


@pytest.mark.parametrize("damage", [lose_some, add_some, lose_all])
def test_lost_and_foreign_bytes_cost_their_packets_and_never_shift_another(damage):
    wrong = missing = 0
    for seed in range(5):
        data, hit = damaged(seed, damage)
        reader = PacketReader(CHANNEL_BYTES, PERIOD)
        found = []
        for i in range(0, len(data), 23):
            found += reader.feed(data[i : i + 23], i)
        true = {packet(n)[4:]: n for n in range(1200)}
        wrong += sum(f.channels not in true for f in found)
        got = {true[f.channels] for f in found if f.channels in true}
        # What went before a damaged beginning might be what was damaged: it is not taken either.
        missing += len(set(range(1199)) - hit - {n - 1 for n in hit} - got)
        if damage is not lose_all:
            assert reader.resynchronised >= 0.9 * len(hit)
            assert reader.skipped > 0
    assert wrong == 0  # 1 in 2e4 damaged packets ends in what looks like the next one's beginning
    assert missing <= 5  # of 5000 beside which nothing was done


def test_a_stream_that_begins_in_the_middle_of_a_packet_is_found():
    data = b"".join(packet(n) for n in range(10))[9:]
    reader = PacketReader(CHANNEL_BYTES, PERIOD)
    assert [f.channels for f in reader.feed(data, 0)] == [packet(n)[4:] for n in range(1, 9)]


def test_answers_between_packets_are_taken_out():
    reader = PacketReader(CHANNEL_BYTES, PERIOD)
    data = packet(0) + packet(1) + b"\xff\x8a\x94" + pack("<H", 2700) + b"\xc0" + packet(2)
    data += b"\x8a\x71\x01" + packet(3) + packet(4)
    assert len(reader.feed(data, 0)) == 4
    assert reader.battery_v == pytest.approx(2700 / 4095 * 3.0 * 1.988)
    assert reader.skipped == 0


@given(
    start=st.integers(0, WRAP - 1),
    steps=st.lists(st.integers(1, 200_000), max_size=30),
    late_s=st.lists(st.floats(0.0, 2.0), min_size=31, max_size=31),
)
def test_a_clock_that_wraps_is_counted_on(start, steps, late_s):
    clock, number = TickCounter(PERIOD), 0
    for step, late in zip([0, *steps], late_s, strict=False):
        number += step
        ticks = start + PERIOD * number
        arrived = round(ticks / 32768 * S) + round(late * S)
        assert clock.follow(ticks % WRAP, arrived)
        assert clock.number == number
        assert clock.ticks == ticks


def test_the_clock_wraps_every_512_s_and_is_told_in_whole_us():
    assert WRAP / p.TICK_HZ == 512.0
    assert microseconds(WRAP) == 512_000_000
    assert microseconds(640) == 19_531


def test_a_stamp_that_comes_again_is_not_taken():
    clock = TickCounter(PERIOD)
    assert clock.follow(1000, 0)
    assert not clock.follow(1000, S // 50)
    assert not clock.follow(360, S // 50)
    assert (clock.number, clock.ticks) == (0, 1000)


@given(st.floats(0.1, 3000.0), st.integers(0, WRAP - 1), st.booleans())
def test_after_an_outage_the_same_clock_is_known_again(outage_s, start, restarted):
    clock = TickCounter(PERIOD)
    clock.follow(start, 0)
    shown = (start + round(outage_s * 32768) + (WRAP // 3 if restarted else 0)) % WRAP
    assert clock.same_clock(shown, round(outage_s * S)) is not restarted


STEPS = {"low-noise": (2048, 0x0102, 4095), "wide-range": (-2, 0x0102, 300), "gyr": (-2, 0x0304, 7)}


@pytest.mark.parametrize(
    ("newer", "field"), [(False, bytes.fromhex("fffe 0506 0007")), (True, bytes.fromhex("feff 0605 0700"))]
)
def test_each_channel_has_its_own_byte_order(newer, field):
    channels = (0, 1, 2, 10, 11, 12, 4, 5, 6, 7, 8, 9)
    data = bytes.fromhex("0008 0201 ff0f") + bytes.fromhex("fffe 0304 0007")
    data += bytes.fromhex("feff 0201 2c01") + field
    formats, places = p.layout(channels, newer=newer)
    values = [
        np.frombuffer(data[i : i + 2], formats[i : i + 2].replace("h", "i2").replace("H", "u2"))[0]
        for i in range(0, len(data), 2)
    ]
    found = {kind: tuple(int(values[i]) for i in at) for kind, at in places.items()}
    assert found == {**STEPS, "mag": (-2, 0x0506, 7)}


def test_the_older_magnetometer_tells_its_axes_in_its_own_order():
    _, places = p.layout((7, 9, 8), newer=False)
    assert places["mag"] == (0, 2, 1)


def test_a_channel_that_was_not_asked_for_is_named():
    with pytest.raises(p.ShimmerError, match="channel 0x1a"):
        p.layout((0, 1, 2, 0x1A), newer=True)


def test_the_inquiry_is_read_as_the_firmware_lays_it_out():
    body = bytes.fromhex("8002 08 9b 2f 00 03 01 0a0b0c")
    found = p.read_inquiry(body)
    assert (found.ticks, found.accel_range, found.gyro_range, found.mag_range) == (640, 2, 3, 1)
    assert found.channels == (10, 11, 12)


INQUIRY = p.Inquiry(ticks=640, accel_range=2, gyro_range=3, mag_range=1, channels=())


@pytest.mark.parametrize("newer", [False, True])
@pytest.mark.parametrize("blocks", [b"\xff" * 84, b"\x00" * 84])
def test_a_device_without_calibration_gets_the_data_sheets_and_says_so(newer, blocks):
    found = conversions(INQUIRY, blocks, "wide-range", newer=newer)
    assert len(found.warnings) == 3
    assert found.calibration.gyro_bias is None
    still = found.gyr(np.zeros((1, 3)))
    assert still == pytest.approx(np.zeros((1, 3)))
    for conversion in (found.acc, found.gyr, found.mag):
        assert (np.count_nonzero(conversion.matrix, axis=1) == 1).all()  # axes are exchanged, not mixed


@pytest.mark.parametrize(
    ("kind", "newer", "steps", "si"),
    [("wide-range", True, 836, 1.0), ("wide-range", False, 408, 1.0), ("gyr", True, 16.4, np.radians(1.0)),
     ("mag", True, 667, 100.0), ("mag", False, 1100, 100.0)],
)  # fmt: skip
def test_scales_are_those_of_the_data_sheets(kind, newer, steps, si):
    found = conversions(INQUIRY, b"\xff" * 84, "wide-range", newer=newer)
    conversion = {"wide-range": found.acc, "gyr": found.gyr, "mag": found.mag}[kind]
    assert np.abs(conversion(np.array([[steps, 0.0, 0.0]]))).max() == pytest.approx(si, rel=1e-9)


def test_a_block_that_turns_the_chip_round_is_no_calibration():
    usual = nominal("gyr", INQUIRY, newer=True)
    good = pack(">6h9b", 1, 2, 3, 1640, 1640, 1640, 0, -100, 0, -100, 0, 0, 0, 0, -100)
    turned = pack(">6h9b", 1, 2, 3, 1640, 1640, 1640, 100, 0, 0, 0, 100, 0, 0, 0, 100)
    assert stored("gyr", good, usual) is not None
    assert stored("gyr", turned, usual) is None


class Scripted:
    """A device that answers as a table says."""

    def __init__(self, **changes):
        self.answers = {
            0x20: b"\xff",
            0x2E: b"\xff\x2f\x03\x00\x00\x00\x10\x04",
            0x3F: b"\xff\x25\x03",
            0x66: b"\xff\x65\x03\x1f\x06\x00",
            0x01: b"\xff\x02\x80\x02\x08\x9b\x03\x00\x09\x01" + bytes([10, 11, 12, 4, 5, 6, 7, 8, 9]),
            0x2C: b"\xff\x2d" + b"\xff" * 84,
            0x95: b"\xff\x8a\x94\x8c\x0a\xc0",
        }
        self.answers |= {int(name[1:], 16): answer for name, answer in changes.items()}

    def converse(self, noise=b""):
        now, dialogue = S, Dialogue(Wish(), S)
        words = dialogue.begin()
        for turn in range(400):
            came = self.answers.get(words[0], b"\xff") if words else b""
            came += noise if turn < 3 else b""
            words = dialogue.receive(came, now) if came else b""
            now += S // 10
            words += dialogue.tick(now)
            if dialogue.device is not None:
                return dialogue
        raise AssertionError("neither set up nor refused")


def test_a_device_that_answers_is_set_up():
    device = Scripted().converse().device
    assert device.rate_hz == 51.2
    assert device.newer
    assert device.battery_v == pytest.approx(3.93, abs=0.01)


def test_what_an_interrupted_stream_still_sends_is_not_taken_for_an_answer():
    noise = b"".join(packet(n) for n in range(3)) + b"\xff\x2f\x09\x09"
    assert Scripted().converse(noise).device.firmware == "LogAndStream 0.16.4"


def test_a_dock_that_speaks_before_an_answer_is_skipped():
    assert Scripted(x2E=b"\xff\x8a\x71\x01\xff\x2f\x03\x00\x00\x00\x10\x04").converse().device is not None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"x2E": b"\xff\x2f\x03\x00\x00\x00\x05\x00"}, "0.5.0: a Shimmer3 .* 0.6 or newer"),
        ({"x3F": b"\xff\x25\x0a"}, "hardware 10"),
        ({"x2E": b""}, "no answer to firmware version"),
        ({"x2C": b"\x00"}, "no answer to calibration"),
        ({"x40": b"\xfe"}, "refuses accelerometer rate"),
        ({"x01": b"\xff\x02\x80\x02\x08\x9b\x03\x00\x03\x01\x0a\x0b\x0c"}, "wide-range was asked for"),
        ({"x01": b"\xff\x02\x00\x00\x08\x9b\x03\x00\x00\x01"}, "never samples"),
    ],
)
def test_a_device_that_cannot_be_used_is_refused_with_what_to_do(changes, said):
    with pytest.raises(p.ShimmerError, match=said):
        Scripted(**changes).converse()


@pytest.mark.parametrize(
    ("wish", "said"),
    [({"rate_hz": 0.5}, "rate 0.5 Hz"), ({"accel_g": 3}, "3 g"), ({"gyro_dps": 1}, "1 deg/s")],
)
def test_a_wish_that_no_device_fulfils_is_refused(wish, said):
    with pytest.raises(ValueError, match=said):
        Wish(**wish)
