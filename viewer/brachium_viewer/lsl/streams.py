"""What the streams are: channels as the XDF conventions name them, messages as rows of numbers. Pure.

LSL has no missing values: here, and nowhere else on a network of ours, what was not measured is NaN, and each
stream's description says so. Types are those of the XDF conventions (MoCap) and, for samples, of Motion-BIDS.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import get_args

import numpy as np
import numpy.typing as npt

from brachium_body.angles import COLUMNS, SHARING_QUALITY
from brachium_body.kinematics import JOINTS
from brachium_body.segments import Side, arm_segments
from brachium_wire.messages import Event, Info, Origin, Quality, Skeleton
from brachium_wire.samples import Samples

Rows = npt.NDArray[np.float32]

OWN = "brachium:"
"""The source ids of our streams begin with this."""
QUALITIES: tuple[Quality, ...] = get_args(Quality)
NOTICE = "A measuring and research tool, not a medical device."
MISSING = "NaN: not measured"
CACHED = 256
"""Streams are made once and then asked for with every message."""
AXES = "XYZ"
PARTS_OF_QUATERNION = "ABCD"
"""Their types after "Orientation": A is the scalar, B, C, D its axes."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One number of each sample."""

    label: str
    type: str
    unit: str
    of: str
    """The joint (marker) or segment (object) that it belongs to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """One stream as others find it."""

    name: str
    content: str
    """LSL's content type."""
    source_id: str
    """The same whenever this stream is opened again: readers then go on by themselves."""
    rate_hz: float
    """Nominal; 0: comes as it comes."""
    channels: tuple[Channel, ...]
    model: str = ""
    description: dict[str, str] = field(default_factory=dict)


def _named(room: str, subject: str, what: str, origin: Origin) -> tuple[str, str]:
    """Return name and source id; what nobody wears says so in both."""
    name = f"{subject} {what}" + ("" if origin == "worn" else f" ({origin})")
    return name, f"{OWN}{room}:{subject}:{what.replace(' ', '-')}:{origin}"


def _described(subject: str, origin: Origin, **more: str) -> dict[str, str]:
    return {"subject": subject, "origin": origin, "missing_values": MISSING, "notice": NOTICE, **more}


def _vector(name: str, unit: str, kind: str = "Position") -> list[Channel]:
    return [Channel(f"{name}_{axis.lower()}", f"{kind}{axis}", unit, name) for axis in AXES]


def _turn(name: str) -> list[Channel]:
    parts = zip("wxyz", PARTS_OF_QUATERNION, strict=True)
    return [Channel(f"{name}_q{i}", f"Orientation{part}", "quaternion", name) for i, part in parts]


def _grade(name: str) -> Channel:
    return Channel(f"quality_{name}", "Quality", "code", name)


_CODES = ", ".join(f"{code} {name}" for code, name in enumerate(QUALITIES))


# -- skeletons -------------------------------------------------------------------------------------------


@lru_cache(maxsize=CACHED)
def skeleton_stream(room: str, subject: str, side: Side, origin: Origin, rate_hz: float) -> Stream:
    """Return the stream of an arm's positions and orientations."""
    name, source_id = _named(room, subject, f"{side} skeleton", origin)
    segments = ("sternum", *arm_segments(side))
    return Stream(
        name=name,
        content="MoCap",
        source_id=source_id,
        rate_hz=rate_hz,
        channels=(
            *(c for joint in JOINTS for c in _vector(joint, "meters")),
            *_vector("shoulder_shift", "meters"),
            *_turn("trunk_from_world"),
            *(c for segment in segments for c in _turn(segment)),
            *(_grade(segment) for segment in segments),
        ),
        model="arm model",
        description=_described(
            subject,
            origin,
            side=side,
            positions="trunk axes: x right, y forward, z up; from the chest",
            orientations="world from segment, scalar first; trunk_from_world turns them into trunk axes",
            quality=_CODES,
        ),
    )


def skeleton_row(skeleton: Skeleton) -> Rows:
    """Return the row (1, channels) of a skeleton."""
    nothing = (None,) * 3, (None,) * 4
    row: list[float | None] = []
    for joint in JOINTS:
        row += skeleton.positions.get(joint) or nothing[0]
    row += skeleton.shoulder_shift or nothing[0]
    row += skeleton.trunk_from_world
    segments = ("sternum", *arm_segments(skeleton.side))
    poses = [skeleton.segments.get(segment) for segment in segments]
    for pose in poses:
        row += (pose and pose.world_from_segment) or nothing[1]
    row += [QUALITIES.index("missing" if pose is None else pose.quality) for pose in poses]
    return _rows([row])


@lru_cache(maxsize=CACHED)
def angle_stream(room: str, subject: str, side: Side, origin: Origin, rate_hz: float) -> Stream:
    """Return the stream of an arm's angles, in degrees, with the quality of each joint's."""
    name, source_id = _named(room, subject, f"{side} angles", origin)
    return Stream(
        name=name,
        content="JointAngles",
        source_id=source_id,
        rate_hz=rate_hz,
        channels=(
            *(Channel(column, "Angle", "degrees", column.partition("_")[0]) for column in COLUMNS),
            *(_grade(group) for group in SHARING_QUALITY),
        ),
        model="arm model",
        description=_described(
            subject,
            origin,
            side=side,
            signs="as in Brachium's conventions; unwrapped from the first sample on",
            quality=_CODES,
        ),
    )


def angle_row(skeleton: Skeleton) -> Rows:
    """Return the row (1, channels) of a skeleton's angles."""
    angles = skeleton.angles
    degrees = [None if (rad := angles.get(column)) is None else np.degrees(rad) for column in COLUMNS]
    grades = []
    for names in SHARING_QUALITY.values():
        known = [name for name in names if name in angles]
        told = next((skeleton.assumed[name] for name in known if name in skeleton.assumed), "good")
        grades.append(QUALITIES.index(told if known else "missing"))
    return _rows([[*degrees, *grades]])


# -- samples ---------------------------------------------------------------------------------------------

_RAW = (("acc", "ACCEL", "m/s^2"), ("gyr", "GYRO", "rad/s"), ("mag", "MAGN", "uT"))


@lru_cache(maxsize=CACHED)
def sample_stream(room: str, subject: str, segment: str, info: Info) -> Stream:
    """Return the stream of one sensor's samples, as they came: in sensor axes, uncalibrated."""
    name, source_id = _named(room, subject, f"{segment} samples", info.origin)
    raw = [row for row in _RAW if row[0] != "mag" or info.magnetometer]
    channels = (
        _turn("world_from_sensor")
        if info.orientation_only
        else [Channel(f"{b}_{a.lower()}", kind, unit, segment) for b, kind, unit in raw for a in AXES]
    )
    return Stream(
        name=name,
        content="IMU",
        source_id=source_id,
        rate_hz=info.rate_hz,
        channels=tuple(channels),
        model=info.chip,
        description=_described(
            subject,
            info.origin,
            segment=segment,
            node=info.node,
            firmware=info.firmware,
            axes="the sensor's own; acceleration is specific force, +g upwards at rest",
            calibration="the sensor's own is not applied",
        ),
    )


def sample_rows(samples: Samples, info: Info) -> Rows:
    """Return the rows (n, channels) of a batch; blocks that it does not hold are NaN."""
    n = len(samples)
    if info.orientation_only:
        return _rows(np.full((n, 4), np.nan) if samples.quat is None else samples.quat)
    blocks = [np.full((n, 3), np.nan) if block is None else block for block in (samples.acc, samples.gyr)]
    if info.magnetometer:
        field_ut = np.full((n, 3), np.nan)
        if samples.mag is not None:
            index = range(n) if samples.mag_index is None else samples.mag_index
            field_ut[list(index)] = samples.mag
        blocks.append(field_ut)
    return _rows(np.hstack(blocks))


# -- events ----------------------------------------------------------------------------------------------


@lru_cache(maxsize=CACHED)
def event_stream(room: str, subject: str) -> Stream:
    """Return the stream of a subject's events."""
    return Stream(
        name=f"{subject} events",
        content="Markers",
        source_id=f"{OWN}{room}:{subject}:events",
        rate_hz=0.0,
        channels=(Channel("event", "Marker", "text", subject),),
        description={"subject": subject, "notice": NOTICE},
    )


def event_text(event: Event) -> str:
    """Return what a marker says: the kind, and its words if it has any."""
    return f"{event.kind}: {event.text}" if event.text else event.kind


def _rows(rows: npt.NDArray[np.float64] | Iterable[Iterable[float | None]]) -> Rows:
    """Return rows as float32; None becomes NaN."""
    return np.array(rows if isinstance(rows, np.ndarray) else list(rows), dtype=np.float32)
