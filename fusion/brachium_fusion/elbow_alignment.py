"""One elbow from its movement: axes, heading, carrying angle, scores, and what is refused and why. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import degrees, radians
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Side, arm_segments, suffix
from brachium_fusion.elbow_refusals import (
    LEAST_PRONATION_DEG,
    ElbowSpan,
    span_reasons,
    whole_reason,
)
from brachium_fusion.joint_alignment import JointAlignment
from brachium_fusion.joint_axes import FEWEST_ROWS, JointAxes, fit_joint_axes
from brachium_fusion.joint_centre import JointCentre, find_joint_centre
from brachium_fusion.joint_equations import AxisPriors, HeadingPrior
from brachium_fusion.joint_motion import JointMotion, SensorMotion, joint_motion
from brachium_fusion.segment_frames import ElbowFrames, ElbowPose, elbow_angles, elbow_frames, excursion_deg
from brachium_fusion.segment_records import leaves_open
from brachium_wire.tuples import vector

Floats = npt.NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
BENDING = ("elbow-flexion", "free")
"""Movements of which one must be left when others are refused."""
UNSURE_DEG = 15.0
"""An axis or heading that is not known better is told as a warning."""
NEAR_S = 120.0
"""The heading between sensors without magnetometers holds so long."""
MORE_S = 30.0
"""So much more movement than the refused spans hold stands in for them."""
SHARED_SD = radians(20.0)
"""Of the headings of two magnetometers in a room with iron in it."""
CENTRE_SD = radians(3.0)
"""What skin, and a joint that is no point, add to a heading from accelerations."""
LEVER_SD_M = 0.03
"""A joint's centre that is not known better is not told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """Nothing of the elbow can be used."""

    reasons: dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElbowFound:
    """What movement shows of one elbow."""

    joint: JointAlignment
    upper_from_sensor: Floats
    forearm_from_sensor: Floats
    axis_in_pose: Floats
    """The flexion axis (3,) in the upper-arm sensor's world while the pose was held, to the right."""
    scores: dict[str, float]
    refused: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElbowSensors:
    """The sensors beside an elbow."""

    side: Side
    upper: SensorMotion
    forearm: SensorMotion
    shared_heading: bool = False
    """Both have magnetometers: their worlds are believed to agree within 20 deg."""
    nominal_upper: Floats | None = None
    """segment_from_sensor (4,) as told; None when nothing is known."""
    nominal_forearm: Floats | None = None


class FittedElbow(NamedTuple):
    """An elbow before anything of it is refused."""

    motion: JointMotion
    centre: JointCentre | None
    found: JointAxes
    frames: ElbowFrames


def find_elbow(
    sensors: ElbowSensors, pose: ElbowPose, spans: Sequence[ElbowSpan], rate_hz: float
) -> ElbowFound | Refused:
    """Return the elbow between two sensors from the pose's and the movements' spans.

    A functional span that holds another movement than its name says is refused and left out.
    """
    refused: dict[str, str] = {}
    end, all_spans = suffix(sensors.side), spans
    while True:
        fitted = fit_elbow(sensors, pose, spans, rate_hz)
        if isinstance(fitted, str):
            return Refused(reasons=refused | {f"elbow{end}": fitted})
        wrong = span_reasons(fitted.motion, fitted.found, fitted.frames, spans, rate_hz)
        refused |= {f"{spans[place][0]}{end}": why for place, why in wrong.items()}
        spans = [span for place, span in enumerate(spans) if place not in wrong]
        if wrong:
            if leaves_open([kind for kind, _, _ in spans]):
                spans = _all_of_it(all_spans, sensors, rate_hz) or spans
            if not any(kind in BENDING for kind, _, _ in spans):
                return Refused(reasons=refused)
            continue
        if degrees(fitted.found.axis_a_sd) > UNSURE_DEG and not any(kind == "free" for kind, _, _ in spans):
            # a still upper arm leaves open where its axis points: what came between may show it
            wider = fit_elbow(sensors, pose, _all_of_it(spans, sensors, rate_hz, 0.0), rate_hz)
            if not isinstance(wider, str) and wider.found.axis_a_sd < fitted.found.axis_a_sd:
                fitted = wider
        return _result(fitted, sensors, pose, refused)


def _all_of_it(
    spans: Sequence[ElbowSpan], sensors: ElbowSensors, rate_hz: float, least_s: float = MORE_S
) -> list[ElbowSpan]:
    """Return one free span over all that was recorded near the spans, if it is `least_s` longer than they."""
    margin, last = round(NEAR_S * rate_hz), len(sensors.upper.world_from_sensor)
    first, end = min(s[1] for s in spans), max(s[2] for s in spans)
    whole: ElbowSpan = ("free", max(0, first - margin), min(last, end + margin))
    more = (whole[2] - whole[1]) - sum(s[2] - s[1] for s in spans)
    return [whole] if more >= least_s * rate_hz else []


def fit_elbow(
    sensors: ElbowSensors, pose: ElbowPose, spans: Sequence[ElbowSpan], rate_hz: float
) -> FittedElbow | str:
    """Return the elbow that fits the spans best, or why there is none."""
    rows = [(first, end) for _, first, end in spans]
    motion = joint_motion(sensors.upper, sensors.forearm, rows, rate_hz)
    if len(motion.time_s) < FEWEST_ROWS:
        return "too few samples of upper arm and forearm together in the spans: at least 2 s are needed"
    # the elbow's centre and its range show in all that was recorded near the spans
    margin, last = round(NEAR_S * rate_hz), len(sensors.upper.world_from_sensor)
    around = [(max(0, first - margin), min(last, end + margin)) for first, end in rows]
    seen = joint_motion(sensors.upper, sensors.forearm, around, rate_hz)
    centre = find_joint_centre(seen)
    solutions = fit_joint_axes(motion, _priors(sensors, pose, centre))
    nominal = sensors.nominal_upper, sensors.nominal_forearm
    judged = [(f, elbow_frames(seen, f, pose, sensors.side, *nominal)) for f in solutions]
    found, frames = min(judged, key=lambda pair: pair[0].cost - pair[1].merit)
    flexion, _ = elbow_angles(motion, found, frames, sensors.side)
    return whole_reason(found, excursion_deg(flexion)) or FittedElbow(motion, centre, found, frames)


def _priors(sensors: ElbowSensors, pose: ElbowPose, centre: JointCentre | None) -> AxisPriors:
    told = (
        None
        if sensors.nominal_upper is None
        else rotation.rotate(rotation.inverse(sensors.nominal_upper), UP)
    )
    hanging = rotation.rotate(rotation.inverse(pose.upper_sensor), UP) if pose.hanging else None
    return AxisPriors(
        across_a=hanging,
        axis_a=told,
        axis_a_sd=radians(25.0),
        axis_b=_forearm_axis(pose, sensors.nominal_forearm),
        axis_b_sd=radians(12.0 if pose.hanging_forearm else 25.0),
        heading=_heading_prior(centre, sensors.shared_heading),
    )


def _result(
    fitted: FittedElbow, sensors: ElbowSensors, pose: ElbowPose, refused: dict[str, str]
) -> ElbowFound:
    motion, centre, found, frames = fitted
    end = suffix(sensors.side)
    near, far, _ = arm_segments(sensors.side)
    flexion, pronation = elbow_angles(motion, found, frames, sensors.side)
    turned = excursion_deg(pronation)
    if turned < LEAST_PRONATION_DEG:
        few = (
            f"too little movement: the forearm turned by {turned:.0f} deg, at least "
            f"{LEAST_PRONATION_DEG:.0f} are needed; its axis rests on gravity in the pose"
        )
        refused.setdefault(f"pronation{end}", few)
    if degrees(found.heading_sd) > UNSURE_DEG and degrees(found.axis_a_sd) > UNSURE_DEG:
        refused[f"heading{end}"] = (
            "the upper arm was too still to tell where its flexion axis points: "
            "raise the arm forward and sideways with the elbow bent"
        )
    joint = JointAlignment(
        near=near,
        far=far,
        axis_near=vector(frames.axis_upper),
        axis_far=vector(frames.axis_forearm),
        carrying_rad=frames.carrying,
        heading_rad=float(rotation.wrap(found.heading_at(pose.time_s))),
        axis_near_sd_rad=found.axis_a_sd,
        axis_far_sd_rad=found.axis_b_sd,
        heading_sd_rad=found.heading_sd,
        lever_near_m=None if centre is None else _lever(centre.lever_a, centre.lever_a_sd),
        lever_far_m=None if centre is None else _lever(centre.lever_b, centre.lever_b_sd),
    )
    return ElbowFound(
        joint=joint,
        upper_from_sensor=frames.upper_from_sensor,
        forearm_from_sensor=frames.forearm_from_sensor,
        axis_in_pose=rotation.rotate(pose.upper_sensor, frames.axis_upper),
        scores={
            f"flexion_axis_deg{end}": degrees(found.axis_a_sd),
            f"pronation_axis_deg{end}": degrees(found.axis_b_sd),
            f"joint_heading_deg{end}": degrees(found.heading_sd),
            f"carrying_deg{end}": degrees(-frames.carrying),
            f"elbow_in_pose_deg{end}": degrees(frames.pose_flexion),
            f"flexion_range_deg{end}": excursion_deg(flexion),
            f"pronation_range_deg{end}": turned,
            f"unexplained_share{end}": found.residual,
        },
        refused=refused,
    )


def _heading_prior(centre: JointCentre | None, shared: bool) -> HeadingPrior | None:
    if centre is not None:
        sd = np.hypot(centre.headings_sd, CENTRE_SD)
        return HeadingPrior(time_s=centre.knots_s, heading=centre.headings, sd=sd)
    if shared:
        return HeadingPrior(time_s=np.zeros(1), heading=np.zeros(1), sd=np.full(1, SHARED_SD))
    return None


def _forearm_axis(pose: ElbowPose, nominal: Floats | None) -> Floats | None:
    if pose.hanging_forearm:
        return rotation.rotate(rotation.inverse(pose.forearm_sensor), UP)
    if nominal is not None:
        return rotation.rotate(rotation.inverse(nominal), np.array([0.0, 1.0, 0.0]))
    return None


def _lever(lever: Floats, sd: Floats) -> tuple[float, float, float] | None:
    return vector(lever) if float(np.linalg.norm(sd)) < LEVER_SD_M else None
