"""A result table cut to a span, to some columns, to an even grid. Pure."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.angles import CLAVICLE, COLUMNS, SHARING_QUALITY, TRUNK
from brachium_body.kinematics import JOINTS
from brachium_body.segments import SEGMENTS
from brachium_viewer.metrics.arm_motion import MEASURED
from brachium_wire.table import Table, TableError

Floats = npt.NDArray[np.float64]

PARTS = ("w", "x", "y", "z")
GAP_PERIODS = 1.5
"""Two instants further apart than so many periods have a gap between them: nothing is put there."""
EMPTY_FROM, EMPTY_TIMES = 100_000, 10
"""An even grid with so many instants is refused when it has so many times those of the table, too: what is
nearly all gap is no motion, but recordings of two days or a clock that was set."""
SAME = 1e-4
"""Of a period: an instant nearer to one that is there than this is that one."""


def period_s(time_s: Floats) -> float:
    """Return the usual time between instants (n,); raises TableError when there are not two."""
    if len(time_s) < 2:
        raise TableError(f"a motion needs two instants at least; there are {len(time_s)}")
    return float(np.median(np.diff(time_s)))


def between(table: Table, from_s: float | None, until_s: float | None) -> Table:
    """Return the rows whose time, counted from the first row's, is in [from_s, until_s).

    Raises TableError when none is.
    """
    since = table.columns["time"] - table.columns["time"][0] if len(table) else np.empty(0)
    kept = (since >= (from_s or 0.0) - 1e-9) & (since < (np.inf if until_s is None else until_s) - 1e-9)
    if not kept.any():
        length = f"{since[-1]:.3g} s" if len(since) else "no row"
        end = "on" if until_s is None else f"to {until_s:g} s"
        raise TableError(f"there is nothing from {from_s or 0:g} s {end}: the motion has {length}")
    return Table({name: values[kept] for name, values in table.columns.items()}, table.units, table.metadata)


def chosen(table: Table, words: Sequence[str]) -> Table:
    """Return the columns that the words name, with `time`.

    A word is a group (GROUPS), a column, one without its ending `_r` or `_l`, or a pattern with `*`. Raises
    TableError for one that names nothing.
    """
    kept = {"time"}
    for word in words:
        found = {name for name in table.columns if _named(name, word)}
        if not found:
            groups = ", ".join(GROUPS)
            raise TableError(f"--columns {word!r} names nothing in it; give groups ({groups}) or columns")
        kept |= found
    columns = {name: values for name, values in table.columns.items() if name in kept}
    return Table(columns, {n: u for n, u in table.units.items() if n in kept}, table.metadata)


GROUPS = ("segments", "sensors", "positions", "shift", "theta", "clinical", "isb", "trunk", "quality")
"""As `solve --columns` names them."""


def _named(column: str, word: str) -> bool:
    bare = column.removesuffix("_r").removesuffix("_l")
    return word == _group(column) if word in GROUPS else any(fnmatchcase(n, word) for n in (column, bare))


def _group(column: str) -> str:
    bare = column.removesuffix("_r").removesuffix("_l")
    if column.startswith("quality_"):
        return "quality"
    if bare in COLUMNS:
        shared = {**dict.fromkeys((*TRUNK, *CLAVICLE), "trunk")}
        first = "theta" if bare.startswith("theta") else "isb" if bare.startswith("isb_") else "clinical"
        return shared.get(bare, first)
    if bare.startswith("shoulder_shift_"):
        return "shift"
    if bare.rpartition("_")[0] in JOINTS:
        return "positions"
    return "sensors" if "_sensor_q" in column else "segments" if column[:-3] in SEGMENTS else ""


def measured(table: Table) -> Table:
    """Return the table without what is held, assumed, uncalibrated or rests on an assumed heading.

    Raises TableError when no column tells which numbers are.
    """
    if not any(name.startswith("quality_") for name in table.columns):
        raise TableError("--measured needs the columns of quality, and there are none; solve with them")
    columns = dict(table.columns)
    for name, values in columns.items():
        words = table.columns.get(_quality(name))
        if values.dtype.kind == "f" and words is not None:
            columns[name] = np.where(np.isin(words, list(MEASURED)), values, np.nan)
    return Table(columns, table.units, table.metadata)


def sensed(table: Table) -> Table:
    """Return the table without what rests on a sensor that was silent: there is a gap.

    That is what is `missing`, and what is assumed of a segment that is heard at other instants. One that is
    heard at none has no sensor: what is assumed of it stands, as the exercise states it. Columns whose
    quality is not told stand, too.
    """
    columns = dict(table.columns)
    for name, values in columns.items():
        told = _quality(name)
        gone = [rows for s in _rests_on(told, table) if (rows := _fell_silent(table, s)) is not None]
        if values.dtype.kind == "f" and told in table.columns:
            words = table.columns[told]
            silent = np.any([np.zeros(len(table), dtype=np.bool_), *gone], axis=0)
            left_out = (words == "missing") | ((words == "assumed") & silent)
            columns[name] = np.where(left_out, np.nan, values)
    return Table(columns, table.units, table.metadata)


RESTS_ON = {
    "shoulder_position": ("upper_arm",),
    "elbow_position": ("upper_arm",),
    "elbow_angles": ("upper_arm", "forearm"),
    "wrist_position": ("upper_arm", "forearm"),
    "wrist_angles": ("forearm", "hand"),
    "hand_position": ("upper_arm", "forearm", "hand"),
}
"""Whose sensors give a number: without one of them it is assumed, if it is known at all."""


def _rests_on(quality: str, table: Table) -> list[str]:
    """Return the segments whose sensors give what a column of quality tells of."""
    bare = quality.removeprefix("quality_").removesuffix("_r").removesuffix("_l")
    ends = [quality[-2:]] if quality.endswith(("_r", "_l")) else ["_r", "_l"]
    named = [part + end for part in RESTS_ON.get(bare, ()) for end in ends]
    return [segment for segment in named if f"quality_{segment}" in table.columns]


def _fell_silent(table: Table, segment: str) -> npt.NDArray[np.bool_] | None:
    """Return where (n,) a segment's sensor is missing that is heard at other instants; None: it never is."""
    words = table.columns[f"quality_{segment}"]
    silent = np.isin(words, ["missing", ""])
    return None if silent.all() or not silent.any() else silent


def _quality(column: str) -> str:
    """Return the name of the column that tells how far to trust another."""
    end = column[-2:] if column.endswith(("_r", "_l")) else ""
    bare = column.removesuffix(end)
    segment = column.removesuffix(column[-3:]).removesuffix("_sensor")
    if segment in SEGMENTS and column[-3:-1] == "_q":
        return f"quality_{segment}"
    for group, angles in SHARING_QUALITY.items():
        if bare in angles:
            return f"quality_{group}{end}"
    joint, _, axis = bare.rpartition("_")
    joint = "shoulder" if joint.startswith("shoulder_shift") else joint
    return f"quality_{joint}_position{end}" if joint in JOINTS and axis in ("x", "y", "z") else ""


def evenly(table: Table, rate_hz: float) -> Table:
    """Return the table at first + k / rate_hz, k = 0, 1, ...: numbers on the line between their neighbours.

    Where neighbours are further apart than GAP_PERIODS, or one of them is not known, nothing is known.
    Orientations turn the shortest way; words are those of the neighbour before. Raises TableError for times
    that do not grow, and for a table that is nearly all gap.
    """
    time_s = np.asarray(table.columns["time"], dtype=np.float64)
    period = period_s(time_s)
    _refuse(time_s, period)
    count = int(np.floor((time_s[-1] - time_s[0]) * rate_hz + SAME)) + 1
    wanted = time_s[0] + np.arange(count) / rate_hz
    before = np.clip(np.searchsorted(time_s, wanted + SAME * period, side="right") - 1, 0, len(time_s) - 1)
    after = np.minimum(before + 1, len(time_s) - 1)
    step = time_s[after] - time_s[before]
    fraction = np.where(step > 0.0, (wanted - time_s[before]) / np.where(step > 0.0, step, 1.0), 0.0)
    fraction[np.abs(wanted - time_s[before]) <= SAME * period] = 0.0
    gap = (step > GAP_PERIODS * period) & (fraction > 0.0)
    columns = {}
    for name, values in table.columns.items():
        if name == "time":
            columns[name] = wanted
        elif values.dtype.kind == "f":
            columns[name] = np.where(gap, np.nan, _line(values[before], values[after], fraction))
        else:
            columns[name] = np.where(gap, "", values[before]) if values.dtype.kind == "U" else values[before]
    for stem in _orientations(table):
        block = np.stack([table.columns[f"{stem}_q{part}"] for part in PARTS], axis=-1)
        turned = np.where(
            (fraction == 0.0)[:, None],
            block[before],
            rotation.slerp(block[before], block[after], fraction),
        )
        turned[gap] = np.nan
        columns |= {f"{stem}_q{part}": turned[:, i] for i, part in enumerate(PARTS)}
    return Table(columns, table.units, table.metadata)


def _refuse(time_s: Floats, period: float) -> None:
    """Refuse times (n,) that no even grid is for."""
    step = np.diff(time_s)
    if not (step > 0.0).all():
        at = time_s[np.argmax(step <= 0.0)] - time_s[0]
        raise TableError(f"time does not grow after {at:.2f} s: sort its rows, or cut it there with --until")
    instants = (time_s[-1] - time_s[0]) / period
    if instants > EMPTY_FROM and instants > EMPTY_TIMES * len(time_s):
        longest = int(np.argmax(step))
        last, first = (float(time_s[i] - time_s[0]) for i in (longest, longest + 1))
        raise TableError(
            f"nothing is known from {last:.2f} s to {first:.2f} s, and an even grid over it would be empty: "
            f"export what is before with --until {last + 0.5 * period:.2f}, what is after with "
            f"--from {first - 0.5 * period:.2f}"
        )


def _line(a: Floats, b: Floats, fraction: Floats) -> Floats:
    return np.where(fraction == 0.0, a, a + fraction * (b - a))


def _orientations(table: Table) -> list[str]:
    names = [name.removesuffix("_qw") for name in table.columns if name.endswith("_qw")]
    return [stem for stem in names if all(f"{stem}_q{part}" in table.columns for part in PARTS)]
