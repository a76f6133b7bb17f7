"""Arrays as messages have them: plain numbers."""

import numpy as np
import numpy.typing as npt

from brachium_wire.messages import Quaternion, Vector


def vector(v: npt.ArrayLike) -> Vector:
    """Return (3,) as a tuple. Raises ValueError for another shape."""
    x, y, z = np.asarray(v, dtype=np.float64).tolist()
    return (x, y, z)


def quaternion(q: npt.ArrayLike) -> Quaternion:
    """Return (4,) as a tuple. Raises ValueError for another shape."""
    w, x, y, z = np.asarray(q, dtype=np.float64).tolist()
    return (w, x, y, z)
