"""Since when a sensor is still. Pure.

Whoever waits for a pose asks at each instant; otherwise nobody does, so batches are looked at many at once.
"""

from itertools import chain

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

STILL_RAD_S = 0.15
"""A sensor turning slower than this is still: above hand tremor and sway, far below any movement."""
TOGETHER = 32
"""Batches that wait at most until they are looked at: more would hold on to their samples for seconds."""


class Stillness:
    """Takes a sensor's rates; tells from when on all of them were still."""

    def __init__(self, since_ns: int = 0) -> None:
        self._since_ns = since_ns
        self._waiting: list[tuple[Floats, list[int]]] = []

    def see(self, gyr: Floats, times_ns: list[int]) -> None:
        """Take a batch: rates (n, 3) rad/s and their instants, host time."""
        if self._since_ns == 0:
            self._since_ns = times_ns[0]
        self._waiting.append((gyr, times_ns))
        if len(self._waiting) >= TOGETHER:
            self._look()

    @property
    def since_ns(self) -> int:
        """Host time; 0 before any sample."""
        if self._waiting:
            self._look()
        return self._since_ns

    def _look(self) -> None:
        rates = np.concatenate([gyr for gyr, _ in self._waiting])
        moving = np.flatnonzero(np.einsum("ij,ij->i", rates, rates) > STILL_RAD_S**2)
        if len(moving):
            times_ns = list(chain.from_iterable(times for _, times in self._waiting))
            self._since_ns = times_ns[moving[-1]] + 1
        self._waiting.clear()
