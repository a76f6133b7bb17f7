"""What is known of one sensor's own errors, and of where sensors sit, and how far finding it has come.

Parts of messages.
"""

from typing import Literal

import msgspec

Vector = tuple[float, float, float]
CalibrationState = Literal["none", "waiting", "running", "done", "refused"]
SensorStep = Literal["rest", "faces", "turn"]
WearStep = Literal["listen", "ready", "hang", "raise", "bend"]
WearTurn = Literal["", "upside-down", "inside-out", "both"]
Keeper = Literal["", "node", "gateway"]


class SensorCalibration(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What turns raw samples into calibrated ones: gyr - gyro_bias; accel_scale * (acc - accel_bias);
    mag_matrix (mag - mag_offset)."""

    gyro_bias: Vector | None = None
    """rad/s, taken off the angular rate."""
    accel_scale: Vector | None = None
    """Factor of each axis of the specific force, after the bias."""
    accel_bias: Vector | None = None
    """m/s^2, taken off the specific force."""
    mag_offset: Vector | None = None
    """uT, taken off the magnetic field (hard iron)."""
    mag_matrix: tuple[Vector, Vector, Vector] | None = None
    """Three rows, applied after the offset (soft iron)."""


class SensorProgress(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How far the calibration of one sensor has come; what it found stands in `scores` once it is over."""

    segment: str
    """The segment whose sensor it is."""
    node: str
    """The id of its node."""
    state: CalibrationState
    """running, and in the end done or refused."""
    step: SensorStep = "rest"
    """What is to be done now: let it lie still, lay it on each of its six faces, turn it all around."""
    steps: list[SensorStep] = msgspec.field(default_factory=list)
    """All steps, in order."""
    attempt: int = 1
    """Counts how often this step was begun."""
    reason: str = ""
    """What to do now, or why it was refused: one line."""
    still: bool = False
    """Whether the sensor lies still at this moment."""
    left_s: float = 0.0
    """How much longer it must lie so, or be turned, s."""
    faces: list[str] = msgspec.field(default_factory=list)
    """The faces seen, by the axis that pointed up: `+x`, `-x` and so on."""
    cells: str = ""
    """48 cells of equal area on the sphere of the field's directions in sensor axes, `#` seen and `.` not:
    six bands from +z to -z, each of eight from -180 to 180 deg about z, 0 being +x."""
    coverage: float = 0.0
    """Share of the cells seen, 0 to 1."""
    lacks: str = ""
    """Which side is to be turned downwards (northwards where the field is level): `+x`, `-x` and so on."""
    scores: dict[str, float] = msgspec.field(default_factory=dict)
    """How well it went, by name with unit; `_before` is without this calibration."""
    refused: dict[str, str] = msgspec.field(default_factory=dict)
    """Steps that found nothing, and why: one line that says what to do."""


class WearFound(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Where one sensor sits, and what to change."""

    segment: str
    """What its name says."""
    seat: str | None = None
    """Where it sits; not there, or null in an answer, if it cannot be told."""
    turn: WearTurn = ""
    """How it is turned on the skin; empty where it is as it should be."""
    fine: bool
    """Whether there is nothing to change."""
    text: str
    """What is so and what to change: one line for people."""


class WearProgress(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How far the check of who sits where has come; what it found stands in `findings` once it is over."""

    state: CalibrationState
    """running, and in the end done or refused."""
    step: WearStep = "listen"
    """What is to be done now: nothing yet, let both arms hang, hang still, raise the arm sideways and let it
    down, bend the elbow and straighten it."""
    side: str = ""
    """Which arm does it: right or left; empty while nothing is to be done."""
    sides: list[str] = msgspec.field(default_factory=list)
    """All arms, in order."""
    reason: str = ""
    """What to do now, or why it was refused: one line."""
    left_s: int = 0
    """How much longer this is to be done, whole s."""
    fine: bool = False
    """Whether every sensor was checked and found as it should be."""
    findings: list[WearFound] = msgspec.field(default_factory=list)
    """One for each sensor that was checked."""
    left_out: dict[str, str] = msgspec.field(default_factory=dict)
    """Sensors that were not checked, and why: `sends ...`, `is silent ...`."""
    assumed: list[str] = msgspec.field(default_factory=list)
    """Sensors of which nobody told how they should be worn: their axes were taken for the segment's."""
