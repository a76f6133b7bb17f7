"""A capture folder through the pipeline: the spans that calibrate it first, then every sample. Pure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.capture_batches import ZERO_NS, batches, nanoseconds, numbers
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
from brachium_wire.capture import Capture
from brachium_wire.messages import Info, SensorCalibration, Session

Floats = npt.NDArray[np.float64]

SUBJECT = "capture"
FREE_S = 120.0
"""Where movements are led, or only movement can tell the headings, all of it up to so long after the pose is
looked at beside what is stated: it shows heading, centre and range of the joints."""


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
