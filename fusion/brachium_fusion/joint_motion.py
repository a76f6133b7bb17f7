"""What two sensors beside a joint did: orientations, rates and forces, thinned out for a fit. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.still_stretches import runs

Floats = npt.NDArray[np.float64]

ROWS_HZ = 10.0
"""Instants kept: movement of arms is below 5 Hz, and skin's wobble above it."""
SMOOTH_S = 0.1
"""Rates are averaged over about so long."""
SLOW_S = 0.4
"""Forces are averaged over about so long: arms are moved at 1 or 2 Hz, and tremble at 4 to 12."""
MOST_ROWS = 1500
KNOT_S = 15.0
"""The heading between two sensors is taken as straight over so long."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMotion:
    """n instants of sensors a (nearer to the trunk) and b (beyond the joint), each in its own world."""

    time_s: Floats
    """(n,) from row 0 of the records."""
    world_from_a: Floats
    """(n, 3, 3)."""
    world_from_b: Floats
    rate_a: Floats
    """(n, 3) rad/s."""
    rate_b: Floats
    force_a: Floats | None = None
    """(n, 3) specific force, m/s^2; None for sensors that deliver orientation only."""
    force_b: Floats | None = None
    turning_a: Floats | None = None
    """(n, 3, 3) rad/s^2: turns a lever in sensor axes into what it adds to the force; averaged as that is, so
    that the force at the lever's end is averaged, too, and not another one."""
    turning_b: Floats | None = None

    def part(self, first_s: float, end_s: float) -> "JointMotion":
        """Return the instants from first_s to end_s."""
        kept = (self.time_s >= first_s) & (self.time_s <= end_s)
        return JointMotion(
            time_s=self.time_s[kept],
            world_from_a=self.world_from_a[kept],
            world_from_b=self.world_from_b[kept],
            rate_a=self.rate_a[kept],
            rate_b=self.rate_b[kept],
            force_a=None if self.force_a is None else self.force_a[kept],
            force_b=None if self.force_b is None else self.force_b[kept],
            turning_a=None if self.turning_a is None else self.turning_a[kept],
            turning_b=None if self.turning_b is None else self.turning_b[kept],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorMotion:
    """One sensor over all rows, NaN where unknown."""

    world_from_sensor: Floats
    """(n, 4)."""
    acc: Floats | None = None
    """(n, 3) specific force in sensor axes, m/s^2."""


def joint_motion(
    a: SensorMotion, b: SensorMotion, spans: Sequence[tuple[int, int]], rate_hz: float
) -> JointMotion:
    """Return the motion within spans (first row, end row).

    Rates are taken from the orientations, so sensors that deliver nothing else serve as well, and a gyroscope
    bias that the filter has found is gone from them. Runs shorter than 1 s between gaps are left out.
    """
    forces = a.acc is not None and b.acc is not None
    known = np.isfinite(a.world_from_sensor[:, 0]) & np.isfinite(b.world_from_sensor[:, 0])
    if a.acc is not None and b.acc is not None:
        known &= np.isfinite(a.acc[:, 0]) & np.isfinite(b.acc[:, 0])
    inside = np.zeros(len(known), dtype=np.bool_)
    for first, end in spans:
        inside[max(0, first) : end] = True
    step = max(1, round(rate_hz / ROWS_HZ), int(np.ceil(inside.sum() / MOST_ROWS)))
    kept = [np.zeros(0, dtype=np.intp)]
    columns = [np.zeros((0, 30))]
    for first, end in runs(known & inside):
        if end - first < rate_hz:
            continue
        run, cut = slice(first, end), slice(step // 2, None, step)
        kept.append(np.arange(first, end)[cut])
        columns.append(np.concatenate([_moving(s, run, rate_hz)[cut] for s in (a, b)], axis=1))
    rows, moving = np.concatenate(kept), np.concatenate(columns)
    return JointMotion(
        time_s=rows / rate_hz,
        world_from_a=rotation.to_matrix(a.world_from_sensor[rows]),
        world_from_b=rotation.to_matrix(b.world_from_sensor[rows]),
        rate_a=moving[:, 0:3],
        rate_b=moving[:, 15:18],
        force_a=moving[:, 3:6] if forces else None,
        force_b=moving[:, 18:21] if forces else None,
        turning_a=moving[:, 6:15].reshape(-1, 3, 3) if forces else None,
        turning_b=moving[:, 21:30].reshape(-1, 3, 3) if forces else None,
    )


def knots(time_s: Floats) -> Floats:
    """Return instants about KNOT_S apart from the first time to the last."""
    length = float(time_s[-1] - time_s[0])
    return np.linspace(float(time_s[0]), float(time_s[-1]), max(2, round(length / KNOT_S) + 1))


def shares(time_s: Floats, knots_s: Floats) -> Floats:
    """Return how much each knot counts at each time, (n, k), for straight lines between knots."""
    return np.stack([np.interp(time_s, knots_s, row) for row in np.eye(len(knots_s))], axis=-1)


def _moving(sensor: SensorMotion, run: slice, rate_hz: float) -> Floats:
    """Return rate, force, and turning (n, 15) in the sensor's world, smoothed without delay."""
    quats = sensor.world_from_sensor[run]
    turn = rotation.multiply(quats[1:], rotation.inverse(quats[:-1]))
    between = rotation.to_rotation_vector(turn) * rate_hz
    rate = 0.5 * (np.concatenate([between[:1], between]) + np.concatenate([between, between[-1:]]))
    rate = _smooth(rate, rate_hz, SMOOTH_S)
    if sensor.acc is None:
        return np.concatenate([rate, np.zeros((len(rate), 12))], axis=1).astype(np.float64)
    across = rotation.cross_matrix(rate)
    spin = rotation.cross_matrix(np.gradient(rate, 1.0 / rate_hz, axis=0))
    turning = ((spin + across @ across) @ rotation.to_matrix(quats)).reshape(-1, 9)
    force = rotation.rotate(quats, sensor.acc[run])
    slow = _smooth(np.concatenate([force, turning], axis=1), rate_hz, SLOW_S)
    return np.concatenate([rate, slow], axis=1).astype(np.float64)


def _smooth(values: Floats, rate_hz: float, span_s: float) -> Floats:
    """Return values (n, k) under a Hann window of about so long."""
    window = np.hanning(2 * max(1, round(0.5 * span_s * rate_hz)) + 3)
    window /= window.sum()
    half = len(window) // 2
    padded = np.concatenate(
        [np.repeat(values[:1], half, axis=0), values, np.repeat(values[-1:], half, axis=0)]
    )
    columns = [np.convolve(column, window, mode="valid") for column in padded.T]
    return np.stack(columns, axis=-1).astype(np.float64)
