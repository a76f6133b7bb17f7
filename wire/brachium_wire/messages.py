"""What travels: frozen records in SI units. Short names are those on the wire, docs/wire.md explains each.

A number that was not measured is absent or nil; it is never 0 and never NaN.
"""

from typing import Any, Literal

import msgspec
from brachium_body.segments import Side

Origin = Literal["worn", "emulated", "playback"]
Quality = Literal["good", "held", "missing", "disturbed", "uncalibrated", "heading_assumed", "assumed"]
Forward = Literal["sternum", "elbow", "facing", "mounting", "none"]
CalibrationState = Literal["none", "waiting", "running", "done", "refused"]

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Message(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="m"):
    """Base of all messages; `m` names kind and version, so that another version is refused, not misread."""



class SampleBatch(Message, frozen=True, kw_only=True, tag="imu/1"):
    """1 to n samples of one sensor, in sensor axes, uncalibrated; blocks are little-endian (see samples.py)."""

    sequence: int = msgspec.field(name="seq")
    """Number of the first sample; the others follow it one by one. Never wraps in practice."""
    time_ns: int = msgspec.field(name="t")
    """Host time of the first sample."""
    offsets: bytes = msgspec.field(name="dt")
    """n x u32: ns from `t` to each sample in host time; the first is 0."""
    device_us: int = msgspec.field(name="dev")
    """The node's own clock at the first sample, us."""
    device_offsets: bytes = msgspec.field(name="ddt")
    """n x u32: us from `dev` to each sample."""
    received_ns: int = msgspec.field(name="rx")
    """Host time at which the gateway had the whole batch."""
    uncertainty_ns: int = msgspec.field(name="unc")
    """Half width within which the host times are believed to lie."""
    acc: bytes | None = None
    """n x 3 f32: specific force, m/s^2; a sensor at rest reads +g upward."""
    gyr: bytes | None = None
    """n x 3 f32: angular rate, rad/s."""
    mag: bytes | None = None
    """k x 3 f32: magnetic field, uT, turned into the accelerometer's axes."""
    mag_index: bytes | None = msgspec.field(name="mi", default=None)
    """k x u16: which samples `mag` belongs to; absent when it has one row a sample."""
    quat: bytes | None = None
    """n x 4 f32: world from sensor, for sensors that deliver orientation."""
    late: bool = False
    """Sent again after an outage: for the record, too late for the live skeleton."""


class SensorCalibration(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What turns raw samples into calibrated ones: gyr - gyro_bias; accel_scale * (acc - accel_bias);
    mag_matrix (mag - mag_offset)."""

    gyro_bias: Vector | None = None
    accel_scale: Vector | None = None
    accel_bias: Vector | None = None
    mag_offset: Vector | None = None
    mag_matrix: tuple[Vector, Vector, Vector] | None = None


class Info(Message, frozen=True, kw_only=True, tag="info/1"):
    """What is known of the sensor on one segment (retained)."""

    node: str
    rate_hz: float = msgspec.field(name="rate")
    origin: Origin = msgspec.field(name="org")
    host: str
    """Names the clock that gave host time; all nodes of a subject must share it."""
    chip: str = ""
    firmware: str = msgspec.field(name="fw", default="")
    mounting: Quaternion | None = msgspec.field(name="mnt", default=None)
    """Nominal segment_from_sensor; absent when nothing is known of how it is worn."""
    calibration: SensorCalibration = msgspec.field(name="cal", default_factory=SensorCalibration)
    magnetometer: bool = msgspec.field(name="mag", default=False)
    orientation_only: bool = msgspec.field(name="ori", default=False)


class Status(Message, frozen=True, kw_only=True, tag="status/1"):
    """How one sensor fares, once a second. Counts are samples since the node joined."""

    node: str
    time_ns: int = msgspec.field(name="t")
    connected: bool = msgspec.field(name="up")
    received: int = msgspec.field(name="rcv")
    lost: int
    out_of_order: int = msgspec.field(name="ooo")
    late: int = 0
    rate_hz: float | None = msgspec.field(name="rate", default=None)
    """Samples that arrived during the last second."""
    battery_v: float | None = msgspec.field(name="bat", default=None)
    battery_hours: float | None = msgspec.field(name="bath", default=None)
    rssi_dbm: float | None = msgspec.field(name="rssi", default=None)
    node_dropped: int | None = msgspec.field(name="ndrop", default=None)
    """Samples the node itself says that it dropped."""
    clock_offset_ns: int | None = msgspec.field(name="off", default=None)
    clock_skew_ppm: float | None = msgspec.field(name="skew", default=None)
    clock_uncertainty_ns: int | None = msgspec.field(name="unc", default=None)
    drops: dict[str, int] = msgspec.field(default_factory=dict)
    """What was refused, by reason."""


class SegmentPose(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One segment at the skeleton's instant. Without orientation when it is missing."""

    quality: Quality = msgspec.field(name="ql")
    sequence: int | None = msgspec.field(name="seq", default=None)
    """Number of the last sample that was used."""
    world_from_segment: Quaternion | None = msgspec.field(name="q", default=None)
    world_from_sensor: Quaternion | None = msgspec.field(name="sq", default=None)


class Skeleton(Message, frozen=True, kw_only=True, tag="skeleton/1"):
    """One arm at one instant; a published one is never revised. On the truth key: what really is."""

    time_ns: int = msgspec.field(name="t")
    side: Side
    origin: Origin = msgspec.field(name="org")
    forward: Forward = msgspec.field(name="fwd")
    """Which rule says where forward is (docs/conventions.md)."""
    trunk_from_world: Quaternion = msgspec.field(name="trunk")
    segments: dict[str, SegmentPose] = msgspec.field(name="seg")
    positions: dict[str, Vector] = msgspec.field(name="pos")
    """shoulder, elbow, wrist, hand in trunk axes, m; one that is not known is absent."""
    angles: dict[str, float] = msgspec.field(name="ang")
    """Clinical, ISB and model angles by their column names, rad; one that is not known is absent."""
    assumed: dict[str, Quality] = msgspec.field(name="aq", default_factory=dict)
    """Angles and positions that are not plainly measured, with their quality."""
    shoulder_shift: Vector | None = msgspec.field(name="shift", default=None)
    received_ns: int | None = msgspec.field(name="rx", default=None)
    """Host time at which the gateway had the last sample that this skeleton needed."""


class Calibration(Message, frozen=True, kw_only=True, tag="calibration/1"):
    """What fusion knows of a subject's calibration (retained), and progress while it finds it."""

    time_ns: int = msgspec.field(name="t")
    state: CalibrationState
    pose: str = ""
    progress: float = 0.0
    reason: str = ""
    """Why it was refused, or what it waits for: one line that says what to do."""
    forward: Forward = msgspec.field(name="fwd", default="none")
    mounting: dict[str, Quaternion] = msgspec.field(name="mnt", default_factory=dict)
    """segment_from_sensor found for each segment."""
    scores: dict[str, float] = msgspec.field(default_factory=dict)
    warnings: list[str] = msgspec.field(default_factory=list)


class Session(Message, frozen=True, kw_only=True, tag="session/1"):
    """A subject's session (retained). Pseudonyms only: a name of a person never travels."""

    side: Literal["right", "left", "both"] = "right"
    height_m: float | None = None
    lengths_m: dict[str, float] = msgspec.field(default_factory=dict)
    """chest_to_shoulder, upper_arm, forearm, hand between joint centres."""
    facing_deg: float | None = None
    """Where neutral faces, 0 = magnetic north, 90 = east."""
    exercise: str = ""
    assumed_angles_deg: dict[str, float] = msgspec.field(default_factory=dict)
    """Angles the exercise states for joints that no sensor sees: elbow_flexion, forearm_pronation."""


class Event(Message, frozen=True, kw_only=True, tag="event/1"):
    """A mark in time: an exercise begins, a therapist's note, a change that fusion applied."""

    time_ns: int = msgspec.field(name="t")
    kind: str
    text: str = ""
    data: dict[str, Any] = msgspec.field(default_factory=dict)


class Snapshot(Message, frozen=True, kw_only=True, tag="snapshot/1"):
    """Fusion's settings and whole state for one subject at one moment; a recording begins with it."""

    time_ns: int = msgspec.field(name="t")
    settings: dict[str, Any]
    state: bytes
    """MessagePack that only fusion reads."""


class Health(Message, frozen=True, kw_only=True, tag="health/1"):
    """How a service fares, once a second."""

    kind: str
    id: str
    time_ns: int = msgspec.field(name="t")
    uptime_s: float = msgspec.field(name="up")
    counts: dict[str, int] = msgspec.field(default_factory=dict)
    drops: dict[str, int] = msgspec.field(default_factory=dict)
    waiting: list[str] = msgspec.field(default_factory=list)
    """Nodes that asked to join and are not assigned."""
    text: str = ""


class Command(Message, frozen=True, kw_only=True, tag="command/1"):
    """The question of a command query; `arguments` depend on the verb."""

    arguments: dict[str, Any] = msgspec.field(name="args", default_factory=dict)


class Answer(Message, frozen=True, kw_only=True, tag="answer/1"):
    """The answer to a command: ok, or the reason why not."""

    ok: bool
    reason: str = ""
    data: dict[str, Any] = msgspec.field(default_factory=dict)
