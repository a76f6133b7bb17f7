"""What a recording holds, sorted out into arrays: the way in of figures, pages and exports."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
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
from brachium_wire.skeleton_columns import SkeletonCollector, SkeletonColumns
from brachium_wire.steady_times import steady_times

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


@dataclass(frozen=True, slots=True)
class ArmContents:
    """One arm's skeletons, published and true, in the order in which they came; there is at least one.

    The times of those that were published grow.
    """

    published: SkeletonColumns
    true: SkeletonColumns


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
    clocks: dict[str, str] = field(default_factory=dict)
    """Of each subject whose skeletons' times did not grow: what was put right, and what was left out."""

    @property
    def duration_s(self) -> float:
        """Return the time from the first message to the last."""
        return 0.0 if self.first_ns is None or self.last_ns is None else (self.last_ns - self.first_ns) / 1e9

    @property
    def origins(self) -> list[str]:
        """Return where the data come from, by every sensor and skeleton: worn, emulated, playback."""
        found = {s.info.origin for s in self.sensors.values() if s.info is not None}
        found |= {arm.published.last.origin for arm in self.arms.values() if len(arm.published)}
        return sorted(found)


def load(path: Path) -> Contents:
    """Return what a recording holds; raises recording.RecordingError for a file that is none."""
    with recording.read(path) as reading:
        contents = sort_out(reading)
    contents.metadata, contents.warning = reading.metadata, reading.warning
    return contents


def sort_out(messages: Iterable[Recorded]) -> Contents:
    """Sort messages in order of arrival; what cannot be read is counted and left out."""
    contents = Contents()
    arms: dict[Who, dict[str, SkeletonCollector]] = {}
    for name, payload, log_time_ns in messages:
        contents.first_ns = log_time_ns if contents.first_ns is None else contents.first_ns
        contents.last_ns = log_time_ns
        try:
            key = keys.parse(name)
            if key.topic in ("skeleton", "truth"):
                who = (key.subject, key.detail)
                if who not in arms:
                    arms[who] = {"skeleton": SkeletonCollector(), "truth": SkeletonCollector()}
                arms[who][key.topic].take(payload, log_time_ns)
            else:
                _take(contents, key, payload)
        except WireError as error:
            _count(contents, error.drop.value)
        except keys.BadKey:
            _count(contents, "bad_key")
    for who, collectors in arms.items():
        arm = ArmContents(collectors["skeleton"].columns(), collectors["truth"].columns())
        if len(arm.published) or len(arm.true):
            contents.arms[who] = arm
        for collector in collectors.values():
            for reason, n in collector.refused.items():
                _count(contents, reason, n)
    _put_right(contents)
    return contents


def _put_right(contents: Contents) -> None:
    """Put the skeletons of each subject on one clock; the true ones have their own, which nobody sets."""
    for subject in {who for who, _ in contents.arms}:
        arms = {who: arm for who, arm in contents.arms.items() if who[0] == subject}
        steady = steady_times([(arm.published.time_ns, arm.published.arrived_ns) for arm in arms.values()])
        if steady.told:
            contents.clocks[subject] = steady.told
        for (who, arm), time_ns, kept in zip(arms.items(), steady.time_ns, steady.kept, strict=True):
            contents.arms[who] = replace(arm, published=arm.published.on_clock(time_ns, kept))


def _count(contents: Contents, reason: str, n: int = 1) -> None:
    contents.unreadable[reason] = contents.unreadable.get(reason, 0) + n


def _take(contents: Contents, key: keys.Key, payload: bytes) -> None:
    if key.topic in ("health", "command"):
        return
    message = decode_topic(payload, key.topic)
    who = (key.subject, key.detail)
    if isinstance(message, SampleBatch):
        sensor = contents.sensors.setdefault(who, SensorContents())
        sensor.counted.feed(message.sequence, len(message.offsets) // 4)
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


def calibrated(skeletons: SkeletonColumns) -> npt.NDArray[np.bool_]:
    """Return which skeletons (n,), in order, are of calibrated sensors.

    One of whose segments all are held or missing is what the one before it was; the first is not calibrated.
    """
    said = skeletons.each(_says_calibrated, np.int8)
    latest = np.maximum.accumulate(np.where(said == UNSAID, -1, np.arange(len(said))))
    return np.asarray((latest >= 0) & (said[latest] == 1))


UNSAID = -1


def _says_calibrated(skeleton: Skeleton) -> int:
    qualities = {pose.quality for pose in skeleton.segments.values()} - {"held", "missing"}
    return int("uncalibrated" not in qualities) if qualities else UNSAID


def outwards(item: tuple[Who, object]) -> tuple[str, int]:
    """Return what orders sensors by subject, and as segments are named, from the trunk outwards."""
    (subject, segment), _ = item
    return subject, SEGMENTS.index(segment) if segment in SEGMENTS else len(SEGMENTS)
