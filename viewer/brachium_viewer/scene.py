"""What the live view draws: messages in, named drawings out. Knows no network, no clock and no viewer.

The picture is in metres, z up, x to the subject's right, y forward, the floor at z = 0. Every subject stands
at its own place on the x axis and faces forward, whatever its heading in the room; a leaning trunk is drawn
leaning. What is not known is not drawn, and what is doubtful is grey.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from brachium_body import rotation
from brachium_body.ranges import REFERENCE
from brachium_body.segments import SEGMENTS, part_of
from brachium_viewer.drawings import Arm, Capsules, Colour, Degrees, Drawing, Floats, Lane
from brachium_wire.messages import Quality, Skeleton

CHEST_HEIGHT = 1.38
"""m above the floor, for a figure of about 1.75 m: the view shows a pose, not a body's height."""
HIP = np.array([0.0, 0.0, -0.46])
"""Where a leaning trunk turns, in trunk axes."""
SPACING = 1.5
"""m between subjects."""

# Okabe and Ito's palette: told apart with every common colour blindness, and in order of brightness too.
ORANGE, SKY, GREEN, YELLOW = (230, 159, 0, 255), (86, 180, 233, 255), (0, 158, 115, 255), (240, 228, 66, 255)
BLUE, VERMILION, PURPLE, GREY = (
    (0, 114, 178, 255),
    (213, 94, 0, 255),
    (204, 121, 167, 255),
    (150, 150, 155, 255),
)
BODY: Colour = (98, 104, 112, 255)
TRUTH: Colour = (255, 255, 255, 130)
JOINT: Colour = (236, 238, 240, 255)
PART_COLOUR: Mapping[str, Colour] = {"upper_arm": ORANGE, "forearm": SKY, "hand": GREEN}
ARM_COLOUR: Mapping[str, Colour] = {
    "light blue": SKY,
    "orange": ORANGE,
    "green": GREEN,
    "pink": PURPLE,
    "yellow": YELLOW,
    "red": VERMILION,
}
"""The line of each arm in the plots, in order of appearance."""

QUALITY_COLOUR: Mapping[str, Colour] = {
    "good": BLUE,
    "held": ORANGE,
    "missing": (60, 60, 64, 255),
    "disturbed": VERMILION,
    "uncalibrated": YELLOW,
    "heading_assumed": SKY,
    "assumed": PURPLE,
    "silent": (30, 30, 32, 255),
}
"""`silent` is the view's own word: no skeleton arrives."""
_SOLID: frozenset[Quality] = frozenset(("good", "heading_assumed", "uncalibrated", "disturbed"))
"""Qualities whose orientation is a measurement of now; the others are drawn grey."""

_BONES = (
    ("upper_arm", "shoulder", "elbow", 0.042),
    ("forearm", "elbow", "wrist", 0.034),
    ("hand", "wrist", "hand", 0.030),
)
_JOINT_RADIUS = {"shoulder": 0.052, "elbow": 0.043, "wrist": 0.035}
# The figure, in trunk axes: two ends and a radius, m.
_TORSO = (
    ((-0.045, -0.03, -0.36), (-0.065, -0.03, -0.13), 0.115),
    ((0.045, -0.03, -0.36), (0.065, -0.03, -0.13), 0.115),
    ((-0.07, -0.03, -0.46), (0.07, -0.03, -0.46), 0.098),
    ((-0.16, -0.01, -0.01), (0.16, -0.01, -0.01), 0.052),
    ((0.0, -0.02, 0.0), (0.0, 0.0, 0.12), 0.048),
    ((0.0, 0.015, 0.20), (0.0, 0.005, 0.25), 0.085),
)
_LEGS = (
    ((-0.09, -0.03, -0.54), (-0.10, -0.01, -1.28), 0.068),
    ((0.09, -0.03, -0.54), (0.10, -0.01, -1.28), 0.068),
    ((-0.10, -0.01, -1.34), (-0.11, 0.12, -1.34), 0.035),
    ((0.10, -0.01, -1.34), (0.11, 0.12, -1.34), 0.035),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """One angle's plot: its column, its title and its AAOS reference range in degrees."""

    angle: str
    title: str
    low: float
    high: float


def _plot(angle: str, title: str) -> Plot:
    low, high = REFERENCE[angle]
    assert low is not None, angle
    assert high is not None, angle
    return Plot(angle=angle, title=title, low=low, high=high)


PLOTS = (
    _plot("elbow_flexion", "Elbow flexion"),
    _plot("forearm_pronation", "Forearm: pronation +, supination −"),
    _plot("shoulder_flexion", "Shoulder: flexion +, extension −"),
    _plot("shoulder_abduction", "Shoulder abduction"),
    _plot("shoulder_rotation", "Shoulder: internal +, external −"),
    _plot("wrist_flexion", "Wrist: flexion +, extension −"),
    _plot("wrist_deviation", "Wrist: ulnar +, radial −"),
)


def draw_arm(skeleton: Skeleton, place: float, *, truth: bool = False) -> Capsules:
    """Return the arm of one skeleton as bones and joints, for a subject who stands at x = `place` m.

    Bones run between the positions that the skeleton has, so their lengths are the measured ones. A segment
    whose quality is no measurement of now is grey; with `truth` all is pale and translucent.
    """
    suffix = "_r" if skeleton.side == "right" else "_l"
    rows: list[tuple[tuple[float, ...], tuple[float, ...], float, Colour]] = []
    for part, near, far, radius in _BONES:
        start, end = skeleton.positions.get(near), skeleton.positions.get(far)
        if start is None or end is None:
            continue
        pose = skeleton.segments.get(part + suffix)
        known = pose is not None and pose.quality in _SOLID and near not in skeleton.assumed
        rows.append((start, end, radius, PART_COLOUR[part] if known else GREY))
        if near in _JOINT_RADIUS:
            rows.append((start, start, _JOINT_RADIUS[near], JOINT))
    if truth:
        rows = [(start, end, 0.8 * radius, TRUTH) for start, end, radius, _ in rows]
    return _capsules(rows, skeleton, place)


def hand_in_picture(skeleton: Skeleton, place: float) -> Floats | None:
    """Return where the hand (without one, the wrist) is drawn, (3,) m; None when that is not measured now."""
    at = skeleton.positions.get("hand", skeleton.positions.get("wrist"))
    poses = [pose for name, pose in skeleton.segments.items() if part_of(name) in PART_COLOUR]
    if at is None or not all(pose.quality in _SOLID for pose in poses):
        return None
    point: Floats = _capsules([(at, at, 0.0, JOINT)], skeleton, place).starts[0]
    return point


def draw_body(skeleton: Skeleton | None, place: float) -> Capsules:
    """Return torso, neck, head and legs of the figure at x = `place` m; the trunk leans as it does."""
    trunk = _capsules([(*row, BODY) for row in _TORSO], skeleton, place)
    legs = _capsules([(*row, BODY) for row in _LEGS], None, place)
    return Capsules(
        starts=np.concatenate([trunk.starts, legs.starts]),
        ends=np.concatenate([trunk.ends, legs.ends]),
        radii=np.concatenate([trunk.radii, legs.radii]),
        colours=np.concatenate([trunk.colours, legs.colours]),
    )


def lean(skeleton: Skeleton) -> Floats:
    """Return the trunk's tilt (4,): picture from trunk, without heading, so that the figure faces forward."""
    world_from_trunk = rotation.inverse(skeleton.trunk_from_world)
    return rotation.multiply(rotation.about(2, -rotation.heading(world_from_trunk)), world_from_trunk)


def angles_deg(skeleton: Skeleton) -> dict[str, Degrees]:
    """Return every plotted angle in degrees by its column name; one the skeleton does not have is None."""
    known = skeleton.angles
    return {p.angle: Degrees(math.degrees(known[p.angle]) if p.angle in known else None) for p in PLOTS}


def place_of(number: int) -> float:
    """Return the x, in m, at which the subject that appeared as `number` (from 0) stands.

    Who looks at people's faces has their left on the right: so the first is the leftmost of the picture.
    """
    return -SPACING * number


def line_colours(arms: Iterable[Arm]) -> dict[tuple[str, str], str]:
    """Return the name of the line's colour of each (subject, side); the seventh looks like the first."""
    people = dict.fromkeys((arm.subject, arm.side) for arm in arms)
    return dict(zip(people, cycle(ARM_COLOUR), strict=False))


def draw_skeleton(
    subject: str, skeleton: Skeleton, place: float, *, truth: bool = False
) -> dict[str, Drawing]:
    """Return all drawings of one skeleton by their paths.

    world/<subject>/<side>[_truth]                        the arm
    angles/<angle>/<actual|estimate>/<subject>_<side>     degrees; `actual` is the truth
    quality/<subject>/<segment>                           not for the truth
    """
    line = Arm(subject, skeleton.side, truth).path
    side = skeleton.side + ("_truth" if truth else "")
    out: dict[str, Drawing] = {f"world/{subject}/{side}": draw_arm(skeleton, place, truth=truth)}
    out.update({f"angles/{angle}/{line}": value for angle, value in angles_deg(skeleton).items()})
    if not truth:
        for segment, pose in skeleton.segments.items():
            if segment in SEGMENTS:
                out[f"quality/{subject}/{segment}"] = Lane(pose.quality)
    return out


def draw_silence(
    subject: str, skeleton: Skeleton, place: float, *, truth: bool = False
) -> dict[str, Drawing]:
    """Return what is shown once a stream has stopped: its last pose in grey, lines broken, lanes silent."""
    drawings = draw_skeleton(subject, skeleton, place, truth=truth)
    for path, drawing in drawings.items():
        if isinstance(drawing, Capsules):
            colours = np.tile(np.array(TRUTH if truth else GREY, dtype=np.uint8), (len(drawing.colours), 1))
            drawings[path] = Capsules(drawing.starts, drawing.ends, drawing.radii, colours)
        elif isinstance(drawing, Degrees):
            drawings[path] = Degrees(None)
        elif isinstance(drawing, Lane):
            drawings[path] = Lane("silent")
    return drawings


def _capsules(
    rows: Iterable[tuple[tuple[float, ...], tuple[float, ...], float, Colour]],
    skeleton: Skeleton | None,
    place: float,
) -> Capsules:
    rows = list(rows)
    starts = np.array([row[0] for row in rows], dtype=np.float64).reshape(-1, 3)
    ends = np.array([row[1] for row in rows], dtype=np.float64).reshape(-1, 3)
    if skeleton is not None:
        tilt = lean(skeleton)
        starts, ends = (HIP + rotation.rotate(tilt, points - HIP) for points in (starts, ends))
    chest = np.array([place, 0.0, CHEST_HEIGHT])
    return Capsules(
        starts=starts + chest,
        ends=ends + chest,
        radii=np.array([row[2] for row in rows], dtype=np.float64),
        colours=np.array([row[3] for row in rows], dtype=np.uint8).reshape(-1, 4),
    )
