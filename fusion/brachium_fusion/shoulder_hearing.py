"""What the filter hears besides the sensors' accelerations: elbow, rest, postures, heading. Pure."""

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_equations import MISSING_FORCE, MISSING_TURN, PLACE, SIZE, SPEED, missing_share
from brachium_fusion.shoulder_errors import SITS, STATE, ErrorState
from brachium_fusion.shoulder_model import MOST_SCALE, ArmModel, Floats, Sizes, gravity_scale, levelled
from brachium_fusion.shoulder_postures import Posture
from brachium_fusion.shoulder_rest import SLOW_M_S

STEADY = 3.0
"""A rest is steady speed if the speed 0 is so unlikely: normalised square."""
BELIEVE_REST_S = 1.5
"""No shoulder moves steadily for longer."""
REST_RATE = 0.005
"""rad/s: of an arm that is held still, a new one each second."""
HEADING_S = 10.0
"""The orientation filter's heading has a new error so often."""


def settled(world_from: Floats, constants: Floats, measured: Floats) -> bool:
    """Level both sensors (2, 4) and make their accelerations as long as gravity, in place, at a rest.

    `measured` (12,) are gyr, acc, gyr, acc. Return False, and stop there, if one is far from gravity.
    """
    for i in range(2):
        c = constants[12 * i : 12 * i + 12]
        acc = measured[6 * i + 3 : 6 * i + 6]
        scale = gravity_scale(acc * (1.0 - c[9:12]) - c[3:6])
        if abs(scale) > MOST_SCALE:
            return False
        c[9:12] += scale
        world_from[i] = levelled(world_from[i], acc * (1.0 - c[9:12]) - c[3:6])
    return True


def elbow_and_place(
    errors: ErrorState,
    size: Sizes,
    model: ArmModel,
    world_from: Floats,
    place: Floats,
    place_variance: float,
    step_s: float,
) -> None:
    """Hear that the forearm keeps its angle to the axis of flexion, and that the shoulder is not far.

    `world_from` (2, 4) are the sensors' orientations, `place` (3,) m the displacement held.
    """
    world = rotation.to_matrix(world_from)
    flexion, along = world[0] @ model.flexion_axis, world[1] @ model.forearm_axis
    turn = np.cross(flexion, along)
    rows, value, variance = np.zeros((4, STATE)), np.empty(4), np.full(4, place_variance)
    rows[0, 6:9], rows[0, 9:12] = turn, -turn
    rows[0, SITS] = np.concatenate([turn @ world[0], -turn @ world[1]])
    value[0], variance[0] = model.hinge - flexion @ along, size.hinge**2 / step_s
    rows[1:, PLACE], value[1:] = np.eye(3), -place
    errors.observe(rows, value, variance)


def slow(errors: ErrorState, size: Sizes, speed: Floats, step_s: float) -> bool:
    """Return whether the shoulder's speed (3,) m/s may well be 0, and cannot be far from it."""
    variance = size.rest_speed**2 * 0.1 / step_s
    small = float(np.linalg.norm(speed)) < SLOW_M_S
    return small and errors.surprise(SPEED, -speed, variance) < STEADY


def rest(errors: ErrorState, size: Sizes, speed: Floats, rates: Floats, rest_s: float, step_s: float) -> None:
    """Hear that neither shoulder nor segments move: `speed` (3,) m/s and `rates` (6,) rad/s are what is held;
    the rest has lasted `rest_s`."""
    variance = size.rest_speed**2 * 0.1 / step_s
    if errors.surprise(SPEED, -speed, variance) > STEADY:
        if rest_s < BELIEVE_REST_S:
            return
        errors.widen(slice(0, 6), np.tile(speed**2, 2) + 1e-6)
    rows = np.zeros((9, STATE))
    rows[:3, SPEED] = rows[3:6, 12:15] = rows[6:9, 24:27] = np.eye(3)
    spread = np.concatenate([np.full(3, variance), np.full(6, REST_RATE**2 / step_s)])
    errors.observe(rows, np.concatenate([-speed, rates]), spread)


def back(errors: ErrorState, size: Sizes, posture: Posture, world_from: Floats, place: Floats) -> None:
    """Hear that the shoulder is where it was when the arm rested so before; no better than known then."""
    rows = np.zeros((5, STATE))
    rows[:3, PLACE] = np.eye(3)
    rows[3, 8] = rows[4, 11] = 1.0
    turn = rotation.heading(rotation.multiply(posture.world_from, rotation.inverse(world_from)))
    spread = np.concatenate([posture.sd**2 + size.rest_place**2, np.full(2, size.rest_heading**2)])
    errors.observe(rows, np.concatenate([posture.place - place, turn]), spread)
    errors.widen(PLACE, np.maximum(posture.sd**2 - np.diag(errors.covariance)[PLACE], 0.0))


def heading(errors: ErrorState, world_from: Floats, given: Floats, sd_rad: float, step_s: float) -> None:
    """Hear both sensors' headings from an orientation filter's `given` (2, 4)."""
    rows = np.zeros((2, STATE))
    rows[0, 8] = rows[1, 11] = 1.0
    turn = rotation.heading(rotation.multiply(given, rotation.inverse(world_from)))
    errors.observe(rows, turn, np.full(2, sd_rad**2 * HEADING_S / step_s))


def gap(errors: ErrorState, missing_s: float) -> None:
    """Know less after a time without samples, over which they are taken to lie on a straight line."""
    speed = MISSING_FORCE * missing_share(missing_s) * missing_s
    turn = MISSING_TURN * missing_share(missing_s) * missing_s
    errors.widen(slice(0, SIZE), np.repeat([0.5 * missing_s * speed, speed, turn, turn], 3) ** 2)
