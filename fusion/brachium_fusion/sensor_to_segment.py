"""Where each sensor sits on its segment, from a pose and movement together. Pure.

A pose alone gives every mounting as well as the pose was held, and without magnetometers no heading.
Movement of the elbow adds both its axes, the heading between the sensors beside it and the carrying angle
(joint_axes.py); segment_frames.py says on what the zeros then rest. What movement does not show is refused
with its reason and stays as the pose has it. Spans may be short guided movements or a whole recording
(`free`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.alignment_warnings import warnings_for
from brachium_fusion.elbow_alignment import ElbowFound, ElbowSensors, Refused, find_elbow
from brachium_fusion.free_pose import pose_from_movement
from brachium_fusion.hand_alignment import hand_mounting, wrist_heading
from brachium_fusion.joint_motion import SensorMotion
from brachium_fusion.pose import (
    POSES,
    Alignment,
    PoseName,
    PoseSensor,
    align,
    pose_orientations,
    with_magnetometers,
)
from brachium_fusion.segment_frames import ElbowPose
from brachium_fusion.segment_records import SensorRecord, Span, SpanKind, check, held_pose, rows_of
from brachium_fusion.swapped_sensors import swapped

__all__ = ["SensorRecord", "Span", "SpanKind", "align_segments"]

Floats = npt.NDArray[np.float64]

NO_POSE = (
    "no pose was held: zeros of flexion and pronation rest on the range of the movement "
    "(straightest elbow 5 deg, middle of pronation 0) and forward on the arm's usual stance"
)
FLEXION_SD = {"n-pose": radians(5.0), "table": radians(3.0), "given": radians(2.0)}
"""How far the elbow's stated flexion is believed: told to hang, laid at a right angle, measured."""


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
    check(records, spans, rate_hz)
    if spans and not any(span.kind in POSES for span in spans):
        return _without_pose(records, spans, rate_hz, facing_deg)
    refused: dict[str, str] = {}
    pose = held_pose(records, spans, refused)
    if pose is None:
        return Alignment(refused=refused, warnings=tuple(refused.values()))
    still = {name: quats for name, record in records.items() if len(quats := rows_of(record, pose)) > 0}
    elbows: dict[Side, ElbowFound] = {}
    for side in SIDES:
        found = _elbow(records, still, spans, pose, side, rate_hz)
        if isinstance(found, Refused):
            refused |= found.reasons
        elif found is not None:
            elbows[side] = found
            refused |= found.refused
    return _joined(records, still, pose, spans, rate_hz, elbows, refused, facing_deg)


def _without_pose(
    records: Mapping[str, SensorRecord], spans: Sequence[Span], rate_hz: float, facing_deg: float | None
) -> Alignment:
    """Return the alignment of each arm from its movement alone; hands and sternum stay as they are."""
    found = Alignment(warnings=(NO_POSE,))
    for side in SIDES:
        upper, forearm, _ = arm_segments(side)
        if upper not in records or forearm not in records:
            continue
        moving = [(span.kind, span.first, span.end) for span in spans]
        pose = pose_from_movement(_elbow_sensors(records, side), moving, rate_hz)
        if isinstance(pose, str):
            found = replace(found, refused=found.refused | {f"elbow_{side[0]}": pose})
            continue
        angles = {"elbow_flexion": pose.elbow_flexion_deg, "forearm_pronation": pose.forearm_pronation_deg}
        given = Span(kind="given", first=pose.row, end=pose.row + 1, angles_deg=angles)
        arm: dict[str, SensorRecord] = {name: records[name] for name in (upper, forearm)}
        one = align_segments(arm, [given, *spans], rate_hz, facing_deg=facing_deg)
        found = replace(
            one,
            heading=found.heading | one.heading,
            mounting=found.mounting | one.mounting,
            assumed=found.assumed | one.assumed,
            scores=found.scores | one.scores,
            joints=found.joints | one.joints,
            refused=found.refused | one.refused,
            warnings=tuple(dict.fromkeys((*found.warnings, *one.warnings))),
        )
    return found


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
        _elbow_sensors(records, side),
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


def _elbow_sensors(records: Mapping[str, SensorRecord], side: Side) -> ElbowSensors:
    upper, forearm = (records[name] for name in arm_segments(side)[:2])
    return ElbowSensors(
        side=side,
        upper=_motion(upper),
        forearm=_motion(forearm),
        shared_heading=upper.magnetometer and forearm.magnetometer,
        nominal_upper=upper.nominal_mounting,
        nominal_forearm=forearm.nominal_mounting,
    )


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
    scores, assumed, tied = dict(base.scores), set(base.assumed), [with_magnetometers(sensors)]
    time_s = 0.5 * (pose.first + pose.end) / rate_hz
    for side, found in elbows.items():
        upper, forearm, hand = arm_segments(side)
        heading[forearm] = float(rotation.wrap(heading[upper] + found.joint.heading_rad))
        mounting[upper], mounting[forearm] = found.upper_from_sensor, found.forearm_from_sensor
        scores |= found.scores
        tied.append({upper, forearm})
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
                tied.append({forearm, hand})
                assumed.discard(hand)
                if forearm in assumed:
                    assumed.add(hand)
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
        warnings=(
            *warnings_for(base.forward, heading, assumed, tied, scores),
            *swapped(records, spans),
        ),
    )
