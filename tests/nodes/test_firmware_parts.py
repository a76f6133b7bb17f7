"""Parts of the firmware by themselves, in the interpreter that the chip has; judged by other libraries."""

import hashlib
import hmac
import json
from itertools import pairwise
from pathlib import Path

import msgpack
import pytest


def test_maps_are_written_as_messagepack_has_them(on_chip):
    numbers = [0, 1, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**53 - 1]
    lines = """
import binascii
from message_pack import Writer
writer = Writer(600, 8)
writer.begin(len(given) + 6, "batch/1")
for number in given:
    writer.whole(str(number), number)
writer.text("short", "x" * 31)
writer.text("long", "x" * 200)
writer.real("real", 0.125)
writer.yes("yes")
writer.block("block", bytes(range(40)))
writer.group("group", 1)
writer.reals("rows", [[1, 2.5], [-3, 4]])
print(json.dumps(binascii.hexlify(memoryview(writer.buffer)[8:writer.end]).decode()))
"""
    lines = lines.replace("len(given) + 6", "len(given[:8]) + 6").replace("in given:", "in given[:8]:")
    read = msgpack.unpackb(bytes.fromhex(on_chip(lines, numbers[3:])))
    assert read == {
        "m": "batch/1",
        **{str(n): n for n in numbers[3:11]},
        "short": "x" * 31,
        "long": "x" * 200,
        "real": 0.125,
        "yes": True,
        "block": bytes(range(40)),
        "group": {"rows": [[1.0, 2.5], [-3.0, 4.0]]},
    }


def test_what_a_gateway_says_is_read_and_what_is_broken_is_nothing(on_chip):
    said = {
        "m": "welcome/1",
        "id": 65535,
        "t": 2**60,
        "retry": 2.5,
        "why": "ä" * 40,
        "no": None,
        "is": True,
        "low": -7,
        "later": {"with": [1, {"more": [True, "x"]}]},
    }
    whole = msgpack.packb(said)
    broken = [
        whole[:-1],
        whole + b"\0",
        b"",
        b"\xc1",
        b"\x93\1\2\3",
        b"\x81\xa1m\x91",
        b"\x91" * 9,
        b"\xdf" * 9,
        b"\x81\xd9\xff",
    ]
    lines = """
import binascii
from message_pack import read_map
print(json.dumps([read_map(binascii.unhexlify(text)) for text in given]))
"""
    assert on_chip(lines, [data.hex() for data in [whole, *broken]]) == [said, *[{}] * len(broken)]


def test_only_who_knows_the_token_can_prove_it(on_chip):
    lines = "from discovery import proof\nprint(json.dumps(proof(*given)))"
    url = "ws://192.168.1.10:8765/node"
    key = hashlib.sha256(b"secret").hexdigest().encode()
    assert (
        on_chip(lines, ["secret", "nonce", url])
        == hmac.new(key, f"nonce {url}".encode(), "sha256").hexdigest()
    )


def test_a_clock_that_wraps_goes_on(on_chip):
    lines = """
import device_clock
class Ticks:
    now = (1 << 30) - 50
    def ticks_us(self):
        self.now += 20
        return self.now % (1 << 30)
    def ticks_diff(self, end, start):
        return (end - start + (1 << 29)) % (1 << 30) - (1 << 29)
device_clock.time = Ticks()
clock = device_clock.DeviceClock()
print(json.dumps([clock.now() for _ in range(200)]))
"""
    assert {b - a for a, b in pairwise(on_chip(lines))} == {20}


@pytest.mark.parametrize("off", [0.97, 1.0, 1.02])
def test_times_of_samples_are_found_though_the_sensors_oscillator_is_percents_off(on_chip, off):
    # Polls every 40 ms and some; what is seen of the sensor is only how many samples have gathered.
    lines = """
import random
from device_clock import SampleClock
random.seed(1)
period, clock, now, seen, latest, earliest = 10000 * given, SampleClock(100), 5000000.0, 0, 0, 0
for poll in range(1500):
    now += 40000 + random.randrange(3000)
    after = now + random.randrange(300)
    due = int((now + 150 - 5000000) / period)
    clock.read(int(now), int(after) + 1, due - seen)
    for k in range(seen, due):
        error = clock.take() - (5000000 + (k + 1) * period)
        if k > 2500:
            latest, earliest = max(latest, error), min(earliest, error)
    seen = due
    if poll % 25 == 0:
        clock.learn()
print(json.dumps([seen, latest, earliest, clock.period / 256 / period]))
"""
    count, latest, earliest, learned = on_chip(lines, off)
    assert count > 5000
    assert -1500 < earliest <= latest < 1500  # us, of 10 000 between two samples
    assert learned == pytest.approx(1.0, abs=2e-4)


def test_what_a_cell_has_left_falls_with_its_voltage(on_chip):
    lines = """
from battery import share_left
print(json.dumps([int(1e6 * share_left(v)) for v in given]))
"""
    shares = [1e-6 * share for share in on_chip(lines, [3.0 + k / 50 for k in range(65)])]
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert all(a <= b for a, b in pairwise(shares))
    assert shares[40] == pytest.approx(0.47, abs=1e-3)  # 3.8 V


def test_a_cell_is_spared_when_it_is_empty_and_not_for_one_sag(on_chip):
    lines = """
from battery import Battery
class Converter:
    volts = 4.0
    def read_u16(self):
        return int(65535 * self.volts / 5.0)
converter = Converter()
battery = Battery(converter, {"full_scale_v": 5.0, "capacity_mah": 700, "current_ma": 70, "empty_v": 3.3})
said = []
for volts in [4.0, 3.0, 4.0] + [3.2] * 10:
    converter.volts = volts
    battery.measure()
    said.append(battery.empty())
print(json.dumps([said, battery.hours]))
"""
    said, hours = on_chip(lines)
    assert said == [False] * 12 + [True]
    assert 0.0 < hours < 10.0


GOOD = {"id": "n1", "token": "t"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({}, "'id' is missing"),
        ({"id": "n1"}, "'token' is missing"),
        ({**GOOD, "rate": 50}, "'rate' is not known"),
        ({**GOOD, "i2c": {"sdl": 1}}, "'i2c.sdl' is not known"),
        ({**GOOD, "i2c": 1}, "must be an object"),
        ({**GOOD, "gateway": 1}, "cannot be 1"),
        ({**GOOD, "rate_hz": None}, "'rate_hz' cannot be None"),
        ({**GOOD, "batch": [5]}, "'batch' cannot be [5]"),
        ({**GOOD, "rate_hz": 1000}, "rate_hz takes"),
        ({**GOOD, "poll_ms": 400}, "between two polls"),
        ([], "one JSON object"),
    ],
)
def test_a_configuration_that_cannot_be_is_refused_with_its_reason(on_chip, content, said):
    lines = """
import configuration
try:
    configuration.load()
    print(json.dumps(""))
except ValueError as error:
    print(json.dumps(str(error)))
"""
    assert said in on_chip(lines, files={"brachium.json": content})


def test_what_is_left_out_of_a_configuration_is_filled_in(on_chip):
    lines = "import configuration\nprint(json.dumps(configuration.load()))"
    kept = on_chip(lines, files={"brachium.json": {**GOOD, "i2c": {"scl": 9}}})
    assert kept["i2c"] == {"id": -1, "scl": 9, "sda": 4, "hz": 400000}
    assert (kept["rate_hz"], kept["gateway"]) == (50, "")


def test_a_configuration_is_kept_whole_or_not_at_all(on_chip, tmp_path: Path):
    lines = """
import configuration
def kept(said):
    try:
        configuration.save(said)
        return "kept"
    except ValueError as error:
        return "refused"
print(json.dumps([kept(said) for said in given]))
"""
    given = [{**GOOD, "id": ".n"}, {**GOOD, "token": "a\nb"}, {**GOOD, "gateway": "http://x"}, GOOD, {}]
    given.append({**GOOD, "wifi": {"name": "x" * 33}})
    assert on_chip(lines, given) == ["refused"] * 3 + ["kept"] + ["refused"] * 2
    assert json.loads((tmp_path / "brachium.json").read_text()) == GOOD
    assert not (tmp_path / "brachium.new").exists()
