"""What a sensor on the sternum says of the shoulder: where the trunk carries it. Pure.

The trunk is taken as a rigid body that turns about the middle of the pelvis, which stays where it is: a
person who sits or stands. The shoulder's displacement is then the trunk's part and the girdle's; the sensors
on the arm show only their sum. The trunk's part is subtracted from what they measure, and the rest is
estimated as on a back held still.
"""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side
from brachium_fusion.shoulder_model import Floats

PELVIS_BELOW = 0.25 / 0.129
"""Height of the shoulders above the middle of the pelvis over their half distance: body proportions."""


@dataclass(frozen=True, slots=True, eq=False)
class TrunkMotion:
    """What the trunk does to one shoulder; world axes."""

    place: Floats
    """(n, 3) m displacement of the shoulder since the start, the girdle still."""
    velocity: Floats
    """(n, 3) m/s: `trunk_velocity` of filter and smoother, whose displacement is then the girdle's."""


def shoulder_from_pelvis(lengths: ArmLengths, side: Side) -> Floats:
    """Return where a shoulder is from the middle of the pelvis, (3,) m in trunk axes (x right, z up)."""
    out = lengths.chest_to_shoulder
    return np.array([out if side == "right" else -out, 0.0, PELVIS_BELOW * out])


def trunk_motion(
    world_from_sternum: Floats,
    gyr: Floats,
    thorax_from_sensor: Floats,
    from_pelvis: Floats,
    start: slice,
) -> TrunkMotion:
    """Return the trunk's part of a shoulder's movement.

    `world_from_sternum` (n, 4) and `gyr` (n, 3) rad/s are the sternum sensor's, in the heading of the arm's
    sensors; `thorax_from_sensor` (4,) its mounting; `from_pelvis` (3,) m as `shoulder_from_pelvis` has it;
    the trunk is still in `start`, where the gyroscope's bias is taken and the displacement is 0.
    """
    sensor_from_trunk = rotation.inverse(rotation.multiply(TRUNK_FROM_THORAX, thorax_from_sensor))
    arm = rotation.rotate(sensor_from_trunk, from_pelvis)
    rate = gyr - gyr[start].mean(axis=0)
    place = rotation.rotate(world_from_sternum, np.broadcast_to(arm, rate.shape))
    velocity = rotation.rotate(world_from_sternum, np.cross(rate, arm))
    return TrunkMotion(place - place[start].mean(axis=0), velocity)
