"""Write the made sections of docs/wire.md, and tests/golden/wire.json, from the messages and the topic table.

Run `python docs/make_wire_tables.py` after a change in messages.py or topics.py; a test fails until then.
"""

import ast
import inspect
import json
import re
import types
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import msgpack
import msgspec

from brachium_wire import codec, messages, plausible, samples
from brachium_wire.messages import Message
from brachium_wire.sensor_records import SensorProgress, WearFound, WearProgress
from brachium_wire.topics import TOPICS

HERE = Path(__file__).parent
PAGE = HERE / "wire.md"
GOLDEN = HERE.parent / "tests" / "golden" / "wire.json"
TIME_NS = 1_790_000_000_123_456_789

EXAMPLES: tuple[Message, ...] = (
    samples.write_samples(
        sequence=1200,
        time_ns=[TIME_NS, TIME_NS + 10_000_000],
        device_us=[12_000_000, 12_010_000],
        received_ns=TIME_NS + 13_000_000,
        uncertainty_ns=800_000,
        acc=[[0.0, 9.75, 0.5], [0.0, 9.75, 0.625]],
        gyr=[[0.0, 0.0, 1.0], [0.0, -0.25, 1.0]],
        mag=[[20.0, 0.0, -40.0]],
        mag_index=[1],
    ),
    messages.Info(
        node="esp-3f21",
        rate_hz=100.0,
        origin="worn",
        host="gateway-1",
        chip="mpu9150",
        firmware="1.0",
        mounting=(1.0, 0.0, 0.0, 0.0),
        calibration=messages.SensorCalibration(gyro_bias=(0.01, 0.0, -0.02)),
        magnetometer=True,
    ),
    messages.Status(
        node="esp-3f21",
        time_ns=TIME_NS,
        connected=True,
        received=5990,
        lost=10,
        out_of_order=5,
        rate_hz=99.5,
        battery_v=3.75,
        rssi_dbm=-61.0,
        clock_offset_ns=1_789_999_988_123_456_789,
        clock_skew_ppm=12.5,
        clock_uncertainty_ns=800_000,
        drops={"malformed": 1},
    ),
    messages.Skeleton(
        time_ns=TIME_NS,
        side="right",
        origin="worn",
        forward="facing",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={
            "upper_arm_r": messages.SegmentPose(
                quality="good",
                sequence=1201,
                world_from_segment=(0.5, 0.5, 0.5, 0.5),
                world_from_sensor=(0.5, 0.5, 0.5, 0.5),
            ),
            "forearm_r": messages.SegmentPose(quality="missing"),
        },
        positions={"shoulder": (0.2, 0.0, 0.25), "elbow": (0.2, 0.0, -0.0625)},
        angles={"shoulder_flexion": 0.125, "elbow_flexion": 1.5},
        assumed={"elbow_flexion": "assumed"},
        received_ns=TIME_NS + 13_000_000,
        angle_sd={"elbow_flexion": 0.0625},
    ),
    messages.Calibration(
        time_ns=TIME_NS,
        state="done",
        pose="n-pose",
        progress=1.0,
        forward="facing",
        mounting={"upper_arm_r": (1.0, 0.0, 0.0, 0.0)},
        scores={"stillness_rad_s": 0.03125},
    ),
    messages.Session(side="right", height_m=1.75, lengths_m={"upper_arm": 0.3125}, exercise="elbow-flexion"),
    messages.Event(time_ns=TIME_NS, kind="repetition", text="third", data={"number": 3}),
    messages.Snapshot(time_ns=TIME_NS, settings={"filter": "vqf"}, state=b"\x80"),
    messages.Health(
        kind="fusion",
        id="f1",
        time_ns=TIME_NS,
        uptime_s=12.5,
        counts={"skeletons": 600},
        drops={"late": 2},
    ),
    messages.Command(arguments={"pose": "n-pose", "seconds": 3.0}),
    messages.Answer(ok=False, reason="the right hand moves; hold still for 3 s"),
)


def tag_of(kind: type[Message]) -> str:
    """Return a message's kind and version as they stand in `m`."""
    return str(kind.__struct_config__.tag)


def field_docs(kind: type[msgspec.Struct]) -> dict[str, str]:
    """Return what the source says of each field; every field must have a docstring."""
    body = ast.parse(inspect.getsource(kind)).body[0]
    assert isinstance(body, ast.ClassDef)
    docs = {}
    for line, after in zip(body.body, body.body[1:], strict=False):
        if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name):
            assert isinstance(after, ast.Expr), f"{kind.__name__}.{line.target.id} has no docstring"
            assert isinstance(after.value, ast.Constant)
            docs[line.target.id] = " ".join(str(after.value.value).split())
    return docs


def type_text(annotation: Any) -> str:
    """Return an annotation in MessagePack's words."""
    plain = {
        int: "int",
        float: "float",
        str: "str",
        bytes: "bin",
        bool: "bool",
        Any: "any",
        messages.Vector: "[float; 3]",
        messages.Quaternion: "[float; 4]",
        tuple[messages.Vector, messages.Vector, messages.Vector]: "[[float; 3]; 3]",
        dict[str, Any]: "map",
    }
    if annotation in plain:
        return plain[annotation]
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return "str: " + ", ".join(f"`{value}`" for value in inner)
    if origin in (Union, types.UnionType):
        return " or ".join(type_text(one) for one in inner if one is not type(None))
    if origin is dict:
        return f"map of {type_text(inner[1])}"
    if origin is list:
        return f"list of {type_text(inner[0])}"
    return f"map: {annotation.__name__}"


def fields(kind: type[msgspec.Struct]) -> str:
    """Return the table of a record's fields."""
    docs, hints = field_docs(kind), get_type_hints(kind)
    rows = ["| field | type | | meaning |", "|---|---|---|---|"]
    if issubclass(kind, Message):
        rows.append(f"| `m` | str | always | `{tag_of(kind)}` |")
    for one in msgspec.structs.fields(kind):
        need = "always" if one.required else "optional"
        rows.append(f"| `{one.encode_name}` | {type_text(hints[one.name])} | {need} | {docs[one.name]} |")
    return "\n".join(rows)


def topic_rows() -> str:
    """Return the topic table."""
    rows = [
        "| topic | key after `brachium/<room>/` | message | nominal Hz | stale after | priority "
        "| retained | recorded | at most |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    priority = {"data": "data", "control": "interactive high", "background": "background"}
    for t in TOPICS.values():
        rate = "" if t.rate_hz is None else f"{t.rate_hz:g}"
        stale = "" if t.stale_after_s is None else f"{t.stale_after_s:g} s"
        marks = "yes" if t.retained else "", "yes" if t.recorded else "", f"{t.max_bytes} B"
        cells = t.name, f"`{t.pattern}`", f"`{tag_of(t.message)}`", rate, stale, priority[t.urgency.value]
        rows.append(f"| {' | '.join((*cells, *marks))} |")
    return "\n".join(rows)


def limits() -> str:
    """Return the bounds at the door, with their figures."""
    parser = codec._LIMITS
    strings, binaries = parser["max_str_len"], parser["max_bin_len"]
    lists, maps = parser["max_array_len"], parser["max_map_len"]
    acc, gyr, mag = samples.MAX_ACC, samples.MAX_GYR, samples.MAX_MAG
    count, span_s = samples.MAX_SAMPLES, samples.MAX_SPAN_NS / 1e9
    rate, length = plausible.MAX_RATE_HZ, plausible.MAX_HEIGHT_M
    lines = (
        f"`acc` at most {acc:g} m/s^2, `gyr` {gyr:g} rad/s, `mag` {mag:g} uT, each component.",
        f"A quaternion's length within {plausible.LENGTH_TOLERANCE:g} of 1; "
        f"`rate` above 0 and at most {rate:g} Hz; "
        f"body height and lengths above 0 and at most {length:g} m.",
        f"1 to {count} samples in a batch (within the topic's bytes), spanning at most {span_s:g} s.",
        f"Strings up to {strings} bytes, binaries {binaries}, lists {lists} and maps {maps} entries, "
        f"{codec.MAX_DEPTH} levels; no extension types.",
        "Reasons by name: " + ", ".join(f"`{drop.value}`" for drop in codec.Drop) + ".",
    )
    return "\n".join(f"* {line}" for line in lines)


def readable(value: Any) -> Any:
    """Return an unpacked message with its binaries as hex, for JSON."""
    if isinstance(value, bytes):
        return value.hex(" ", 4) if len(value) % 4 == 0 else value.hex()
    if isinstance(value, dict):
        return {key: readable(inner) for key, inner in value.items()}
    return [readable(inner) for inner in value] if isinstance(value, list) else value


def example(message: Message) -> str:
    """Return one message in hex and what it says."""
    payload = codec.encode(message)
    text = "\n".join(payload.hex()[i : i + 96] for i in range(0, len(payload.hex()), 96))
    said = json.dumps(readable(msgpack.unpackb(payload)), ensure_ascii=False)
    said = "\n".join(wrap(said))
    title = f"{len(payload)} bytes in hex, and the map they hold (binaries as hex):"
    return f"{title}\n\n```\n{text}\n```\n```\n{said}\n```"


def wrap(text: str, width: int = 108) -> list[str]:
    """Return `text` in lines, broken after commas."""
    lines = [""]
    for part in re.split(r"(?<=, )", text):
        if len(lines[-1]) + len(part) > width:
            lines[-1] = lines[-1].rstrip()
            lines.append("")
        lines[-1] += part
    return lines


def sections() -> dict[str, str]:
    """Return every generated section of the page by its name."""
    out = {"topics": topic_rows(), "limits": limits()}
    for message in EXAMPLES:
        kind = type(message)
        out[tag_of(kind)] = f"{fields(kind)}\n\n{example(message)}"
    for record in (messages.SensorCalibration, SensorProgress, WearProgress, WearFound, messages.SegmentPose):
        out[record.__name__] = fields(record)
    return out


def rewritten(page: str) -> str:
    """Return the page with its marked sections made anew. Raises KeyError for a marker that names nothing."""
    made = sections()
    found: list[str] = []

    def fill(match: re.Match[str]) -> str:
        found.append(match[1])
        return f"<!-- made: {match[1]} -->\n{made[match[1]]}\n<!-- end -->"

    page = re.sub(r"<!-- made: (\S+) -->\n.*?<!-- end -->", fill, page, flags=re.DOTALL)
    missing = set(made) - set(found)
    assert not missing, f"docs/wire.md has no section for {sorted(missing)}"
    return page


def golden() -> str:
    """Return the bytes of each example as JSON text."""
    rows = {tag_of(type(message)): codec.encode(message).hex() for message in EXAMPLES}
    return json.dumps(rows, indent=1) + "\n"


if __name__ == "__main__":
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    GOLDEN.parent.mkdir(exist_ok=True)
    GOLDEN.write_text(golden(), encoding="utf-8")
    print(f"wrote {PAGE} and {GOLDEN}")
