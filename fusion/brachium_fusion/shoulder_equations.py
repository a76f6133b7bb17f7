"""All that is known of a shoulder over one stretch of time, as linear equations of the errors. Pure."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from brachium_body import rotation
from brachium_fusion import shoulder_increments as si
from brachium_fusion.shoulder_arrow import Chain
from brachium_fusion.shoulder_model import ArmModel, Bools, Floats, Sizes
from brachium_fusion.shoulder_tissue import UNKNOWNS, Tissue
from brachium_fusion.still_stretches import runs

SIZE = 12
"""Of a knot: displacement, velocity, turn of the upper arm's sensor, of the forearm's; all in the world."""
PLACE, SPEED, TURNS = slice(0, 3), slice(3, 6), slice(6, 12)
TISSUE = slice(si.CONSTANTS, si.CONSTANTS + UNKNOWNS)
POSTURES = si.CONSTANTS + UNKNOWNS
"""Where the constants of postures begin: the shoulder's place in each, 3 numbers."""

EXACT_M = 2e-5
"""m: of the displacement that speed makes between knots."""
NEAR_REST_S = 2.5
BROKEN = 1.0
"""m and m/s: by how much a person who walks may be elsewhere, and faster, a knot later."""
GONE = 1e3
"""Times the noise of an interval with samples missing."""
MISSING_S = 0.5
MISSING_TURN, MISSING_FORCE = 0.5, 1.0
"""rad/s and m/s^2: by how much a sensor may have moved otherwise than a straight line across a gap of
MISSING_S or more; less in a shorter one, with its square."""


@dataclass(frozen=True, slots=True, eq=False)
class Ties:
    """Rests in postures that were taken before: the shoulder is where it was then."""

    knots: npt.NDArray[np.int64]
    """(m,) one for each such rest."""
    posture: npt.NDArray[np.int64]
    """(m,) the posture's number among the constants, or -1: the posture of the start, with displacement 0."""
    heading: Floats
    """(m, 2) by how much each sensor must turn about the vertical to stand as it did."""
    heading_sd: Floats
    """(m, 2)."""


NO_TIES = Ties(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros((0, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Nominal movement over k intervals."""

    step_s: float
    increments: si.Increments
    world_from_upper: Floats
    """(k + 1, 4) at the knots, as the next."""
    world_from_forearm: Floats
    upper_rate: Floats
    """(k + 1, 3) rad/s."""
    at_rest: Bools
    """(k + 1,)."""
    missing: Bools
    """(k,) intervals in which samples were missing."""
    broken: Bools
    """(k,) intervals in which more moves than a shoulder: nothing is expected of it there."""
    tissue: Tissue


def missing_share(gap_s: float) -> float:
    """Return the share of MISSING_TURN and MISSING_FORCE to expect in a gap."""
    return min(1.0, (gap_s / MISSING_S) ** 2)


def equations(
    model: ArmModel, sizes: Sizes, stretch: Stretch, postures: int, ties: Ties, shift: Floats
) -> Chain:
    """Return the equations without what was known before: movement, sensors, elbow, rests and ties.

    `shift` (k + 1,) m is the standard deviation of the shoulder's displacement, at each knot.
    """
    k = len(stretch.missing)
    chain = Chain.empty(k, SIZE, POSTURES + 3 * postures)
    world_upper = rotation.to_matrix(stretch.world_from_upper)
    world_forearm = rotation.to_matrix(stretch.world_from_forearm)
    _movement(chain, sizes, stretch, world_upper, model, shift)
    _places(chain, sizes, stretch, shift)
    _elbow(chain, model, sizes, stretch, world_upper, world_forearm)
    _rests(chain, sizes, stretch)
    _ties(chain, sizes, ties)
    return chain


def _movement(
    chain: Chain, sizes: Sizes, stretch: Stretch, world_upper: Floats, model: ArmModel, shift: Floats
) -> None:
    """Add what links neighbouring knots: speed and place, both sensors' accelerations and turns."""
    k, h, inc = len(stretch.missing), stretch.step_s, stretch.increments
    eye = np.eye(3)
    begin, end = np.zeros((k, 6, SIZE)), np.zeros((k, 6, SIZE))
    sd = np.full((k, 6), EXACT_M)
    begin[:, :3, PLACE], end[:, :3, PLACE] = -eye, eye
    begin[:, :3, SPEED] = end[:, :3, SPEED] = -0.5 * h * eye
    begin[:, 3:, SPEED], end[:, 3:, SPEED] = -eye, eye
    sd[:, 3:] = (sizes.shoulder_accel * sqrt(h) / sizes.shift * shift[:-1])[:, None]
    sd[stretch.broken] = BROKEN
    chain.add_between(begin, end, None, np.zeros((k, 6)), sd)
    begin, end = np.zeros((k, 12, SIZE)), np.zeros((k, 12, SIZE))
    constant, value = np.zeros((k, 12, len(chain.constants) - 1)), np.zeros((k, 12))
    for rows in (slice(0, 3), slice(3, 6)):
        begin[:, rows, SPEED], end[:, rows, SPEED] = -eye, eye
    begin[:, :6, TURNS], end[:, :6, TURNS] = -inc.by_turn[:, :, :6], -inc.by_turn[:, :, 6:]
    constant[:, :6, : si.CONSTANTS] = -inc.by_constant
    constant[:, 3:6, TISSUE] = -stretch.tissue.velocity_by_tissue(model, world_upper, stretch.upper_rate, h)
    value[:, :6] = inc.velocity
    begin[:, 6:, TURNS], end[:, 6:, TURNS] = -np.eye(6), np.eye(6)
    constant[:, 6:, : si.CONSTANTS] = -inc.turn_by_constant
    noise = sizes.accel_noise**2 + np.cumsum((sizes.lever * inc.swing) ** 2, axis=1)
    sd = np.full((k, 12), sizes.gyro_noise * sqrt(h))
    sd[:, :6] = np.repeat(np.sqrt(noise * 0.1 * h), 3, axis=1)
    sd[stretch.missing, :6] *= GONE
    for first, last in runs(stretch.missing):
        sd[first:last, 6:] = MISSING_TURN * missing_share((last - first) * h) * h
    chain.add_between(begin, end, constant, value, sd)


def _places(chain: Chain, sizes: Sizes, stretch: Stretch, shift: Floats) -> None:
    """Add at each knot that the shoulder is not far from its place: little near a rest of a shoulder that
    moves, for it may rest anywhere, and enough to forget what integration does between rests."""
    k, h = len(stretch.missing), stretch.step_s
    variance: Floats = shift**2 * sizes.shift_s / h
    if stretch.at_rest.any():
        away: Floats = h * np.asarray(distance_transform_edt(~stretch.at_rest))
        variance[(shift > 0.5 * sizes.shift) & (away < NEAR_REST_S)] = (2.0 * sizes.shift) ** 2 * 60.0 / h
    own = np.zeros((k + 1, 3, SIZE))
    own[:, :, PLACE] = np.eye(3)
    chain.add_at(np.arange(k + 1), own, None, np.zeros((k + 1, 3)), np.sqrt(variance)[:, None] * np.ones(3))


def _elbow(
    chain: Chain,
    model: ArmModel,
    sizes: Sizes,
    stretch: Stretch,
    world_upper: Floats,
    world_forearm: Floats,
) -> None:
    """Add that the forearm's long axis keeps its angle to the axis of flexion."""
    n = len(world_upper)
    flexion, along = world_upper @ model.flexion_axis, world_forearm @ model.forearm_axis
    turn = np.cross(flexion, along)
    own, constant = np.zeros((n, 1, SIZE)), np.zeros((n, 1, chain.constants.shape[0] - 1))
    own[:, 0, 6:9], own[:, 0, 9:12] = turn, -turn
    upper = np.einsum("ki,kij->kj", turn, world_upper)
    forearm = -np.einsum("ki,kij->kj", turn, world_forearm)
    constant[:, 0, si.SITS] = np.concatenate([upper, forearm], axis=1)
    constant[:, 0, TISSUE] = stretch.tissue.spread(upper, forearm)
    value = model.hinge - np.einsum("ki,ki->k", flexion, along)
    sd = np.full((n, 1), sizes.hinge / sqrt(stretch.step_s))
    chain.add_at(np.arange(n), own, constant, value[:, None], sd)


def _rests(chain: Chain, sizes: Sizes, stretch: Stretch) -> None:
    knots = np.flatnonzero(stretch.at_rest)
    if not len(knots):
        return
    own = np.zeros((len(knots), 3, SIZE))
    own[:, :, SPEED] = np.eye(3)
    sd = np.full((len(knots), 3), sizes.rest_speed * sqrt(0.1 / stretch.step_s))
    chain.add_at(knots, own, None, np.zeros((len(knots), 3)), sd)


def _ties(chain: Chain, sizes: Sizes, ties: Ties) -> None:
    m = len(ties.knots)
    if not m:
        return
    own, constant = np.zeros((m, 5, SIZE)), np.zeros((m, 5, chain.constants.shape[0] - 1))
    own[:, :3, PLACE] = np.eye(3)
    own[:, 3, 8] = own[:, 4, 11] = 1.0
    for row, posture in enumerate(ties.posture.tolist()):
        if posture >= 0:
            first = POSTURES + 3 * posture
            constant[row, :3, first : first + 3] = -np.eye(3)
    value = np.concatenate([np.zeros((m, 3)), ties.heading], axis=1)
    sd = np.concatenate([np.full((m, 3), sizes.rest_place), ties.heading_sd], axis=1)
    chain.add_at(ties.knots, own, constant, value, sd)
