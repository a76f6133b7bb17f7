"""Skin and muscle under a sensor: a slow turn that follows the joints, a wobble that follows acceleration."""

import cmath
from functools import lru_cache
from math import ceil, pi, sqrt

import numpy as np
import numpy.typing as npt

from brachium_nodes.movement import Array

Complex = npt.NDArray[np.complex128]

NEIGHBOURS: dict[str, tuple[str, ...]] = {
    "upper_arm": ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion"),
    "forearm": ("elbow_flexion", "forearm_pronation", "wrist_flexion"),
    "hand": ("wrist_flexion", "wrist_deviation"),
    "sternum": ("shoulder_flexion", "shoulder_abduction"),
}
"""Joints whose movement pulls the skin of a part."""

LAGS: dict[str, str] = {"upper_arm": "shoulder_rotation", "forearm": "forearm_pronation"}
"""The rotation about a part's own length that its skin follows in part."""

WOBBLE_HZ = 7.0
DAMPING = 0.3
"""Of the sensor on its skin, as a mass on a damped spring; assumptions of this project."""
_W = 2.0 * pi * WOBBLE_HZ
_POLE = _W * complex(-DAMPING, sqrt(1.0 - DAMPING**2))
BLOCK = 128
"""Rows: a live packet with its second of warm-up at 100 Hz is one block."""
TIP_M = 0.06
"""A shift by this much along the skin would tip the sensor by 1 rad."""
WARM_UP_S = 1.0
"""After this time nothing is left of how the wobble began: exp(-13)."""


def pull(angles: dict[str, Array], part: str) -> Array:
    """Return how far each neighbouring joint pulls, (n, joints): 0 in neutral, 1 at 90 deg, and a little more
    beyond."""
    return np.stack([sqrt(2.0) * np.sin(0.5 * angles[name]) for name in NEIGHBOURS[part]], axis=-1)


def wobble(acceleration: Array, period_s: float) -> tuple[Array, Array, Array]:
    """Return shift, its velocity and its acceleration (n, 3) of the sensor against the bone, in segment axes.

    `acceleration` (n, 3) is the bone's, without gravity, once every `period_s` s and straight in between; the
    shift is at rest in 0 a period before its first row: x'' + 2 z w x' + w^2 x = -acceleration.
    """
    # With z' = p z - acceleration for one of the two poles p the shift is Im z / Im p. A block of rows is one
    # product: the filters of scipy.signal take a second to import, at each start of an emulated wearer.
    fading, since, before, now = _oscillator(period_s)
    driven = -now * acceleration
    driven[1:] -= before * acceleration[:-1]
    z = np.empty(driven.shape, dtype=np.complex128)
    last = np.zeros(3, dtype=np.complex128)
    for begin in range(0, len(z), BLOCK):
        block = driven[begin : begin + BLOCK]
        n = len(block)
        z[begin : begin + n] = fading[:n, :n] @ block + since[:n, None] * last
        last = z[begin + n - 1]
    shift, velocity = z.imag / _POLE.imag, (_POLE * z).imag / _POLE.imag
    return shift, velocity, -acceleration - 2.0 * DAMPING * _W * velocity - _W * _W * shift


@lru_cache(maxsize=16)
def _oscillator(period_s: float) -> tuple[Complex, Complex, complex, complex]:
    """Return what is left of row j in row i of a block (BLOCK, BLOCK), what is left there of the row before
    the block (BLOCK,), and what a row takes of the force in the row before and in its own."""
    power = np.arange(BLOCK)
    left = np.exp(_POLE * period_s * power)
    fading = np.tril(left[np.maximum(power[:, None] - power, 0)])
    step = cmath.exp(_POLE * period_s)
    constant = (step - 1.0) / _POLE
    now = (constant / period_s - 1.0) / _POLE
    return fading, step * left, constant - now, now


def warm_up(period_s: float) -> int:
    """Return the number of instants by which the wobble must be begun early."""
    return ceil(WARM_UP_S / period_s)


def tip(shift: Array) -> Array:
    """Return the rotation vectors (n, 3) rad by which shifts (n, 3) m tip a sensor: about the axes across the
    segment."""
    return np.stack([-shift[:, 2], np.zeros(len(shift)), shift[:, 0]], axis=-1) / TIP_M
