"""Skin between sensor and bone: it turns the sensor a little as the joints beside it move. Pure.

The turn is taken as proportional to the angles of the joints on both sides of the segment, one unknown vector
each (the model of Bonci, Camomilla, Dumas, Cheze, Cappozzo 2014, without its higher terms). The lever arm to
the nearer joint moves with the skin; what becomes wrong is where the sensor thinks the farther joint is, and
the axes of the elbow.
"""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_model import ArmModel, Floats

UPPER_JOINTS = 4
"""Elbow flexion, then the upper arm's turn since the start about its three axes."""
FOREARM_JOINTS = 2
"""Elbow flexion, pronation."""
UNKNOWNS = 3 * (UPPER_JOINTS + FOREARM_JOINTS)


@dataclass(frozen=True, slots=True, eq=False)
class Tissue:
    """How far the joints have moved since the start at k + 1 knots, rad."""

    upper: Floats
    """(k + 1, UPPER_JOINTS)."""
    forearm: Floats
    """(k + 1, FOREARM_JOINTS)."""

    @classmethod
    def at(
        cls, model: ArmModel, world_from_upper: Floats, world_from_forearm: Floats, start: Floats
    ) -> "Tissue":
        """Return it for sensors' orientations (k + 1, 4); `start` (2, 4) are theirs in the pose."""
        first = _joints(model, start[:1], start[1:])
        upper, flexion, pronation = _joints(model, world_from_upper, world_from_forearm)
        bent = rotation.wrap(flexion - first[1])
        turned = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(first[0]), upper))
        return cls(
            np.column_stack([bent, turned]), np.column_stack([bent, rotation.wrap(pronation - first[2])])
        )

    def velocity_by_tissue(self, model: ArmModel, world: Floats, rate: Floats, step_s: float) -> Floats:
        """Return (k, 3, UNKNOWNS): change over each interval of the shoulder's velocity, as the forearm's
        sensor has it, by the unknowns; `world` (k + 1, 3, 3) and `rate` (k + 1, 3) are the upper arm's
        sensor's."""
        k = len(rate)
        speed = np.gradient(self.upper, step_s, axis=0)
        moved = rotation.cross_matrix(rate)[:, None] * self.upper[..., None, None]
        moved = moved + speed[..., None, None] * np.eye(3)
        elbow = world[:, None] @ moved @ rotation.cross_matrix(model.elbow_from_shoulder)
        result = np.zeros((k - 1, 3, UNKNOWNS))
        result[:, :, : 3 * UPPER_JOINTS] = np.diff(elbow, axis=0).transpose(0, 2, 1, 3).reshape(k - 1, 3, -1)
        return result

    def spread(self, upper: Floats, forearm: Floats) -> Floats:
        """Return coefficients (k + 1, UNKNOWNS) from those (k + 1, 3) of each sensor's turn on its bone."""
        k = len(upper)
        return np.concatenate(
            [
                (self.upper[:, :, None] * upper[:, None]).reshape(k, -1),
                (self.forearm[:, :, None] * forearm[:, None]).reshape(k, -1),
            ],
            axis=1,
        )

    def turns(self, unknowns: Floats) -> Floats:
        """Return both sensors' turns on their bones (k + 1, 6), in sensor axes, for unknowns (UNKNOWNS,)."""
        cut = 3 * UPPER_JOINTS
        return np.concatenate(
            [self.upper @ unknowns[:cut].reshape(-1, 3), self.forearm @ unknowns[cut:].reshape(-1, 3)], axis=1
        )


def _joints(
    model: ArmModel, world_from_upper: Floats, world_from_forearm: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the upper arm's orientation (n, 4), elbow flexion and pronation (n,) rad."""
    upper = rotation.multiply(world_from_upper, model.sensor_from_upper_arm)
    forearm = rotation.multiply(world_from_forearm, model.sensor_from_forearm)
    elbow = rotation.to_matrix(rotation.multiply(rotation.inverse(upper), forearm))
    return upper, np.arctan2(-elbow[:, 0, 1], elbow[:, 1, 1]), np.arctan2(-elbow[:, 2, 0], elbow[:, 2, 2])
