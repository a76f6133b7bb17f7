"""The magnetic field where a sensor is: the earth's, disturbed as it is indoors."""

from dataclasses import dataclass

import numpy as np

from brachium_nodes.movement import Array, Variation
from brachium_nodes.sensors import FIELD_UT
from brachium_wire.messages import Vector

CORRELATION_S = 2.0
"""The disturbance's autocorrelation over a lag of t is exp(-(t / CORRELATION_S)^2 / 2)."""
_WAVES = 32
_NEAREST_M = 0.02
"""No sensor comes nearer to a magnet's middle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Magnet:
    """A magnet that stays where it is, as a dipole; an arm that passes it sees its field come and go."""

    place_m: Vector
    """In world axes from the chest as it is in neutral."""
    moment: Vector = (0.0, 0.0, 1.0)
    """A m^2: 1 gives 200 uT at 10 cm along its axis (a loudspeaker, the frame of a desk)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What disturbs the field, beyond each chip's own errors."""

    disturbance_ut: float = 0.0
    """Standard deviation along each world axis of a field that wanders, for each sensor its own."""
    magnet: Magnet | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for what is no disturbance."""
        if not 0.0 <= self.disturbance_ut <= 100.0:
            raise ValueError(f"disturbance {self.disturbance_ut} uT cannot be used; give 0 to 100 uT")

    def field_ut(self, t: Array, place: Array, variation: Variation) -> Array:
        """Return the field (n, 3) uT, world axes, at times (n,) s and places (n, 3) m from neutral's chest.

        `variation` is one sensor's.
        """
        field: Array = np.broadcast_to(FIELD_UT, place.shape)
        if self.disturbance_ut:
            field = field + self.disturbance_ut * wandering(t, variation)
        if self.magnet is not None:
            field = field + dipole_ut(place - np.array(self.magnet.place_m), np.array(self.magnet.moment))
        return field


def wandering(t: Array, variation: Variation) -> Array:
    """Return a random vector (n, 3) of standard deviation 1 along each axis, at times (n,) s.

    It is a sum of waves whose frequencies are spread as the spectrum of its autocorrelation is: normally.
    """
    from scipy.special import ndtri  # at its use: few wearers move in a disturbed field, all must start

    index = np.arange(_WAVES)
    axes = []
    for axis in "xyz":
        share = (index + variation.uniform(f"magnetic/{axis}/frequency", index)) / _WAVES
        turn = ndtri(0.5 + 0.5 * np.minimum(share, 1.0 - 1e-6)) / CORRELATION_S
        phase = 2.0 * np.pi * variation.uniform(f"magnetic/{axis}/phase", index)
        axes.append(np.sin(t[:, None] * turn + phase).sum(axis=1) * np.sqrt(2.0 / _WAVES))
    return np.stack(axes, axis=-1)


def dipole_ut(away: Array, moment: Array) -> Array:
    """Return a dipole's field (n, 3) uT at places (n, 3) m away from it; `moment` (3,) A m^2."""
    r = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), _NEAREST_M)
    along = (away @ moment)[:, None]
    field: Array = 0.1 * (3.0 * along * away / r**5 - moment / r**3)
    return field
