"""The rigid segments that can carry a sensor, and the sides of the body. Names are those on the wire."""

from typing import Literal, get_args

Side = Literal["right", "left"]
Part = Literal["sternum", "upper_arm", "forearm", "hand"]
Segment = Literal["sternum", "upper_arm_r", "forearm_r", "hand_r", "upper_arm_l", "forearm_l", "hand_l"]

SIDES: tuple[Side, ...] = get_args(Side)
SEGMENTS: tuple[Segment, ...] = get_args(Segment)
ARM_PARTS: tuple[Part, ...] = ("upper_arm", "forearm", "hand")

_SUFFIX: dict[Side, str] = {"right": "_r", "left": "_l"}


def suffix(side: Side) -> str:
    """Return the ending of names that belong to one side: `_r` or `_l`."""
    return _SUFFIX[side]


def arm_segments(side: Side) -> tuple[Segment, Segment, Segment]:
    """Return upper arm, forearm and hand of one side, from the shoulder outwards."""
    if side == "right":
        return ("upper_arm_r", "forearm_r", "hand_r")
    return ("upper_arm_l", "forearm_l", "hand_l")


def side_of(segment: str) -> Side | None:
    """Return the side a segment belongs to, or None for the sternum."""
    if segment.endswith("_r"):
        return "right"
    if segment.endswith("_l"):
        return "left"
    return None


def part_of(segment: str) -> str:
    """Return the segment's name without its side: `forearm` for `forearm_l`."""
    return segment[:-2] if side_of(segment) else segment
