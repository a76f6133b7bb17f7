"""From the axes of an elbow to the full axes of upper arm and forearm: signs and zeros. Pure.

Movement shows two lines and the heading between the sensors; what else is needed comes from here:

* Signs. The forearm's axis points to the elbow, the flexion axis to the subject's right (for both arms, as Z
  of every segment does). Each of the four choices is judged by gravity in the pose, by the elbow's plausible
  range over the whole movement, and by the nominal mounting where one is known.
* Level. While the upper arm hangs its flexion axis is level: one that movement shows but roughly gives way.
* Zero of flexion. Turning the upper arm's axes about its flexion axis changes nothing that the joint shows.
  Three things are weighed: what the pose states (n-pose: straight), gravity along the hanging upper arm
  against the forearm's turning axis, and that no elbow bends far backwards in all the movement. The pose
  `table` or `given` is believed almost alone. So a bent elbow does not read straight because someone called
  it a pose.
* Zero of pronation. Rests on the pose alone: `n-pose` palms at the thighs, `table` thumb up, `given` as
  given; the flexion axis, seen from the forearm in the pose, is where that pronation puts it.
"""

from dataclasses import dataclass, replace
from itertools import product
from math import cos, degrees, radians, sin

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import Side
from brachium_fusion.joint_axes import JointAxes
from brachium_fusion.joint_motion import JointMotion

Floats = npt.NDArray[np.float64]

STRAIGHTEST = radians(-5.0)
"""Few elbows bend back further; a movement that seems to, moves the zero."""
STRAIGHTEST_SD = radians(3.0)
MOST_BENT = radians(155.0)
VERTICAL_SD = radians(7.0)
"""Of the hanging upper arm, and of the turning axis as the forearm's long axis."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElbowPose:
    """The elbow in the pose, as told and as the sensors stand."""

    upper_sensor: Floats
    """world_from_sensor (4,) while the pose was held."""
    forearm_sensor: Floats
    time_s: float
    flexion: float
    """rad, as stated by the pose, and how far that is to be believed."""
    flexion_sd: float
    pronation: float
    hanging: bool
    """The upper arm hangs: gravity runs along it."""
    hanging_forearm: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElbowFrames:
    """Where the sensors sit on their segments; angles rad."""

    axis_upper: Floats
    """Flexion axis (3,) in the upper-arm sensor, to the subject's right."""
    axis_forearm: Floats
    """Pronation axis (3,) in the forearm sensor, to the elbow."""
    upper_from_sensor: Floats
    forearm_from_sensor: Floats
    carrying: float
    """Valgus negative, on either side."""
    pose_flexion: float
    merit: float
    """How well signs agree with gravity, range and mounting, as squares of standard deviations."""


def elbow_frames(
    motion: JointMotion,
    found: JointAxes,
    pose: ElbowPose,
    side: Side,
    nominal_upper: Floats | None = None,
    nominal_forearm: Floats | None = None,
) -> ElbowFrames:
    """Return the axes of both segments. `nominal_...` are segment_from_sensor (4,) as told, if known."""
    choices = (
        _frames(motion, found, pose, side, sign_a * _levelled(found, pose), sign_b * found.axis_b)
        for sign_a, sign_b in product((1.0, -1.0), repeat=2)
    )
    judged = [
        replace(
            f,
            merit=_merit(
                motion, f, pose, elbow_angles(motion, found, f, side)[0], nominal_upper, nominal_forearm
            ),
        )
        for f in choices
    ]
    return max(judged, key=lambda frames: frames.merit)


def _levelled(found: JointAxes, pose: ElbowPose) -> Floats:
    """Return the flexion axis, which is level while the upper arm hangs, by the weights of both findings."""
    if not pose.hanging:
        return found.axis_a
    up = rotation.rotate(rotation.inverse(pose.upper_sensor), np.array([0.0, 0.0, 1.0]))
    weight = found.axis_a_sd**2 / (found.axis_a_sd**2 + VERTICAL_SD**2)
    axis = found.axis_a - weight * float(found.axis_a @ up) * up
    levelled: Floats = axis / np.linalg.norm(axis)
    return levelled


def _frames(
    motion: JointMotion, found: JointAxes, pose: ElbowPose, side: Side, axis_a: Floats, axis_b: Floats
) -> ElbowFrames:
    turn = rotation.about(2, float(found.heading_at(pose.time_s)))
    upper_from_forearm = rotation.multiply(
        rotation.inverse(pose.upper_sensor), rotation.multiply(turn, pose.forearm_sensor)
    )
    forearm_axis = rotation.rotate(upper_from_forearm, axis_b)
    y0, x0 = _beside(axis_a, forearm_axis)
    along = _relative(motion, found) @ axis_b
    beyond = np.arctan2(-(along @ x0), along @ y0)  # flexion beyond that of the pose
    flexion = _flexion_in_pose(pose, y0, x0, beyond, found.axis_b_sd)
    if pose.hanging:
        # the upper arm leans and the turning axis lies beside the forearm's length, each by its own doubt
        share = found.axis_b_sd**2 / (found.axis_b_sd**2 + VERTICAL_SD**2)
        beside = share * (flexion - _flexion_if_vertical(pose, y0, x0))
        flexion_axis = rotation.rotate(rotation.inverse(upper_from_forearm), axis_a)
        axis_b = rotation.rotate(rotation.from_rotation_vector(beside * flexion_axis), axis_b)
        y0, x0 = _beside(axis_a, rotation.rotate(upper_from_forearm, axis_b))
        along = _relative(motion, found) @ axis_b
    y = cos(flexion) * y0 + sin(flexion) * x0
    upper_from_sensor = rotation.from_matrix(np.stack([np.cross(y, axis_a), y, axis_a]))
    seen = rotation.rotate(rotation.inverse(upper_from_forearm), axis_a)
    z0, x1 = _beside(axis_b, seen)
    pronation = pose.pronation if side == "right" else -pose.pronation
    # in the forearm the flexion axis lies at Y(-pronation) Z: turn it back
    z = cos(pronation) * z0 + sin(pronation) * -x1
    forearm_from_sensor = rotation.from_matrix(np.stack([np.cross(axis_b, z), axis_b, z]))
    carrying = float(np.arcsin(np.clip(np.median(along @ axis_a), -1.0, 1.0)))
    return ElbowFrames(
        axis_upper=axis_a,
        axis_forearm=axis_b,
        upper_from_sensor=upper_from_sensor,
        forearm_from_sensor=forearm_from_sensor,
        carrying=carrying if side == "right" else -carrying,
        pose_flexion=flexion,
        merit=0.0,
    )


def elbow_angles(
    motion: JointMotion, found: JointAxes, frames: ElbowFrames, side: Side
) -> tuple[Floats, Floats]:
    """Return flexion and pronation (n,) rad over a movement."""
    upper, forearm = (rotation.to_matrix(q) for q in (frames.upper_from_sensor, frames.forearm_from_sensor))
    joint = upper @ _relative(motion, found) @ forearm.T
    flexion = np.arctan2(-joint[:, 0, 1], joint[:, 1, 1])
    turned = np.arctan2(-joint[:, 2, 0], joint[:, 2, 2])
    return flexion, turned if side == "right" else -turned


def _relative(motion: JointMotion, found: JointAxes) -> Floats:
    """Return upper-arm sensor from forearm sensor (n, 3, 3)."""
    turns = rotation.to_matrix(rotation.about(2, found.heading_at(motion.time_s)))
    relative: Floats = np.swapaxes(motion.world_from_a, 1, 2) @ turns @ motion.world_from_b
    return relative


def _beside(axis: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Return `direction` made square to `axis`, and the third direction: (first, first x axis)."""
    first = direction - (direction @ axis) * axis
    length = float(np.linalg.norm(first))
    if length < 1e-6:
        first = np.linalg.svd(axis[None])[2][1]
        length = 1.0
    first = first / length
    return first, np.cross(first, axis)


def _flexion_in_pose(pose: ElbowPose, y0: Floats, x0: Floats, beyond: Floats, axis_b_sd: float) -> float:
    """Return the flexion held in the pose: the weighted mean of what is known of it."""
    values, weights = [pose.flexion], [pose.flexion_sd**-2]
    if pose.hanging:
        seen = _flexion_if_vertical(pose, y0, x0)
        sd = float(np.hypot(VERTICAL_SD, axis_b_sd))
        # far from what the pose states, the statement is doubted: it was not held
        doubt = max(0.0, abs(seen - pose.flexion) / np.hypot(sd, pose.flexion_sd) - 2.0)
        weights[0] /= (1.0 + doubt) ** 4
        values.append(seen)
        weights.append(sd**-2)
    flexion = float(np.average(values, weights=weights))
    short = STRAIGHTEST - (flexion + float(np.percentile(beyond, 1.0)))
    if short > 0.0:
        weight = STRAIGHTEST_SD**-2
        flexion += short * weight / (weight + sum(weights))
    return flexion


def _flexion_if_vertical(pose: ElbowPose, y0: Floats, x0: Floats) -> float:
    """Return the flexion held in the pose if the upper arm is vertical in it."""
    up = rotation.rotate(rotation.inverse(pose.upper_sensor), np.array([0.0, 0.0, 1.0]))
    return float(np.arctan2(up @ x0, up @ y0))


def _merit(
    motion: JointMotion,
    frames: ElbowFrames,
    pose: ElbowPose,
    flexion: Floats,
    nominal_upper: Floats | None,
    nominal_forearm: Floats | None,
) -> float:
    """Return how well signs agree with gravity, range and mounting."""
    up = np.array([0.0, 0.0, 1.0])
    strained = (frames.pose_flexion - pose.flexion) / pose.flexion_sd
    low, high = np.percentile(flexion, [1.0, 99.0])
    beyond = max(0.0, STRAIGHTEST - float(low), float(high) - MOST_BENT) / STRAIGHTEST_SD
    merit = -min(25.0, strained**2) - min(25.0, beyond**2)
    y = rotation.rotate(rotation.inverse(frames.upper_from_sensor), np.array([0.0, 1.0, 0.0]))
    merit += 20.0 * float(rotation.rotate(pose.upper_sensor, y) @ up)
    if pose.hanging_forearm:
        merit += 20.0 * float(rotation.rotate(pose.forearm_sensor, frames.axis_forearm) @ up)
    merit += 2.0 * float(np.mean(motion.world_from_b[:, 2] @ frames.axis_forearm))
    if nominal_upper is not None:
        merit += 5.0 * float(rotation.rotate(nominal_upper, frames.axis_upper)[2])
    if nominal_forearm is not None:
        merit += 5.0 * float(rotation.rotate(nominal_forearm, frames.axis_forearm)[1])
    return merit


def excursion_deg(angle: Floats) -> float:
    """Return the range in deg that 90 % of the angles (n,) rad cover, turns counted on."""
    low, high = np.percentile(np.unwrap(angle), [5.0, 95.0])
    return degrees(float(high - low))
