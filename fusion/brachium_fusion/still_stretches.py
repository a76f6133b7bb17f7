"""Where a sensor lay or was held still, told without knowing its biases. Pure."""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

WINDOW_S = 0.5
GYRO_SPREAD = 0.02
"""rad/s, standard deviation of an axis in the window: thirty times a cheap gyro's noise."""
ACCEL_SPREAD = 0.12
"""m/s^2: four times a cheap accelerometer's noise at 100 Hz."""


def still_stretches(gyr: Floats, acc: Floats, rate_hz: float, shortest_s: float) -> list[slice]:
    """Return the stretches of rows in which angular rate (n, 3) and specific force (n, 3) do not vary.

    Levels do not count, only spreads: an uncalibrated gyroscope turns while it lies still.
    """
    width = max(2, round(WINDOW_S * rate_hz))
    if len(gyr) < width:
        return []
    quiet = (_spread(gyr, width) < GYRO_SPREAD) & (_spread(acc, width) < ACCEL_SPREAD)
    found = []
    for first, last in runs(quiet):
        stretch = slice(first, last + width - 1)
        if stretch.stop - stretch.start >= shortest_s * rate_hz:
            found.append(stretch)
    return found


def runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, end) of each run of True in flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _spread(values: Floats, width: int) -> Floats:
    """Return the largest axis' standard deviation in each window of rows: (n - width + 1,)."""
    centred = values - values.mean(axis=0)
    sums = np.cumsum(np.vstack([np.zeros(3), centred]), axis=0)
    squares = np.cumsum(np.vstack([np.zeros(3), centred**2]), axis=0)
    mean = (sums[width:] - sums[:-width]) / width
    variance = (squares[width:] - squares[:-width]) / width - mean**2
    spread: Floats = np.sqrt(np.maximum(variance, 0.0)).max(axis=1)
    return spread
