"""A capture folder through the pipeline: the spans that calibrate it first, then every sample. Pure."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Segment, part_of
from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.pose import Alignment
from brachium_fusion.session_terms import check_session
from brachium_fusion.settings import Settings
from brachium_fusion.subject import Subject
from brachium_fusion.uniform import Series
from brachium_wire.capture import Capture, CaptureSegment
from brachium_wire.messages import Info, SensorCalibration, Session
from brachium_wire.samples import Samples

Floats = npt.NDArray[np.float64]

SUBJECT = "capture"
ZERO_NS = 1_000_000_000_000_000
"""Host time given to t = 0 of a capture, so that times are positive whatever its t."""
BATCH = 16


def nanoseconds(t: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Return a capture's times (n,) s as host time in ns."""
    return np.round(np.asarray(t, dtype=np.float64) * 1e9).astype(np.int64) + ZERO_NS


def infos(capture: Capture) -> dict[str, Info]:
    """Return what capture.toml says of each segment's sensor."""
    settings = capture.settings
    return {
        segment: Info(
            node=f"capture-{segment}",
            rate_hz=data.rate_hz,
            origin="playback",
            host="capture",
            mounting=settings.mounting.get(segment),
            calibration=settings.sensor.get(segment, SensorCalibration()),
            magnetometer=data.mag is not None,
            orientation_only=data.quat is not None,
        )
        for segment, data in capture.segments.items()
    }


def session(capture: Capture) -> Session:
    """Return what capture.toml says of the subject; raises ValueError for an angle that no arm has."""
    settings = capture.settings
    said = Session(
        side=settings.side,
        height_m=settings.height_m,
        lengths_m={str(k): v for k, v in settings.lengths_m.items()},
        facing_deg=settings.facing_deg,
        assumed_angles_deg=settings.assumed_angles_deg,
    )
    check_session(said)
    return said


def material(capture: Capture) -> Material:
    """Return what `--mode best` starts from."""
    spans, start = capture.settings.calibration, _start(capture)
    timed = [TimedSpan(kind=f.motion, from_s=start + f.from_s, to_s=start + f.to_s) for f in spans.functional]
    if spans.pose is not None and spans.to_s is not None:
        begin_s, end_s = start + (spans.from_s or 0.0), start + spans.to_s
        timed.insert(0, TimedSpan(kind=spans.pose, from_s=begin_s, to_s=end_s, angles_deg=spans.angles_deg))
    return Material(
        series={
            name: Series(
                time_s=data.t, rate_hz=data.rate_hz, gyr=data.gyr, acc=data.acc, mag=data.mag, quat=data.quat
            )
            for name, data in capture.segments.items()
        },
        infos=infos(capture),
        sequences={name: np.arange(len(data.t)) for name, data in capture.segments.items()},
        session=session(capture),
        spans=tuple(timed),
        stated=stated(capture),
        zero_ns=ZERO_NS,
        warnings=capture.warnings,
    )


def stated(capture: Capture) -> dict[str, tuple[int, dict[str, Floats]]]:
    """Return what capture.toml says of joints."""
    return {
        name: (joint.axes, {s: np.array(v) for s, v in joint.centre_from.items()})
        for name, joint in capture.settings.joint.items()
    }


def output_times(capture: Capture, rate_hz: float | None) -> Floats:
    """Return the instants (n,) s to solve: a grid of `rate_hz`, or the samples of the fastest segment.

    Among equals it is the one nearest to the trunk.
    """
    if rate_hz is not None:
        first = min(float(data.t[0]) for data in capture.segments.values())
        last = max(float(data.t[-1]) for data in capture.segments.values())
        count = int(np.floor((last - first) * rate_hz + 1e-6)) + 1
        return first + np.arange(count) / rate_hz
    fastest = max(capture.segments.values(), key=lambda data: round(data.rate_hz, 3))
    return fastest.t


def solve(capture: Capture, settings: Settings, times_s: Floats) -> tuple[Pipeline, Alignment | None]:
    """Return the pipeline after all samples, its skeletons waiting in it, and the alignment that was used."""
    alignment = _alignment(capture, settings)
    pipeline = Pipeline(settings)
    subject = pipeline.subject(SUBJECT)
    _begin(subject, capture, nanoseconds(times_s).tolist())
    subject.alignment = alignment
    subject.reference_ns = int(nanoseconds(_start(capture)))
    for segment, samples in batches(capture):
        pipeline.samples(SUBJECT, segment, samples)
    pipeline.finish()
    return pipeline, alignment


def batches(capture: Capture, until_s: float | None = None) -> Iterator[tuple[str, Samples]]:
    """Yield all segments' samples in small batches, in order of their last sample's time. A gap in time
    never lies
    within a batch."""
    pieces: list[tuple[float, Segment, int, int]] = []
    for segment, data in capture.segments.items():
        breaks = np.flatnonzero(np.diff(data.t) > 2.5 / data.rate_hz) + 1
        edges = np.unique(np.concatenate([np.arange(0, len(data.t), BATCH), breaks, [len(data.t)]]))
        for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            pieces.append((float(data.t[end - 1]), segment, start, end))
    for last, segment, start, end in sorted(pieces):
        if until_s is not None and last > until_s + 1.0:
            return
        yield segment, _samples(capture.segments[segment], start, end)


def _samples(data: CaptureSegment, start: int, end: int) -> Samples:
    times = nanoseconds(data.t[start:end])
    mag, index = None, None
    if data.mag is not None:
        mag = data.mag[start:end]
        there = ~np.isnan(mag[:, 0])
        if not there.all():
            mag, index = np.ascontiguousarray(mag[there]), tuple(np.flatnonzero(there).tolist())
    return Samples(
        sequence=start,
        time_ns=times.tolist(),
        device_us=0,
        device_offsets=b"",
        received_ns=int(times[-1]),
        uncertainty_ns=0,
        acc=None if data.acc is None else np.ascontiguousarray(data.acc[start:end]),
        gyr=None if data.gyr is None else np.ascontiguousarray(data.gyr[start:end]),
        mag=None if mag is not None and len(mag) == 0 else mag,
        mag_index=index,
        quat=None if data.quat is None else np.ascontiguousarray(data.quat[start:end]),
        late=False,
    )


def _start(capture: Capture) -> float:
    return min(float(data.t[0]) for data in capture.segments.values())


def _begin(subject: Subject, capture: Capture, instants: Sequence[int]) -> None:
    subject.session = session(capture)
    subject.stated = stated(capture)
    subject.use_instants(instants)
    for segment, info in infos(capture).items():
        subject.inform(segment, info)


class _Held(NamedTuple):
    times_ns: list[int]
    quats: list[Floats]


def _alignment(capture: Capture, settings: Settings) -> Alignment | None:
    """Return what the calibration spans give, or None when there are none: filters run up to their end."""
    spans = capture.settings.calibration
    if spans.pose is None or spans.to_s is None:
        return None
    start = _start(capture)
    pose_span = (start + (spans.from_s or 0.0), start + spans.to_s)
    elbow_spans = [
        (start + f.from_s, start + f.to_s) for f in spans.functional if f.motion == "elbow-flexion"
    ]
    end = max([pose_span[1], *(to for _, to in elbow_spans)])
    subject = Subject(settings, lambda _: None)
    times = output_times(capture, None)
    _begin(subject, capture, nanoseconds(times[times <= end]).tolist())
    pose: dict[str, list[Floats]] = {}
    moving: dict[str, _Held] = {}
    for fed, samples in batches(capture, end):
        subject.feed(fed, samples)
        for instant in subject.instants():
            at_s = (instant.time_ns - ZERO_NS) * 1e-9
            for name, reading in instant.readings.items():
                if reading is None:
                    continue
                if pose_span[0] - 1e-9 <= at_s <= pose_span[1]:
                    pose.setdefault(name, []).append(reading.after)
                if part_of(name) == "forearm" and any(a <= at_s <= b for a, b in elbow_spans):
                    held = moving.setdefault(name, _Held([], []))
                    held.times_ns.append(instant.time_ns)
                    held.quats.append(reading.after)
    if not pose:
        return None
    held_pose = {name: np.array(quats) for name, quats in pose.items()}
    axes = {
        name: flexion_axis(
            np.array(held.quats), np.array(held.times_ns) * 1e-9, rotation.mean(held_pose[name])
        )
        for name, held in moving.items()
        if name in held_pose and len(held.quats) > 1
    }
    subject.take_alignment(subject.received_ns, held_pose, spans.pose, dict(spans.angles_deg), axes)
    return subject.alignment


def flexion_axis(world_from_sensor: Floats, time_s: Floats, in_pose: Floats) -> Floats:
    """Return the axis (3,) of elbow flexion in the forearm sensor's world, pointing to the subject's right.

    From orientations (n, 4) during repeated flexion, time_s (n,), and the one (4,) in the pose, arm hanging:
    the axis about which it turned most; its sign is the one with which the forearm rises.
    """
    step = rotation.multiply(world_from_sensor[1:], rotation.inverse(world_from_sensor[:-1]))
    rate = rotation.to_rotation_vector(step) / np.diff(time_s)[:, None]
    _, vectors = np.linalg.eigh(rate.T @ rate)
    axis: Floats = vectors[:, -1]
    up_in_sensor = rotation.rotate(rotation.inverse(in_pose), np.array([0.0, 0.0, 1.0]))
    proximal = rotation.rotate(world_from_sensor, up_in_sensor)
    rising = -np.diff(proximal[:, 2])  # the proximal axis leaves the vertical as the forearm rises
    return axis if float(rising @ (rate @ axis)) >= 0.0 else -axis
