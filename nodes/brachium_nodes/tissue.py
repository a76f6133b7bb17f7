"""Skin and muscle under a sensor: a slow turn that follows the joints, a wobble that follows acceleration."""

from functools import lru_cache
from math import ceil, pi, sqrt
from typing import Any

import numpy as np
from scipy.signal import cont2discrete, lfilter

from brachium_nodes.movement import Array

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
    shift is at rest in 0 at its first row: x'' + 2 z w x' + w^2 x = -acceleration.
    """
    (b, a), (b_velocity, a_velocity) = _oscillator(period_s)
    shift: Array = np.asarray(lfilter(b, a, -acceleration, axis=0))
    velocity: Array = np.asarray(lfilter(b_velocity, a_velocity, -acceleration, axis=0))
    return shift, velocity, -acceleration - 2.0 * DAMPING * _W * velocity - _W * _W * shift


@lru_cache(maxsize=16)
def _oscillator(period_s: float) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return numerator and denominator of the digital filters from force to shift and to velocity."""
    denominator = [1.0, 2.0 * DAMPING * _W, _W * _W]
    filters: list[tuple[Array, Array]] = []
    for numerator in ([1.0], [1.0, 0.0]):
        system: Any = cont2discrete((numerator, denominator), period_s, method="foh")
        filters.append((np.ravel(system[0]), np.ravel(system[1])))
    return filters[0], filters[1]


def warm_up(period_s: float) -> int:
    """Return the number of instants by which the wobble must be begun early."""
    return ceil(WARM_UP_S / period_s)


def tip(shift: Array) -> Array:
    """Return the rotation vectors (n, 3) rad by which shifts (n, 3) m tip a sensor: about the axes across the
    segment."""
    return np.stack([-shift[:, 2], np.zeros(len(shift)), shift[:, 0]], axis=-1) / TIP_M
