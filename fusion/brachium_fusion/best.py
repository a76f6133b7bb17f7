"""`--mode best`: a whole recording at once, past and future. Pure.

Each sensor's orientation is smoothed, the sensors are aligned from the stated spans or from all movement,
joints and shoulder are smoothed, and the arm is computed as live. A part that cannot be had is named with its
reason and left as the part before it gave it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import SIDES
from brachium_fusion.arms import Arms
from brachium_fusion.best_arm import ArmSolution, Tracked, solve_arm
from brachium_fusion.best_material import Material, calibrated
from brachium_fusion.best_spans import rows_of_spans
from brachium_fusion.offline_orientation import smooth_orientation
from brachium_fusion.pose import POSES, Alignment
from brachium_fusion.rows import Row, rows_of
from brachium_fusion.sensor_to_segment import SensorRecord, Span, align_segments
from brachium_fusion.session_terms import lengths_of
from brachium_fusion.settings import Settings
from brachium_fusion.subject import Instant, Subject
from brachium_fusion.timeline import Reading, Shift
from brachium_fusion.uniform import Uniform, grid, on_grid
from brachium_wire.messages import Quality, Skeleton

Floats = npt.NDArray[np.float64]

SUBJECT = "best"


@dataclass(slots=True, kw_only=True)
class Best:
    """What a recording gives."""

    skeletons: list[Skeleton]
    alignment: Alignment | None
    magnetometer: bool = False
    """Whether some sensor's magnetic field was used."""
    parts: dict[str, str] = field(default_factory=dict)
    """What was used for each part of the way, in words."""
    refused: dict[str, str] = field(default_factory=dict)
    """What could not be had, with its reason."""
    warnings: list[str] = field(default_factory=list)


def solve(
    material: Material, settings: Settings, times_s: Floats, one_arm: Callable[..., ArmSolution] = solve_arm
) -> Best:
    """Return the skeletons at the instants (n,) s; `one_arm` stands for solve_arm.

    Raises ValueError for a sensor of a single sample.
    """
    best = Best(skeletons=[], alignment=None)
    series = {
        s: calibrated(raw, material.infos[s], magnetometer=settings.magnetometer)
        for s, raw in material.series.items()
    }
    time_s, rate_hz = grid(series)
    tracked = {
        s: _tracked(on_grid(one, time_s), rate_hz, own_heading=material.infos[s].heading_free)
        for s, one in series.items()
    }
    best.magnetometer = any(one.magnetometer and one.raw for one in tracked.values())
    best.parts["orientation"] = _filtered(tracked)
    spans = rows_of_spans(material, tracked, time_s, rate_hz)
    best.alignment = _align(material, tracked, spans, rate_hz, best)
    solutions = [
        one_arm(
            side,
            tracked,
            best.alignment,
            lengths_of(material.session),
            material.stated,
            next((s for s in spans if s.kind in POSES), None),
            rate_hz,
        )
        for side in SIDES
        if settings.joints
    ]
    for solution in solutions:
        best.parts |= solution.parts
        best.refused |= solution.refused
        best.warnings += [w for w in solution.warnings if w not in best.warnings]
    _finish(material, settings, tracked, solutions, (time_s, times_s, rate_hz), best)
    return best


def _filtered(tracked: Mapping[str, Tracked]) -> str:
    """Return in words how the sensors' orientations came about."""
    raw = [one for one in tracked.values() if one.raw]
    if not raw:
        return "as the sensors deliver it"
    heading = any(one.magnetometer for one in raw)
    own = len(raw) < len(tracked)
    return (
        "offline VQF for tilt"
        + (", robust heading from the field of the whole recording" if heading else ", no magnetometer")
        + ("; as delivered of sensors that give orientation only" if own else "")
    )


def _tracked(samples: Uniform, rate_hz: float, *, own_heading: bool) -> Tracked:
    """Return one sensor's orientation at every instant of the grid.

    `own_heading`: that of the orientations it delivers is its own.
    """
    if samples.quat is not None:
        nothing = np.zeros(len(samples.quat), dtype=np.bool_)
        return Tracked(samples, samples.quat, nothing, magnetometer=not own_heading, raw=False)
    found = smooth_orientation(samples.gyr, samples.acc, samples.mag, rate_hz)
    return Tracked(
        samples, found.world_from_sensor, found.disturbed, magnetometer=samples.mag is not None, raw=True
    )


def _align(
    material: Material, tracked: Mapping[str, Tracked], spans: list[Span], rate_hz: float, best: Best
) -> Alignment | None:
    if not spans:
        best.refused["alignment"] = "no span calibrates it, and nobody stood still for 3 s"
        return None
    mountings = {s: info.mounting for s, info in material.infos.items()}
    records = {
        s: SensorRecord(
            world_from_sensor=one.world_from_sensor,
            magnetometer=one.magnetometer,
            nominal_mounting=None if mountings[s] is None else np.array(mountings[s]),
            gyr=one.samples.gyr if one.raw else None,
            acc=one.samples.acc if one.raw else None,
        )
        for s, one in tracked.items()
    }
    alignment = align_segments(records, spans, rate_hz, facing_deg=material.session.facing_deg)
    best.refused |= alignment.refused
    if not alignment.mounting:
        return None
    best.parts["alignment"] = " and ".join(_rests_on(spans, alignment))
    best.warnings += alignment.warnings
    for segment, turn in alignment.heading.items():
        one = tracked[segment]
        one.world_from_sensor = rotation.multiply(rotation.about(2, turn), one.world_from_sensor)
    return alignment


def _rests_on(spans: list[Span], alignment: Alignment) -> list[str]:
    """Return the kinds of span that were used: a movement that no elbow took shows nothing."""
    ends = {joint.removeprefix("elbow") for joint in alignment.joints}
    used = (
        span.kind
        for span in spans
        if span.kind in POSES or any(f"{span.kind}{end}" not in alignment.refused for end in ends)
    )
    return list(dict.fromkeys(used))


def _finish(
    material: Material,
    settings: Settings,
    tracked: Mapping[str, Tracked],
    solutions: list[ArmSolution],
    times: tuple[Floats, Floats, float],
    best: Best,
) -> None:
    """Put the skeletons at the wanted instants."""
    time_s, times_s, rate_hz = times
    at = (times_s - time_s[0]) * rate_hz
    before = np.clip(np.floor(at + 1e-6).astype(np.int64), 0, len(time_s) - 1)
    after = np.minimum(before + 1, len(time_s) - 1)
    part = np.clip(at - before, 0.0, 1.0)
    nearest = np.where(part < 0.5, before, after)
    times_ns = material.zero_ns + np.round(times_s * 1e9).astype(np.int64)
    readings = {
        s: _readings(one, before, after, part, nearest, material.sequences[s], times_ns)
        for s, one in tracked.items()
    }
    shifts = {one.side: one.at(nearest) for one in solutions}
    subject = _subject(material, settings, best.alignment)
    arms, rows = Arms(settings), list[Row]()
    for i, time_ns in enumerate(times_ns.tolist()):
        now = {s: column[i] for s, column in readings.items()}
        if any(now.values()):
            subject.calibrating.reference_ns = (
                time_ns  # headings are those of the whole recording: they do not age
            )
            instant = Instant(time_ns, now, time_ns, subject.calibrating.alignment, subject.session, {})
            for row in rows_of(SUBJECT, subject, instant):
                moved: Shift | None = shifts[row.side][i] if row.side in shifts else None
                rows.append(row._replace(shift=moved))
    best.skeletons = arms.solve(rows)


def _subject(material: Material, settings: Settings, alignment: Alignment | None) -> Subject:
    """Return a subject that knows all this; no sample passes through it. Headings are turned already."""
    subject = Subject(settings, lambda _: None)
    for segment, info in material.infos.items():
        subject.inform(segment, info)
    subject.session = material.session
    if alignment is not None:
        subject.calibrating.alignment = replace(alignment, heading=dict.fromkeys(alignment.heading, 0.0))
    return subject


def _readings(
    one: Tracked,
    before: npt.NDArray[np.int64],
    after: npt.NDArray[np.int64],
    part: Floats,
    nearest: npt.NDArray[np.int64],
    numbers: npt.NDArray[np.int64],
    times_ns: npt.NDArray[np.int64],
) -> list[Reading | None]:
    q = one.world_from_sensor
    result: list[Reading | None] = []
    missing = (one.samples.missing | np.isnan(q[:, 0]))[nearest]
    rows = zip(
        before.tolist(), after.tolist(), part.tolist(), nearest.tolist(), times_ns.tolist(), strict=True
    )
    for i, (a, b, share, near, time_ns) in enumerate(rows):
        if missing[i]:
            result.append(None)
            continue
        usable = not (np.isnan(q[a, 0]) or np.isnan(q[b, 0]))
        quality: Quality = (
            "held" if one.samples.held[near] else "disturbed" if one.disturbed[near] else "good"
        )
        number = int(numbers[max(int(one.samples.sample[near]), 0)])
        first, second = (q[a], q[b]) if usable else (q[near], q[near])
        result.append(Reading(first, second, share, quality, number, time_ns))
    return result
