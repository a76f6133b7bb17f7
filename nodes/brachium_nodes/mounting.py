"""How a sensor is worn: where it sits, how far off it was put on, and how the skin moves it."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from brachium_body import rotation
from brachium_body.lengths import ArmLengths
from brachium_body.segments import Segment
from brachium_nodes.movement import Array, minimum_jerk
from brachium_nodes.person import NEUTRAL_S, TRANSITION_S, Person
from brachium_nodes.sensors import FIELD_UT, Errors, G, generator
from brachium_wire.messages import Quaternion, Vector

STEP_S = 0.001
"""Of the central differences that give acceleration and angular rate."""

_NEIGHBOURS = {
    "upper_arm": ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion"),
    "forearm": ("elbow_flexion", "forearm_pronation", "wrist_flexion"),
    "hand": ("wrist_flexion", "wrist_deviation"),
    "sternum": (),
}
"""Joints whose movement pulls the skin under a sensor."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a sensor is worn."""

    part: str
    joint: str
    """The joint it is measured from."""
    lever: Vector
    """m in segment axes (X forward, Y proximal, Z right), for a right arm."""
    mounting: Quaternion
    """Nominal segment_from_sensor."""


_SAME: Quaternion = (1.0, 0.0, 0.0, 0.0)
_HALF_TURN_ABOUT_Y: Quaternion = (0.0, 0.0, 1.0, 0.0)
_FRONT: Quaternion = (sqrt(0.5), 0.0, sqrt(0.5), 0.0)


def place(segment: Segment, lengths: ArmLengths) -> Place:
    """Return where the sensor of a segment sits: on the outer side, y along the segment, z off the skin.

    Upper arm: lateral, 4 cm above the epicondyle. Forearm: dorsal, 3 cm above the wrist. Hand: dorsal, on the
    third metacarpal. Sternum: in front, 4 cm below the line of the shoulders.
    """
    if segment == "sternum":
        return Place("sternum", "chest", (0.10, -0.04, 0.0), _FRONT)
    part, side = segment[:-2], segment[-1]
    along, off, joint = {
        "upper_arm": (lengths.upper_arm - 0.04, 0.04, "shoulder"),
        "forearm": (lengths.forearm - 0.03, 0.03, "elbow"),
        "hand": (0.41 * lengths.hand, 0.02, "wrist"),
    }[part]
    if side == "r":
        return Place(part, joint, (0.0, -along, off), _SAME)
    return Place(part, joint, (0.0, -along, -off), _HALF_TURN_ABOUT_Y)


@dataclass(frozen=True, slots=True, eq=False)
class Worn:
    """One sensor on one person."""

    segment: Segment
    place: Place
    placement: Array
    """segment_from_sensor as the strap was put on."""
    settling: Array
    """Rotation vector (3,) rad, in sensor axes, by which it settles as the exercise begins."""
    tissue: Array
    """One rotation vector (3,) rad in segment axes for each neighbouring joint."""

    @classmethod
    def put_on(cls, segment: Segment, person: Person, errors: Errors) -> "Worn":
        """Return the sensor of this segment, its errors drawn from the person's seed."""
        where = place(segment, person.lengths)
        random = generator(person.settings.seed, segment, "strap")
        off = rotation.from_rotation_vector(random_turn(errors.placement_deg, random))
        directions = random.standard_normal((len(_NEIGHBOURS[where.part]), 3))
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return cls(
            segment,
            where,
            placement=rotation.multiply(where.mounting, off),
            settling=random_turn(errors.settling_deg, random),
            tissue=unit * (errors.soft_tissue_deg * pi / 180.0),
        )

    def pose(self, t: Array, person: Person) -> tuple[Array, Array]:
        """Return world_from_sensor (n, 4) and the sensor's place in the world (n, 3) m at times (n,)."""
        if self.segment == "sternum":
            trunk = person.trunk(t)
            bone, joint, angles = trunk.world_from_thorax, trunk.chest, trunk.angles
        else:
            arm = person.arm(t, "right" if self.segment.endswith("_r") else "left")
            bone, joint, angles = arm.world_from[self.place.part], arm.joints[self.place.joint], arm.angles
        skin = bone
        if self.tissue.any():
            # sqrt(2) sin(angle / 2) is 0 in neutral, 1 at 90 deg, and still grows beyond.
            pull = np.stack(
                [sqrt(2.0) * np.sin(0.5 * angles[n]) for n in _NEIGHBOURS[self.place.part]], axis=-1
            )
            skin = rotation.multiply(bone, rotation.from_rotation_vector(pull @ self.tissue))
        q = rotation.multiply(skin, self.placement)
        if self.settling.any():
            begun = minimum_jerk((t - NEUTRAL_S) / TRANSITION_S)
            q = rotation.multiply(q, rotation.from_rotation_vector(begun[:, None] * self.settling))
        return q, joint + rotation.rotate(skin, np.array(self.place.lever))

    def truth(self, t: Array, person: Person) -> tuple[Array, Array, Array]:
        """Return specific force m/s^2, angular rate rad/s and field uT (n, 3), sensor axes, at times (n,)."""
        n = len(t)
        q, p = self.pose(np.concatenate([t - STEP_S, t, t + STEP_S]), person)
        acceleration = (p[2 * n :] - 2.0 * p[n : 2 * n] + p[:n]) / (STEP_S * STEP_S)
        acceleration[:, 2] += G
        sensor_from_world = rotation.inverse(q[n : 2 * n])
        turn = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(q[:n]), q[2 * n :]))
        return (
            rotation.rotate(sensor_from_world, acceleration),
            turn / (2.0 * STEP_S),
            rotation.rotate(sensor_from_world, FIELD_UT),
        )


def random_turn(degrees_rms: float, random: np.random.Generator) -> Array:
    """Return a rotation vector (3,) rad about any axis whose length has this root mean square in deg."""
    return degrees_rms * pi / 180.0 / sqrt(3.0) * random.standard_normal(3)
