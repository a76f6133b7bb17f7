"""How a sensor is worn: where it sits, how far off it was put on, and how the skin moves it."""

from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_nodes import tissue
from brachium_nodes.magnetism import Surroundings
from brachium_nodes.movement import Array, Variation, minimum_jerk
from brachium_nodes.person import TRANSITION_S, Person
from brachium_nodes.places import Place, place
from brachium_nodes.sensors import FIELD_UT, GRAVITY, Errors, generator
from brachium_nodes.wearing import TURNS, Wearing
from brachium_wire.messages import Quaternion

STEP_S = 0.001
"""Of the central differences that give acceleration and angular rate."""
SLIP_S = 0.3
"""How long a strap takes to slip."""

DEFAULT_WEARING = Wearing()
UNDISTURBED = Surroundings()


@dataclass(frozen=True, slots=True, eq=False)
class Worn:
    """One sensor on one person."""

    segment: Segment
    """The segment that the node is named for."""
    seat: Segment
    """The segment that it sits on."""
    nominal: Quaternion
    """segment_from_sensor (4,) that the node's name stands for."""
    place: Place
    placement: Array
    """segment_from_sensor as the strap was put on; of the seat."""
    settling: Array
    """Rotation vector (3,) rad, in sensor axes, by which it settles as movement begins."""
    stand_s: float
    """When movement begins."""
    tissue: Array
    """One rotation vector (3,) rad in segment axes for each neighbouring joint."""
    lag: float
    """Turn about the segment's Y over the angle of `tissue.LAGS`: how skin fails to follow rotation."""
    slip: Array
    """Rotation vector (3,) rad, in sensor axes, by which the strap slips."""
    slip_s: float
    """When it begins to slip."""
    surroundings: Surroundings
    seed: int

    @classmethod
    def put_on(
        cls,
        segment: Segment,
        person: Person,
        errors: Errors,
        wearing: Wearing = DEFAULT_WEARING,
        surroundings: Surroundings = UNDISTURBED,
        slip_s: float = inf,
    ) -> "Worn":
        """Return the sensor of this segment, its errors drawn from the person's seed."""
        seed, seat = person.settings.seed, wearing.seats.get(segment, segment)
        where = place(seat, person.lengths, wearing.arrangement)
        random = generator(seed, segment, "strap")
        off = rotation.from_rotation_vector(random_turn(errors.placement_deg, random))
        directions = random.standard_normal((len(tissue.NEIGHBOURS[where.part]), 3))
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        turned = np.array(TURNS[wearing.turned[segment]]) if segment in wearing.turned else rotation.IDENTITY
        placement = rotation.multiply(rotation.multiply(where.mounting, turned), off)
        outward = -1.0 if seat.endswith("_l") else 1.0
        lag = {"upper_arm": errors.humeral_lag, "forearm": errors.pronation_lag}.get(where.part, 0.0)
        slipping = generator(seed, segment, "slip").standard_normal(3)
        return cls(
            segment,
            seat,
            nominal=place(segment, person.lengths, wearing.arrangement).mounting,
            place=where,
            placement=np.array(wearing.mounting[segment]) if segment in wearing.mounting else placement,
            settling=random_turn(errors.settling_deg, random),
            stand_s=person.settings.stand_s,
            tissue=unit * (errors.soft_tissue_deg * pi / 180.0),
            lag=-outward * lag,
            slip=errors.slip_deg * pi / 180.0 * slipping / np.linalg.norm(slipping),
            slip_s=slip_s,
            surroundings=surroundings,
            seed=seed,
        )

    def truth(self, t: Array, period_s: float, person: Person) -> tuple[Array, Array, Array]:
        """Return specific force m/s^2, angular rate rad/s and field uT (n, 3) in sensor axes.

        The times t (n,) are `period_s` apart.
        """
        n = len(t)
        around = np.concatenate([t - STEP_S, t, t + STEP_S])
        q, p = self.pose(around, person, self._wobble(t, period_s, person))
        sensor_from_world = rotation.inverse(q[n : 2 * n])
        turn = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(q[:n]), q[2 * n :]))
        return (
            rotation.rotate(sensor_from_world, _second_difference(p) - GRAVITY),
            turn / (2.0 * STEP_S),
            rotation.rotate(sensor_from_world, self._field(t, p[n : 2 * n], person)),
        )

    def pose(self, t: Array, person: Person, shift: Array | None = None) -> tuple[Array, Array]:
        """Return world_from_sensor (n, 4) and the sensor's place in the world (n, 3) m at times (n,).

        `shift` (n, 3) m, in segment axes, is the skin's wobble; none if left out.
        """
        return self.pose_on(*self._bone(t, person), t, shift)

    def pose_on(
        self, bone: Array, joint: Array, angles: dict[str, Array], t: Array, shift: Array | None = None
    ) -> tuple[Array, Array]:
        """Return what `pose` does from world_from_segment (n, 4), the joint (n, 3) m and the angles at t."""
        skin, place = bone, np.array(self.place.lever)
        if self.tissue.any():
            pulled = np.einsum("nj,ji->ni", tissue.pull(angles, self.place.part), self.tissue)
            skin = rotation.multiply(skin, rotation.from_rotation_vector(pulled))
        if self.lag:
            skin = rotation.multiply(skin, rotation.about(1, self.lag * angles[tissue.LAGS[self.place.part]]))
        point = joint + rotation.rotate(skin, place)
        if shift is not None:
            skin = rotation.multiply(skin, rotation.from_rotation_vector(tissue.tip(shift)))
            point = point + rotation.rotate(bone, shift)
        q = rotation.multiply(skin, self.placement)
        if self.settling.any():
            begun = minimum_jerk((t - self.stand_s) / TRANSITION_S)
            q = rotation.multiply(q, rotation.from_rotation_vector(begun[:, None] * self.settling))
        if self.slip_s < inf and self.slip.any():
            gone = minimum_jerk((t - self.slip_s) / SLIP_S)
            q = rotation.multiply(q, rotation.from_rotation_vector(gone[:, None] * self.slip))
        return q, point

    def _field(self, t: Array, point: Array, person: Person) -> Array:
        """Return the field (n, 3), or (3,) where it is one, uT, world axes, at places (n, 3) m."""
        if self.surroundings == UNDISTURBED:
            return FIELD_UT
        chest = person.trunk(np.zeros(1)).chest
        return self.surroundings.field_ut(t, point - chest, Variation(self.seed, self.segment))

    def _bone(self, t: Array, person: Person) -> tuple[Array, Array, dict[str, Array]]:
        """Return world_from_segment, the joint that the sensor is measured from, and the joint angles."""
        if self.seat == "sternum":
            trunk = person.trunk(t)
            return trunk.world_from_thorax, trunk.chest, person.posture(t, person.moving_side).angles
        arm = person.arm(t, "right" if self.seat.endswith("_r") else "left")
        return arm.world_from[self.place.part], arm.joints[self.place.joint], arm.angles

    def _wobble(self, t: Array, period_s: float, person: Person) -> Array | None:
        """Return the skin's shift (3 n, 3) m STEP_S before, at and after each time; rigid: None."""
        if not self.tissue.any():
            return None
        early = tissue.warm_up(period_s)
        before = t[0] - period_s * np.arange(early, 0, -1)
        times = np.concatenate([before, t])
        m = len(times)
        bone, joint, _ = self._bone(np.concatenate([times - STEP_S, times, times + STEP_S]), person)
        acceleration = _second_difference(joint + rotation.rotate(bone, np.array(self.place.lever)))
        along = rotation.rotate(rotation.inverse(bone[m : 2 * m]), acceleration)
        x, v, a = (part[early:] for part in tissue.wobble(along, period_s))
        bend = 0.5 * STEP_S**2 * a
        return np.concatenate([x - STEP_S * v + bend, x, x + STEP_S * v + bend])


def _second_difference(p: Array) -> Array:
    before, at, after = np.split(p, 3)
    acceleration: Array = (after - 2.0 * at + before) / (STEP_S * STEP_S)
    return acceleration


def random_turn(degrees_rms: float, random: np.random.Generator) -> Array:
    """Return a rotation vector (3,) rad about any axis whose length has this root mean square in deg."""
    return degrees_rms * pi / 180.0 / sqrt(3.0) * random.standard_normal(3)
