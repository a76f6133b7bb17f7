"""Where a table's own columns say that a number was assumed and not measured. Pure."""

import numpy as np
import numpy.typing as npt

from brachium_body.angles import SHARING_QUALITY
from brachium_body.kinematics import JOINTS
from brachium_wire.table import Table

Mask = npt.NDArray[np.bool_]


def assumed_rows(table: Table, column: str) -> Mask | None:
    """Return the rows (n,) in which a column's numbers rest on an assumption; None if nothing says so."""
    told = table.columns.get(_quality_column(column))
    if told is None or told.dtype.kind != "U":
        return None
    assumed: Mask = told == "assumed"
    return assumed if assumed.any() else None


def _quality_column(column: str) -> str:
    """Return the name of the column that tells of another: `quality_elbow_angles_r` of `elbow_flexion_r`."""
    end = column[-2:] if column.endswith(("_r", "_l")) else ""
    name = column.removesuffix(end)
    for group, angles in SHARING_QUALITY.items():
        if name in angles:
            return f"quality_{group}{end}"
    joint, _, axis = name.rpartition("_")
    return f"quality_{joint}_position{end}" if joint in JOINTS and axis in ("x", "y", "z") else ""
