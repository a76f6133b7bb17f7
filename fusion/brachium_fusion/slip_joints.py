"""Whether one of two sensors on a joint has turned, from movement that the joint cannot make. Pure, causal.

A joint of two axes a (seen from the upper sensor) and b (from the lower one) allows no relative angular rate
w along n = a x b. A sensor that turned on its segment by d shows such a rate: to first order, w.n changes by
J(movement) d. Normal equations of both sensors' turns, and of the heading between them, are summed over
blocks of time; each block may have a turn of its own, as skin that follows the posture has. The evidence is
the gain in 2 log likelihood of one more turn of one sensor from one block on.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_model import Joint

Floats = npt.NDArray[np.float64]

BLOCK_S = 5.0
BLOCKS = 24
BEFORE, AFTER = 3, 2
"""Blocks at least before and after a slip."""
RATE_SD = 0.02
"""rad/s of w.n with everything right; a gyroscope's noise and bias are less,"""
RATE_PART = 0.04
"""... and this part of how fast both turn: scale factors, heading within a block, skin."""
CORRELATED_S = 0.16
"""Samples closer than this tell the same."""
HEADING_SD, AXES_SD, SLIP_SD = np.radians(5.0), np.radians(3.0), np.radians(8.0)
"""Of the heading in a block, of the axes as known from the start, of a slip; rad."""
SKIN_SDS = tuple(np.radians([0.7, 1.5, 3.0, 6.0, 10.0]).tolist())
"""rad: how far skin may turn a sensor from block to block; what suits the movement best is taken."""


class JointTurned(NamedTuple):
    """The best account of a joint's movement by one sensor that turned."""

    evidence: float
    sensor: int
    """0 the upper one, 1 the lower."""
    block: int
    """The first one after it."""
    turn: Floats
    """Rotation vector (3,) rad in the sensor's axes: before_from_now."""


class Block(NamedTuple):
    """What a stretch of movement tells of both sensors' turns (6,): normal matrix (6, 6) and right side."""

    from_ns: int
    normal: Floats
    right: Floats


class JointTurns:
    """Sums one joint's movement; `step` returns a finding whenever a block is full."""

    def __init__(self, joint: Joint, rate_hz: float) -> None:
        if joint.axis_a is None or joint.axis_b is None:
            raise ValueError("the joint's axes must be known to tell what it cannot do")
        self._axis_a, self._axis_b = np.asarray(joint.axis_a), np.asarray(joint.axis_b)
        self._weight = 1.0 / max(1.0, CORRELATED_S * rate_hz)
        self._size = round(BLOCK_S * rate_hz)
        self.blocks: list[Block] = []
        self._begin()

    def _begin(self) -> None:
        self._from_ns, self._count = 0, 0
        self._normal, self._right = np.zeros((7, 7)), np.zeros(7)

    def step(self, now_ns: int, quats: Floats, gyr: Floats) -> JointTurned | None:
        """Take world_from_sensor (2, 4) and angular rates (2, 3) rad/s in sensor axes at an instant."""
        if not self._count:
            self._from_ns = now_ns
        row, residual, size = self._row(rotation.to_matrix(quats), gyr)
        weight = self._weight / (RATE_SD**2 + (RATE_PART * size) ** 2)
        self._normal += weight * np.outer(row, row)
        self._right -= weight * residual * row
        self._count += 1
        if self._count < self._size:
            return None
        self.blocks = [*self.blocks[1 - BLOCKS :], self._block()]
        self._begin()
        return judged(self.blocks)

    def _row(self, world_from: Floats, gyr: Floats) -> tuple[Floats, float, float]:
        """Return the change of w.n with both turns and the heading (7,), w.n itself, and how fast all is."""
        first, second = world_from
        rate_a, rate_b = first @ gyr[0], second @ gyr[1]
        w, a, b = rate_b - rate_a, first @ self._axis_a, second @ self._axis_b
        n, up = _cross(a, b), np.array([0.0, 0.0, 1.0])
        by_a = _cross(self._axis_a, first.T @ _cross(b, w))
        by_b = _cross(self._axis_b, second.T @ _cross(w, a))
        by_heading = _cross(up, rate_b) @ n + w @ _cross(a, _cross(up, b))
        size = float(np.sqrt(w @ w + rate_a @ rate_a))
        return np.array([*by_a, *by_b, by_heading]), float(w @ n), size

    def _block(self) -> Block:
        """Return the sums without the heading, which is each block's own."""
        normal, right = self._normal, self._right
        pivot = normal[6, 6] + HEADING_SD**-2
        beside = normal[:6, 6] / pivot
        return Block(
            self._from_ns,
            normal[:6, :6] - np.outer(beside, normal[6, :6]),
            right[:6] - beside * right[6],
        )

    def forget(self, until_ns: int) -> None:
        """Leave aside what was before: the sensors sit otherwise since."""
        self.blocks = [b for b in self.blocks if b.from_ns >= until_ns]
        self._begin()

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "blocks": [[b.from_ns, b.normal.tolist(), b.right.tolist()] for b in self.blocks],
            "now": [self._from_ns, self._count, self._normal.tolist(), self._right.tolist()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the sums whose state this is would have."""
        self.blocks = [Block(t, np.array(n), np.array(r)) for t, n, r in state["blocks"]]
        self._from_ns, self._count, normal, right = state["now"]
        self._normal, self._right = np.array(normal), np.array(right)


def judged(blocks: list[Block]) -> JointTurned | None:
    """Return the likeliest turn of one sensor within these blocks, or None while there are too few."""
    if len(blocks) < BEFORE + AFTER:
        return None
    splits = np.arange(BEFORE, len(blocks) - AFTER + 1)
    unturned = least = np.inf
    best = JointTurned(0.0, 0, 0, np.zeros(3))
    for skin in SKIN_SDS:
        normals, rights, cost = _with_skin(blocks, skin)
        whole, right = normals.sum(axis=0) + np.eye(6) / AXES_SD**2, rights.sum(axis=0)
        unturned = min(unturned, cost + float(_cost(whole[None], right[None])[0][0]))
        later = normals[::-1].cumsum(axis=0)[::-1][splits]
        later_right = rights[::-1].cumsum(axis=0)[::-1][splits]
        for sensor in (0, 1):
            own = slice(3 * sensor, 3 * sensor + 3)
            matrix, side = np.empty((len(splits), 9, 9)), np.empty((len(splits), 9))
            matrix[:, :6, :6], matrix[:, :6, 6:], matrix[:, 6:, :6] = whole, later[:, :, own], later[:, own]
            matrix[:, 6:, 6:] = later[:, own, own] + np.eye(3) / SLIP_SD**2
            side[:, :6], side[:, 6:] = right, later_right[:, own]
            costs, found = _cost(matrix, side)
            at = int(costs.argmin())
            turned = cost + float(costs[at]) + 6.0 * float(np.log(SLIP_SD))
            if turned < least:
                least, best = turned, JointTurned(0.0, sensor, int(splits[at]), -found[at, 6:])
    return best._replace(evidence=float(unturned - least))


def _with_skin(blocks: list[Block], skin: float) -> tuple[Floats, Floats, float]:
    """Return what is left of the blocks' sums when each has a turn of its own of this SD, and its cost."""
    normals: Floats = np.array([b.normal for b in blocks])
    rights: Floats = np.array([b.right for b in blocks])
    loose = np.eye(6) + skin**2 * normals
    left = np.linalg.solve(loose.transpose(0, 2, 1), normals)
    explained = _solved(normals + np.eye(6) / skin**2, rights)
    cost = np.linalg.slogdet(loose)[1].sum() - np.einsum("ij,ij->", rights, explained)
    symmetric = np.asarray(0.5 * (left + left.transpose(0, 2, 1)), dtype=np.float64)
    return symmetric, _solved(loose.transpose(0, 2, 1), rights), float(cost)


def _cost(normals: Floats, rights: Floats) -> tuple[Floats, Floats]:
    """Return -2 log likelihoods (k,) but for what all accounts share, and estimates (k, ..)."""
    found = _solved(normals, rights)
    costs: Floats = np.linalg.slogdet(normals)[1] - np.einsum("ki,ki->k", rights, found)
    return costs, found


def _solved(matrices: Floats, sides: Floats) -> Floats:
    """Return the solutions (k, n) of k systems."""
    return np.asarray(np.linalg.solve(matrices, sides[:, :, None])[:, :, 0], dtype=np.float64)


def _cross(a: Floats, b: Floats) -> Floats:
    (p, q, r), (x, y, z) = a.tolist(), b.tolist()
    return np.array([q * z - r * y, r * x - p * z, p * y - q * x])
