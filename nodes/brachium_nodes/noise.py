"""What is random in a sensor from sample to sample: white noise, and the walk of the gyro's bias.

Both are drawn for blocks of about one second, each from the seed and its own number, so that samples far into
a session need no past.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, sqrt

import numpy as np

from brachium_nodes.movement import Array
from brachium_nodes.sensors import Errors, generator

_PAGE = 4096
"""Blocks whose walk is drawn at once: more than an hour."""


@dataclass(frozen=True, slots=True)
class Noise:
    """The noise of one sensor at one rate."""

    errors: Errors
    seed: int
    segment: str
    rate_hz: float

    @property
    def size(self) -> int:
        """Samples in a block."""
        return ceil(self.rate_hz)

    def block(self, number: int) -> tuple[Array, Array]:
        """Return one block's white noise (3, size, 3) of variance 1 for acceleration, rate and field, and the
        drift (size, 3) rad/s of the gyro's bias: straight between a block's ends."""
        random = generator(self.seed, self.segment, "noise", number)
        page, row = divmod(number, _PAGE)
        walk = _walk(self, page)
        share = (np.arange(self.size) / self.size)[:, None]
        return random.standard_normal((3, self.size, 3)), walk[row] + share * (walk[row + 1] - walk[row])

    def span(self, first: int, count: int) -> tuple[Array, Array]:
        """Return white noise (3, count, 3) and drift (count, 3) of samples from number `first` on."""
        start = first // self.size
        blocks = [self.block(number) for number in range(start, (first + count - 1) // self.size + 1)]
        cut = slice(first - start * self.size, first - start * self.size + count)
        white = np.concatenate([white for white, _ in blocks], axis=1)
        return white[:, cut], np.concatenate([drift for _, drift in blocks])[cut]


@lru_cache(maxsize=64)
def _walk(noise: Noise, page: int) -> Array:
    """Return the walk (_PAGE + 1, 3) rad/s at the ends of a page's blocks."""
    start = _walk(noise, page - 1)[-1] if page else np.zeros(3)
    random = generator(noise.seed, noise.segment, "walk", page)
    steps = noise.errors.gyro_walk * sqrt(noise.size / noise.rate_hz) * random.standard_normal((_PAGE, 3))
    walk: Array = start + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return walk
