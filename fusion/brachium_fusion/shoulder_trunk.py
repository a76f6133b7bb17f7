"""What a sensor on the sternum says of the shoulder: where the trunk carries it. Pure.

The trunk is taken as a rigid body that turns about the middle of the pelvis, which stays where it is: a
person who sits or stands. The shoulder's displacement is then the trunk's part and the girdle's; the sensors
on the arm show only their sum. The trunk's part is subtracted from what they measure, and the rest is
estimated as on a back held still.
"""

import numpy as np

from brachium_body import rotation
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side
from brachium_fusion.shoulder_model import Floats

PELVIS_BELOW = 0.25 / 0.129
"""Height of the shoulders above the middle of the pelvis over their half distance: body proportions."""


def shoulder_from_pelvis(lengths: ArmLengths, side: Side) -> Floats:
    """Return where a shoulder is from the middle of the pelvis, (3,) m in trunk axes (x right, z up)."""
    out = lengths.chest_to_shoulder
    return np.array([out if side == "right" else -out, 0.0, PELVIS_BELOW * out])


def trunk_velocity(world_from_sternum: Floats, rate: Floats, arm: Floats) -> Floats:
    """Return how fast the trunk carries a shoulder, (..., 3) m/s in world axes: with it the displacement that
    filter and smoother find is the girdle's.

    `world_from_sternum` (..., 4) is the sternum sensor's, in the heading of the arm's sensors; `rate`
    (..., 3) rad/s its gyroscope's without the bias; `arm` (3,) m from the middle of the pelvis to the
    shoulder, in the sensor's axes.
    """
    return rotation.rotate(world_from_sternum, np.cross(rate, arm))
