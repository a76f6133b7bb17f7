"""A capture folder through the pipeline: the spans that calibrate it first, then every sample. Pure."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from brachium_body.segments import Segment
from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.field_wander import told_of, wandering
from brachium_fusion.motion_record import MotionRecord
from brachium_fusion.pipeline import Pipeline
from brachium_fusion.pose import POSES, Alignment
from brachium_fusion.segment_records import leaves_open
from brachium_fusion.sensor_to_segment import Span, align_segments
from brachium_fusion.session_terms import check_session
from brachium_fusion.settings import Settings
from brachium_fusion.subject import Subject
from brachium_fusion.track import CARRIED_NS
from brachium_fusion.uniform import NEAR, Series
from brachium_wire.capture import Capture, CaptureSegment
from brachium_wire.messages import Info, SensorCalibration, Session
from brachium_wire.samples import Samples

Floats = npt.NDArray[np.float64]

SUBJECT = "capture"
ZERO_NS = 1_000_000_000_000_000
"""Host time given to t = 0 of a capture, so that times are positive whatever its t."""
BATCH_S = 0.1
"""A batch is as long as a node's: what waits for a sensor waits longer than this."""
SURE_GAP = 2.5
"""Periods: in a longer time than this a sample is missing, however its neighbours lie."""
FREE_S = 120.0
"""Where movements are led, or only movement can tell the headings, all of it up to so long after the pose is
looked at beside what is stated: it shows heading, centre and range of the joints."""


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
    return Material(
        series={
            name: Series(
                time_s=data.t, rate_hz=data.rate_hz, gyr=data.gyr, acc=data.acc, mag=data.mag, quat=data.quat
            )
            for name, data in capture.segments.items()
        },
        infos=infos(capture),
        sequences={name: numbers(data) for name, data in capture.segments.items()},
        session=session(capture),
        spans=_timed(capture),
        stated=stated(capture),
        zero_ns=ZERO_NS,
        warnings=capture.warnings,
    )


def _timed(capture: Capture) -> tuple[TimedSpan, ...]:
    """Return the spans that capture.toml states, in its own time, the pose first."""
    spans, start = capture.settings.calibration, _start(capture)
    timed = [TimedSpan(kind=f.motion, from_s=start + f.from_s, to_s=start + f.to_s) for f in spans.functional]
    if spans.pose is not None and spans.to_s is not None:
        begin_s, end_s = start + (spans.from_s or 0.0), start + spans.to_s
        pose = TimedSpan(kind=spans.pose, from_s=begin_s, to_s=end_s, angles_deg=spans.angles_deg)
        timed.insert(0, pose)
    return tuple(timed)


def _loose(capture: Capture) -> bool:
    """Return whether only movement can tell how some sensors' headings are to one another."""
    return any(
        data.quat is None and data.mag is None and name not in capture.settings.mounting
        for name, data in capture.segments.items()
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
    """Return the pipeline after all samples, its skeletons waiting in it, and the alignment that was used.

    Where movement ties sensors to each other, magnetometers in a field that wanders are set aside.
    """
    alignment = _alignment(capture, settings)
    tied = {} if alignment is None else alignment.joints
    away = wandering(material(capture)) if settings.magnetometer and settings.binds and tied else []
    if away:
        settings = replace(settings, magnetometer=False)
        alignment = told_of(_alignment(capture, settings), away)
    pipeline = Pipeline(settings)
    subject = pipeline.subject(SUBJECT)
    _begin(subject, capture, nanoseconds(times_s).tolist(), nanoseconds(_left_out(times_s)).tolist())
    subject.calibrating.alignment = alignment
    subject.calibrating.reference_ns = int(nanoseconds(_start(capture)))
    for segment, samples in batches(capture):
        pipeline.samples(SUBJECT, segment, samples)
    pipeline.finish()
    return pipeline, alignment


def numbers(data: CaptureSegment) -> npt.NDArray[np.int64]:
    """Return the samples' numbers (n,) as the sensor may have counted them, missing ones included.

    Times that jitter are no gap: an interval that is too long by up to a period and a half, and made up for
    by one beside it, misses nothing.
    """
    periods = np.diff(data.t) * data.rate_hz
    missing = np.maximum(np.round(periods) - 1.0, 0.0).astype(np.int64)
    with_next, with_last = np.full((2, len(periods)), np.inf)
    with_next[:-1] = with_last[1:] = periods[:-1] + periods[1:]
    made_up = np.minimum(with_next, with_last) <= SURE_GAP
    missing[(periods <= NEAR) | (made_up & (periods <= SURE_GAP))] = 0
    return np.concatenate([[0], np.cumsum(missing + 1)])


def _left_out(times_s: Floats) -> Floats:
    """Return instants in the short gaps of a capture's own: who follows its sensors sample by sample goes
    through them."""
    if len(times_s) < 2:
        return times_s[:0]
    steps = np.diff(times_s)
    period = float(np.median(steps))
    short = np.flatnonzero((steps > NEAR * period) & (steps <= 1e-9 * CARRIED_NS))
    gaps = [times_s[i] + np.arange(1, round(steps[i] / period)) * period for i in short.tolist()]
    return np.concatenate([times_s[:0], *gaps])


def batches(capture: Capture, until_s: float | None = None) -> Iterator[tuple[str, Samples]]:
    """Yield all segments' samples in small batches, in order of their last sample's time. A gap in time
    never lies
    within a batch."""
    pieces: list[tuple[float, Segment, int, int]] = []
    counted: dict[str, npt.NDArray[np.int64]] = {}
    for segment, data in capture.segments.items():
        sequence = counted[segment] = numbers(data)
        breaks = np.flatnonzero(np.diff(sequence) > 1) + 1
        regular = np.arange(0, len(data.t), max(1, round(BATCH_S * data.rate_hz)))
        edges = np.unique(np.concatenate([regular, breaks, [len(data.t)]]))
        for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            pieces.append((float(data.t[end - 1]), segment, start, end))
    for last, segment, start, end in sorted(pieces):
        if until_s is not None and last > until_s + 1.0:
            return
        yield segment, _samples(capture.segments[segment], start, end, counted[segment])


def _samples(data: CaptureSegment, start: int, end: int, counted: npt.NDArray[np.int64]) -> Samples:
    times = nanoseconds(data.t[start:end])
    mag, index = None, None
    if data.mag is not None:
        mag = data.mag[start:end]
        there = ~np.isnan(mag[:, 0])
        if not there.all():
            mag, index = np.ascontiguousarray(mag[there]), tuple(np.flatnonzero(there).tolist())
    return Samples(
        sequence=int(counted[start]),
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


def _begin(subject: Subject, capture: Capture, instants: Sequence[int], between: Sequence[int] = ()) -> None:
    subject.session = session(capture)
    subject.stated = stated(capture)
    subject.use_instants(instants, between)
    for segment, info in infos(capture).items():
        subject.inform(segment, info)


def _alignment(capture: Capture, settings: Settings) -> Alignment | None:
    """Return what the calibration spans give, or None when there are none: filters run up to their end."""
    spans = list(_timed(capture))
    if not any(span.kind in POSES for span in spans):
        return None
    end_s = max(span.to_s for span in spans)
    if len(spans) > 1 or _loose(capture):
        whole = TimedSpan(kind="free", from_s=spans[0].to_s, to_s=spans[0].to_s + FREE_S)
        end_s = max(end_s, whole.to_s)
        if leaves_open([span.kind for span in spans]):
            spans.append(whole)
    subject = Subject(replace(settings, joints=False), lambda _: None)
    times = output_times(capture, None)
    times = np.sort(np.concatenate([times, _left_out(times)]))
    wanted = times[times <= end_s + 1e-9]
    _begin(subject, capture, nanoseconds(wanted).tolist())
    record = MotionRecord()
    for fed, samples in batches(capture, end_s):
        subject.feed(fed, samples)
        for instant in subject.instants():
            record.take(instant.time_ns, instant.readings, subject.tracks)
    if not record.times_ns:
        return None
    solved_s = 1e-9 * (np.array(record.times_ns) - ZERO_NS)
    rows = [
        Span(kind=span.kind, first=first, end=last, angles_deg=dict(span.angles_deg))  # type: ignore[arg-type]
        for span in spans
        for first, last in [np.searchsorted(solved_s, [span.from_s - 1e-9, span.to_s + 1e-9]).tolist()]
        if first < last
    ]
    if not rows:
        return None
    rate_hz = 1e9 / float(np.median(np.diff(record.times_ns)))
    return align_segments(
        record.records(subject.tracks), rows, rate_hz, facing_deg=capture.settings.facing_deg
    )
