"""A pose taken from movement alone, for an arm that held none. Pure.

What no pose states is taken from the range of the joint: the straightest elbow seen stands for 5 deg, the
middle of the pronation seen for 0. That is right for an arm that used its whole range and off by as much as
it did not; whoever uses it is warned.
"""

from collections.abc import Sequence
from math import degrees, radians
from typing import NamedTuple

import numpy as np

from brachium_body import rotation
from brachium_fusion.elbow_alignment import ElbowSensors, fit_elbow
from brachium_fusion.elbow_refusals import ElbowSpan
from brachium_fusion.joint_axes import FEWEST_ROWS
from brachium_fusion.joint_motion import joint_motion
from brachium_fusion.segment_frames import ElbowPose, elbow_angles

STRAIGHTEST = radians(5.0)
UNKNOWN_SD = radians(60.0)


class FreePose(NamedTuple):
    """One instant of the movement, and the elbow in it."""

    row: int
    elbow_flexion_deg: float
    forearm_pronation_deg: float


def pose_from_movement(sensors: ElbowSensors, spans: Sequence[ElbowSpan], rate_hz: float) -> FreePose | str:
    """Return the instant at which the arm stood as it mostly did, and its angles; or why there is none."""
    motion = joint_motion(sensors.upper, sensors.forearm, [(first, end) for _, first, end in spans], rate_hz)
    if len(motion.time_s) < FEWEST_ROWS:
        return "too few samples of upper arm and forearm together in the spans: at least 2 s are needed"
    up_a, up_b = motion.world_from_a[:, 2], motion.world_from_b[:, 2]
    usual = up_a @ np.median(up_a, axis=0) + up_b @ np.median(up_b, axis=0)
    place = int(np.argmax(usual))
    fitted = fit_elbow(
        sensors,
        ElbowPose(
            upper_sensor=rotation.from_matrix(motion.world_from_a[place]),
            forearm_sensor=rotation.from_matrix(motion.world_from_b[place]),
            time_s=float(motion.time_s[place]),
            flexion=0.0,
            flexion_sd=UNKNOWN_SD,
            pronation=0.0,
            hanging=False,
            hanging_forearm=False,
        ),
        spans,
        rate_hz,
    )
    if isinstance(fitted, str):
        return fitted
    flexion, pronation = elbow_angles(motion, fitted.found, fitted.frames, sensors.side)
    straightest = float(np.percentile(flexion, 1.0))
    middle = 0.5 * float(np.sum(np.percentile(np.unwrap(pronation), [2.0, 98.0])))
    return FreePose(
        round(float(motion.time_s[place]) * rate_hz),
        degrees(fitted.frames.pose_flexion + STRAIGHTEST - straightest),
        -degrees(middle),
    )
