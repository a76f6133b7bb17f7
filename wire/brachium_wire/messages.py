"""What travels, in SI units (docs/wire.md). A number not measured is absent or nil, never 0 and never NaN."""

from typing import Any, Literal

import msgspec

from brachium_body.segments import Side
from brachium_wire.sensor_records import CalibrationState, Keeper, SensorProgress, WearProgress
from brachium_wire.sensor_records import SensorCalibration as SensorCalibration
from brachium_wire.sensor_records import Vector as Vector

Origin = Literal["worn", "emulated", "playback"]
Quality = Literal["good", "held", "missing", "disturbed", "uncalibrated", "heading_assumed", "assumed"]
Forward = Literal["sternum", "elbow", "facing", "mounting", "none"]
Quaternion = tuple[float, float, float, float]


class Message(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="m"):
    """Base of all messages; `m` names kind and version, so that another version is refused, not misread."""


class SampleBatch(Message, frozen=True, kw_only=True, tag="imu/1"):
    """1 to n samples of one sensor, in sensor axes, uncalibrated; blocks are little-endian (samples.py)."""

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


class Info(Message, frozen=True, kw_only=True, tag="info/1"):
    """What is known of the sensor on one segment (retained)."""

    node: str
    """The id of the node that the segment carries, as in the site file."""
    rate_hz: float = msgspec.field(name="rate")
    """Nominal sampling rate, Hz; filters run at its period."""
    origin: Origin = msgspec.field(name="org")
    """Whether a person wears it, an emulated wearer does, or a recording is played."""
    host: str
    """Names the clock that gave host time; all nodes of a subject must share it."""
    chip: str = ""
    """The sensor's type, as the node says it: `mpu9150`."""
    firmware: str = msgspec.field(name="fw", default="")
    """Version of the node's program."""
    mounting: Quaternion | None = msgspec.field(name="mnt", default=None)
    """Nominal segment_from_sensor; absent when nothing is known of how it is worn."""
    calibration: SensorCalibration = msgspec.field(name="cal", default_factory=SensorCalibration)
    """Sensor calibration that whoever uses the samples must apply."""
    kept: Keeper = ""
    """Who keeps the calibration: the node itself, or its gateway for it; empty when there is none."""
    magnetometer: bool = msgspec.field(name="mag", default=False)
    """Whether batches will carry a magnetic field."""
    orientation_only: bool = msgspec.field(name="ori", default=False)
    """Whether batches carry `quat` and nothing else."""
    heading_free: bool = msgspec.field(name="free", default=False)
    """Whether its orientations have a heading of their own, which drifts: no magnetometer is behind them."""


class Status(Message, frozen=True, kw_only=True, tag="status/1"):
    """How one sensor fares, once a second. Counts are samples since the node joined."""

    node: str
    """The id of the node."""
    time_ns: int = msgspec.field(name="t")
    """Host time, ns."""
    connected: bool = msgspec.field(name="up")
    """Whether the node is connected now."""
    received: int = msgspec.field(name="rcv")
    """Samples that came."""
    lost: int
    """Sequence numbers that were passed over and did not come."""
    out_of_order: int = msgspec.field(name="ooo")
    """Samples that came after a later one."""
    late: int = 0
    """Samples sent again after an outage."""
    rate_hz: float | None = msgspec.field(name="rate", default=None)
    """Samples that arrived during the last second."""
    battery_v: float | None = msgspec.field(name="bat", default=None)
    """Battery voltage, V."""
    battery_level: float | None = msgspec.field(name="batl", default=None)
    """How full the battery is, 0 to 1."""
    battery_hours: float | None = msgspec.field(name="bath", default=None)
    """Estimated time left, h."""
    rssi_dbm: float | None = msgspec.field(name="rssi", default=None)
    """Received signal strength, dBm."""
    node_dropped: int | None = msgspec.field(name="ndrop", default=None)
    """Samples the node itself says that it dropped."""
    clock_offset_ns: int | None = msgspec.field(name="off", default=None)
    """Host time minus the node's clock, ns."""
    clock_skew_ppm: float | None = msgspec.field(name="skew", default=None)
    """How much faster than host time the node's clock runs, 1e-6."""
    clock_uncertainty_ns: int | None = msgspec.field(name="unc", default=None)
    """Half width within which the offset is believed to lie, ns."""
    drops: dict[str, int] = msgspec.field(default_factory=dict)
    """What was refused, by reason."""


class SegmentPose(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One segment at the skeleton's instant. Without orientation when it is missing."""

    quality: Quality = msgspec.field(name="ql")
    """How far to trust it; the values are explained under Quality."""
    sequence: int | None = msgspec.field(name="seq", default=None)
    """Number of the last sample that was used."""
    world_from_segment: Quaternion | None = msgspec.field(name="q", default=None)
    """Orientation of the segment."""
    world_from_sensor: Quaternion | None = msgspec.field(name="sq", default=None)
    """Orientation of its sensor."""


class Skeleton(Message, frozen=True, kw_only=True, tag="skeleton/1"):
    """One arm at one instant; a published one is never revised. On the truth key: what really is."""

    time_ns: int = msgspec.field(name="t")
    """The instant solved, host time, ns."""
    side: Side
    """Which arm."""
    origin: Origin = msgspec.field(name="org")
    """Where its samples come from."""
    forward: Forward = msgspec.field(name="fwd")
    """Which rule says where forward is (docs/conventions.md)."""
    trunk_from_world: Quaternion = msgspec.field(name="trunk")
    """Turns world axes into trunk axes."""
    segments: dict[str, SegmentPose] = msgspec.field(name="seg")
    """By segment: `upper_arm_r`, `forearm_r`, `hand_r`, `sternum` and so on."""
    positions: dict[str, Vector] = msgspec.field(name="pos")
    """shoulder, elbow, wrist, hand in trunk axes, m; one that is not known is absent."""
    angles: dict[str, float] = msgspec.field(name="ang")
    """Clinical, ISB and model angles by their column names, rad; one that is not known is absent."""
    assumed: dict[str, Quality] = msgspec.field(name="aq", default_factory=dict)
    """Angles and positions that are not plainly measured, with their quality."""
    shoulder_shift: Vector | None = msgspec.field(name="shift", default=None)
    """Displacement of the shoulder from where it was in the pose, trunk axes, m."""
    shoulder_shift_sd: Vector | None = msgspec.field(name="shiftsd", default=None)
    """Its standard deviation along each axis, m, as the estimator states it."""
    received_ns: int | None = msgspec.field(name="rx", default=None)
    """Host time at which the gateway had the last sample that this skeleton needed."""
    angle_sd: dict[str, float] = msgspec.field(name="angsd", default_factory=dict)
    """Standard deviations of angles, rad: tilt and heading between sensors, not mounting nor soft tissue."""


class Calibration(Message, frozen=True, kw_only=True, tag="calibration/1"):
    """What fusion knows of a subject's calibration (retained), and progress while it finds it."""

    time_ns: int = msgspec.field(name="t")
    """Host time, ns."""
    state: CalibrationState
    """How far it has come."""
    pose: str = ""
    """The pose that is held: `n-pose`, `table`, `given`."""
    motion: str = ""
    """What is to be done now: the pose, `elbow-flexion`, `pronation`, `free`; empty when nothing is."""
    progress: float = 0.0
    """0 to 1."""
    reason: str = ""
    """Why it was refused, or what it waits for: one line that says what to do."""
    forward: Forward = msgspec.field(name="fwd", default="none")
    """Which rule says where forward is."""
    mounting: dict[str, Quaternion] = msgspec.field(name="mnt", default_factory=dict)
    """segment_from_sensor found for each segment."""
    scores: dict[str, float] = msgspec.field(default_factory=dict)
    """How well it went, by name with unit."""
    warnings: list[str] = msgspec.field(default_factory=list)
    """What a person should know, one line each."""
    refused: dict[str, str] = msgspec.field(default_factory=dict)
    """What could not be found, by name, and the reason: one line that says what to do."""
    moving: list[str] = msgspec.field(default_factory=list)
    """Segments whose sensors are not still yet while a pose is waited for."""
    sensor: SensorProgress | None = None
    """The sensor that is being calibrated by itself, or was last."""
    sensors: dict[str, SensorCalibration] = msgspec.field(default_factory=dict)
    """Sensor calibrations found here, by node: what gateways bring to the nodes."""
    wear: WearProgress | None = None
    """The check of who sits where that runs, or ran last."""


class Session(Message, frozen=True, kw_only=True, tag="session/1"):
    """A subject's session (retained). Pseudonyms only: a name of a person never travels."""

    side: Literal["right", "left", "both"] = "right"
    """Which arms are tracked."""
    height_m: float | None = None
    """Body height, m."""
    lengths_m: dict[str, float] = msgspec.field(default_factory=dict)
    """chest_to_shoulder, upper_arm, forearm, hand between joint centres."""
    facing_deg: float | None = None
    """Where neutral faces, 0 = magnetic north, 90 = east."""
    exercise: str = ""
    """Name of the exercise."""
    assumed_angles_deg: dict[str, float] = msgspec.field(default_factory=dict)
    """Angles the exercise states for joints that no sensor sees: elbow_flexion, forearm_pronation."""


class Event(Message, frozen=True, kw_only=True, tag="event/1"):
    """A mark in time: an exercise begins, a therapist's note, a change that fusion applied."""

    time_ns: int = msgspec.field(name="t")
    """Host time of the mark, ns."""
    kind: str
    """What happened: `exercise`, `repetition`, `note` and so on."""
    text: str = ""
    """For people."""
    data: dict[str, Any] = msgspec.field(default_factory=dict)
    """For programs; what it holds depends on the kind."""


class Snapshot(Message, frozen=True, kw_only=True, tag="snapshot/1"):
    """Fusion's settings and whole state for one subject at one moment; a recording begins with it."""

    time_ns: int = msgspec.field(name="t")
    """Host time, ns."""
    settings: dict[str, Any]
    """The settings that fusion ran with."""
    state: bytes
    """MessagePack that only fusion reads."""


class Health(Message, frozen=True, kw_only=True, tag="health/1"):
    """How a service fares, once a second."""

    kind: str
    """Kind of service, as in the key."""
    id: str
    """Id of the service, as in the key."""
    time_ns: int = msgspec.field(name="t")
    """Host time, ns."""
    uptime_s: float = msgspec.field(name="up")
    """Since the service started, s."""
    counts: dict[str, int] = msgspec.field(default_factory=dict)
    """What it did, by name, since it started."""
    drops: dict[str, int] = msgspec.field(default_factory=dict)
    """What it refused, by reason, since it started."""
    waiting: list[str] = msgspec.field(default_factory=list)
    """Nodes that asked to join and are not assigned."""
    text: str = ""
    """One line for people."""
    alarm: str = ""
    """What somebody must see to now, and how: one line. Empty while all is well."""


class Command(Message, frozen=True, kw_only=True, tag="command/1"):
    """The question of a command query; `arguments` depend on the verb."""

    arguments: dict[str, Any] = msgspec.field(name="args", default_factory=dict)
    """By name, as the verb asks for them."""


class Answer(Message, frozen=True, kw_only=True, tag="answer/1"):
    """The answer to a command: ok, or the reason why not."""

    ok: bool
    """Whether it was done, or begun."""
    reason: str = ""
    """Why not: one line that says what to do."""
    data: dict[str, Any] = msgspec.field(default_factory=dict)
    """What the verb answers with."""
