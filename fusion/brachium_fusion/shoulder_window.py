"""One window of a recording's shoulder: nominal movement, equations of its errors, their solution. Pure."""

from dataclasses import dataclass, replace
from math import radians

import numpy as np
from scipy.ndimage import uniform_filter1d

from brachium_body import rotation
from brachium_fusion import shoulder_increments as si
from brachium_fusion.shoulder_arrow import Chain, Solution
from brachium_fusion.shoulder_equations import (
    NO_TIES,
    PLACE,
    POSTURES,
    SIZE,
    SPEED,
    TISSUE,
    TURNS,
    Stretch,
    equations,
)
from brachium_fusion.shoulder_model import ArmModel, Bools, Floats, Sizes
from brachium_fusion.shoulder_postures import Posture, Postures
from brachium_fusion.shoulder_rest import broken, rests
from brachium_fusion.shoulder_tissue import Tissue

PASSES = 3
"""Of linearisation; the second knows how much the shoulder moves, and its rests."""
LINEARISED = (np.arange(POSTURES) < si.LEVERS.start).astype(np.float64)
"""The constants that the nominal movement is corrected by; lever arms and skin stay linear."""
ABOUT_S = 10.0
"""Before and after an instant: whether the shoulder is being moved or held still."""
CAREFUL = 1.5
"""Standard deviations are carried on larger by so much, for their correlations are not."""
RIGID = 1e-4
WALKS = np.zeros(POSTURES)
WALKS[[0, 1, 2, 12, 13, 14]] = radians(0.002)
"""rad/s a sqrt(s): gyroscopes' biases go on from window to window. Everything else begins anew: a shoulder
that moves with the arm looks a little like a longer lever arm; what is small in a window must not add up."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known at the first sample of a window, by its mean and standard deviation."""

    world_from: Floats
    """(2, 4)."""
    knot: Floats
    """(SIZE,) with the turns 0."""
    knot_sd: Floats
    constants: Floats
    """(POSTURES,)."""
    constants_sd: Floats
    first: Floats
    first_sd: Floats
    """(POSTURES,) the constants as they were known at the start of the recording."""

    def rigid(self) -> "Known":
        """Return the same of sensors that sit where the pose put them."""
        sits = np.arange(POSTURES) >= si.SITS.start
        return replace(
            self,
            constants=np.where(sits, 0.0, self.constants),
            constants_sd=np.where(sits, RIGID, self.constants_sd),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """A solved window."""

    solution: Solution
    stretch: Stretch
    constants: Floats
    """(POSTURES,) what the last pass was linearised at."""
    sensors: Floats
    """(2, n, 4) nominal orientations."""
    used: list[Posture]

    @property
    def sits_rad(self) -> float:
        """How far the sensor that sits farthest from where the pose put it does so."""
        total = (self.constants[si.SITS] + self.solution.constants[si.SITS]).reshape(2, 3)
        return float(np.linalg.norm(total, axis=1).max())


def solve(
    model: ArmModel,
    size: Sizes,
    rate_hz: float,
    data: list[Floats],
    known: Known,
    postures: Postures,
    trunk_velocity: Floats | None,
) -> Window:
    """Return the solution of a window of samples `data`: gyr and acc of the upper arm's sensor, then of the
    forearm's, (n, 3) each with n one more than whole intervals; rows of NaN are gaps."""
    every, period = si.stride(rate_hz), 1.0 / rate_hz
    step_s = every * period
    filled, missing = _filled(data, every)
    world, constants = known.world_from, known.constants * LINEARISED
    shift = np.full(len(missing) + 1, size.shift)
    place: Floats | None = None
    speed: Floats | None = None
    walks = np.zeros(len(missing), dtype=bool)
    for number in range(PASSES):
        fitted = fitted_model(model, constants)
        errors = constants[: si.SITS.start].reshape(2, 4, 3)
        read = [si.Sensor(*filled[2 * i : 2 * i + 2], *errors[i]).corrected() for i in range(2)]
        sensors = np.stack([si.strapdown(read[i][0], world[i], period) for i in range(2)])
        inc = si.increments(
            fitted, period, every, (sensors[0], *read[0]), (sensors[1], *read[1]), trunk_velocity
        )
        knots = sensors[:, ::every]
        fastest = rotation.angle_between(knots[:, :-1], knots[:, 1:]).max(axis=0) / step_s
        at_rest = rests(inc.velocity, step_s, fastest, speed) & ~_beside(missing)
        walks = walks | broken(inc.velocity, step_s, place)
        at_rest &= ~_beside(walks)
        tissue = Tissue.at(fitted, knots[0], knots[1], postures.start)
        stretch = Stretch(
            step_s, inc, knots[0], knots[1], read[0][0][::every], at_rest, missing, walks, tissue
        )
        ties, used = (NO_TIES, []) if place is None else postures.ties(knots, at_rest, step_s, place, size)
        chain = equations(fitted, size, stretch, len(used), ties, shift)
        _remember(chain, known, world, constants, used)
        solution = chain.solve()
        if number == PASSES - 1:
            return Window(solution, stretch, constants, sensors, used)
        constants = constants + solution.constants[:POSTURES] * LINEARISED
        turn = solution.knots[0, TURNS].reshape(2, 3)
        world = rotation.multiply(rotation.from_rotation_vector(turn), world)
        place, speed = solution.knots[:, PLACE], solution.knots[:, SPEED]
        shift = _goes(place, _beside(walks), step_s, size)
    raise AssertionError("there is at least one pass")


def _goes(place: Floats, walks: Bools, step_s: float, size: Sizes) -> Floats:
    """Return how far the shoulder goes about each knot (k + 1,) m: the 3-D RMS of `place` (k + 1, 3) within
    ABOUT_S, for it may be held still for a minute and then be lifted. Walking does not count."""
    width = 2 * round(ABOUT_S / step_s) + 1
    square, counts = (
        uniform_filter1d(values, width, mode="constant")
        for values in (np.where(walks, 0.0, np.sum(place**2, axis=1)), np.where(walks, 0.0, 1.0))
    )
    known: Bools = counts > 0.5 / width
    goes = np.sqrt(np.where(known, square / np.maximum(counts, 0.5 / width), size.shift**2))
    return np.asarray(np.clip(goes, size.still, size.shift))


def _filled(data: list[Floats], every: int) -> tuple[list[Floats], Bools]:
    """Return the samples with straight lines across gaps, and the intervals (k,) that touch one."""
    bad: Bools = np.asarray(~np.isfinite(np.concatenate(data, axis=1)).all(axis=1))
    both_ends = np.stack([bad[1:].reshape(-1, every), bad[:-1].reshape(-1, every)])
    missing: Bools = np.asarray(both_ends.any(axis=(0, 2)))
    if not bad.any():
        return data, missing
    rows, good = np.arange(len(bad)), np.flatnonzero(~bad)
    if not len(good):
        return [np.zeros_like(part) for part in data], missing
    return [
        np.stack([np.interp(rows, good, part[good, i]) for i in range(3)], axis=1) for part in data
    ], missing


def _beside(missing: Bools) -> Bools:
    """Return the knots (k + 1,) at either end of the intervals (k,)."""
    beside: Bools = np.concatenate([missing, [False]]) | np.concatenate([[False], missing])
    return beside


def fitted_model(model: ArmModel, constants: Floats) -> ArmModel:
    """Return the model with both sensors sitting as the constants say."""
    upper, forearm = rotation.from_rotation_vector(constants[si.SITS].reshape(2, 3))
    return replace(
        model,
        sensor_from_upper_arm=rotation.multiply(upper, model.sensor_from_upper_arm),
        sensor_from_forearm=rotation.multiply(forearm, model.sensor_from_forearm),
        lever_upper=rotation.rotate(upper, model.lever_upper),
        lever_forearm=rotation.rotate(forearm, model.lever_forearm),
    )


def _remember(chain: Chain, known: Known, world: Floats, constants: Floats, used: list[Posture]) -> None:
    """Add what was known before to the equations of the errors of `world` and `constants`."""
    turned = rotation.to_rotation_vector(rotation.multiply(known.world_from, rotation.inverse(world)))
    value = known.knot + np.concatenate([np.zeros(6), turned.ravel()])
    chain.add_at(np.array([0]), np.eye(SIZE)[None], None, value[None], known.knot_sd[None])
    mean = np.concatenate([known.constants - constants * LINEARISED, *(p.place for p in used)])
    weight = np.concatenate([known.constants_sd, *(p.sd for p in used)]) ** -2.0
    index = np.arange(len(mean))
    chain.constants[index, index] += weight
    chain.constants[index, -1] += weight * mean


def samples(window: Window, every: int, n: int) -> tuple[Floats, Floats, Floats, Bools, Bools]:
    """Return displacement (n, 3), its sd (n, 3), orientations (2, n, 4), rest (n,) and whether no more than a
    shoulder moves (n,), at a window's samples: cubic between knots for the displacement, straight for the
    errors of orientation."""
    solution, stretch = window.solution, window.stretch
    t = np.arange(n) / every
    i = np.minimum(t.astype(np.int64), len(stretch.missing) - 1)
    s = (t - i)[:, None]
    a, b, h = solution.knots[i], solution.knots[i + 1], stretch.step_s
    shift = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * a[:, PLACE] + s * s * (3.0 - 2.0 * s) * b[:, PLACE]
    shift += h * s * (1.0 - s) * ((1.0 - s) * a[:, SPEED] - s * b[:, SPEED])
    sd = np.sqrt(np.einsum("kii->ki", solution.covariance[:, PLACE, PLACE]))
    settled, left = window.constants[si.SITS].reshape(2, 3), solution.constants[si.SITS]
    on_bone = left + stretch.tissue.turns(solution.constants[TISSUE])
    error = np.concatenate([solution.knots[:, TURNS], on_bone], axis=1)
    error = (1.0 - s) * error[i] + s * error[i + 1]
    sensors = []
    for j in range(2):
        turn, sits = error[:, 3 * j : 3 * j + 3], error[:, 6 + 3 * j : 9 + 3 * j]
        q = rotation.multiply(rotation.from_rotation_vector(turn), window.sensors[j, :n])
        q = rotation.multiply(q, rotation.from_rotation_vector(sits))
        sensors.append(rotation.multiply(q, rotation.from_rotation_vector(settled[j])))
    nearest = np.minimum(np.rint(t).astype(np.int64), len(sd) - 1)
    return shift, sd[nearest], np.stack(sensors), stretch.at_rest[nearest], ~stretch.broken[i]


def carried(window: Window, known: Known, knot: int, every: int, postures: Postures) -> Known:
    """Return what a window makes of one of its knots, for the next to begin from; tell the postures."""
    solution, elapsed_s = window.solution, knot * window.stretch.step_s
    x, covariance = solution.knots[knot], solution.covariance[knot]
    turn = rotation.from_rotation_vector(x[TURNS].reshape(2, 3))
    constants = window.constants * LINEARISED + solution.constants[:POSTURES]
    spread = np.sqrt(np.diag(solution.constants_covariance))
    postures.learn(
        window.used, solution.constants[POSTURES:].reshape(-1, 3), spread[POSTURES:].reshape(-1, 3)
    )
    walks = WALKS > 0.0
    constants = np.where(walks, constants, known.first)
    sd = np.where(walks, np.hypot(spread[:POSTURES], np.sqrt(elapsed_s) * WALKS), known.first_sd)
    return Known(
        rotation.multiply(turn, window.sensors[:, knot * every]),
        np.concatenate([x[:6], np.zeros(6)]),
        CAREFUL * np.sqrt(np.diag(covariance)),
        constants,
        sd,
        known.first,
        known.first_sd,
    )
