"""The hand's heading and mounting once the forearm's are known. Pure.

The wrist's stated angles in the pose (straight, where nothing is stated) hold against the forearm as it
really is, not against the forearm as the pose would have it. The hand's heading, without magnetometer, comes
from accelerations where the wrist was moved about (joint_centre.py); else from the nominal mounting, as for
any sensor.
"""

from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_centre import find_joint_centre
from brachium_fusion.joint_motion import SensorMotion, joint_motion

Floats = npt.NDArray[np.float64]

HEADING_SD = radians(10.0)
"""A heading that accelerations show no better than this is left to the nominal mounting."""


def wrist_heading(
    forearm: SensorMotion, hand: SensorMotion, spans: list[tuple[int, int]], time_s: float, rate_hz: float
) -> float | None:
    """Return the turn that brings the hand's world into the forearm's at time_s, or None if unseen."""
    centre = find_joint_centre(joint_motion(forearm, hand, spans, rate_hz))
    if centre is None or float(centre.headings_sd.min()) > HEADING_SD:
        return None
    return float(np.interp(time_s, centre.knots_s, centre.headings))


def hand_mounting(
    world_from_forearm: Floats, forearm_from_hand: Floats, world_from_sensor: Floats, heading: float
) -> Floats:
    """Return segment_from_sensor (4,) of the hand from the pose: forearm and wrist as they are, the sensor in
    its own world, and the heading that brings that into the common one."""
    world_from_hand = rotation.multiply(world_from_forearm, forearm_from_hand)
    turned = rotation.multiply(rotation.about(2, heading), world_from_sensor)
    return rotation.multiply(rotation.inverse(world_from_hand), turned)
