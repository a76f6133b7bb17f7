"""What a sensor probably read while its samples were missing: a curve through those on both sides. Pure."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

SIDE = 2
"""Samples of each side that a curve goes through. An arm that trembles at 5 Hz, sampled at 50 Hz, is a fifth
of its amplitude off a straight line in the middle of two samples, and a fortieth off this curve."""
BEYOND = 0.5
"""A curve stays this many times the range of its samples about that range: a blow just before a gap does not
swing on through it."""
FEW = 2
"""So many missing samples are bridged by a curve that knows one sample only of one side."""


def bridge(before: Floats, after: Floats, missing: int) -> Floats:
    """Return the rows (missing, w) between the samples before (k, w) and after (m, w), all of one period."""
    k, m = min(SIDE, len(before)), min(SIDE, len(after))
    if k + m < 2 * SIDE and missing > FEW:
        k = m = 1
    rows = np.concatenate([before[-k:], after[:m]])
    return _within(_weights(k, m, missing) @ rows, rows.min(axis=0), rows.max(axis=0))


def curve(at: Floats, values: Floats, wanted: Floats) -> Floats:
    """Return values (n, w) at the instants wanted (n,), each by the curve through its own samples: values
    (n, nodes, w) at the instants (n, nodes), all apart."""
    weights = np.ones(at.shape)
    for i in range(at.shape[1]):
        for j in range(at.shape[1]):
            if i != j:
                weights[:, i] *= (wanted - at[:, j]) / (at[:, i] - at[:, j])
    return _within(np.einsum("ni,niw->nw", weights, values), values.min(axis=1), values.max(axis=1))


def _within(found: Floats, least: Floats, most: Floats) -> Floats:
    room = BEYOND * (most - least)
    inside: Floats = np.clip(found, least - room, most + room)
    return inside


@lru_cache(maxsize=256)
def _weights(before: int, after: int, missing: int) -> Floats:
    """Return the share (missing, before + after) of each sample in each row of a curve."""
    at = np.concatenate([np.arange(1 - before, 1), missing + 1 + np.arange(after)]).astype(np.float64)
    apart = np.arange(1, missing + 1)[:, None] - at
    between = at[:, None] - at + np.eye(len(at))
    rest = np.where(np.eye(len(at), dtype=np.bool_), 1.0, apart[:, None, :])
    weights: Floats = rest.prod(axis=2) / between.prod(axis=1)
    return weights
