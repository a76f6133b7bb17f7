"""Every format by its name, and the one way to a file: a result table, cut, put on an even grid, written."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from brachium_viewer.export import bvh, c3d, motion_bids, opensim, rows, rrd, tables
from brachium_viewer.export.about import about
from brachium_viewer.export.motion import Motion, motion, sides_of
from brachium_wire.table import MissingExtra, Table


@dataclass(frozen=True, kw_only=True)
class Format:
    """How a format is written."""

    write: Callable[[Motion, Path], list[Path]]
    even: bool
    """The motion is put on an even grid first."""
    tells_quality: bool = False
    """It has the columns of quality. One without leaves out what is assumed while a sensor was silent."""
    package: str = ""
    """What it needs, and the extra that brings it."""
    extra: str = ""


FORMATS: dict[str, Format] = {
    "csv": Format(write=tables.write_table, even=False, tells_quality=True),
    "parquet": Format(
        write=tables.write_table, even=False, tells_quality=True, package="pyarrow", extra="parquet"
    ),
    "sto": Format(write=opensim.write_sto, even=True),
    "mot": Format(write=opensim.write_mot, even=True),
    "trc": Format(write=opensim.write_trc, even=True),
    "c3d": Format(write=c3d.write_c3d, even=True, package="ezc3d", extra="export"),
    "bvh": Format(write=bvh.write_bvh, even=True),
    "rrd": Format(write=rrd.write_rrd, even=False, package="rerun", extra="view"),
    "motion-bids": Format(write=motion_bids.write_motion_bids, even=True),
}
"""By name, which is the file's ending, too; motion-bids is a folder."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """What of a motion is wanted, and how."""

    to: str
    columns: tuple[str, ...] = ()
    """Empty: all."""
    rate_hz: float | None = None
    """None: the motion's own."""
    from_s: float | None = None
    until_s: float | None = None
    measured: bool = False
    """Leave out what is held, assumed or uncalibrated."""
    session: str | None = None
    """Of motion-bids, as `task`."""
    task: str | None = None


def export(source: Table, out: Path, wish: Wish, made_by: str) -> list[Path]:
    """Write what is wanted of a result table; return the files.

    Raises TableError for what cannot be written so, MissingExtra naming what is to be installed.
    """
    chosen = FORMATS[wish.to]
    if chosen.package and find_spec(chosen.package) is None:
        raise MissingExtra(
            f"--to {wish.to} needs the package {chosen.package}: pip install 'brachium[{chosen.extra}]'"
        )
    motion_of_it = prepared(source, wish, made_by)
    if wish.to == "motion-bids":
        return chosen.write(motion_of_it, out)
    return _whole(out, lambda fresh: chosen.write(motion_of_it, fresh))


def _whole(out: Path, write: Callable[[Path], list[Path]]) -> list[Path]:
    """Write a file, and those beside it, whole or not at all: what was there before stands until then."""
    try:
        with TemporaryDirectory(prefix=".brachium-", dir=out.parent) as scratch:
            return [path.replace(out.with_name(path.name)) for path in write(Path(scratch, out.name))]
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(out)) from None


def prepared(source: Table, wish: Wish, made_by: str) -> Motion:
    """Return the motion that a format gets. Raises TableError."""
    sides = sides_of(source)
    cut = source if FORMATS[wish.to].tells_quality else rows.sensed(source)
    if wish.from_s is not None or wish.until_s is not None:
        cut = rows.between(cut, wish.from_s, wish.until_s)
    if wish.measured:
        cut = rows.measured(cut)
    if wish.columns:
        cut = rows.chosen(cut, wish.columns)
    if FORMATS[wish.to].even or wish.rate_hz is not None:
        cut = rows.evenly(cut, wish.rate_hz or own_rate_hz(cut))
    said = about(
        source,
        made_by,
        columns=list(wish.columns) or None,
        rate_hz=wish.rate_hz,
        from_s=wish.from_s,
        until_s=wish.until_s,
        measured=wish.measured or None,
        session=wish.session,
        task=wish.task,
    )
    said["sides"] = sides
    return motion(Table(cut.columns, cut.units, source.metadata | {"sides": sides}), said)


def own_rate_hz(source: Table) -> float:
    """Return the rate of a table's own instants, Hz, as round as they are."""
    rate = 1.0 / rows.period_s(source.columns["time"])
    near = round(rate)
    return float(near) if near and abs(rate - near) < 1e-3 * near else rate
