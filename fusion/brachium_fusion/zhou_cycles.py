"""Repetitions of an exercise, and what Zhou et al. 2008 do with them: the reset of drift and lambda. Pure."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

Floats = npt.NDArray[np.float64]

SHORTEST_S, LONGEST_S = 1.0, 15.0
"""How long one repetition of an exercise takes."""
WHOLE = 0.8
"""Of a repetition, when the recording ends: it is taken for a whole one."""
DEGREE = 5
"""Of the polynomials fitted to each repetition. The paper says polynomial regression; the degree is ours."""


def find_cycles(gyr: Floats, rate_hz: float) -> list[int]:
    """Return the rows at which repetitions begin, the last one's end included; empty where none repeat.

    `gyr` (n, k) rad/s are the axes of all sensors together. Their autocorrelation, with its sign, gives the
    period: the way back is the negative of the way there. Each repetition begins where there was least
    movement.
    """
    n = len(gyr)
    shortest, longest = round(SHORTEST_S * rate_hz), min(round(LONGEST_S * rate_hz), n // 2)
    if longest <= shortest + 1:
        return []
    spectrum = np.fft.rfft(gyr - gyr.mean(axis=0), 2 * n, axis=0)
    alike = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[: longest + 1].sum(axis=1)
    alike = alike / np.arange(n, n - longest - 1, -1)  # the mean product, whatever the overlap
    if alike[0] <= 0.0:
        return []
    peaks = [
        lag
        for lag in range(shortest, longest)
        if alike[lag] >= alike[lag - 1] and alike[lag] >= alike[lag + 1] and alike[lag] > 0.3 * alike[0]
    ]
    if not peaks:
        return []
    best = max(alike[lag] for lag in peaks)
    period = next(lag for lag in peaks if alike[lag] > 0.8 * best)
    energy = uniform_filter1d((gyr * gyr).sum(axis=1), max(3, period // 4), mode="nearest")
    count = n // period
    first = int(np.argmin(energy[: count * period].reshape(count, period).sum(axis=0)))
    reach = period // 6
    beginnings = range(first, n, period)
    near = [max(0, b - reach) + int(np.argmin(energy[max(0, b - reach) : b + reach + 1])) for b in beginnings]
    if near and n - near[-1] > WHOLE * period:
        near.append(n - 1)
    return [int(b) for b in near] if len(near) > 1 else []


def cycle_reset(shift: Floats, cycles: list[int]) -> Floats:
    """Return shift (n, 3) m with each repetition's drift taken off: `each cycle rather than the overall`.

    A repetition begins and ends in place and at rest, so the cubic through its positions and velocities at
    both ends is drift. The rows before the first begin so, too; those after the last only begin so.
    """
    result: Floats = shift - shift[0]
    if not cycles:
        return result
    edges = [0, *(min(c, len(shift) - 1) for c in cycles if c > 0)]
    for begin, end in pairwise(edges):
        result[begin : end + 1] = shift[begin : end + 1] - _hermite(shift[begin : end + 1])
    last = edges[-1]
    before = max(0, last - 2)
    velocity = (shift[last] - shift[before]) / max(1, last - before)
    result[last:] = shift[last:] - shift[last] - velocity * np.arange(len(shift) - last)[:, None]
    return result


def _hermite(piece: Floats) -> Floats:
    """Return the cubic (n, 3) through the ends of piece (n, 3) with its velocities there."""
    n = len(piece)
    if n < 4:
        return piece
    slope = np.gradient(piece, axis=0)
    v0, v1 = slope[:2].mean(axis=0) * (n - 1), slope[-2:].mean(axis=0) * (n - 1)
    s = np.linspace(0.0, 1.0, n)[:, None]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * piece[0]
        + (s**3 - 2 * s**2 + s) * v0
        + (3 * s**2 - 2 * s**3) * piece[-1]
        + (s**3 - s**2) * v1
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LambdaFit:
    """Lambda's diagonal from a calibration with a still shoulder."""

    weight: Floats
    """(3,): l11, l22, l33."""
    explained: Floats
    """(3,): how much of the variance of dS_a/dt it explains; near 0 the figure means nothing."""
    repetitions: int


def fit_lambda(s_a: Floats, s_b: Floats, cycles: list[int], rate_hz: float) -> LambdaFit:
    """Return lambda from S_a and S_b (n, 3) of repeated movement with a still shoulder, by eq 9.

    In each repetition polynomials are fitted to both; per axis dS_a/dt = constant + lambda dS_b/dt over all
    repetitions, by least squares, dP_s/dt being constant there. Raises ValueError without two repetitions.
    """
    if len(cycles) < 3:
        raise ValueError(
            f"lambda needs repetitions of a movement, about 20; there are {max(0, len(cycles) - 1)}"
        )
    slopes: list[tuple[Floats, Floats]] = []
    for begin, end in pairwise(cycles):
        u = np.linspace(-1.0, 1.0, end - begin)
        powers = np.vander(u, DEGREE + 1, increasing=True)
        per_second = 2.0 * rate_hz / max(1, end - begin - 1)
        derivative = np.zeros_like(powers)
        derivative[:, 1:] = powers[:, :-1] * np.arange(1, DEGREE + 1) * per_second
        both = np.concatenate([s_a[begin:end], s_b[begin:end]], axis=1)
        fitted = derivative @ np.linalg.lstsq(powers, both, rcond=None)[0]
        slopes.append((fitted[:, :3], fitted[:, 3:]))
    d_a, d_b = (np.concatenate(parts) for parts in zip(*slopes, strict=True))
    d_a, d_b = d_a - d_a.mean(axis=0), d_b - d_b.mean(axis=0)
    weight = (d_a * d_b).sum(axis=0) / (d_b * d_b).sum(axis=0)
    left = ((d_a - weight * d_b) ** 2).sum(axis=0) / (d_a * d_a).sum(axis=0)
    return LambdaFit(weight=weight, explained=1.0 - left, repetitions=len(cycles) - 1)
