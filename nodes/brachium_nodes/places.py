"""Where on a segment a sensor is worn, by the name of the arrangement."""

from dataclasses import dataclass
from math import sqrt
from typing import Literal, get_args

from brachium_body.lengths import ArmLengths
from brachium_body.segments import Segment
from brachium_wire.messages import Quaternion, Vector

Arrangement = Literal["usual", "near-joints", "moved-away", "tracker"]
"""usual: upper arm lateral, 4 cm above the epicondyle; forearm dorsal, 3 cm above the wrist.
near-joints: 2 cm from elbow and wrist (Zhou 2008, 2.3.1).
moved-away: 10 cm from them; Zhou does not say how far his were moved.
tracker: upper arm 5 cm from the acromion, forearm on the palmar side, 1 cm from the wrist (Zhou, 2.3.2)."""
ARRANGEMENTS: tuple[Arrangement, ...] = get_args(Arrangement)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a sensor is worn."""

    part: str
    joint: str
    """The joint it is measured from."""
    lever: Vector
    """m in segment axes (X forward, Y proximal, Z right)."""
    mounting: Quaternion
    """Nominal segment_from_sensor: y along the segment, z off the skin."""


_SAME: Quaternion = (1.0, 0.0, 0.0, 0.0)
_HALF_TURN_ABOUT_Y: Quaternion = (0.0, 0.0, 1.0, 0.0)
_FRONT: Quaternion = (sqrt(0.5), 0.0, sqrt(0.5), 0.0)


def place(segment: Segment, lengths: ArmLengths, arrangement: Arrangement = "usual") -> Place:
    """Return where the sensor of a segment sits.

    Hand: dorsal, on the third metacarpal. Sternum: in front, 4 cm below the line of the shoulders.
    """
    if segment == "sternum":
        return Place("sternum", "chest", (0.10, -0.04, 0.0), _FRONT)
    part, side = segment[:-2], segment[-1]
    upper, fore = {
        "usual": (lengths.upper_arm - 0.04, lengths.forearm - 0.03),
        "near-joints": (lengths.upper_arm - 0.02, lengths.forearm - 0.02),
        "moved-away": (lengths.upper_arm - 0.10, lengths.forearm - 0.10),
        "tracker": (0.05, lengths.forearm - 0.01),
    }[arrangement]
    along, off, joint = {
        "upper_arm": (upper, 0.04, "shoulder"),
        "forearm": (fore, 0.03, "elbow"),
        "hand": (0.41 * lengths.hand, 0.02, "wrist"),
    }[part]
    medial = part == "forearm" and arrangement == "tracker"
    if (side == "r") != medial:
        return Place(part, joint, (0.0, -along, off), _SAME)
    return Place(part, joint, (0.0, -along, -off), _HALF_TURN_ABOUT_Y)
