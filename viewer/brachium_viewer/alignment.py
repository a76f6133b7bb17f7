"""Two tables on one time: columns and orientations of one at the instants of the other. Pure."""

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import SEGMENTS
from brachium_viewer.statistics import interpolate, wrap_deg
from brachium_wire.table import Column, Table, TableError

Floats = npt.NDArray[np.float64]

TIME_NAMES = ("time", "t")
_PARTS = ("qw", "qx", "qy", "qz")
MAX_GAP_S = 0.1
"""Nothing is interpolated between instants further apart."""


def time_of(table: Table, name: str) -> tuple[str, Floats]:
    """Return the time column's name and values (n,) s.

    Raises TableError when there is none or it does not grow.
    """
    for column in TIME_NAMES:
        if column in table.columns:
            time = table.columns[column].astype(np.float64)
            if len(time) < 2 or not (np.diff(time) > 0).all():
                raise TableError(f"{name}: column {column} must grow from row to row, over two rows or more")
            return column, time
    raise TableError(f"{name}: expected a column time or t, in seconds; there are {', '.join(table.columns)}")


def snapped(time: Floats, at: Floats) -> Floats:
    """Return the times, those within 0.1 us of one of `at` being exactly it: sums of decimals are not."""
    right = np.clip(np.searchsorted(at, time), 1, len(at) - 1)
    nearest = np.where(time - at[right - 1] < at[right] - time, at[right - 1], at[right])
    return np.where(np.abs(nearest - time) < 1e-7, nearest, time)


def orientation_stems(columns: Iterable[str]) -> list[str]:
    """Return what orientations are named by: `forearm_r_sensor` for `forearm_r_sensor_qw` to `_qz`."""
    names = list(columns)
    return [
        n.removesuffix("_qw")
        for n in names
        if n.endswith("_qw") and all(f"{n.removesuffix('_qw')}_{p}" in names for p in _PARTS)
    ]


def is_orientation(name: str) -> bool:
    """Return whether a column is a part of a quaternion."""
    return name.rpartition("_")[2] in _PARTS


def quaternions(columns: Mapping[str, Column], stem: str) -> Floats:
    """Return an orientation's quaternions (n, 4) of length 1; NaN where a part is not known."""
    q = np.stack([columns[f"{stem}_{part}"].astype(np.float64) for part in _PARTS], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return rotation.normalize(q)


def orientations_at(time: Floats, at: Floats, q: Floats) -> Floats:
    """Return the orientations (m, 4), known at `at` (m,), at each of `time` (n,): (n, 4).

    On the shorter way between two of them; NaN outside and in gaps.
    """
    right = np.clip(np.searchsorted(at, time, side="left"), 1, len(at) - 1)
    left = right - 1
    fraction = (time - at[left]) / (at[right] - at[left])
    left_q, right_q = q[left], q[right]
    # At an instant that is known, what is beside it is not needed.
    left_q = np.where((fraction >= 1.0)[:, None], right_q, left_q)
    right_q = np.where((fraction <= 0.0)[:, None], left_q, right_q)
    result = rotation.slerp(left_q, right_q, np.clip(fraction, 0.0, 1.0))
    between = (fraction > 0.0) & (fraction < 1.0) & (at[right] - at[left] > MAX_GAP_S)
    result[between | (time < at[0]) | (time > at[-1])] = np.nan
    return result


def numbers_at(time: Floats, at: Floats, values: Floats, *, turns: bool) -> Floats:
    """Return a column (m,), known at `at`, at each of `time`: (n,); `turns`: degrees, unwrapped for it."""
    if turns:
        known = np.isfinite(values)
        values = values.copy()
        values[known] = np.unwrap(values[known], period=360.0)
    found: Floats = interpolate(time, at, values[:, None], MAX_GAP_S)[:, 0]
    return found


def difference(a: Floats, b: Floats, *, turns: bool) -> Floats:
    """Return a - b; of degrees within half a turn."""
    return wrap_deg(a - b) if turns else a - b


def _segment(stem: str) -> str:
    return stem.removesuffix("_sensor")


def outwards(stem: str) -> tuple[bool, int, str]:
    """Return what orders orientations: segments before sensors, from the trunk outwards."""
    segment = _segment(stem)
    place = SEGMENTS.index(segment) if segment in SEGMENTS else len(SEGMENTS)
    return stem.endswith("_sensor"), place, stem


def neighbours(stems: list[str]) -> list[tuple[str, str]]:
    """Return the orientations next to each other on one arm, both of segments or both of sensors."""
    pairs = []
    for i, second in enumerate(stems):
        for first in reversed(stems[:i]):
            same_kind = first.endswith("_sensor") == second.endswith("_sensor")
            if same_kind and (_segment(first)[-2:] == _segment(second)[-2:] or _segment(first) == "sternum"):
                pairs.append((first, second))
                break
    return pairs
