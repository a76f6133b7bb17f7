"""What a magnetometer on a tilt-levelled sensor measures, averaged over steps of time. Pure.

In a frame whose z axis is vertical but whose heading drifts (a filter without magnetometer), the measured
field is, to first order,

    R m = Rz(offset) (0, horizontal, vertical) + R b + R S m - lag R (m x w) + noise

R levels the sensor, b is what is left of hard iron, S of soft iron, scale and axes of the magnetometer, and
`lag` the time by which the magnetometer is behind the gyroscope: a quick turn of 400 deg/s with 15 ms shows
as 6 deg of heading, all to one side while the turn goes on. `offset` is the heading that the drifting frame
lacks: world_from_sensor = Rz(offset) R. Everything but `offset` enters linearly, by columns of `response`.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Floats = npt.NDArray[np.float64]

CALIBRATION = 13
"""Columns of the response: lag (1), hard iron (3), soft iron row by row (9)."""
HARD_IRON = slice(1, 4)
SOFT_IRON = slice(4, 13)
LAG_SD_S = 0.01
"""Conversion and filtering of a magnetometer take up to some 20 ms; the gyroscope's own filter less."""
INDEPENDENT_RAD = 0.5
"""A sensor has to turn this far before the field that it meets tells something new: deviations belong to
places and attitudes, so that resting in one of them for a minute says no more than a moment does."""
REST_SHARE = 0.003
"""What a moment of rest still counts for, as a part of what one of movement does."""
MOVING_RAD_S = 0.1
"""At this mean rate the gyroscope's scale, and not its bias at rest, makes the heading drift."""
HEADING_NOISE = 5.2e-4
"""rad/sqrt(s): 0.03 deg of heading in a second by noise and by the unsteadiness of the bias in movement."""
SCALE_NOISE = 0.003
"""rad/sqrt(s) of heading for each rad/s of turning: its scale and axes are some 0.3 percent off."""


@dataclass(frozen=True, slots=True, eq=False)
class FieldSteps:
    """Averages over k steps of time."""

    field: Floats
    """(k, 3) the measured field in the levelled, drifting frame, in the magnetometer's unit."""
    response: Floats
    """(k, 3, CALIBRATION) what a unit of each calibration term adds to `field`."""
    rate: Floats
    """(k,) mean angular rate, rad/s."""
    share: Floats
    """(k,) part of each step's samples with a magnetometer value; `field` and `response` are 0 without."""


def field_steps(levelled: Floats, gyr: Floats, mag: Floats, count: int) -> FieldSteps:
    """Return averages over every `count` samples; the samples after the last whole step are left out.

    `levelled` (n, 4) takes the sensor's axes to a frame with z up, `gyr` (n, 3) is free of bias, `mag` (n, 3)
    has rows of NaN where there is no value.
    """
    k = len(gyr) // count
    n = k * count
    matrix = rotation.to_matrix(levelled[:n])
    rate = np.sqrt(np.einsum("ij,ij->i", gyr[:n], gyr[:n])).reshape(k, count).mean(axis=1)
    had = ~np.isnan(mag[:n, 0])
    if had.all():
        values, held, used = mag[:n], np.full(k, float(count)), matrix
    else:
        values = np.where(had[:, None], mag[:n], 0.0)
        held = had.reshape(k, count).sum(axis=1).astype(float)
        used = matrix * had[:, None, None]
    mean = 1.0 / np.maximum(held, 1.0)
    columns = np.empty((k, 3, CALIBRATION))
    # Sums over a step of products of two of a sample's quantities are matrix products.
    pairs = np.empty((n, 6))
    pairs[:, :3] = values
    x, y, z = values.T
    p, q, r = gyr[:n].T
    pairs[:, 3], pairs[:, 4], pairs[:, 5] = r * y - q * z, p * z - r * x, q * x - p * y
    by_axis = used.reshape(k, count, 9).swapaxes(1, 2) @ pairs.reshape(k, count, 6)
    by_axis = by_axis.reshape(k, 3, 3, 6) * mean[:, None, None, None]
    field = by_axis[:, :, 0, 0] + by_axis[:, :, 1, 1] + by_axis[:, :, 2, 2]
    columns[:, :, 0] = -(by_axis[:, :, 0, 3] + by_axis[:, :, 1, 4] + by_axis[:, :, 2, 5])
    columns[:, :, HARD_IRON] = used.reshape(k, count, 3, 3).sum(axis=1) * mean[:, None, None]
    columns[:, :, SOFT_IRON] = by_axis[..., :3].reshape(k, 3, 9)
    return FieldSteps(field, columns, rate, held / count)


def looks(rate: Floats, step_s: float, apart_s: float) -> Floats:
    """Return how many independent looks at the field steps of `step_s` at mean rates (rad/s) are worth,
    one being worth `apart_s` of movement."""
    count: Floats = np.minimum(1.0, REST_SHARE + rate / INDEPENDENT_RAD) * (step_s / apart_s)
    return count


def heading_variance(rate: Floats, step_s: float) -> Floats:
    """Return the variance, rad^2, by which the heading of a frame without magnetometer drifts in a step."""
    moving = np.minimum(1.0, rate / MOVING_RAD_S)
    variance: Floats = (HEADING_NOISE**2 * (REST_SHARE + moving) + (SCALE_NOISE * rate) ** 2) * step_s
    return variance
