"""How smooth a movement is: SPARC and LDLJ of its speed. Pure.

Balasubramanian et al. 2015, "On the analysis of movement smoothness": the spectral arc length of the speed,
and the logarithm of its dimensionless jerk. Closer to 0 is smoother in both.
"""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

CUTOFF_HZ = 10.0
"""Of SPARC: no voluntary movement of an arm is faster. It is printed beside every value."""
PADDING = 4
"""Zeros that make the spectrum this many powers of two finer."""
THRESHOLD = 0.05
"""Of the largest magnitude: the arc ends at the last frequency that is above it."""
LDLJ_RATE_HZ = 100.0
"""LDLJ loses samples at both ends, so its value depends on the rate: it is always taken at this one."""


def sparc(speed: Floats, rate_hz: float, cutoff_hz: float = CUTOFF_HZ) -> float:
    """Return the spectral arc length of the speed (n,) of one movement, any unit; NaN for one at rest.

    The spectrum is scaled by its largest magnitude, and ends at the last frequency at most `cutoff_hz` whose
    magnitude is THRESHOLD or more.
    """
    size = 2 ** (int(np.ceil(np.log2(len(speed)))) + PADDING)
    magnitude = np.abs(np.fft.rfft(speed, size))
    frequency = np.fft.rfftfreq(size, 1.0 / rate_hz)
    if not magnitude.max() > 0.0:
        return float("nan")
    magnitude = (magnitude / magnitude.max())[frequency <= cutoff_hz]
    frequency = frequency[frequency <= cutoff_hz]
    last = int(np.flatnonzero(magnitude >= THRESHOLD)[-1])
    if last == 0:
        return float("nan")
    along = np.diff(frequency[: last + 1]) / frequency[last]
    return -float(np.sum(np.hypot(along, np.diff(magnitude[: last + 1]))))


def ldlj(speed: Floats, rate_hz: float) -> float:
    """Return the logarithm of the dimensionless jerk of the speed (n,) of one movement.

    -ln(T^3 / peak^2 * integral of (second derivative of the speed)^2), T the movement's n samples. Values
    compare only at one rate: `at_ldlj_rate` brings a speed to it. NaN for a movement at rest.
    """
    peak = float(np.abs(speed).max(initial=0.0))
    if len(speed) < 4 or peak == 0.0:
        return float("nan")
    jerk = np.diff(speed, 2) * rate_hz**2
    duration = len(speed) / rate_hz
    return -float(np.log(duration**3 / peak**2 * np.sum(jerk**2) / rate_hz))


def at_ldlj_rate(speed: Floats, rate_hz: float) -> Floats:
    """Return the speed (n,), n >= 4, resampled from one even rate to LDLJ_RATE_HZ.

    By a cubic spline (not a knot next to its ends): straight lines would add jerk.
    """
    bend = _bend(speed)
    at = rate_hz * np.arange(0.0, (len(speed) - 1) / rate_hz + 1e-9, 1.0 / LDLJ_RATE_HZ)
    i = np.minimum(at.astype(np.int64), len(speed) - 2)
    right, left = at - i, 1.0 - (at - i)
    straight = left * speed[i] + right * speed[i + 1]
    return np.asarray(straight + (left**3 - left) * bend[i] + (right**3 - right) * bend[i + 1])


def _bend(values: Floats) -> Floats:
    """Return a sixth of the spline's second derivative (n,) at even values (n,), times the step squared.

    bend[i - 1] + 4 bend[i] + bend[i + 1] is the second difference at i. Not a knot: the first three are on a
    line, and the last three, so the second one is a sixth of its difference. Solved by elimination.
    """
    second = np.diff(values, 2)
    inner = (second / 6.0).tolist()
    weights = [0.0]
    for i, difference in enumerate(second.tolist()[1:-1], start=1):
        weight = 1.0 / (4.0 - weights[-1])
        inner[i] = (difference - inner[i - 1]) * weight
        weights.append(weight)
    for i in range(len(inner) - 2, 0, -1):
        inner[i] -= weights[i] * inner[i + 1]
    ends = 2.0 * inner[0] - inner[1], 2.0 * inner[-1] - inner[-2]
    return np.array([ends[0], *inner, ends[1]])
