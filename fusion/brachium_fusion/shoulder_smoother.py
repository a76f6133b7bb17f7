"""The shoulder of a recording: its displacement and both sensors' orientations from all samples. Pure.

The error-state smoother of two sensors, solved as least squares over knots (shoulder_arrow.py). Long
recordings are solved in windows, each begun from what the one before made of the same instant.
"""

from dataclasses import dataclass, replace

import numpy as np

from brachium_body import rotation
from brachium_fusion import shoulder_increments as si
from brachium_fusion.shoulder_equations import POSTURES, SIZE
from brachium_fusion.shoulder_model import (
    FARTHEST_M,
    MOST_SCALE,
    ArmModel,
    Bools,
    Floats,
    Sizes,
    gravity_scale,
    levelled,
    sizes,
)
from brachium_fusion.shoulder_postures import Postures
from brachium_fusion.shoulder_window import Known, carried, samples, solve

WINDOW_S, OVERLAP_S = 30.0, 4.0
"""Not longer: what the model leaves out comes again with each repetition, and does not average out of how the
sensors seem to sit."""
IMPLAUSIBLE = 3.0
"""No sensor sits farther, in standard deviations, from where the pose put it."""
LEAST_M = 1e-4
"""No lever arm is known better."""

Pair = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class ShoulderTrajectory:
    """What a recording's shoulder did, one row a sample; world axes."""

    shift_m: Floats
    """(n, 3) displacement of the shoulder since the start."""
    sd_m: Floats
    """(n, 3) its standard deviation."""
    world_from_upper: Floats
    """(n, 4) of the upper arm's sensor as if it sat as the model says: times `sensor_from_upper_arm` it is
    the segment's orientation."""
    world_from_forearm: Floats
    """(n, 4) the same of the forearm's."""
    at_rest: Bools
    """(n,)."""
    valid: Bools
    """(n,) False where the movement is not one of a shoulder on a still back."""


def smooth_shoulder(
    model: ArmModel,
    rate_hz: float,
    upper: Pair,
    forearm: Pair,
    world_from_upper: Floats,
    world_from_forearm: Floats,
    start: slice,
    *,
    trunk_velocity: Floats | None = None,
) -> ShoulderTrajectory:
    """Return the shoulder's movement over n samples at `rate_hz`.

    A sensor is (gyr, acc), (n, 3) each, rad/s and m/s^2 in its axes, calibrated; rows of NaN are gaps.
    `world_from_upper` and `world_from_forearm` (n, 4) are the sensors' orientations by an orientation filter
    with a common heading; they are needed at the `start`, a second or more in which the arm hangs still, from
    where the displacement counts. `trunk_velocity` (n, 3) m/s, world, is the trunk's part of the shoulder's
    velocity (shoulder_trunk.py): the displacement is then the girdle's alone.
    Raises ValueError when the start is too short, has gaps or is no rest.
    """
    n = len(upper[0])
    first, end, _ = start.indices(n)
    held = [part[first:end] for sensor in (upper, forearm) for part in sensor]
    if end - first < 0.5 * rate_hz or not all(np.isfinite(part).all() for part in held):
        raise ValueError(
            f"the start must be at least 0.5 s without gaps, not samples {first} to {end}; "
            "give a slice in which the arm hangs still"
        )
    size = sizes(model)
    known = _begin(size, model.lever_sd_m, held, (world_from_upper[first:end], world_from_forearm[first:end]))
    postures = Postures(known.world_from)
    every = si.stride(rate_hz)
    window, overlap = (round(s * rate_hz / every) * every for s in (WINDOW_S, OVERLAP_S))
    shift, sd = np.zeros((n, 3)), np.zeros((n, 3))
    turned = np.stack([world_from_upper, world_from_forearm]).astype(np.float64)
    at_rest, valid = np.zeros(n, dtype=bool), np.ones(n, dtype=bool)
    at = first
    while at < n - 1:
        stop = n if n - at < window + overlap else at + window
        data = [_padded(part[at:stop], every) for sensor in (upper, forearm) for part in sensor]
        trunk = None if trunk_velocity is None else _padded(trunk_velocity[at:stop], every)
        one = solve(model, size, rate_hz, data, known, postures, trunk)
        if one.sits_rad > IMPLAUSIBLE * size.mounting:
            one = solve(model, _doubtful(size), rate_hz, data, known.rigid(), postures, trunk)
        rows = slice(at, stop)
        shift[rows], sd[rows], turned[:, rows], at_rest[rows], valid[rows] = samples(one, every, stop - at)
        if stop == n:
            break
        knot = (window - overlap) // every
        known = carried(one, known, knot, every, postures)
        at += knot * every
    valid &= np.linalg.norm(shift, axis=1) < FARTHEST_M
    turned[:, :first] = turned[:, first : first + 1]
    return ShoulderTrajectory(shift, sd, turned[0], turned[1], at_rest, valid)


def _begin(size: Sizes, lever_sd: float, held: list[Floats], orientations: Pair) -> Known:
    world = []
    constants = np.zeros(POSTURES)
    for i, measured in enumerate(orientations):
        gyr, acc = held[2 * i], held[2 * i + 1]
        world.append(levelled(rotation.mean(measured), acc.mean(axis=0)))
        constants[12 * i : 12 * i + 3] = gyr.mean(axis=0)
        scale = gravity_scale(acc.mean(axis=0))
        if abs(scale) > MOST_SCALE:
            raise ValueError(
                f"a sensor reads {np.linalg.norm(acc.mean(axis=0)):.2f} m/s^2 at the start; "
                "give accelerations in m/s^2 and a start in which the arm rests"
            )
        constants[12 * i + 9 : 12 * i + 12] = scale
    knot_sd = np.array([1e-4] * 3 + [1e-3] * 3 + [size.tilt, size.tilt, size.heading] * 2)
    one = np.repeat([size.gyro_bias, size.accel_bias, size.gyro_scale, size.accel_scale], 3)
    skin = np.full(POSTURES - si.CONSTANTS, size.tissue)
    sd = np.concatenate([one, one, np.full(6, size.mounting), np.full(9, max(lever_sd, LEAST_M)), skin])
    return Known(np.array(world), np.zeros(SIZE), knot_sd, constants, sd, constants, sd)


def _doubtful(size: Sizes) -> Sizes:
    """Return the sizes for a movement that contradicts the model of the arm: something that it does not know
    of, a trunk that moves or wrong lengths, must not be taken for a sensor that sits otherwise."""
    return replace(size, accel_noise=5.0 * size.accel_noise, lever=5.0 * size.lever)


def _padded(values: Floats, every: int) -> Floats:
    """Return the rows and as many copies of the last one as make whole intervals."""
    more = -(len(values) - 1) % every
    return np.concatenate([values, np.repeat(values[-1:], more, axis=0)])
