"""When an arm is at rest: shoulder, upper arm and forearm. Pure.

A sensor cannot tell rest from steady speed. In the middle of a shrug the acceleration passes through zero at
the greatest speed, and a short look at gyroscope and spread of acceleration calls that a rest. What tells
them apart is time: over half a second the acceleration of a movement changes.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from brachium_fusion.shoulder_model import Bools, Floats

WINDOW_S = 0.5
RATE = 0.10
"""rad/s: neither sensor turns faster within the window."""
SPREAD = 0.05
"""m/s^2: the shoulder's acceleration spreads less within the window, by either sensor."""


def rests(speed_change: Floats, step_s: float, fastest: Floats, noise: float = 0.0) -> Bools:
    """Return which of k + 1 knots lie within a rest.

    `speed_change` (k, 6) m/s is Increments.velocity, `fastest` (k + 1,) rad/s the faster sensor's rate at the
    knots, `noise` m/s^2 the spread at a rest that is known.
    """
    acceleration = speed_change / step_s
    width = max(3, round(WINDOW_S / step_s)) | 1
    mean = uniform_filter1d(acceleration, width, axis=0, mode="nearest")
    square = uniform_filter1d(acceleration**2, width, axis=0, mode="nearest")
    variance = np.maximum(square - mean**2, 0.0)
    spread = np.sqrt(variance.reshape(-1, 2, 3).sum(axis=2).max(axis=1))
    quiet = spread < max(SPREAD, 3.0 * noise)
    knots = np.concatenate([quiet[:1], quiet[1:] & quiet[:-1], quiet[-1:]])
    slow = maximum_filter1d(fastest, width, mode="nearest") < RATE
    result: Bools = knots & slow
    return result


def runs(flags: Bools) -> list[tuple[int, int]]:
    """Return (first, end) of each run of True in flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
