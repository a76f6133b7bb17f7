"""The body of an emulated wearer: where each segment really is at any instant.

World axes are east, north, up; the person faces magnetic north, stands in neutral for `stand_s`, goes to the
exercise's first posture within TRANSITION_S by a minimum-jerk movement and exercises for ever after.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_body.lengths import ArmLengths, from_height
from brachium_body.segments import ARM_PARTS, Side
from brachium_nodes.exercises import EXERCISES
from brachium_nodes.motions import DEG, Build, Posture, pose_error
from brachium_nodes.movement import Array, Variation, at_least, eased, minimum_jerk
from brachium_nodes.routines import ROUTINES
from brachium_nodes.script import Routine, Span

Arms = Literal["right", "left", "both"]

NEUTRAL_S = 4.0
"""Of standing first: a pose is calibrated from 3 s."""
TRANSITION_S = 2.0

CHEST_ABOVE_PELVIS = 0.25
"""Of body height: the arm of the trunk's sway."""

LONGEST_STAND_S = 3600.0
"""An hour: more than any calibration takes, and a unit mixed up shows."""

TREMOR_HZ = (4.5, 5.5)
TREMBLING = ("shoulder_flexion", "elbow_flexion", "forearm_pronation")


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonSettings:
    """Who moves, and how."""

    exercise: str = "elbow-flexion"
    arms: Arms = "right"
    """Which arm exercises; the other hangs in neutral."""
    seed: int = 0
    height_m: float = 1.80
    carrying_deg: float = 0.0
    """Valgus of the elbow, varus negative. 0 as in Tsilomitrou 2021; people have about 8 (women more)."""
    contracture_deg: float = 0.0
    """Elbow flexion at which the elbows stop when straightened; 0: they straighten."""
    routine: str = ""
    """What is done before the exercise: a routine of routines.ROUTINES, or nothing."""
    stand_s: float = NEUTRAL_S
    """Standing in neutral comes before all else; somebody who calibrates by hand needs longer."""
    extent: float = 1.0
    """How far the exercise goes from neutral: 1 as it is described, 0 stands still."""
    movement_seed: int | None = None
    """Of the exercise's movement alone, so that who differs in all else makes the same; None: `seed`."""
    sway_deg: float = 0.0
    """Standard deviation of each of the trunk's three rotations while exercising; 0 is a back held still."""

    def __post_init__(self) -> None:
        """Raise ValueError for what no person is or does."""
        if self.exercise not in EXERCISES:
            raise ValueError(f"exercise {self.exercise!r} is not known; choose one of {', '.join(EXERCISES)}")
        if self.arms not in ("right", "left", "both"):
            raise ValueError(f"arms {self.arms!r} is not known; choose right, left or both")
        if not 1.4 <= self.height_m <= 2.3:
            raise ValueError(f"height {self.height_m} m cannot be used; give 1.4 to 2.3 m")
        if not -15.0 <= self.carrying_deg <= 30.0:
            raise ValueError(
                f"carrying angle {self.carrying_deg} deg cannot be used; give -15 (varus) to 30 deg (valgus)"
            )
        if not 0.0 <= self.contracture_deg <= 80.0:
            raise ValueError(f"contracture {self.contracture_deg} deg cannot be used; give 0 to 80 deg")
        if self.routine and self.routine not in ROUTINES:
            raise ValueError(
                f"routine {self.routine!r} is not known; choose one of {', '.join(filter(None, ROUTINES))}"
            )
        if not NEUTRAL_S <= self.stand_s <= LONGEST_STAND_S:
            raise ValueError(
                f"{self.stand_s:g} s of standing cannot be used; give {NEUTRAL_S:g} to {LONGEST_STAND_S:g} s"
            )
        if not 0.0 <= self.extent <= 1.2:
            raise ValueError(f"extent {self.extent} cannot be used; give 0 to 1.2")
        if not 0.0 <= self.sway_deg <= 20.0:
            raise ValueError(f"sway {self.sway_deg} deg cannot be used; give 0 to 20 deg")


@dataclass(frozen=True, slots=True, eq=False)
class Trunk:
    """The thorax at n instants, world axes."""

    world_from_thorax: Array
    """(n, 4)."""
    chest: Array
    """(n, 3) m."""
    angles: dict[str, Array]
    """trunk_flexion, trunk_lateral, trunk_rotation, rad."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """One arm at n instants, world axes."""

    world_from: dict[str, Array]
    """upper_arm, forearm, hand: (n, 4)."""
    joints: dict[str, Array]
    """shoulder, elbow, wrist, hand (the tip): (n, 3) m."""
    angles: dict[str, Array]
    """Clinical angles, rad."""
    shift: Array
    """Shoulder translation (n, 3) m in trunk axes."""


@dataclass(frozen=True)
class Person:
    """A moving person; every method is a pure function of true time in s."""

    settings: PersonSettings
    pose_error_deg: float = 0.0
    """As sensors.Errors has it."""
    tremor_deg: float = 0.0
    """As sensors.Errors has it."""

    @cached_property
    def lengths(self) -> ArmLengths:
        """Lengths between joint centres, those that body height suggests."""
        return from_height(self.settings.height_m)

    @property
    def moving_side(self) -> Side:
        """The arm that exercises; the right one if both do."""
        return "left" if self.settings.arms == "left" else "right"

    def posture(self, t: Array, side: Side) -> Posture:
        """Return joint angles and shoulder translation at times (n,)."""
        s, build = self.settings, self.build(side)
        own = s.seed if s.movement_seed is None else s.movement_seed
        exercising = eased(t - self.begins_s - TRANSITION_S, rise_s=1.0)
        moving = EXERCISES[s.exercise].motion(exercising, Variation(own, side), build)
        active = s.arms in (side, "both")
        share = self._begun(t) if active else np.zeros(len(t))
        made, before = moving.scaled(s.extent * share), share < 1.0
        first = self.routine if active else ROUTINES[""](build)
        if before.any() and (self.pose_error_deg or s.routine):
            early = first(t[before] - s.stand_s, Variation(s.seed, side), build)
            made = made.added(early.scaled(1.0 - share[before]), before)
        held = first.held(t - s.stand_s) * (1.0 - share) if self.tremor_deg else share
        return self._impaired(made, t, side, 1.0 - held)

    def build(self, side: Side) -> Build:
        """Return what a movement must know of an arm."""
        s = self.settings
        return Build(
            lengths=self.lengths,
            carrying=-s.carrying_deg * DEG,
            contracture_deg=s.contracture_deg,
            pose_error_deg=pose_error(self.pose_error_deg, s.seed, side) if self.pose_error_deg else {},
        )

    @cached_property
    def routine(self) -> Routine:
        """What is done before the exercise."""
        return ROUTINES[self.settings.routine](self.build(self.moving_side))

    @property
    def begins_s(self) -> float:
        """When the way from neutral to the exercise's first posture begins."""
        return self.settings.stand_s + self.routine.seconds

    @property
    def spans(self) -> tuple[Span, ...]:
        """What is done when before the exercise, in true time; standing in neutral comes first."""
        stand_s = self.settings.stand_s
        return (Span("n-pose", 0.0, stand_s), *(span.later(stand_s) for span in self.routine.spans))

    def _impaired(self, made: Posture, t: Array, side: Side, active: Array) -> Posture:
        """Return the posture with tremor, as far as the arm is `active` (n,), and with an elbow that does not
        straighten."""
        if self.tremor_deg:
            variation, size = Variation(self.settings.seed, side), self.tremor_deg * DEG * active
            made = made.turned({n: size * variation.wander(f"tremor/{n}", t, *TREMOR_HZ) for n in TREMBLING})
        if self.settings.contracture_deg:
            limit = self.settings.contracture_deg * DEG
            elbow = at_least(made.angles["elbow_flexion"], limit, within=6.0 * DEG)
            made = Posture({**made.angles, "elbow_flexion": elbow}, made.shift)
        return made

    def trunk(self, t: Array) -> Trunk:
        """Return the thorax at times (n,): it turns about the middle of the pelvis."""
        size = self.settings.sway_deg * DEG * self._begun(t)
        variation = Variation(self.settings.seed, "trunk")
        names = ("trunk_flexion", "trunk_lateral", "trunk_rotation")
        angles = {
            n: size * variation.wander(n, t, 0.05, 0.35) if self.settings.sway_deg else size for n in names
        }
        turn = rotation.multiply(
            rotation.about(2, -angles["trunk_flexion"]),
            rotation.multiply(
                rotation.about(0, angles["trunk_lateral"]), rotation.about(1, angles["trunk_rotation"])
            ),
        )
        world_from_thorax = rotation.multiply(TRUNK_FROM_THORAX, turn)
        up = np.array([0.0, CHEST_ABOVE_PELVIS * self.settings.height_m, 0.0])
        return Trunk(world_from_thorax, rotation.rotate(world_from_thorax, up), angles)

    def arm(self, t: Array, side: Side) -> Arm:
        """Return one arm at times (n,)."""
        posture, trunk = self.posture(t, side), self.trunk(t)
        outward = 1.0 if side == "right" else -1.0
        shift = posture.shift * [outward, 1.0, 1.0]
        world_from_trunk = rotation.multiply(trunk.world_from_thorax, rotation.inverse(TRUNK_FROM_THORAX))
        offset = shift + np.array([outward * self.lengths.chest_to_shoulder, 0.0, 0.0])
        joints = {"shoulder": trunk.chest + rotation.rotate(world_from_trunk, offset)}
        world_from: dict[str, Array] = {}
        q, end = trunk.world_from_thorax, joints["shoulder"]
        turns = joint_turns(posture.angles, -self.settings.carrying_deg * DEG)
        for part, joint, turn in zip(ARM_PARTS, ("elbow", "wrist", "hand"), turns, strict=True):
            q = rotation.multiply(q, turn if side == "right" else rotation.mirror(turn))
            end = end + rotation.rotate(q, np.array([0.0, -getattr(self.lengths, part), 0.0]))
            world_from[part], joints[joint] = q, end
        return Arm(world_from, joints, posture.angles, shift)

    def _begun(self, t: Array) -> Array:
        return minimum_jerk((t - self.begins_s) / TRANSITION_S)


def joint_turns(angles: dict[str, Array], carrying: float) -> tuple[Array, Array, Array]:
    """Return thorax_from_upper_arm, upper_arm_from_forearm, forearm_from_hand (n, 4) of a right arm.

    Shoulder: swing about (-abduction, 0, flexion) and twist; elbow: Z-X-Y; wrist: Z-X.
    """
    flexion, abduction = angles["shoulder_flexion"], angles["shoulder_abduction"]
    swing = rotation.from_rotation_vector(np.stack([-abduction, np.zeros_like(flexion), flexion], axis=-1))
    upper_arm = rotation.multiply(swing, rotation.about(1, angles["shoulder_rotation"]))
    bent = rotation.multiply(rotation.about(2, angles["elbow_flexion"]), rotation.about(0, carrying))
    forearm = rotation.multiply(bent, rotation.about(1, angles["forearm_pronation"]))
    deviation = rotation.about(2, -angles["wrist_deviation"])
    hand = rotation.multiply(deviation, rotation.about(0, angles["wrist_flexion"]))
    return upper_arm, forearm, hand
