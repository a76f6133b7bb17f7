"""What two sensors beside a joint did: orientations and angular rates, thinned out for a fit. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Floats = npt.NDArray[np.float64]

ROWS_HZ = 10.0
"""Instants kept: movement of arms is below 5 Hz, and skin's wobble above it."""
SMOOTH_S = 0.2
"""Rates are averaged over about so long."""
MOST_ROWS = 1500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMotion:
    """n instants of sensors a (nearer to the trunk) and b (beyond the joint)."""

    time_s: Floats
    """(n,) from row 0 of the records."""
    world_from_a: Floats
    """(n, 3, 3), each sensor in the world of its own heading."""
    world_from_b: Floats
    rate_a: Floats
    """(n, 3) rad/s of sensor a, in a's world."""
    rate_b: Floats

    def part(self, first_s: float, end_s: float) -> "JointMotion":
        """Return the instants from first_s to end_s."""
        kept = (self.time_s >= first_s) & (self.time_s <= end_s)
        return JointMotion(
            time_s=self.time_s[kept],
            world_from_a=self.world_from_a[kept],
            world_from_b=self.world_from_b[kept],
            rate_a=self.rate_a[kept],
            rate_b=self.rate_b[kept],
        )


def joint_motion(
    world_from_a: Floats, world_from_b: Floats, spans: Sequence[tuple[int, int]], rate_hz: float
) -> JointMotion:
    """Return the motion within spans (first row, end row) of orientations (n, 4), NaN where unknown.

    Rates are taken from the orientations, so sensors that deliver nothing else serve as well, and a gyroscope
    bias that the filter has found is gone from them. Runs shorter than 1 s between gaps are left out.
    """
    known = np.isfinite(world_from_a[:, 0]) & np.isfinite(world_from_b[:, 0])
    inside = np.zeros(len(known), dtype=np.bool_)
    for first, end in spans:
        inside[max(0, first) : end] = True
    step = max(1, round(rate_hz / ROWS_HZ), int(np.ceil(inside.sum() / MOST_ROWS)))
    rows = [np.zeros(0, dtype=np.intp)]
    rate_a, rate_b = np.zeros((len(known), 3)), np.zeros((len(known), 3))
    for first, end in _runs(known & inside):
        if end - first < rate_hz:
            continue
        rate_a[first:end] = _rates(world_from_a[first:end], rate_hz)
        rate_b[first:end] = _rates(world_from_b[first:end], rate_hz)
        rows.append(np.arange(first + step // 2, end, step))
    kept = np.concatenate(rows)
    return JointMotion(
        time_s=kept / rate_hz,
        world_from_a=rotation.to_matrix(world_from_a[kept]),
        world_from_b=rotation.to_matrix(world_from_b[kept]),
        rate_a=rate_a[kept],
        rate_b=rate_b[kept],
    )


def _runs(kept: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], kept.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _rates(world_from_sensor: Floats, rate_hz: float) -> Floats:
    """Return angular rates (n, 3) rad/s in the world, smoothed by a Hann window without delay."""
    turn = rotation.multiply(world_from_sensor[1:], rotation.inverse(world_from_sensor[:-1]))
    between = rotation.to_rotation_vector(turn) * rate_hz
    rates = 0.5 * (np.concatenate([between[:1], between]) + np.concatenate([between, between[-1:]]))
    window = np.hanning(2 * max(1, round(0.5 * SMOOTH_S * rate_hz)) + 3)
    window /= window.sum()
    half = len(window) // 2
    padded = np.concatenate([np.repeat(rates[:1], half, axis=0), rates, np.repeat(rates[-1:], half, axis=0)])
    columns = [np.convolve(padded[:, i], window, mode="valid") for i in range(3)]
    return np.stack(columns, axis=-1).astype(np.float64)
