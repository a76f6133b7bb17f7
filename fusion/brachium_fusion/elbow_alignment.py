"""One elbow from its movement: axes, heading, carrying angle, scores, and what is refused and why. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import degrees, radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Side, arm_segments, suffix
from brachium_fusion.joint_alignment import JointAlignment
from brachium_fusion.joint_axes import FEWEST_ROWS, JointAxes, fit_joint_axes
from brachium_fusion.joint_centre import JointCentre, find_joint_centre
from brachium_fusion.joint_equations import AxisPriors, HeadingPrior
from brachium_fusion.joint_motion import JointMotion, SensorMotion, joint_motion
from brachium_fusion.segment_frames import ElbowFrames, ElbowPose, elbow_angles, elbow_frames, excursion_deg

Floats = npt.NDArray[np.float64]

LEAST_FLEXION_DEG = 30.0
LEAST_PRONATION_DEG = 25.0
UNEXPLAINED = 0.5
"""More of the joint's rate than this across both axes: it was another movement."""
PARALLEL_DEG = 35.0
"""A carrying angle beyond this is no elbow's."""
UNSURE_DEG = 15.0
"""An axis or heading that is not known better is told as a warning."""
NEAR_S = 120.0
"""The heading between sensors without magnetometers holds so long."""
SHARED_SD = radians(20.0)
"""Of the headings of two magnetometers in a room with iron in it."""
CENTRE_SD = radians(1.5)
"""What the joint that is no point adds to a heading from accelerations."""
LEVER_SD_M = 0.03
"""A joint's centre that is not known better is not told."""
SHARE = 0.5
"""Of a functional movement that must be about its own axis."""


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


def find_elbow(
    upper: SensorMotion,
    forearm: SensorMotion,
    pose: ElbowPose,
    spans: Sequence[tuple[str, int, int]],
    rate_hz: float,
    side: Side,
    *,
    shared_heading: bool = False,
    nominal_upper: Floats | None = None,
    nominal_forearm: Floats | None = None,
) -> ElbowFound | Refused:
    """Return the elbow between two sensors, from spans (kind, first row, end row).

    With `shared_heading` both have magnetometers: their worlds are believed to agree within 20 deg.
    """
    end = suffix(side)
    motion = joint_motion(upper, forearm, [(first, last) for _, first, last in spans], rate_hz)
    if len(motion.time_s) < FEWEST_ROWS:
        few = "too few samples of upper arm and forearm together in the spans: at least 2 s are needed"
        return Refused(reasons={f"elbow{end}": few})
    up = np.array([0.0, 0.0, 1.0])
    centre = find_joint_centre(motion)
    solutions = fit_joint_axes(
        motion,
        AxisPriors(
            across_a=rotation.rotate(rotation.inverse(pose.upper_sensor), up) if pose.hanging else None,
            axis_a=None if nominal_upper is None else rotation.rotate(rotation.inverse(nominal_upper), up),
            axis_b=_forearm_axis(pose, nominal_forearm),
            axis_b_sd=radians(12.0 if pose.hanging_forearm else 25.0),
            axis_a_sd=radians(25.0),
            heading=_heading_prior(centre, shared_heading),
        ),
    )
    # the elbow's range shows in all that was recorded near the spans
    margin, rows = round(NEAR_S * rate_hz), len(upper.world_from_sensor)
    around = [(max(0, first - margin), min(rows, last + margin)) for _, first, last in spans]
    seen = joint_motion(upper, forearm, around, rate_hz)
    judged = [(f, elbow_frames(seen, f, pose, side, nominal_upper, nominal_forearm)) for f in solutions]
    found, frames = min(judged, key=lambda pair: pair[0].cost - pair[1].merit)
    flexion, pronation = elbow_angles(motion, found, frames, side)
    bent, turned = excursion_deg(flexion), excursion_deg(pronation)
    reason = _why_not(motion, found, frames, bent, spans, rate_hz)
    if reason is not None:
        return Refused(reasons={f"elbow{end}": reason})
    near, far, _ = arm_segments(side)
    refused = {}
    if turned < LEAST_PRONATION_DEG:
        refused[f"pronation{end}"] = (
            f"the forearm turned by {turned:.0f} deg only, at least {LEAST_PRONATION_DEG:.0f} are needed: "
            "its axis rests on gravity in the pose"
        )
    if degrees(found.heading_sd) > UNSURE_DEG and degrees(found.axis_a_sd) > UNSURE_DEG:
        refused[f"heading{end}"] = (
            "the upper arm was too still to tell where its flexion axis points: "
            "raise the arm forward and sideways with the elbow bent"
        )
    joint = JointAlignment(
        near=near,
        far=far,
        axis_near=_vector(frames.axis_upper),
        axis_far=_vector(frames.axis_forearm),
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
            f"flexion_range_deg{end}": bent,
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
        return rotation.rotate(rotation.inverse(pose.forearm_sensor), np.array([0.0, 0.0, 1.0]))
    if nominal is not None:
        return rotation.rotate(rotation.inverse(nominal), np.array([0.0, 1.0, 0.0]))
    return None


def _vector(v: Floats) -> tuple[float, float, float]:
    return (float(v[0]), float(v[1]), float(v[2]))


def _lever(lever: Floats, sd: Floats) -> tuple[float, float, float] | None:
    return _vector(lever) if float(np.linalg.norm(sd)) < LEVER_SD_M else None


def _why_not(
    motion: JointMotion,
    found: JointAxes,
    frames: ElbowFrames,
    bent: float,
    spans: Sequence[tuple[str, int, int]],
    rate_hz: float,
) -> str | None:
    """Return why the elbow cannot be used, or None."""
    if bent < LEAST_FLEXION_DEG:
        upper = degrees(float(np.sum(np.linalg.norm(motion.rate_a, axis=1)) / 10.0))
        where = "; the shoulder moved instead" if upper > 180.0 else ""
        return (
            f"too little movement: the elbow bent by {bent:.0f} deg, at least {LEAST_FLEXION_DEG:.0f} "
            f"are needed{where}"
        )
    if found.residual > UNEXPLAINED:
        return (
            f"movement about another axis: {100.0 * found.residual:.0f} % of the turning fits neither "
            "flexion nor pronation of an elbow; check that both sensors sit tight on one arm"
        )
    if abs(degrees(found.carrying)) > PARALLEL_DEG:
        return (
            f"axes too close to parallel: {90.0 - abs(degrees(found.carrying)):.0f} deg apart, not 80: "
            "bend and straighten the elbow, then turn the forearm, one after the other"
        )
    for kind, first, last in spans:
        reason = _wrong_movement(motion.part(first / rate_hz, last / rate_hz), found, frames, kind)
        if reason is not None:
            return reason
    return None


def _wrong_movement(part: JointMotion, found: JointAxes, frames: ElbowFrames, kind: str) -> str | None:
    """Return why a functional span does not hold the movement it is named for, or None."""
    if kind not in ("elbow-flexion", "pronation") or len(part.time_s) == 0:
        return None
    turn = rotation.to_matrix(rotation.about(2, found.heading_at(part.time_s)))
    relative = np.einsum("nij,nj->ni", turn, part.rate_b) - part.rate_a
    bending = np.einsum("ni,ni->n", relative, part.world_from_a @ frames.axis_upper)
    turning = np.einsum("ni,nij,nj->n", relative, turn, part.world_from_b @ frames.axis_forearm)
    sizes = {"elbow-flexion": float(bending @ bending), "pronation": float(turning @ turning)}
    total = float(np.einsum("ni,ni->", relative, relative))
    if sizes[kind] >= SHARE * total:
        return None
    return (
        f"the span {kind} holds another movement: {100.0 * sizes[kind] / max(total, 1e-9):.0f} % of its "
        f"turning is {kind.replace('-', ' ')}; do that movement alone"
    )
