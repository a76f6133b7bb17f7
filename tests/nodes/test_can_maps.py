"""Maps, sensor tables, databases: what is wrong is said in one line; signals are read as cantools does."""

from pathlib import Path

import pytest
from cantools import database
from cantools.database.can import Message, Signal
from cantools.database.conversion import BaseConversion
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.can.map_files import SHIPPED, SensorMap
from brachium_nodes.can.sensor_map import read_sensors
from brachium_nodes.can.signals import ShortFrame, reader
from brachium_nodes.can.toml_records import BadMap, read_toml

TABLE = '[[sensor]]\nid = "s"\nmap = "{map}"\nsubject = "p01"\nsegment = "forearm_r"\n'


@st.composite
def messages(draw: st.DrawFn) -> Message:
    """A message of any signals that do not overlap."""
    length, taken, signals = draw(st.integers(1, 64)), set[int](), []
    order = draw(st.sampled_from(("little_endian", "big_endian")))
    for number in range(draw(st.integers(1, 5))):
        is_float = draw(st.booleans()) and length >= 4
        bits = 32 if is_float else draw(st.integers(1, min(32, 8 * length)))
        first = draw(st.integers(0, 8 * length - bits))
        # Counted from the lowest bit of each byte, or from the highest.
        places = range(first, first + bits)
        used = {p if order == "little_endian" else 8 * (p // 8) + 7 - p % 8 for p in places}
        if used & taken:
            continue
        taken |= used
        start = first if order == "little_endian" else 8 * (first // 8) + 7 - first % 8
        scale, offset = draw(st.sampled_from(((1, 0), (0.25, -3), (0.001, 0.5))))
        conversion = BaseConversion.factory(scale, offset, is_float=is_float)
        signed = draw(st.booleans())
        signals.append(
            Signal(f"s{number}", start, bits, order, is_signed=signed, conversion=conversion)  # type: ignore[arg-type]
        )
    return Message(0x123, "m", length, signals, is_fd=length > 8)


@given(messages(), st.binary(min_size=64, max_size=64))
def test_signals_are_read_as_cantools_reads_them(message: Message, data: bytes):
    read = reader(message, [(signal.name, 2.0) for signal in message.signals])(data)
    expected = message.decode(data[: message.length], decode_choices=False)
    assert isinstance(expected, dict)
    assert read == pytest.approx([2.0 * float(expected[s.name]) for s in message.signals], nan_ok=True)  # type: ignore[arg-type]


def test_a_short_frame_is_refused():
    message = database.load_file(SHIPPED / "mti-600.dbc").get_message_by_name("Acceleration")  # type: ignore[union-attr]
    with pytest.raises(ShortFrame, match="has 6 bytes; came 5"):
        reader(message, [("AccX", 1.0)])(bytes(5))


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.toml")), ids=lambda p: p.stem)
def test_every_shipped_map_fits_its_database(path: Path, tmp_path: Path):
    table = tmp_path / "sensors.toml"
    table.write_text(TABLE.format(map=path.stem))
    (sensor,) = read_sensors(table)
    assert sensor.map == read_toml(path, SensorMap)
    assert (SHIPPED / sensor.map.dbc).is_file()


OWN = """
dbc = "own.dbc"
chip = "own"
rate_hz = 100
[acceleration]
message = "Acceleration"
signals = ["AccX", "AccY", "AccZ"]
[angular_rate]
message = "RateOfTurn"
signals = ["GyrX", "GyrY", "GyrZ"]
"""


@pytest.mark.parametrize(
    ("table", "own", "said"),
    [
        (TABLE.format(map="nothing"), OWN, "neither shipped"),
        (TABLE.format(map="own.toml"), OWN, "nothing numbers the samples"),
        (TABLE.format(map="own.toml"), OWN + '[key]\nsignals = { Nothing = "x" }', "no message 'Nothing'"),
        (TABLE.format(map="own.toml"), OWN + '[key]\nsignals = { SampleTime = "x" }', "no signal 'x'"),
        (
            TABLE.format(map="own.toml"),
            OWN + '[key]\nsignals = { Acceleration = "AccX" }',
            "every message with a quantity, or in one message before",
        ),
        (
            TABLE.format(map="own.toml"),
            OWN + '[key]\ntick_s = 1.0\nsignals = { SampleTime = "SampleTime" }',
            "coarser than a period",
        ),
        (TABLE.format(map="own.toml"), OWN.replace('"AccZ"', '"AccZ", "AccX"'), "3 signals are needed"),
        (
            TABLE.format(map="own.toml"),
            OWN.replace("[angular_rate]", "[field]"),
            "acceleration. and .angular",
        ),
        (TABLE.format(map="mti-600").replace("forearm_r", "knee"), OWN, "segment 'knee' of s is not known"),
        (TABLE.format(map="mti-600") + "mounting = [2, 0, 0, 0]", OWN, "no quaternion of length 1"),
        (TABLE.format(map="mti-600") + "add_to_ids = 0x7FF", OWN, "that is no CAN id"),
        (TABLE.format(map="mti-600") + "rate_hz = 0.1", OWN, "write 1 to 2000"),
        (TABLE.format(map="mti-600") + "rate_hz = 0", OWN, "write 1 to 2000"),
        (
            TABLE.format(map="mti-600") + "colour = 1",
            OWN,
            "sensor s: colour is not known; choose of id, map, ",
        ),
        (
            TABLE.format(map="mti-600") + 'heading_free = "no"',
            OWN,
            "sensor s: heading_free 'no' cannot be used; write true or false$",
        ),
        (
            TABLE.format(map="mti-600") + "mounting = [1, 0, 0]",
            OWN,
            r"sensor s: mounting \[1, 0, 0\] cannot be used; write 4 numbers in brackets, as \[1, 0, 0, 0\]$",
        ),
        (
            TABLE.format(map="mti-600") + '[[sensor]]\nid = "t"',
            OWN,
            "sensor t: map is missing; write a text in quotes$",
        ),
        ('[[sensor]]\nmap = "mti-600"', OWN, "sensor 1: id is missing"),
        ("[sensor]", OWN, r"write a table \[\[sensor\]\] for each$"),
        (
            TABLE.format(map="own.toml"),
            OWN + '[key]\ntick_s = "x"',
            "key: signals is missing; write names in",
        ),
        (2 * TABLE.format(map="mti-600"), OWN, "both send 0x"),
        (TABLE.format(map="mti-600") + TABLE.format(map="lpms-orientation"), OWN, "there twice"),
        ("sensor = []", OWN, "no .*sensor"),
        ("[[sensor", OWN, "Expected"),
    ],
)
def test_what_a_table_or_a_map_has_wrong_is_said(tmp_path: Path, table: str, own: str, said: str):
    (tmp_path / "own.dbc").write_text((SHIPPED / "mti-600.dbc").read_text())
    (tmp_path / "own.toml").write_text(own)
    path = tmp_path / "sensors.toml"
    path.write_text(table)
    with pytest.raises(BadMap, match=said):
        read_sensors(path)


def test_a_database_of_the_user_replaces_the_maps(tmp_path: Path):
    path = tmp_path / "sensors.toml"
    path.write_text(TABLE.format(map="mti-600"))
    with pytest.raises(FileNotFoundError):
        read_sensors(path, tmp_path / "none.dbc")
    bad = tmp_path / "bad.dbc"
    bad.write_text("BO_ nonsense")
    with pytest.raises(BadMap, match="cannot be read as a CAN database"):
        read_sensors(path, bad)
    empty = tmp_path / "empty.dbc"
    empty.write_text('VERSION ""\n')
    with pytest.raises(BadMap, match=r"empty.dbc describes no message at all; give the DBC"):
        read_sensors(path, empty)
