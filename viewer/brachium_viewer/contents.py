"""What a recording holds, sorted out into arrays: the way in of figures, pages and exports."""

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body.segments import SEGMENTS
from brachium_wire import keys, recording
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import (
    Calibration,
    Event,
    Info,
    SampleBatch,
    Session,
    Skeleton,
    Snapshot,
    Status,
)
from brachium_wire.recording import Recorded
from brachium_wire.sequence import SequenceCounter

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

Who = tuple[str, str]
"""A subject and a segment or side."""


@dataclass(slots=True)
class SensorContents:
    """One sensor of one subject."""

    info: Info | None = None
    status: Status | None = None
    """The last one."""
    counted: SequenceCounter = field(default_factory=SequenceCounter)
    """Counted from the batches in the recording."""


@dataclass(slots=True)
class ArmContents:
    """One arm's skeletons, published and true, in the order in which they came."""

    published: list[Skeleton] = field(default_factory=list)
    arrived_ns: list[int] = field(default_factory=list)
    """When each published one was recorded."""
    true: list[Skeleton] = field(default_factory=list)


@dataclass(slots=True)
class Contents:
    """Everything a page or a figure needs of a recording."""

    metadata: dict[str, str] = field(default_factory=dict)
    warning: str = ""
    first_ns: int | None = None
    last_ns: int | None = None
    sensors: dict[Who, SensorContents] = field(default_factory=dict)
    arms: dict[Who, ArmContents] = field(default_factory=dict)
    calibrations: dict[str, Calibration] = field(default_factory=dict)
    """The last of each subject."""
    sessions: dict[str, Session] = field(default_factory=dict)
    events: dict[str, list[Event]] = field(default_factory=dict)
    fusion: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Fusion's settings for each subject."""
    unreadable: dict[str, int] = field(default_factory=dict)
    """Messages left out, by reason."""

    @property
    def duration_s(self) -> float:
        """Return the time from the first message to the last."""
        return 0.0 if self.first_ns is None or self.last_ns is None else (self.last_ns - self.first_ns) / 1e9

    @property
    def origins(self) -> list[str]:
        """Return where the data come from, by every sensor and skeleton: worn, emulated, playback."""
        found = {s.info.origin for s in self.sensors.values() if s.info is not None}
        found |= {arm.published[-1].origin for arm in self.arms.values() if arm.published}
        return sorted(found)


def load(path: Path) -> Contents:
    """Return what a recording holds; raises recording.RecordingError for a file that is none."""
    with recording.read(path) as reading, _uncollected():
        contents = sort_out(reading)
    contents.metadata, contents.warning = reading.metadata, reading.warning
    return contents


@contextmanager
def _uncollected() -> Iterator[None]:
    """Keep the collector of cycles off: a hundred thousand records hold none, and it would look at each of
    them again and again."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


def sort_out(messages: Iterable[Recorded]) -> Contents:
    """Sort messages in order of arrival; what cannot be read is counted and left out."""
    contents = Contents()
    for key, payload, log_time_ns in messages:
        contents.first_ns = log_time_ns if contents.first_ns is None else contents.first_ns
        contents.last_ns = log_time_ns
        try:
            _take(contents, keys.parse(key), payload, log_time_ns)
        except WireError as error:
            _count(contents, error.drop.value)
        except keys.BadKey:
            _count(contents, "bad_key")
    return contents


def _count(contents: Contents, reason: str) -> None:
    contents.unreadable[reason] = contents.unreadable.get(reason, 0) + 1


def _take(contents: Contents, key: keys.Key, payload: bytes, log_time_ns: int) -> None:
    if key.topic in ("health", "command"):
        return
    message = decode_topic(payload, key.topic)
    who = (key.subject, key.detail)
    if isinstance(message, SampleBatch):
        sensor = contents.sensors.setdefault(who, SensorContents())
        sensor.counted.feed(message.sequence, len(message.offsets) // 4)
    elif isinstance(message, Skeleton):
        arm = contents.arms.setdefault(who, ArmContents())
        if key.topic == "truth":
            arm.true.append(message)
        else:
            arm.published.append(message)
            arm.arrived_ns.append(log_time_ns)
    elif isinstance(message, Status):
        contents.sensors.setdefault(who, SensorContents()).status = message
    elif isinstance(message, Info):
        contents.sensors.setdefault(who, SensorContents()).info = message
    elif isinstance(message, Calibration):
        contents.calibrations[key.subject] = message
    elif isinstance(message, Session):
        contents.sessions[key.subject] = message
    elif isinstance(message, Event):
        contents.events.setdefault(key.subject, []).append(message)
    elif isinstance(message, Snapshot):
        contents.fusion[key.subject] = message.settings


def times_ns(skeletons: Iterable[Skeleton]) -> Times:
    """Return the instants (n,)."""
    return np.array([s.time_ns for s in skeletons], dtype=np.int64)


def angles_rad(skeletons: Iterable[Skeleton], names: Iterable[str]) -> Floats:
    """Return the named angles (n, k), NaN where a skeleton has none."""
    wanted = list(names)
    rows = [[s.angles.get(name, np.nan) for name in wanted] for s in skeletons]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted))


def positions_m(skeletons: Iterable[Skeleton], joint: str) -> Floats:
    """Return a joint's positions (n, 3) in trunk axes, NaN where a skeleton has none."""
    unknown = (np.nan, np.nan, np.nan)
    return np.array([s.positions.get(joint, unknown) for s in skeletons], dtype=np.float64).reshape(-1, 3)


def calibrated(skeletons: Iterable[Skeleton]) -> npt.NDArray[np.bool_]:
    """Return which skeletons (n,), in order, are of calibrated sensors.

    One of whose segments all are held or missing is what the one before it was; the first is not calibrated.
    """
    found, state = [], False
    for skeleton in skeletons:
        qualities = {pose.quality for pose in skeleton.segments.values()} - {"held", "missing"}
        if qualities:
            state = "uncalibrated" not in qualities
        found.append(state)
    return np.array(found, dtype=np.bool_)


def outwards(item: tuple[Who, object]) -> tuple[str, int]:
    """Return what orders sensors by subject, and as segments are named, from the trunk outwards."""
    (subject, segment), _ = item
    return subject, SEGMENTS.index(segment) if segment in SEGMENTS else len(SEGMENTS)
