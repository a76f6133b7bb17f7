"""Where gravity lay in each sensor of an arm whenever it rested; whether one sensor has turned since. Pure.

A person comes back to the same postures: the arm hangs, lies on the lap, is held out. All sensors together
tell a posture. If one sensor of the arm now feels gravity elsewhere, by the same turn in every posture,
while the others feel it where they felt it before, that sensor has turned on its segment. Evidence is the sum
over rests of half-sigma-squared misfits: to the nearest posture known from before as it is, less to the
nearest with the sensor turned. A posture never met before fits neither and tells nothing.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Floats = npt.NDArray[np.float64]

SAME = np.radians(1.0)
"""SD of gravity's direction in one sensor when a posture is held again: sway and skin."""
STRANGE = 9.0
"""A misfit (sum of squares over the sensors) counts no more than this: it is another posture."""
ALIKE = 4.5
"""The other sensors tell the same posture up to this misfit."""
NEAR = np.radians(25.0)
"""No strap that still holds slips further."""
SLIP = np.radians(8.0)
"""SD of what straps slip by."""
SPLITS = 12
"""Newest rests before which a slip is looked for."""
ROUNDS = 3


class Turned(NamedTuple):
    """The best account of rests by one sensor that turned."""

    evidence: float
    sensor: int
    split: int
    """The first rest after it."""
    turn: Floats
    """Rotation vector (3,) rad in sensor axes: takes gravity as it is felt now to how it was before."""


def turned_since(ups: Floats) -> Turned | None:
    """Return which sensor turned, and before which rest, or None where all is as it was.

    `ups` (m, k, 3) are unit vectors: where up lay in each of k sensors during m rests, oldest first.
    """
    best: Turned | None = None
    if len(ups) < 3 or ups.shape[1] < 2:
        return None
    angles = np.arccos(np.clip(np.einsum("isx,jsx->ijs", ups, ups), -1.0, 1.0))
    misfits = (angles / SAME) ** 2
    for split in range(max(2, len(ups) - SPLITS), len(ups)):
        between = misfits[:split, split:]
        together = between.sum(axis=2)
        as_known = np.minimum(together.min(axis=0), STRANGE)
        if as_known[0] < ALIKE:
            continue  # the first rest after a slip looks strange
        if best is not None and as_known.sum() <= best.evidence:
            continue  # no turn explains more than all of it
        for sensor in range(ups.shape[1]):
            others = together - between[:, :, sensor]
            others = np.where(angles[:split, split:, sensor] < NEAR, others, np.inf)
            if others[:, 0].min() > STRANGE:
                continue
            found = _explained(ups[:split, sensor], ups[split:, sensor], others)
            if found is None:
                continue
            turn, left = found
            evidence = float((as_known - left).sum() - (np.linalg.norm(turn) / SLIP) ** 2)
            if best is None or evidence > best.evidence:
                best = Turned(evidence, sensor, split, turn)
    return best


def evidence_of(ups: Floats, split: int, sensor: int, turn: Floats) -> float:
    """Return what rests (m, k, 3) say of a turn (3,) of one sensor before rest `split`: below 0, against it.

    Postures that are felt again just as before it contradict a turn that gravity would show.
    """
    if not 0 < split < len(ups):
        return 0.0
    turned = ups[split:].copy()
    turned[:, sensor] = rotation.rotate(rotation.from_rotation_vector(turn), turned[:, sensor])
    costs = []
    for after in (ups[split:], turned):
        angles = np.arccos(np.clip(np.einsum("isx,jsx->ijs", ups[:split], after), -1.0, 1.0))
        costs.append(np.minimum(((angles / SAME) ** 2).sum(axis=2).min(axis=0), STRANGE).sum())
    return float(costs[0] - costs[1])


def _explained(before: Floats, after: Floats, others: Floats) -> tuple[Floats, Floats] | None:
    """Return the turn that best brings `after` (n, 3) onto `before` (m, 3), and each rest's misfit with it.

    `others` (m, n) is how badly the other sensors match. Nearest postures and turn are found in turns.
    """
    turn, rows = np.zeros(3), np.arange(len(after))
    own = _apart(before, after)
    for round_ in range(ROUNDS):
        # At first the sensor's own angle hardly counts: it is what is looked for.
        both = others + (0.01 * own if round_ == 0 else own)
        nearest = both.argmin(axis=0)
        matched = np.flatnonzero(others[nearest, rows] < ALIKE)
        if not len(matched):
            return None
        turn = _fit(before[nearest[matched]], after[matched])
        turned = after @ rotation.to_matrix(rotation.from_rotation_vector(turn)).T
        own = _apart(before, turned)
    return turn, np.minimum((others + own).min(axis=0), STRANGE)


def _apart(before: Floats, after: Floats) -> Floats:
    """Return the misfits (m, n) of one sensor between rests."""
    together = before @ after.T
    angles: Floats = np.arccos(np.minimum(np.maximum(together, -1.0, out=together), 1.0, out=together))
    misfits: Floats = (angles / SAME) ** 2
    return misfits


def _fit(before: Floats, after: Floats) -> Floats:
    """Return the rotation vector (3,) with least squares of before = after + turn x after, shrunk to none."""
    # |turn x v - d|^2 over all rows: the sum of (1 - v v') turn = the sum of v x d.
    normal = len(after) * np.eye(3) - after.T @ after + (SAME / SLIP) ** 2 * np.eye(3)
    m = after.T @ (before - after)
    turn: Floats = np.linalg.solve(normal, [m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
    return turn
