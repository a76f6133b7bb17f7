"""Paths of the wrist on a desk: from a path to the joint angles of an arm whose elbow hangs by its weight.

Coordinates are a right arm's, from the shoulder: right, forward, up; a left arm does the mirror image.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_body.angles import INDEX, joint_angles
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.lengths import FRACTION_OF_HEIGHT
from brachium_nodes.motions import ANGLES, DEG, Build, Posture
from brachium_nodes.movement import Array, Variation, minimum_jerk

RADIUS_M = 0.1
RECTANGLE_M = (0.2, 0.14)
"""To the right, and forward (Zhou 2008, 2.3.1)."""

_MIDDLE: Array = np.array([-0.05, 0.38, -0.22])
"""Middle of the path from the shoulder for a person of 1.80 m: seated at a desk of 0.75 m."""
_ELBOW_WAY: Array = np.array([0.5, 0.0, -1.0])
"""The elbow hangs down and a little outward."""

Path = Callable[[Array, Variation], Array]


@dataclass(frozen=True, slots=True)
class OnDesk:
    """The wrist follows a level path on the desk, the palm turned down, the wrist straight."""

    path: Path
    pronation_deg: float = 70.0

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:
        """Return the posture at times (n,) s."""
        lengths, zero = build.lengths, np.zeros(len(t))
        scale = lengths.upper_arm / (FRACTION_OF_HEIGHT["upper_arm"] * 1.80)
        wrist = _MIDDLE * scale + np.concatenate([self.path(t, variation), zero[:, None]], axis=1)
        shoulder, elbow_flexion = reach(wrist, build)
        angles: dict[str, Array] = dict.fromkeys(ANGLES, zero)
        angles.update(zip(ANGLES[:3], shoulder.T, strict=True))
        angles["elbow_flexion"] = elbow_flexion
        angles["forearm_pronation"] = np.full(len(t), self.pronation_deg * DEG)
        return Posture(angles, np.zeros((len(t), 3)))


def circle(t: Array, variation: Variation) -> Array:
    """Return points (n, 2) m on a circle, a round in about 4 s; its radius wanders by 2 %."""
    turn = 2.0 * np.pi * t / 4.0 + 0.05 * variation.wander("pace", t, 0.02, 0.15)
    radius = RADIUS_M * (1.0 + 0.01 * variation.wander("radius", t, 0.02, 0.2))
    points: Array = radius[:, None] * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
    return points


def rectangle(t: Array, variation: Variation) -> Array:
    """Return points (n, 2) m on a rectangle, a round in about 8 s, with a stop in every corner."""
    _, fraction = variation.repetitions(t, 8.0)
    there = [minimum_jerk((4.0 * fraction - side) / 0.95) for side in range(4)]
    width, depth = RECTANGLE_M
    x = width * (there[0] - there[2] - 0.5)
    y = depth * (0.5 - there[1] + there[3])
    return np.stack([x, y], axis=-1)


def reach(wrist: Array, build: Build) -> tuple[Array, Array]:
    """Return clinical shoulder angles (n, 3) and elbow flexion (n,), rad, that bring a right wrist to
    (n, 3) m from the shoulder, in trunk axes. Points out of reach give NaN."""
    upper, fore = build.lengths.upper_arm, build.lengths.forearm
    distance = np.sqrt((wrist * wrist).sum(axis=1))
    toward = wrist / distance[:, None]
    aside = _unit(_ELBOW_WAY - toward * (toward @ _ELBOW_WAY)[:, None])
    cosine = (upper**2 + distance**2 - fore**2) / (2.0 * upper * distance)
    along = cosine[:, None] * toward + np.sqrt(1.0 - cosine**2)[:, None] * aside
    y_upper = -along
    y_fore = -(wrist - upper * along) / fore
    across = y_fore - y_upper * (y_fore * y_upper).sum(axis=1)[:, None]
    tilt = (np.sin(build.carrying) / np.sqrt((across * across).sum(axis=1)))[:, None]
    # The upper arm's Z is turned out of the plane of the arm so far that the forearm's Y leans by `carrying`.
    z_upper = tilt * _unit(across) + np.sqrt(1.0 - tilt**2) * _unit(np.cross(y_upper, y_fore))
    x_upper = np.cross(y_upper, z_upper)
    trunk_from_upper_arm = rotation.from_matrix(np.stack([x_upper, y_upper, z_upper], axis=-1))
    unknown = np.full((len(wrist), 4), np.nan)
    angles = joint_angles(
        rotation.multiply(rotation.inverse(TRUNK_FROM_THORAX), trunk_from_upper_arm),
        unknown,
        unknown,
        "right",
    )
    first = INDEX["shoulder_flexion"]
    flexion = np.arctan2(-(y_fore * x_upper).sum(axis=1), (y_fore * y_upper).sum(axis=1))
    return angles[:, first : first + 3], flexion


def _unit(v: Array) -> Array:
    unit: Array = v / np.sqrt((v * v).sum(axis=1))[:, None]
    return unit
