"""When an arm is at rest: shoulder, upper arm and forearm. Pure.

A sensor cannot tell rest from steady speed. In the middle of a shrug the acceleration passes through zero at
the greatest speed, and a short look at gyroscope and spread of acceleration calls that a rest. What tells
them apart is time: over half a second the acceleration of a movement changes.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from brachium_fusion.shoulder_model import FARTHEST_M, Bools, Floats

WINDOW_S = 0.5
RATE = 0.10
"""rad/s: neither sensor turns faster, over an interval, within the window."""
SPREAD = 0.05
"""m/s^2: the shoulder's acceleration spreads less within the window, by either sensor."""

LOUDEST = 2.0
"""m/s^2 rms over some 2 s: a shrug has 0.4, the shoulder of a person who walks 2 to 4."""
LISTEN_S = 2.0
SLOW_M_S = 0.05
EARLY_M_S2 = 0.1
"""A shoulder that is slow and does not accelerate needs less time to show that it rests."""


def rests(speed_change: Floats, step_s: float, fastest: Floats, speed: Floats | None = None) -> Bools:
    """Return which of k + 1 knots lie within a rest.

    `speed_change` (k, 6) m/s is Increments.velocity, `fastest` (k,) rad/s the mean rate over each interval of
    the sensor that turns faster; `speed` (k + 1, 3) m/s is the shoulder's, if there is an estimate already:
    where it is slow, less time shows a rest.
    """
    acceleration = speed_change / step_s
    knots = _quiet(acceleration, fastest, max(3, round(WINDOW_S / step_s)) | 1)
    if speed is None:
        return knots
    slow = np.linalg.norm(speed, axis=1) < SLOW_M_S
    level = np.median(acceleration[knots[1:] & knots[:-1]], axis=0) if knots[1:].any() else np.zeros(6)
    steady = np.abs(acceleration - level).max(axis=1) < EARLY_M_S2
    beside = np.concatenate([steady[:1], steady[1:] & steady[:-1], steady[-1:]])
    result: Bools = knots | (slow & beside & _quiet(acceleration, fastest, 1))
    return result


def broken(speed_change: Floats, step_s: float, place: Floats | None = None) -> Bools:
    """Return the intervals (k,) in which a person walks, or something else moves more than a girdle can.

    `speed_change` as above; `place` (k + 1, 3) m is where the shoulder seems to be, if that is known already.
    """
    mean = 0.5 * (speed_change[:, :3] + speed_change[:, 3:]) / step_s
    around = max(1, round(LISTEN_S / step_s)) | 1
    power = uniform_filter1d(np.square(mean).sum(axis=1), around, mode="nearest")
    loud: Bools = np.asarray(power > LOUDEST**2)
    if place is not None:
        far = np.linalg.norm(place, axis=1) > FARTHEST_M
        loud = loud | far[1:] | far[:-1]
    near: Floats = np.asarray(maximum_filter1d(loud.astype(np.float64), around, mode="nearest"))
    return near > 0.5


def _quiet(acceleration: Floats, fastest: Floats, width: int) -> Bools:
    """Return the knots (k + 1,) with quiet windows of `width` intervals on both sides."""
    mean = uniform_filter1d(acceleration, width, axis=0, mode="nearest")
    square = uniform_filter1d(acceleration**2, width, axis=0, mode="nearest")
    variance = np.maximum(square - mean**2, 0.0)
    spread = np.sqrt(variance.reshape(-1, 2, 3).sum(axis=2).max(axis=1))
    quiet = (spread < SPREAD) & (maximum_filter1d(fastest, width, mode="nearest") < RATE)
    knots: Bools = np.concatenate([quiet[:1], quiet[1:] & quiet[:-1], quiet[-1:]])
    return knots
