"""Alignment by pose and movement: axes, heading, carrying angle, a contracture, and what is refused."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated
from brachium.evaluation.solving import word
from brachium.evaluation.tables import Cell, Limit, Table
from brachium.evaluation.trials import Trial, spans
from brachium_body import rotation
from brachium_body.segments import Segment, arm_segments
from brachium_fusion.offline_orientation import smooth_orientation
from brachium_fusion.pose import Alignment
from brachium_fusion.sensor_to_segment import SensorRecord, Span, SpanKind, align_segments
from brachium_nodes.sensors import Level

Floats = npt.NDArray[np.float64]

RATE_HZ = 50.0
PLACEMENT_DEG = 15.0
CARRYING_DEG = (8.0, 15.0, -3.0)
"""Valgus; varus is negative."""
LIMITED: tuple[Level, ...] = ("ideal", "typical")
AXES_DEG, HEADING_DEG = (0.5, 1.5), (0.6, 1.2)
COLUMNS = ("flexion axis", "pronation axis", "heading between", "carrying angle")


def alignment(context: Context) -> list[Table]:
    """Return the errors of what the calibration routine shows of an elbow."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for level in context.levels:
        for carrying in CARRYING_DEG:
            label = f"{level}, {abs(carrying):g} deg {'valgus' if carrying > 0 else 'varus'}"
            context.progress(f"alignment: {label}")
            cells = context.over_seeds_each(partial(errors, context, level, carrying))
            rows.append((label, tuple(cells)))
            if level in LIMITED:
                i = LIMITED.index(level)
                bounds = (AXES_DEG[i], AXES_DEG[i], HEADING_DEG[i])
                limits += [
                    Limit(what=f"{label}: {what}", value=value, at_most=bound, unit="deg")
                    for what, value, bound in zip(COLUMNS[:3], cells[:3], bounds, strict=True)
                ]
    return [
        Table(
            name="alignment",
            title="Alignment from the calibration routine, sensors put on 15 deg off, no magnetometer",
            unit="deg",
            columns=COLUMNS,
            rows=tuple(rows),
            limits=tuple(limits),
            notes=(
                "Standing for 4 s, five elbow flexions, five pronations, 10 s of both. Against where the "
                "axes lie in the sensors on the mean of the movement, since skin moves them; the heading "
                "between the two sensors' worlds in the pose. Median of seeds "
                f"{', '.join(map(str, context.seeds))}.",
            ),
        )
    ]


def errors(context: Context, level: Level, carrying_deg: float, seed: int) -> list[float | None]:
    """Return the errors by COLUMNS of one wearer, None where the elbow was refused."""
    trial = Trial(
        exercise="elbow-flexion",
        level=level,
        seed=seed,
        rate_hz=RATE_HZ,
        seconds=4.0,
        routine="calibration",
        magnetometer=False,
        placement_deg=PLACEMENT_DEG,
        more=(("carrying_deg", carrying_deg),),
    )
    made = context.emulated(trial)
    records: dict[str, SensorRecord] = {name: _record(made, name) for name in trial.segments()}
    chosen = _rows(made)
    found = align_segments(records, chosen, RATE_HZ)
    upper, fore, _ = arm_segments(trial.side)
    joint = found.joints.get(f"elbow_{trial.side[0]}")
    if joint is None:
        return [None] * len(COLUMNS)
    moving = slice(chosen[1].first, chosen[-1].end)
    true = {s: rotation.mean(made.session.sensors[s].segment_from_sensor[moving]) for s in (upper, fore)}
    flexion = rotation.rotate(rotation.inverse(true[upper]), np.array([0.0, 0.0, 1.0]))
    pronation = rotation.rotate(rotation.inverse(true[fore]), np.array([0.0, 1.0, 0.0]))
    pose = slice(chosen[0].first, chosen[0].end)
    apart = [_own_heading(made, records[s], s, pose) for s in (fore, upper)]
    heading = found.heading[fore] - found.heading[upper]
    return [
        _between_deg(np.array(joint.axis_near), flexion),
        _between_deg(np.array(joint.axis_far), pronation),
        abs(float(np.degrees(rotation.wrap(heading - (apart[0] - apart[1]))))),
        abs(float(np.degrees(joint.carrying_rad)) + carrying_deg),
    ]


def _record(made: Emulated, segment: Segment) -> SensorRecord:
    """Return one sensor as a recording has it: its orientation found with the future known, no heading."""
    sensor = made.session.sensors[segment]
    found = smooth_orientation(sensor.gyr, sensor.acc, None, RATE_HZ)
    return SensorRecord(
        world_from_sensor=found.world_from_sensor, nominal_mounting=sensor.nominal_mounting, acc=sensor.acc
    )


def _rows(made: Emulated) -> Sequence[Span]:
    """Return what was done as rows, the pose first."""
    stated = spans(made.session.spans)

    def span(kind: SpanKind, from_s: float, to_s: float, angles_deg: dict[str, float]) -> Span:
        first, end = round(from_s * RATE_HZ), round(to_s * RATE_HZ)
        return Span(kind=kind, first=first, end=end, angles_deg=angles_deg)

    pose = span(stated.pose or "n-pose", stated.from_s or 0.0, stated.to_s or 0.0, stated.angles_deg)
    return [pose, *(span(f.motion, f.from_s, f.to_s, {}) for f in stated.functional)]


def _own_heading(made: Emulated, record: SensorRecord, segment: Segment, rows: slice) -> float:
    """Return the turn about the vertical that brings a sensor's own world into the true one, rad."""
    true = made.session.sensors[segment].world_from_sensor[rows]
    turn = rotation.multiply(true, rotation.inverse(record.world_from_sensor[rows]))
    return float(rotation.heading(rotation.mean(turn)))


def _between_deg(a: Floats, b: Floats) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


CONTRACTURE_DEG, CONTRACTURE_OFF_DEG = 35.0, 4.0
POSES = {"given": "calibration-given", "table": "calibration-table"}


def contracture(context: Context) -> list[Table]:
    """Return what an elbow that cannot straighten beyond 35 deg reads at its limit."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for level in context.levels[-1:]:
        for pose, routine in POSES.items():
            for method in ("auto", "best"):
                label = f"{level}, pose {pose}, {word(method)}"
                context.progress(f"contracture: {label}")
                reads = _at_limit(context, level, routine, method, context.seeds[0])
                rows.append((label, (reads,)))
                if level == "typical":
                    off = None if reads is None else abs(reads - CONTRACTURE_DEG)
                    limits.append(
                        Limit(what=f"{label}: off", value=off, at_most=CONTRACTURE_OFF_DEG, unit="deg")
                    )
    return [
        Table(
            name="contracture",
            title="An elbow that stops at 35 deg when it is straightened",
            unit="deg read while it is at its limit",
            columns=("reads",),
            rows=tuple(rows),
            limits=tuple(limits),
            notes=(
                "Calibrated by the routine, after a pose that such an elbow can hold. "
                f"Seed {context.seeds[0]}.",
            ),
        )
    ]


def _at_limit(context: Context, level: Level, routine: str, method: str, seed: int) -> float | None:
    trial = Trial(
        exercise="elbow-flexion",
        level=level,
        seed=seed,
        rate_hz=RATE_HZ,
        routine=routine,
        more=(("contracture_deg", CONTRACTURE_DEG), ("carrying_deg", CARRYING_DEG[0])),
    )
    made = context.emulated(trial)
    found = made.solved(method).angles["elbow_flexion"][made.counts]
    true = made.truth.angles["elbow_flexion"][made.counts]
    at_limit = np.degrees(found[np.degrees(true) < np.degrees(true).min() + 1.0])
    return float(np.nanmean(at_limit)) if np.isfinite(at_limit).any() else None


BAD = ("calibration-shrugged", "calibration-small", "calibration-mixed-up", "calibration-restless")


def refusals(context: Context) -> list[Table]:
    """Return what is said of calibration movements that cannot be used."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    refused = 0
    for routine in BAD:
        context.progress(f"refusals: {routine}")
        trial = Trial(
            exercise="elbow-flexion",
            level="typical",
            seed=context.seeds[0],
            rate_hz=RATE_HZ,
            seconds=4.0,
            routine=routine,
            magnetometer=False,
        )
        made = context.emulated(trial)
        records: dict[str, SensorRecord] = {name: _record(made, name) for name in trial.segments()}
        found: Alignment = align_segments(records, _rows(made), RATE_HZ)
        refused += bool(found.refused)
        said = "; ".join(f"{what}: {why}" for what, why in found.refused.items()) or "nothing"
        rows.append((routine.removeprefix("calibration-"), (said,)))
    share = 100.0 * refused / len(BAD)
    return [
        Table(
            name="refusals",
            title="Calibration movements that cannot be used, and what is said of them",
            unit="",
            columns=("refused",),
            rows=tuple(rows),
            limits=(Limit(what="refused", value=share, at_most=100.0, unit="%", at_least=True),),
            notes=(
                "shrugged: the shoulder is lifted and the upper arm swings along; small: 8 deg of movement; "
                "mixed-up: forearm and elbow always turn together; restless: the arm sways in the pose.",
            ),
        )
    ]
