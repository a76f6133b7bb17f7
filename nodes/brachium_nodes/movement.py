"""Smooth movement as a function of time: minimum-jerk steps, repetitions that differ a little, slow wander.

Nothing here keeps state, so a movement can be asked for at any instant, in any order: what is random is drawn
from the seed and the number of the repetition.
"""

from dataclasses import dataclass
from functools import lru_cache
from zlib import crc32

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_MASK = (1 << 64) - 1
_DURATION_SPREAD = 0.08
"""A repetition begins within +-4 % of its period around its beat."""
_EXTENT_SPREAD = 0.05
"""A repetition reaches 97.5 to 102.5 % of the stated way: trained movements repeat within a few per cent."""


def minimum_jerk(u: npt.ArrayLike) -> Array:
    """Return the step from 0 (u <= 0) to 1 (u >= 1) of least jerk (Flash and Hogan 1985); it is C2."""
    u = np.clip(np.asarray(u, dtype=np.float64), 0.0, 1.0)
    step: Array = u * u * u * (10.0 + u * (-15.0 + 6.0 * u))
    return step


def eased(t: npt.ArrayLike, rise_s: float) -> Array:
    """Return a time that stands at 0 until t = 0 and runs at full pace from t = rise_s on: the integral of
    `minimum_jerk(t / rise_s)`, so it is C3."""
    t = np.asarray(t, dtype=np.float64)
    u = np.clip(t / rise_s, 0.0, 1.0)
    return rise_s * u**4 * (2.5 - 3.0 * u + u * u) + np.maximum(t - rise_s, 0.0)


def at_least(value: Array, limit: float, *, within: float) -> Array:
    """Return the value (n,), or the limit where it is less; near it, `within` about, the way is smooth."""
    result: Array = 0.5 * (value + limit + np.sqrt((value - limit) ** 2 + within**2))
    return result


@dataclass(frozen=True, slots=True)
class Variation:
    """The natural variation of one arm of one person: everything random about its movement."""

    seed: int
    side: str = "right"

    def uniform(self, name: str, index: npt.ArrayLike) -> Array:
        """Return numbers in [0, 1) for indices (...) that depend on seed, side, name and index alone.

        The finaliser of SplitMix64 (Steele, Lea, Flood 2014) scatters the index; it needs no state.
        """
        key = (self.seed * 0xD1342543DE82EF95 + crc32(f"{self.side}/{name}".encode())) & _MASK
        z = np.atleast_1d(np.asarray(index)).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(
            key
        )
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
        z = z ^ (z >> np.uint64(31))
        return ((z >> np.uint64(11)).astype(np.float64) * 2.0**-53).reshape(np.shape(index))

    def repetitions(self, t: Array, period_s: float) -> tuple[Array, Array]:
        """Return for times (n,) the number of the repetition and the fraction of it that has passed.

        Repetition 0 begins at 0; before it the fraction is 0.
        """
        beat = np.maximum(np.floor(t / period_s), 0.0)
        number = beat - (t < self._start(beat, period_s)) + (t >= self._start(beat + 1.0, period_s))
        number = np.maximum(number, 0.0)
        start, end = self._start(number, period_s), self._start(number + 1.0, period_s)
        return number, np.clip((t - start) / (end - start), 0.0, 1.0)

    def extent(self, number: Array) -> Array:
        """Return how far each repetition goes, about 1."""
        return 1.0 + _EXTENT_SPREAD * (self.uniform("extent", number) - 0.5)

    def wander(self, name: str, t: Array, slowest_hz: float, fastest_hz: float) -> Array:
        """Return a slow random movement (n,) of standard deviation 1: a sum of six sinusoids."""
        turn, phase = _waves(self, name, slowest_hz, fastest_hz)
        result: Array = np.sin(turn * t[:, None] + phase).sum(axis=1) * np.sqrt(2.0 / len(turn))
        return result

    def _start(self, number: Array, period_s: float) -> Array:
        jitter = _DURATION_SPREAD * (self.uniform("start", number) - 0.5)
        return period_s * (number + np.where(number > 0.0, jitter, 0.0))


@lru_cache(maxsize=512)
def _waves(variation: Variation, name: str, slowest_hz: float, fastest_hz: float) -> tuple[Array, Array]:
    """Return angular frequencies in rad/s and phases of six sinusoids, spread over the band."""
    terms = np.arange(6)
    spread = (terms + variation.uniform(f"{name}/frequency", terms)) / len(terms)
    turn = 2.0 * np.pi * (slowest_hz + (fastest_hz - slowest_hz) * spread)
    return turn, 2.0 * np.pi * variation.uniform(f"{name}/phase", terms)
