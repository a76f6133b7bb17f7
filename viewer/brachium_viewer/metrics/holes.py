"""Times at which nothing came at all, as rows of their own: what counts rows counts time then. Pure."""

import numpy as np
import numpy.typing as npt

from brachium_viewer.metrics.even_grid import BRIDGED_S, stretches

Floats = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]

NOTHING = -1
"""In place of a row: nothing came then."""
MOST = 20_000
"""In all holes there are at most so many rows, and one for each that came: a hole of a year costs no more
memory than that, and what was measured beside it is still less than half."""


def with_holes(time_s: Floats) -> tuple[Floats, Rows]:
    """Return times (m,) in growing order, those of holes among them, and of each its row or NOTHING.

    `time_s` (n,) grows. A hole is a step longer than BRIDGED_S; it is filled at the usual step between times,
    but in the longest ones more sparsely where that would be more than MOST + n rows in all.
    """
    steps = np.diff(time_s)
    rows = np.arange(len(time_s))
    holes = np.flatnonzero(steps > BRIDGED_S)
    if not len(holes):
        return time_s, rows
    wanted = np.clip(steps[holes] / np.median(steps) - 1.0, 0.0, MOST + len(time_s))
    counts = _shared(np.rint(wanted).astype(np.intp), MOST + len(time_s))
    inside = [
        np.linspace(time_s[i], time_s[i + 1], n + 2)[1:-1]
        for i, n in zip(holes, counts.tolist(), strict=True)
    ]
    at = np.repeat(holes + 1, counts)
    return np.insert(time_s, at, np.concatenate(inside)), np.insert(rows, at, NOTHING)


def _shared(wanted: Rows, most: int) -> Rows:
    """Return how many rows (k,) each gets of `most`: what it wants, or as many as all that want more."""
    given = np.zeros_like(wanted)
    left = most
    for nth, i in enumerate(np.argsort(wanted, kind="stable").tolist()):
        given[i] = min(int(wanted[i]), left // (len(wanted) - nth))
        left -= int(given[i])
    return given


def unseen(time_s: Floats, known: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return the times (s) without a known row (n,) that are too long to be bridged: from the one before to
    the one after; at the ends from the first row, and to the last."""
    last = len(time_s) - 1
    spans = [
        (float(time_s[max(first - 1, 0)]), float(time_s[min(end, last)])) for first, end in stretches(~known)
    ]
    return [(from_s, to_s) for from_s, to_s in spans if to_s - from_s > BRIDGED_S]
