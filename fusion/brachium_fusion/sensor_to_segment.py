"""Where each sensor sits on its segment, from a pose and movement together. Pure.

A pose alone gives every mounting as well as the pose was held, and without magnetometers no heading.
Movement of the elbow adds both its axes, the heading between the sensors beside it and the carrying angle
(joint_axes.py); segment_frames.py says on what the zeros then rest. What movement does not show is refused
with its reason and stays as the pose has it. Spans may be short guided movements or a whole recording
(`free`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import degrees, radians
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.elbow_alignment import ElbowFound, ElbowSensors, Refused, find_elbow
from brachium_fusion.hand_alignment import hand_mounting, wrist_heading
from brachium_fusion.joint_motion import SensorMotion
from brachium_fusion.pose import POSES, Alignment, PoseName, PoseSensor, align, pose_orientations
from brachium_fusion.segment_frames import ElbowPose

Floats = npt.NDArray[np.float64]
SpanKind = Literal["n-pose", "table", "given", "elbow-flexion", "pronation", "free"]

SWAY_LIMIT_DEG = 5.0
"""A pose in which a sensor turned by more than this (rms) was not held."""
FLEXION_SD = {"n-pose": radians(5.0), "table": radians(3.0), "given": radians(2.0)}
"""How far the elbow's stated flexion is believed: told to hang, laid at a right angle, measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Rows `first` to `end` (exclusive) of all records, and what the person did in them."""

    kind: SpanKind
    first: int
    end: int
    angles_deg: dict[str, float] = field(default_factory=dict)
    """Of the pose `given`, by clinical names."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorRecord:
    """One sensor over the rows; NaN where nothing was measured. Rows of all records belong together."""

    world_from_sensor: Floats
    """(n, 4)."""
    magnetometer: bool = False
    """Its world is the common one; without, its heading is its own."""
    nominal_mounting: Floats | None = None
    """segment_from_sensor (4,) as the wearer was told to put it on; None when nothing is known."""
    gyr: Floats | None = None
    """(n, 3) rad/s; not used: rates are taken from the orientations."""
    acc: Floats | None = None
    """(n, 3) m/s^2, calibrated; finds the heading between sensors of a joint that is moved about. None for
    sensors that deliver orientation only."""
    mag: Floats | None = None


def align_segments(
    records: Mapping[str, SensorRecord],
    spans: Sequence[Span],
    rate_hz: float,
    *,
    facing_deg: float | None = None,
) -> Alignment:
    """Return the alignment of all records from the spans.

    The first pose among the spans that was held still fixes zeros. Without any, and for what movement does
    not show, Alignment.refused says why. Raises ValueError for spans outside the records and records of
    different lengths.
    """
    _check(records, spans, rate_hz)
    refused: dict[str, str] = {}
    pose = _held_pose(records, spans, refused)
    if pose is None:
        return Alignment(refused=refused, warnings=tuple(refused.values()))
    still = {name: quats for name, record in records.items() if len(quats := _rows(record, pose)) > 0}
    elbows: dict[Side, ElbowFound] = {}
    for side in SIDES:
        found = _elbow(records, still, spans, pose, side, rate_hz)
        if isinstance(found, Refused):
            refused |= found.reasons
        elif found is not None:
            elbows[side] = found
            refused |= found.refused
    return _joined(records, still, pose, spans, rate_hz, elbows, refused, facing_deg)


def _check(records: Mapping[str, SensorRecord], spans: Sequence[Span], rate_hz: float) -> None:
    lengths = {len(record.world_from_sensor) for record in records.values()}
    if len(lengths) != 1:
        raise ValueError(f"expected records of one length, got {sorted(lengths)} rows")
    if not rate_hz > 0.0:
        raise ValueError(f"expected a rate above 0, got {rate_hz} Hz")
    (rows,) = lengths
    for span in spans:
        if not 0 <= span.first < span.end <= rows:
            raise ValueError(
                f"the span {span.kind} has rows {span.first} to {span.end}; records have {rows} rows"
            )


def _rows(record: SensorRecord, span: Span) -> Floats:
    quats = record.world_from_sensor[span.first : span.end]
    return quats[np.isfinite(quats[:, 0])]


def _held_pose(
    records: Mapping[str, SensorRecord], spans: Sequence[Span], refused: dict[str, str]
) -> Span | None:
    """Return the first pose in which all sensors were still; reasons of others go to `refused`."""
    poses = [span for span in spans if span.kind in POSES]
    if not poses:
        refused["pose"] = "no pose among the spans: give n-pose, table or given, held still for some seconds"
    for span in poses:
        moved = []
        for name, record in records.items():
            quats = _rows(record, span)
            if len(quats) == 0:
                continue
            sway = rotation.angle_between(rotation.mean(quats), quats)
            sway_deg = degrees(float(np.sqrt(np.mean(sway**2))))
            if sway_deg > SWAY_LIMIT_DEG:
                moved.append(f"{name} by {sway_deg:.0f} deg")
        if not moved:
            refused.pop("pose", None)
            return span
        refused["pose"] = f"not still in the pose {span.kind}: {', '.join(moved)}; hold it for some seconds"
    return None


def _elbow(
    records: Mapping[str, SensorRecord],
    still: Mapping[str, Floats],
    spans: Sequence[Span],
    pose: Span,
    side: Side,
    rate_hz: float,
) -> ElbowFound | Refused | None:
    upper, forearm, _ = arm_segments(side)
    moving = [(s.kind, s.first, s.end) for s in spans if s.kind not in POSES]
    if upper not in still or forearm not in still or not moving:
        return None
    stated = _stated(pose)
    hanging = pose.kind == "n-pose"
    return find_elbow(
        ElbowSensors(
            side=side,
            upper=_motion(records[upper]),
            forearm=_motion(records[forearm]),
            shared_heading=records[upper].magnetometer and records[forearm].magnetometer,
            nominal_upper=records[upper].nominal_mounting,
            nominal_forearm=records[forearm].nominal_mounting,
        ),
        ElbowPose(
            upper_sensor=rotation.mean(still[upper]),
            forearm_sensor=rotation.mean(still[forearm]),
            time_s=0.5 * (pose.first + pose.end) / rate_hz,
            flexion=radians(stated.get("elbow_flexion", 0.0)),
            flexion_sd=FLEXION_SD[pose.kind],
            pronation=radians(stated.get("forearm_pronation", 0.0)),
            hanging=hanging,
            hanging_forearm=hanging,
        ),
        [(pose.kind, pose.first, pose.end), *moving],
        rate_hz,
    )


def _motion(record: SensorRecord) -> SensorMotion:
    return SensorMotion(world_from_sensor=record.world_from_sensor, acc=record.acc)


def _stated(pose: Span) -> dict[str, float]:
    if pose.kind == "table":
        return {"elbow_flexion": 90.0}
    return pose.angles_deg if pose.kind == "given" else {}


def _joined(
    records: Mapping[str, SensorRecord],
    still: Mapping[str, Floats],
    pose: Span,
    spans: Sequence[Span],
    rate_hz: float,
    elbows: Mapping[Side, ElbowFound],
    refused: dict[str, str],
    facing_deg: float | None,
) -> Alignment:
    """Return what the pose gives, with upper arms and forearms as the elbows show them."""
    sensors = {
        name: PoseSensor(
            world_from_sensor=quats,
            magnetometer=records[name].magnetometer,
            nominal_mounting=records[name].nominal_mounting,
        )
        for name, quats in still.items()
    }
    kind: PoseName = pose.kind if pose.kind in POSES else "n-pose"
    targets = pose_orientations(kind, pose.angles_deg)
    axes = {found.joint.near: found.axis_in_pose for found in elbows.values()}
    base = align(sensors, targets, facing_deg=facing_deg, elbow_axis=axes)
    heading, mounting = dict(base.heading), dict(base.mounting)
    scores, assumed = dict(base.scores), set(base.assumed)
    time_s = 0.5 * (pose.first + pose.end) / rate_hz
    for side, found in elbows.items():
        upper, forearm, hand = arm_segments(side)
        heading[forearm] = float(rotation.wrap(heading[upper] + found.joint.heading_rad))
        mounting[upper], mounting[forearm] = found.upper_from_sensor, found.forearm_from_sensor
        scores |= found.scores
        assumed.discard(forearm)
        if upper in assumed:
            assumed.add(forearm)
        if hand not in still:
            continue
        if not records[hand].magnetometer:
            rows = [(span.first, span.end) for span in spans]
            turn = wrist_heading(_motion(records[forearm]), _motion(records[hand]), rows, time_s, rate_hz)
            if turn is not None:
                heading[hand] = float(rotation.wrap(heading[forearm] + turn))
                assumed.discard(hand)
        stands = rotation.multiply(rotation.about(2, heading[forearm]), rotation.mean(still[forearm]))
        mounting[hand] = hand_mounting(
            rotation.multiply(stands, rotation.inverse(mounting[forearm])),
            rotation.multiply(rotation.inverse(targets[forearm]), targets[hand]),
            rotation.mean(still[hand]),
            heading[hand],
        )
    return replace(
        base,
        heading=heading,
        mounting=mounting,
        assumed=frozenset(assumed),
        scores=scores,
        joints={f"elbow_{side[0]}": found.joint for side, found in elbows.items()},
        refused=refused,
    )
