"""What one sensor felt while its wearer hung, raised and bent an arm. Pure."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Floats = npt.NDArray[np.float64]
Motion = Literal["hang", "raise", "bend"]
Rows = tuple[int, int]
"""First row and the one after the last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WearRecord:
    """One node's readings during the check."""

    gyr: Floats
    """(n, 3) rad/s, sensor axes; a bias does no harm."""
    acc: Floats
    """(n, 3) m/s^2."""
    nominal_mounting: Floats
    """segment_from_sensor (4,) as it should be worn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Felt:
    """What a sensor felt, in its own axes."""

    up: Floats
    """Unit vector (3,) while hanging."""
    restless_rad: float
    """Standard deviation of its orientation while hanging; tremor, being fast, hardly counts."""
    raised: Floats
    """Rotation vector (3,) rad to where it was turned furthest."""
    bent: Floats
    from_joint_m: float
    """Distance from the axis about which it turned in the bend; 0 if it hardly turned."""


SLOW_HZ = 3.0
"""What a person does on request is slower; tremor is faster (4 to 12 Hz)."""
TURNED_RAD = 0.35
"""Below this a distance from the axis cannot be told."""


def felt(record: WearRecord, spans: dict[Motion, Rows], rate_hz: float) -> Felt:
    """Return what one sensor felt in the three spans."""
    from scipy.signal import butter, sosfiltfilt  # at its use: most of the time in which fusion would start

    hang = slice(*spans["hang"])
    bias = record.gyr[hang].mean(axis=0)
    force = record.acc[hang].mean(axis=0)
    low_pass = butter(2, SLOW_HZ, fs=rate_hz, output="sos")
    rate, acc = (sosfiltfilt(low_pass, v, axis=0) for v in (record.gyr - bias, record.acc))
    raised, _ = _furthest(rate[slice(*spans["raise"])], rate_hz)
    bend = slice(*spans["bend"])
    bent, start_from_sensor = _furthest(rate[bend], rate_hz)
    distance = 0.0
    if np.linalg.norm(bent) > TURNED_RAD:
        distance = _from_axis(rate[bend], acc[bend], force, start_from_sensor, bent, rate_hz)
    return Felt(
        up=force / np.linalg.norm(force),
        restless_rad=_sway(rate[hang], rate_hz),
        raised=raised,
        bent=bent,
        from_joint_m=distance,
    )


def _furthest(rate: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Return the largest turn from the span's start (3,) rad, and start_from_sensor (n, 4) at each row."""
    q = np.empty((len(rate), 4))
    q[0] = rotation.IDENTITY
    steps = rotation.from_rotation_vector(rate / rate_hz)
    for i in range(1, len(rate)):
        q[i] = rotation.multiply(q[i - 1], steps[i])
    turns = rotation.to_rotation_vector(q)
    return turns[int(np.argmax(np.linalg.norm(turns, axis=1)))], q


def _sway(rate: Floats, rate_hz: float) -> float:
    """Return the standard deviation of the angle, rad: of the largest component."""
    angle = np.cumsum(rate, axis=0) / rate_hz
    return float((angle - angle.mean(axis=0)).std(axis=0).max())


def _from_axis(
    rate: Floats, acc: Floats, force: Floats, start_from_sensor: Floats, turn: Floats, rate_hz: float
) -> float:
    """Return how far from its axis of rotation a sensor is, m, with least squares of
    acc - gravity = a x r + w x (w x r), the axis itself at rest."""
    gravity = rotation.rotate(rotation.inverse(start_from_sensor), force)
    angular = np.gradient(rate, 1.0 / rate_hz, axis=0)
    skew = rotation.cross_matrix(rate)
    design = (rotation.cross_matrix(angular) + skew @ skew).reshape(-1, 3)
    r, *_ = np.linalg.lstsq(design, (acc - gravity).reshape(-1), rcond=1e-3)
    axis = turn / np.linalg.norm(turn)
    return float(np.linalg.norm(r - axis * (r @ axis)))
