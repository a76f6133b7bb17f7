"""The heading between two sensors, and where the joint between them is, from accelerations. Pure.

Seen from either sensor the joint's centre is one point, so both must tell the same of its acceleration:

    Z(d) (f_b + N_b r_b) = f_a + N_a r_a,   N = [alpha x] + [w x][w x]

with specific forces f, rates w and angular accelerations alpha in each sensor's world, r from sensor to joint
in sensor axes, and Z(d) the turn of b's world into a's (Seel, Raisch and Schauer 2014 find r so; with
unknown heading it is the constraint of Weygers and Kok 2020). It needs no axis of the joint and no
magnetometer, but a joint that is itself moved: about a resting elbow nothing is seen of the heading.
"""

from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.joint_motion import JointMotion, knots, shares

Floats = npt.NDArray[np.float64]

FORCE_SD = 0.3
"""m/s^2: of one sensor's specific force on skin, nearly at rest."""
FORCE_SHARE = 0.1
"""Of the accelerations: what skin adds in movement."""
LEVER_SD_M = 0.15
HEADING_RATE_SD = radians(0.05)
INDEPENDENT = 12.0
"""All instants together count as so many independent ones: skin's errors follow the movement."""
LEAST_NOISE = 0.01
"""Of FORCE_SD, squared: what an accelerometer's bias leaves, 3 mg."""
LOSS_SCALE = 2.0
STEPS = 10
UNSEEN = radians(30.0)
"""A heading that is not known better than this is not told at all."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointCentre:
    """What accelerations show of a joint."""

    knots_s: Floats
    headings: Floats
    """(k,) rad at the knots, straight between them: turns b's world into a's."""
    headings_sd: Floats
    lever_a: Floats
    """From sensor a to the joint (3,) m, in sensor axes."""
    lever_b: Floats
    lever_a_sd: Floats
    lever_b_sd: Floats


def find_joint_centre(motion: JointMotion) -> JointCentre | None:
    """Return heading and levers, or None where the movement does not show the heading."""
    a, b = (motion.force_a, motion.turning_a), (motion.force_b, motion.turning_b)
    if a[0] is None or a[1] is None or b[0] is None or b[1] is None or len(motion.time_s) < 20:
        return None
    rows = _Rows(motion.time_s, (a[0], a[1]), (b[0], b[1]))
    costs = np.array([rows.constant(heading) for heading in rows.scanned])
    spread = _spread(costs / len(motion.time_s))
    if spread > UNSEEN:
        return None
    x = rows.start(float(rows.scanned[int(np.argmin(costs))]))
    for _ in range(STEPS):
        x = x + rows.step(x)[0]
    covariance = rows.step(x)[1]
    sd = np.sqrt(np.diag(covariance))
    if float(sd[6:].min()) > UNSEEN:
        return None
    return JointCentre(
        knots_s=rows.knots_s,
        headings=x[6:],
        headings_sd=np.maximum(sd[6:], spread),
        lever_a=x[:3],
        lever_b=x[3:6],
        lever_a_sd=sd[:3],
        lever_b_sd=sd[3:6],
    )


def _spread(costs: Floats) -> float:
    """Return the circular standard deviation, rad, of a constant heading by the mean loss of each that was
    scanned. About a resting elbow all of them fit: what is small around the best one says nothing there."""
    noise = max(LEAST_NOISE, float(costs.min()) / 3.0)
    odds = np.exp(-0.5 * INDEPENDENT / noise * (costs - costs.min()))
    length = abs(odds @ np.exp(1j * _Rows.scanned)) / odds.sum()
    return float(np.sqrt(max(0.0, -2.0 * np.log(max(length, 1e-9)))))


class _Rows:
    """The equations of all instants. Parameters: lever_a (3), lever_b (3), headings at the knots."""

    scanned = np.arange(-np.pi, np.pi, radians(10.0))

    def __init__(self, time_s: Floats, a: tuple[Floats, Floats], b: tuple[Floats, Floats]) -> None:
        (force_a, self._turning_a), (force_b, self._turning_b) = a, b
        self._force_a, self._force_b = force_a, force_b
        self.knots_s = knots(time_s)
        self._share = shares(time_s, self.knots_s)
        moving = np.linalg.norm(force_a - _GRAVITY, axis=1) + np.linalg.norm(force_b - _GRAVITY, axis=1)
        self._weight = 1.0 / (FORCE_SD + FORCE_SHARE * moving)

    def start(self, heading: float) -> Floats:
        """Return parameters with a constant heading and the levers that fit it."""
        residual, design = self._linear(np.concatenate([np.zeros(6), np.full(len(self.knots_s), heading)]))
        levers = self._levers(residual, design)
        return np.concatenate([levers, np.full(len(self.knots_s), heading)])

    def constant(self, heading: float) -> float:
        """Return the loss of a constant heading, its levers fitted."""
        residual, _ = self._linear(self.start(heading))
        return float(_loss(residual).sum())

    def _levers(self, residual: Floats, design: Floats) -> Floats:
        flat = design[..., :6].reshape(-1, 6)
        normal = flat.T @ flat + np.eye(6) / LEVER_SD_M**2
        return np.asarray(-np.linalg.solve(normal, flat.T @ residual.ravel()), dtype=np.float64)

    def step(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the Gauss-Newton step from x, and the covariance there."""
        residual, design = self._linear(x)
        noise = max(LEAST_NOISE, float(np.mean(_loss(residual))) / 3.0)
        robust = 1.0 / np.sqrt(1.0 + np.einsum("ni,ni->n", residual, residual) / LOSS_SCALE**2)
        scale = robust * INDEPENDENT / (len(residual) * noise)
        normal = np.einsum("n,nij,nik->jk", scale, design, design)
        slope = np.einsum("n,nij,ni->j", scale, design, residual)
        normal[:6, :6] += np.eye(6) / LEVER_SD_M**2
        slope[:6] += x[:6] / LEVER_SD_M**2
        for i, gap in enumerate(np.diff(self.knots_s).tolist()):
            row = np.zeros(len(x))
            row[6 + i : 8 + i] = np.array([-1.0, 1.0]) / (HEADING_RATE_SD * gap)
            normal += np.outer(row, row)
            slope += row * (row @ x)
        normal[6:, 6:] += np.eye(len(self.knots_s)) * 1e-4
        covariance = np.linalg.inv(normal)
        return -covariance @ slope, covariance

    def _linear(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the residuals (n, 3) in standard deviations and their derivatives (n, 3, 6 + k)."""
        turn = rotation.to_matrix(rotation.about(2, self._share @ x[6:]))
        seen_b = np.einsum("nij,nj->ni", turn, self._force_b + self._turning_b @ x[3:6])
        residual = seen_b - (self._force_a + self._turning_a @ x[:3])
        design = np.zeros((len(residual), 3, len(x)))
        design[..., :3] = -self._turning_a
        design[..., 3:6] = turn @ self._turning_b
        quarter = np.stack([-seen_b[:, 1], seen_b[:, 0], np.zeros(len(seen_b))], axis=-1)
        design[..., 6:] = quarter[..., None] * self._share[:, None, :]
        return residual * self._weight[:, None], design * self._weight[:, None, None]


_GRAVITY = np.array([0.0, 0.0, 9.81])


def _loss(residual: Floats) -> Floats:
    square = np.einsum("ni,ni->n", residual, residual)
    return np.asarray(2.0 * LOSS_SCALE**2 * (np.sqrt(1.0 + square / LOSS_SCALE**2) - 1.0), dtype=np.float64)
