"""Right and left at once: one side's name, or a mask that says which rows are left arms."""

import numpy as np
import numpy.typing as npt

from .rotation import Array, mirror
from .segments import Side

Sides = Side | npt.NDArray[np.bool_]
"""`right`, `left`, or booleans (...), true where a row is a left arm."""


def is_left(side: Sides) -> npt.NDArray[np.bool_]:
    """Return booleans (...), true for left arms. A name that is no side raises ValueError."""
    if isinstance(side, str):
        if side not in ("right", "left"):
            raise ValueError(f"a side is right or left, not {side!r}")
        return np.asarray(side == "left")
    return np.asarray(side, dtype=np.bool_)


def mirror_left(q: npt.ArrayLike, side: Sides) -> Array:
    """Return rotations (..., 4) between ISB axes with those of left arms mirrored (R -> S R S), others
    unchanged.

    Turns a left arm into the right arm that does the same, and back: it is its own inverse.
    """
    return np.where(is_left(side)[..., None], mirror(q), np.asarray(q, dtype=np.float64))
