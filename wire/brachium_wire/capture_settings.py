"""capture.toml: what a person says of a capture, read with every name checked."""

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import msgspec
import numpy as np

from brachium_body.assumptions import ASSUMABLE
from brachium_body.ranges import STATED, check_stated
from brachium_body.segments import SEGMENTS, Segment
from brachium_wire.capture_words import in_words, nearest
from brachium_wire.messages import Quaternion, SensorCalibration, Vector
from brachium_wire.plausible import MAX_HEIGHT_M

Pose = Literal["n-pose", "table", "given"]
Motion = Literal["elbow-flexion", "pronation", "free"]
Side = Literal["right", "left", "both"]
Length = Literal["chest_to_shoulder", "upper_arm", "forearm", "hand"]
JointName = Literal["shoulder", "elbow", "wrist"]

MIN_RATE_HZ, MAX_RATE_HZ = 1.0, 2000.0


class CaptureError(ValueError):
    """The folder holds no usable capture: one line that says what was expected, what came and what to do."""


class _Strict(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True):
    """A table of capture.toml: names that it does not know are refused."""


class Functional(_Strict, frozen=True, kw_only=True):
    """One movement that shows a joint's axis; seconds from the first sample of the earliest segment."""

    motion: Motion
    from_s: float
    to_s: float


class CalibrationSpans(_Strict, frozen=True, kw_only=True):
    """Which spans of the recording calibrate it; seconds from the first sample of the earliest segment."""

    pose: Pose | None = None
    from_s: float | None = None
    to_s: float | None = None
    angles_deg: dict[str, float] = msgspec.field(default_factory=dict)
    """Angles held in the pose `given`."""
    functional: tuple[Functional, ...] = ()


class Joint(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of a joint: its axes, and its centre seen from each sensor, in sensor axes, m."""

    axes: int
    centre_from: dict[Segment, Vector]


class Truth(_Strict, frozen=True, kw_only=True):
    """How a capture's truth.parquet is to be compared."""

    kind: str = ""
    metric: str = ""
    mask: str = ""
    max_lag_samples: int = 0


class CaptureSettings(_Strict, frozen=True, kw_only=True):
    """What capture.toml says; every entry may be left out."""

    title: str = ""
    source: str = ""
    licence: str = ""
    side: Side = "right"
    rate_hz: float | None = None
    height_m: float | None = None
    lengths_m: dict[Length, float] = msgspec.field(default_factory=dict)
    facing_deg: float | None = None
    assumed_angles_deg: dict[str, float] = msgspec.field(default_factory=dict)
    """Joint angles that hold throughout, of joints that no sensor sees."""
    mounting: dict[Segment, Quaternion] = msgspec.field(default_factory=dict)
    """segment_from_sensor, of length 1."""
    sensor: dict[Segment, SensorCalibration] = msgspec.field(default_factory=dict)
    calibration: CalibrationSpans = CalibrationSpans()
    joint: dict[JointName, Joint] = msgspec.field(default_factory=dict)
    truth: Truth = Truth()


def read_settings(path: Path) -> CaptureSettings:
    """Return what a capture.toml says, or raise CaptureError naming the entry that is wrong."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise CaptureError(f"{path}: not text (UTF-8)") from None
    except tomllib.TOMLDecodeError as error:
        raise CaptureError(f"{path}: not TOML: {error}") from None
    try:
        _check_names(content)
        content["joint"] = {name: _joint(name, entries) for name, entries in content.get("joint", {}).items()}
        settings = msgspec.convert(content, CaptureSettings)
        _check(settings)
    except msgspec.ValidationError as error:
        raise CaptureError(f"{path}: {in_words(str(error), _CHOICES, _KNOWN)}") from None
    except CaptureError as error:
        raise CaptureError(f"{path}: {error}") from None
    return _normalized(settings)


def _check_names(content: Mapping[str, Any]) -> None:
    for name in ("mounting", "sensor", "joint"):
        _check_table(name, content.get(name, {}))
    for joint in content.get("joint", {}):
        if joint not in get_args(JointName):
            raise CaptureError(f"joint: {joint!r} is not known; joints are {', '.join(get_args(JointName))}")
    for name in ("mounting", "sensor"):
        for segment in content.get(name, {}):
            _known(segment, SEGMENTS, f"{name}: unknown segment")
    for segment, entries in content.get("sensor", {}).items():
        _check_table(f"sensor.{segment}", entries)
        for entry in entries:
            _known(entry, SensorCalibration.__struct_encode_fields__, f"sensor.{segment}: unknown entry")


def _check_table(name: str, entries: Any) -> None:
    if not isinstance(entries, dict):
        raise CaptureError(f"{name}: expected a table, [{name}], came {entries!r}")


def _known(name: str, names: tuple[str, ...], what: str) -> None:
    if name not in names:
        raise CaptureError(f"{what} {name!r}{nearest(name, names)}")


def _joint(name: str, entries: Any) -> dict[str, Any]:
    """Gather `from_<segment>` entries below `centre_from`."""
    if not isinstance(entries, dict) or "axes" not in entries:
        raise CaptureError(
            f"joint.{name}: expected axes = 1, 2 or 3 and the centre from each sensor, from_<segment>"
        )
    centres = {}
    names = ("axes", *(f"from_{segment}" for segment in SEGMENTS))
    for entry, value in entries.items():
        _known(entry, names, f"joint.{name}: unknown entry")
        if entry != "axes":
            centres[entry.removeprefix("from_")] = value
    return {"axes": entries["axes"], "centre_from": centres}


_CHOICES = {
    "side": get_args(Side),
    "pose": get_args(Pose),
    "motion": get_args(Motion),
    "lengths_m": get_args(Length),
}
_KNOWN: tuple[str, ...] = tuple(
    dict.fromkeys(
        name
        for kind in (CaptureSettings, CalibrationSpans, Functional, Truth)
        for name in kind.__struct_encode_fields__
    )
)


def _check(settings: CaptureSettings) -> None:
    if settings.rate_hz is not None and not MIN_RATE_HZ <= settings.rate_hz <= MAX_RATE_HZ:
        raise CaptureError(
            f"rate_hz = {settings.rate_hz:g}: expected {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g} samples a second"
        )
    lengths = {f"lengths_m.{name}": length for name, length in settings.lengths_m.items()}
    for entry, metres in {"height_m": settings.height_m, **lengths}.items():
        if metres is not None and not 0.0 < metres <= MAX_HEIGHT_M:
            raise CaptureError(f"{entry} = {metres:g}: expected metres, above 0 and at most {MAX_HEIGHT_M:g}")
    if settings.facing_deg is not None and not -360.0 <= settings.facing_deg <= 360.0:
        raise CaptureError(f"facing_deg = {settings.facing_deg:g}: expected degrees, -360 to 360")
    spans = settings.calibration
    _check_angles("assumed_angles_deg", settings.assumed_angles_deg, ASSUMABLE)
    _check_angles("calibration.angles_deg", spans.angles_deg, tuple(STATED))
    if spans.pose == "given" and not spans.angles_deg:
        raise CaptureError(
            "calibration: the pose given needs the angles that are held, angles_deg = { elbow_flexion = 35 }"
        )
    if spans.pose != "given" and spans.angles_deg:
        raise CaptureError('calibration: angles_deg belongs to pose = "given"; leave it out, or write that')
    if spans.pose is not None and spans.to_s is None:
        raise CaptureError("calibration: a pose needs to_s, the second at which it ends")
    if spans.to_s is not None and not 0.0 <= (spans.from_s or 0.0) < spans.to_s:
        raise CaptureError(
            f"calibration: to_s = {spans.to_s} must come after from_s = {spans.from_s or 0.0}, from 0 on"
        )
    for span in spans.functional:
        if not 0.0 <= span.from_s < span.to_s:
            raise CaptureError(
                f"calibration.functional {span.motion}: to_s must come after from_s, from 0 on"
            )
    for joint_name, joint in settings.joint.items():
        if joint.axes not in (1, 2, 3):
            raise CaptureError(f"joint.{joint_name}: axes = {joint.axes}; a joint has 1, 2 or 3")
    for name, q in settings.mounting.items():
        if not abs(float(np.linalg.norm(q)) - 1.0) <= 0.01:  # true for NaN too
            raise CaptureError(
                f"mounting.{name}: {list(q)} is no rotation; a quaternion w x y z has length 1"
            )


def _check_angles(entry: str, angles_deg: Mapping[str, float], names: tuple[str, ...]) -> None:
    try:
        check_stated(angles_deg, names)
    except ValueError as error:
        raise CaptureError(f"{entry}.{error}") from None


def _normalized(settings: CaptureSettings) -> CaptureSettings:
    unit: dict[Segment, Quaternion] = {}
    for name, q in settings.mounting.items():
        w, x, y, z = np.asarray(q) / np.linalg.norm(q)
        unit[name] = (float(w), float(x), float(y), float(z))
    return msgspec.structs.replace(settings, mounting=unit)


def to_toml(settings: CaptureSettings) -> str:
    """Return the text of a capture.toml that reads back as these settings."""
    content = msgspec.to_builtins(settings)
    for joint in content.get("joint", {}).values():
        joint |= {f"from_{segment}": vector for segment, vector in joint.pop("centre_from").items()}
    return "".join(f"{name} = {_value(value)}\n" for name, value in content.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)
