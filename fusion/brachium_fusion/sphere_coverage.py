"""How much of the sphere of directions a turned magnetometer has seen, while it is turned. Pure."""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

BANDS, ROUND = 6, 8
"""Cells of 30 deg across or so: a symmetric 3 x 3 matrix and an offset vary far more slowly."""
SEEN, UNSEEN = "#", "."
THINNED = 2000
"""Readings that the centre is found from: half a minute at 100 Hz, in a millisecond."""
HOLD = 0.02
"""Weight of the middle of the extremes beside the sphere, for directions in which nothing has moved yet."""


def centre_of(mag: Floats) -> Floats:
    """Return the centre (3,) of the sphere next to readings (n, 3).

    Where the readings do not tell, as along the axis of a single turn, it is the middle of the extremes.
    """
    m = mag[:: max(1, len(mag) // THINNED)]
    middle = (m.min(axis=0) + m.max(axis=0)) / 2.0
    size = max(float(np.ptp(m, axis=0).max()) / 2.0, 1e-9)
    x = (m - middle) / size
    # |x|^2 = 2 x . c + (r^2 - |c|^2), with c held near 0.
    design = np.column_stack([2.0 * x, np.ones(len(x))])
    hold = HOLD * len(x) * np.diag([1.0, 1.0, 1.0, 0.0])
    found = np.linalg.solve(
        design.T @ design + hold + 1e-9 * np.eye(4), design.T @ np.einsum("ij,ij->i", x, x)
    )
    centre: Floats = middle + size * found[:3]
    return centre


def cells_of(directions: Floats) -> Floats:
    """Return the cells (BANDS, ROUND) that hold one of the unit directions (n, 3): 1 seen, 0 not.

    Bands are equally high in z and therefore of equal area (Archimedes), from +z to -z.
    """
    band = np.clip((1.0 - directions[:, 2]) / 2.0 * BANDS, 0, BANDS - 1).astype(int)
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2.0 * np.pi) + 0.5
    cells = np.zeros((BANDS, ROUND))
    cells[band, np.clip(turn * ROUND, 0, ROUND - 1).astype(int)] = 1.0
    return cells


def text_of(cells: Floats) -> str:
    """Return cells as SensorProgress has them."""
    return "".join(SEEN if seen else UNSEEN for seen in cells.ravel())


def lacking(cells: Floats) -> str:
    """Return the sensor's axis next to the middle of what was not seen, as `-z`; empty when all was."""
    if cells.all():
        return ""
    z = 1.0 - 2.0 * (np.arange(BANDS) + 0.5) / BANDS
    turn = 2.0 * np.pi * ((np.arange(ROUND) + 0.5) / ROUND - 0.5)
    flat = np.sqrt(1.0 - z**2)
    centres = np.stack(
        [
            flat[:, None] * np.cos(turn),
            flat[:, None] * np.sin(turn),
            np.broadcast_to(z[:, None], (BANDS, ROUND)),
        ],
        axis=-1,
    )
    unseen = centres[cells == 0.0]
    axes = np.vstack([np.eye(3), -np.eye(3)])
    # The axis with the most unseen cells around it; a mean of cells all around would point nowhere.
    best = int(np.argmax(np.clip(unseen @ axes.T, 0.0, 1.0).sum(axis=0)))
    return ("+" if best < 3 else "-") + "xyz"[best % 3]
