"""Why an elbow's movement, or one span of it, cannot be used. Pure."""

from collections.abc import Sequence
from math import degrees

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_axes import JointAxes
from brachium_fusion.joint_motion import JointMotion
from brachium_fusion.segment_frames import ElbowFrames, elbow_angles, excursion_deg

Floats = npt.NDArray[np.float64]
ElbowSpan = tuple[str, int, int]
"""Kind, first row, end row (exclusive)."""

LEAST_FLEXION_DEG = 30.0
LEAST_PRONATION_DEG = 25.0
LEAST_LED_DEG = 20.0
"""Of the movement that a functional span is named for."""
UNEXPLAINED = 0.5
"""More of the joint's rate than this across both axes: it was another movement."""
PARALLEL_DEG = 35.0
"""A carrying angle beyond this is no elbow's."""
SHARE = 0.5
"""Of a functional movement's turning that must be about its own axis."""
ALONG = 0.3
"""Of the forearm's rate: an upper arm that turns faster in a functional movement is moved by the shoulder."""
ALONG_SD_DEG = 5.0
"""That does harm when the flexion axis is then not known better than this."""


def whole_reason(found: JointAxes, bent_deg: float) -> str | None:
    """Return why the elbow cannot be used at all, or None; `bent_deg` is the range of its flexion."""
    if bent_deg < LEAST_FLEXION_DEG:
        return (
            f"too little movement: the elbow bent by {bent_deg:.0f} deg, at least {LEAST_FLEXION_DEG:.0f} "
            "are needed; bend and straighten it"
        )
    if found.residual > UNEXPLAINED:
        return (
            f"movement about another axis: {100.0 * found.residual:.0f} % of the turning fits neither "
            "flexion nor pronation of an elbow; check that both sensors sit tight on one arm"
        )
    apart = 90.0 - abs(degrees(found.carrying))
    if apart < 90.0 - PARALLEL_DEG:
        return (
            f"axes too close to parallel: {apart:.0f} deg apart, an elbow's about 80; "
            "bend and straighten the elbow, then turn the forearm, one after the other"
        )
    return None


def span_reasons(
    motion: JointMotion,
    found: JointAxes,
    frames: ElbowFrames,
    spans: Sequence[ElbowSpan],
    rate_hz: float,
) -> dict[int, str]:
    """Return by their place in `spans` why functional movements are not what they are named for."""
    reasons = {}
    for place, (kind, first, end) in enumerate(spans):
        part = motion.part(first / rate_hz, end / rate_hz)
        if kind in ("elbow-flexion", "pronation") and len(part.time_s) > 1:
            reason = _span_reason(part, found, frames, kind)
            if reason is not None:
                reasons[place] = reason
    return reasons


def _span_reason(part: JointMotion, found: JointAxes, frames: ElbowFrames, kind: str) -> str | None:
    flexion, pronation = elbow_angles(part, found, frames, "right")
    range_deg = excursion_deg(flexion if kind == "elbow-flexion" else pronation)
    did = "the elbow bent" if kind == "elbow-flexion" else "the forearm turned"
    if range_deg < LEAST_LED_DEG:
        return f"too little movement: {did} by {range_deg:.0f} deg, at least {LEAST_LED_DEG:.0f} are needed"
    turn = rotation.to_matrix(rotation.about(2, found.heading_at(part.time_s)))
    joint = np.einsum("nij,nj->ni", turn, part.rate_b) - part.rate_a
    axis = (
        part.world_from_a @ frames.axis_upper
        if kind == "elbow-flexion"
        else np.einsum("nij,nj->ni", turn, part.world_from_b @ frames.axis_forearm)
    )
    about = np.einsum("ni,ni->n", joint, axis)
    share = float(about @ about) / max(1e-9, float(np.einsum("ni,ni->", joint, joint)))
    if share < SHARE:
        asked = "bending of the elbow" if kind == "elbow-flexion" else "turning of the forearm"
        return f"movement about another axis: {100.0 * share:.0f} % of it is {asked}; do that movement alone"
    along = float(np.linalg.norm(part.rate_a)) / max(1e-9, float(np.linalg.norm(part.rate_b)))
    if along > ALONG and degrees(found.axis_a_sd) > ALONG_SD_DEG:
        return (
            f"the shoulder moved along: the upper arm turned at {100.0 * along:.0f} % of the forearm's rate; "
            "hold the upper arm still against the body"
        )
    return None
