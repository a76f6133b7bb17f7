"""Skeletons as the table that `solve` writes: one row an instant, degrees where people read. Pure."""

from collections.abc import Callable, Iterable, Sequence
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from brachium_body.angles import CLAVICLE, COLUMNS, TRUNK
from brachium_body.kinematics import JOINTS
from brachium_body.segments import SIDES, Side, arm_segments, suffix
from brachium_fusion.result_quality import NAMES, qualities
from brachium_wire.messages import Skeleton

Group = Literal["segments", "sensors", "positions", "shift", "theta", "clinical", "isb", "trunk", "quality"]
GROUPS: tuple[Group, ...] = get_args(Group)

_AXES = ("x", "y", "z")
_PARTS = ("w", "x", "y", "z")


class Result:
    """Columns and their units, in the order in which they stand in the file."""

    def __init__(self, time_s: npt.NDArray[np.float64]) -> None:
        self.columns: dict[str, npt.NDArray[np.generic]] = {"time": time_s}
        self.units: dict[str, str] = {"time": "s"}

    def add(self, name: str, values: npt.NDArray[np.generic], unit: str = "") -> None:
        """Append a column."""
        self.columns[name] = values
        if unit:
            self.units[name] = unit


def tabulate(
    skeletons: Iterable[Skeleton],
    times_ns: Sequence[int],
    time_s: npt.ArrayLike,
    groups: Sequence[Group] = GROUPS,
) -> Result:
    """Return the table of one subject's skeletons at `times_ns` (n,), shown as `time_s` (n,).

    With one arm, columns without a segment in their name have no ending; with both they end in `_r` or `_l`.
    An instant without a skeleton, or a number that it lacks, is NaN; its quality is "".
    `quality_elbow_angles` and `quality_wrist_position` tell of a joint's numbers, `quality_forearm_r` of a
    segment.
    """
    row_of = {t: i for i, t in enumerate(times_ns)}
    found: dict[Side, list[tuple[int, Skeleton]]] = {side: [] for side in SIDES}
    for skeleton in skeletons:
        row = row_of.get(skeleton.time_ns)
        if row is not None:
            found[skeleton.side].append((row, skeleton))
    by_side: dict[Side, list[tuple[int, Skeleton]]] = {side: rows for side, rows in found.items() if rows}
    result = Result(np.asarray(time_s, dtype=np.float64))
    segments = _segments(by_side)
    n = len(result.columns["time"])
    for group, field, infix in (
        ("segments", "world_from_segment", ""),
        ("sensors", "world_from_sensor", "_sensor"),
    ):
        if group not in groups:
            continue
        for segment in segments:
            block = _fill(n, 4, segments[segment], lambda s, f=field, g=segment: getattr(s.segments[g], f))  # type: ignore[misc]
            for part, values in zip(_PARTS, block.T, strict=True):
                result.add(f"{segment}{infix}_q{part}", values)
    for side, rows in by_side.items():
        ending = suffix(side) if len(by_side) > 1 else ""
        _add_arm(result, rows, ending, groups, first=side == next(iter(by_side)))
    if "quality" in groups:
        for side, rows in by_side.items():
            ending = suffix(side) if len(by_side) > 1 else ""
            shown = _shown(groups, trunk=side == next(iter(by_side)))
            for name, words in qualities(n, rows, shown).items():
                result.add(f"{name}{'' if name.endswith('trunk_angles') else ending}", words)
        for segment, rows in segments.items():
            quality = np.full(n, "", dtype="<U16")
            for row, skeleton in rows:
                quality[row] = skeleton.segments[segment].quality
            result.add(f"quality_{segment}", quality)
    return result


def _shown(groups: Sequence[Group], *, trunk: bool) -> list[str]:
    """Return whose quality is told: that of what the groups show."""
    shown = []
    for name, columns in NAMES.items():
        of = {"positions"} if name.endswith("_position") else {_group(column) for column in columns}
        if of & set(groups) and (trunk or name != "trunk_angles"):
            shown.append(name)
    return shown


def _segments(by_side: dict[Side, list[tuple[int, Skeleton]]]) -> dict[str, list[tuple[int, Skeleton]]]:
    """Return, from the trunk outwards, the rows in which each segment is named."""
    found: dict[str, list[tuple[int, Skeleton]]] = {}
    order = ["sternum", *(segment for side in by_side for segment in arm_segments(side))]
    for segment in order:
        rows = [(r, s) for rows in by_side.values() for r, s in rows if segment in s.segments]
        if rows:
            found[segment] = rows
    return found


def _add_arm(
    result: Result, rows: list[tuple[int, Skeleton]], ending: str, groups: Sequence[Group], *, first: bool
) -> None:
    n = len(result.columns["time"])
    if "positions" in groups:
        for joint in JOINTS:
            block = _fill(n, 3, rows, lambda s, j=joint: s.positions.get(j))  # type: ignore[misc]
            for axis, values in zip(_AXES, block.T, strict=True):
                result.add(f"{joint}_{axis}{ending}", values, "m")
    if "shift" in groups:
        for name in ("shoulder_shift", "shoulder_shift_sd"):
            block = _fill(n, 3, rows, lambda s, f=name: getattr(s, f))  # type: ignore[misc]
            for axis, values in zip(_AXES, block.T, strict=True):
                result.add(f"{name}_{axis}{ending}", values, "m")
    angles = np.degrees(_fill(n, len(COLUMNS), rows, lambda s: [s.angles.get(c, np.nan) for c in COLUMNS]))
    for name, values in zip(COLUMNS, angles.T, strict=True):
        if _group(name) not in groups or (name in TRUNK and not first):
            continue
        result.add(name if name in TRUNK else f"{name}{ending}", values, "deg")


def _group(name: str) -> Group:
    if name in TRUNK or name in CLAVICLE:
        return "trunk"
    if name.startswith("theta"):
        return "theta"
    return "isb" if name.startswith("isb_") else "clinical"


def _fill(
    n: int, width: int, rows: list[tuple[int, Skeleton]], read: Callable[[Skeleton], Sequence[float] | None]
) -> npt.NDArray[np.float64]:
    block = np.full((n, width), np.nan)
    for row, skeleton in rows:
        values = read(skeleton)
        if values is not None:
            block[row] = values
    return block
