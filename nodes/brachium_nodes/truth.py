"""What an emulated wearer really does, in the skeleton's terms."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from brachium_body import rotation
from brachium_body.angles import COLUMNS, joint_angles
from brachium_body.continuation import AngleTracker
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.segments import Segment, Side, arm_segments
from brachium_nodes.mounting import Worn
from brachium_nodes.movement import Array
from brachium_nodes.person import Person
from brachium_wire.messages import SegmentPose, Skeleton
from brachium_wire.tuples import quaternion, vector


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What one arm really does at n instants; numbers as messages.Skeleton has them."""

    trunk_from_world: Array
    world_from_segment: dict[str, Array]
    """By segment, with the sternum: (n, 4)."""
    world_from_sensor: dict[str, Array]
    """By the node's name, of those that sit on this arm or the chest: (n, 4), without the skin's wobble."""
    positions: dict[str, Array]
    """shoulder, elbow, wrist, hand in trunk axes from the chest: (n, 3) m."""
    angles: Array
    """(n, len(angles.COLUMNS)) rad, in principal ranges."""
    thorax_from_upper_arm: Array
    shoulder_shift: Array
    """(n, 3) m in trunk axes."""


def arm_truth(person: Person, worn: Mapping[Segment, Worn], t: Array, side: Side) -> Truth:
    """Return what one arm and the sensors on it and on the chest do at true times (n,) s."""
    trunk, arm = person.trunk(t), person.arm(t, side)
    trunk_from_world = rotation.multiply(TRUNK_FROM_THORAX, rotation.inverse(trunk.world_from_thorax))
    chain = (trunk.world_from_thorax, *arm.world_from.values())
    shoulder, elbow, wrist = (rotation.multiply(rotation.inverse(near), far) for near, far in pairwise(chain))
    angles = joint_angles(
        shoulder,
        elbow,
        wrist,
        side,
        calibration_from_thorax=rotation.multiply(
            rotation.inverse(TRUNK_FROM_THORAX), trunk.world_from_thorax
        ),
        shoulder_shift=arm.shift,
        chest_to_shoulder=person.lengths.chest_to_shoulder,
    )

    segments: tuple[Segment, ...] = ("sternum", *arm_segments(side))
    bones: dict[str, Array] = dict(zip(segments, chain, strict=True))

    def sensor(on: Worn) -> Array:
        if on.seat == "sternum":
            return on.pose(t, person)[0]
        return on.pose_on(bones[on.seat], arm.joints[on.place.joint], arm.angles, t)[0]

    return Truth(
        trunk_from_world,
        bones,
        {name: sensor(on) for seat in bones for name, on in worn.items() if on.seat == seat},
        {name: rotation.rotate(trunk_from_world, p - trunk.chest) for name, p in arm.joints.items()},
        angles,
        shoulder,
        arm.shift,
    )


def skeletons(truth: Truth, t: Array, side: Side, start_ns: int, tracker: AngleTracker) -> list[Skeleton]:
    """Return the truth at true times (n,) s, in order, as messages; true time 0 is host time `start_ns`.

    The tracker follows one arm, from call to call.
    """
    tracker.grow(1)
    row = np.zeros(1, dtype=np.intp)
    results = []
    for i, at in enumerate(t.tolist()):
        one = slice(i, i + 1)
        (angles,) = tracker.step(row, truth.angles[one], truth.thorax_from_upper_arm[one], side)
        results.append(_skeleton(truth, i, angles, side, start_ns + round(1e9 * at)))
    return results


def _skeleton(truth: Truth, i: int, angles: Array, side: Side, time_ns: int) -> Skeleton:
    sensors = truth.world_from_sensor
    return Skeleton(
        time_ns=time_ns,
        side=side,
        origin="emulated",
        forward="facing",
        trunk_from_world=quaternion(truth.trunk_from_world[i]),
        segments={
            name: SegmentPose(
                quality="good",
                world_from_segment=quaternion(q[i]),
                world_from_sensor=quaternion(sensors[name][i]) if name in sensors else None,
            )
            for name, q in truth.world_from_segment.items()
        },
        positions={name: vector(p[i]) for name, p in truth.positions.items()},
        angles=dict(zip(COLUMNS, angles.tolist(), strict=True)),
        shoulder_shift=vector(truth.shoulder_shift[i]),
    )
