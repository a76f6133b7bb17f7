"""Least squares over a chain of knots that also share a few constants: its normal equations form an arrow.

Neighbouring knots are coupled, and every knot with the constants: a block-tridiagonal matrix with a border.
Eliminating knot after knot and then the constants is what a Kalman filter and the smoother of Rauch, Tung and
Striebel do, without their predictions (Triggs et al. 2000, section 6). Pure.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_fusion.shoulder_model import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Normal equations of k + 1 knots of size s and of c constants; rows may be added until it is solved."""

    own: Floats
    """(k + 1, s, s)."""
    next: Floats
    """(k, s, s): between a knot and the one after it."""
    shared: Floats
    """(k + 1, s, c + 1): between a knot and the constants, and in the last column its right-hand side."""
    constants: Floats
    """(c + 1, c + 1): of the constants; its last column is their right-hand side."""

    @classmethod
    def empty(cls, intervals: int, size: int, constants: int) -> "Chain":
        """Return equations without any row."""
        return cls(
            np.zeros((intervals + 1, size, size)),
            np.zeros((intervals, size, size)),
            np.zeros((intervals + 1, size, constants + 1)),
            np.zeros((constants + 1, constants + 1)),
        )

    def add_between(
        self, begin: Floats, end: Floats, constant: Floats | None, value: Floats, sd: Floats
    ) -> None:
        """Add rows begin x_k + end x_(k+1) + constant c = value: (k, r, s), (k, r, s), (k, r, c) or none,
        (k, r), sd (k, r)."""
        s = begin.shape[2]
        gram, shared = self._grams(np.concatenate([begin, end], axis=2), constant, value, sd)
        self.own[:-1] += gram[:, :s, :s]
        self.own[1:] += gram[:, s:, s:]
        self.next[:] += gram[:, :s, s:]
        first = self.shared.shape[2] - shared.shape[2]
        self.shared[:-1, :, first:] += shared[:, :s]
        self.shared[1:, :, first:] += shared[:, s:]

    def add_at(
        self,
        knots: npt.NDArray[np.int64],
        own: Floats,
        constant: Floats | None,
        value: Floats,
        sd: Floats,
    ) -> None:
        """Add rows own x_k + constant c = value at the knots numbered (m,), each once: (m, r, s), (m, r, c)
        or none, (m, r), sd (m, r)."""
        gram, shared = self._grams(own, constant, value, sd)
        self.own[knots] += gram
        self.shared[knots, :, self.shared.shape[2] - shared.shape[2] :] += shared

    def _grams(
        self, own: Floats, constant: Floats | None, value: Floats, sd: Floats
    ) -> tuple[Floats, Floats]:
        """Return what rows give to knots (m, s, s) and between knots and the last constants; add to these."""
        weight = 1.0 / sd[..., None]
        own, right = own * weight, value[..., None] * weight
        if constant is not None:
            right = np.concatenate([constant * weight, right], axis=2)
            flat = right.reshape(-1, right.shape[2])
            self.constants[:] += flat.T @ flat
        turned = own.transpose(0, 2, 1)
        return turned @ own, turned @ right

    def solve(self) -> "Solution":
        """Return the values of least squares and their covariances. The chain stays as it is.

        Raises numpy.linalg.LinAlgError when the rows do not determine all values.
        """
        n = len(self.own)
        inverse, gain = np.empty_like(self.own), np.empty_like(self.next)
        half = np.empty_like(self.shared)
        own, shared = self.own[0], self.shared[0]
        for k in range(n):
            inverse[k] = np.linalg.inv(own)
            half[k] = shared
            if k < n - 1:
                gain[k] = inverse[k] @ self.next[k]
                own = self.own[k + 1] - self.next[k].T @ gain[k]
                shared = self.shared[k + 1] - gain[k].T @ shared
        weighted = np.matmul(inverse, half)
        left = self.constants - np.matmul(half.transpose(0, 2, 1), weighted).sum(axis=0)
        constants_covariance = np.linalg.inv(left[:-1, :-1])
        constants = constants_covariance @ left[:-1, -1]
        values, covariance = weighted, inverse
        for k in range(n - 2, -1, -1):
            values[k] -= gain[k] @ values[k + 1]
            covariance[k] += gain[k] @ covariance[k + 1] @ gain[k].T
        by_constant = -values[:, :, :-1]
        return Solution(
            values[:, :, -1] + by_constant @ constants,
            covariance + by_constant @ constants_covariance @ by_constant.transpose(0, 2, 1),
            constants,
            constants_covariance,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The values of least squares."""

    knots: Floats
    """(k + 1, s)."""
    covariance: Floats
    """(k + 1, s, s)."""
    constants: Floats
    """(c,)."""
    constants_covariance: Floats
    """(c, c)."""
