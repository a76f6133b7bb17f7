"""docs/node-protocol.md: its examples are what the code sends, and a chip can build them byte by byte.

After a change of the frames: python tests/nodes/test_node_protocol_page.py
"""

import re
import struct
from pathlib import Path

import pytest

from brachium_nodes import node_frames as f
from brachium_nodes.batch_blocks import measure
from brachium_nodes.kept_calibration import text_of
from brachium_wire.codec import Drop, encode
from brachium_wire.messages import SensorCalibration

PAGE = Path(__file__).parents[2] / "docs" / "node-protocol.md"

HELLO = f.Hello(
    node="esp-3f21",
    boot=305419896,
    chip="MPU-9150",
    rate_hz=50.0,
    firmware="brachium 0.1",
    magnetometer=True,
    scales=f.Scales(acc=(9.81 / 4096,) * 3, gyr=(0.001064225,) * 3, mag=(0.3, 0.3, 0.3)),
    big_endian=True,
    calibration=SensorCalibration(gyro_bias=(0.01, -0.02, 0.0)),
)
EXAMPLES = {
    "hello": HELLO,
    "welcome": f.Welcome(subject="p01", segment="forearm_r", host="gateway", time_ns=1764000000123456789),
    "batch": f.Batch(
        sequence=7,
        device_us=1234567,
        offsets=struct.pack("<I", 0),
        acc=struct.pack("<3f", 0.0, 9.81, 0.0),
        gyr=struct.pack("<3f", 0.5, 0.0, -0.25),
    ),
    "steps": f.Batch(
        sequence=8,
        device_us=1254567,
        offsets=struct.pack("<2I", 0, 20000),
        acc=struct.pack(">6h", 0, 4096, 0, 10, 4090, -5),
        gyr=struct.pack(">6h", 470, 0, -235, 468, 2, -240),
        mag=struct.pack(">3h", 12, 80, -140),
        mag_index=struct.pack("<H", 1),
    ),
    "ask": f.ClockAsk(id=42),
    "answer": f.ClockAnswer(id=42, came_us=1300000, left_us=1300180),
    "status": f.NodeStatus(battery_v=3.875, rssi_dbm=-55.0, dropped=0),
    "keep": f.Keep(calibration=text_of(SensorCalibration(gyro_bias=(0.01, -0.02, 0.0)))),
    "kept": f.Kept(),
    "bye": f.Bye(next_sequence=10),
    "refused": f.Refused(
        code="segment_taken", reason="forearm_r of p01 is held by node esp-77aa", retry_s=5.0
    ),
}


def block(name: str) -> str:
    data = encode(EXAMPLES[name])
    lines = [data[i : i + 24].hex(" ") for i in range(0, len(data), 24)]
    return "\n".join([f"<!-- example: {name} -->", f"{len(data)} bytes:", "", "```", *lines, "```"])


def blocks(page: str) -> dict[str, bytes]:
    found = re.findall(r"<!-- example: (\w+) -->\n\d+ bytes:\n\n```\n([0-9a-f \n]+)```", page)
    return {name: bytes.fromhex(text) for name, text in found}


def test_the_page_shows_what_is_sent() -> None:
    assert blocks(PAGE.read_text("utf-8")) == {name: encode(frame) for name, frame in EXAMPLES.items()}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_page_s_bytes_are_understood(name: str) -> None:
    payload = blocks(PAGE.read_text("utf-8"))[name]
    read = f.from_gateway if name in ("welcome", "ask", "keep", "refused") else f.from_node
    assert read(payload) == EXAMPLES[name]


def test_the_page_names_every_field_code_and_drop() -> None:
    page = PAGE.read_text("utf-8")
    said = (f.Hello, f.Batch, f.ClockAnswer, f.NodeStatus, f.Bye, f.Welcome, f.ClockAsk, f.Keep, f.Refused)
    for frame in said:
        for name in frame.__struct_encode_fields__:
            assert f"`{name}`" in page, f"{frame.__struct_config__.tag} {name}"
    for code, number in f.CLOSE_CODES.items():
        assert f"| `{code}` | {number} |" in page
    for drop in (Drop.MALFORMED, Drop.REPEATED, Drop.OUT_OF_RANGE, Drop.TIME_BACKWARDS, Drop.WRONG_SHAPE):
        assert f"| `{drop.value}` |" in page


class Chip:
    """MessagePack as a small firmware writes it: one buffer, fixed widths, no library."""

    def __init__(self) -> None:
        self.bytes = bytearray()

    def map(self, size: int) -> "Chip":
        self.bytes += bytes([0x80 | size])
        return self

    def text(self, text: str) -> "Chip":
        self.bytes += bytes([0xD9, len(text)]) + text.encode()
        return self

    def int(self, value: int) -> "Chip":
        self.bytes += struct.pack(">BQ", 0xCF, value)
        return self

    def float(self, value: float) -> "Chip":
        self.bytes += struct.pack(">Bf", 0xCA, value)
        return self

    def bin(self, data: bytes) -> "Chip":
        self.bytes += struct.pack(">BH", 0xC5, len(data)) + data
        return self


def test_a_chip_may_write_every_number_in_one_width() -> None:
    chip = Chip().map(6).text("m").text("batch/1").text("seq").int(8).text("t").int(1254567)
    chip.text("dt").bin(struct.pack("<2I", 0, 20000)).text("acc").bin(struct.pack(">6h", *range(6)))
    chip.text("gyr").bin(bytes(12))
    frame = f.from_node(bytes(chip.bytes))
    assert isinstance(frame, f.Batch)
    assert (frame.sequence, frame.device_us) == (8, 1254567)
    assert len(measure(frame, HELLO)) == 2
    hello = Chip().map(5).text("m").text("hello/1").text("id").text("esp-3f21").text("boot").int(1)
    hello.text("chip").text("MPU-9150").text("rate").float(50.0)
    said = f.from_node(bytes(hello.bytes))
    assert said == f.Hello(node="esp-3f21", boot=1, chip="MPU-9150", rate_hz=50.0)


if __name__ == "__main__":
    text = PAGE.read_text("utf-8")
    text = re.sub(r"(<!-- example: \w+ -->)\n\d+ bytes:\n\n```\n[^`]*```", r"\1", text)
    PAGE.write_text(re.sub(r"<!-- example: (\w+) -->", lambda m: block(m[1]), text), "utf-8")
