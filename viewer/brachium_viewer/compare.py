"""Error statistics between two results, or a result and a reference: b is the reference, errors are a - b."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from brachium_viewer.agreement import Agreement, agreement
from brachium_viewer.metrics.repetitions import Repetition, repetitions
from brachium_viewer.one_frame import FRAMES, FrameName, Removed
from brachium_viewer.pairing import Floats, Mask, Matched, OrientationFigures, Pair
from brachium_viewer.statistics import ErrorFigures, error_figures
from brachium_wire import table
from brachium_wire.capture_settings import read_settings
from brachium_wire.table import Table, TableError

AUTO, NONE = "auto", "none"


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """How two results are compared."""

    lag: float | Literal["estimate"] = 0.0
    """Seconds by which a is late: its row at t + lag belongs to b's at t. `estimate`: the best whole number
    of b's samples within `max_lag_samples`, or within half a second."""
    max_lag_samples: int | None = None
    frame: FrameName = "none"
    """What of a's frame is turned and shifted onto b's first: nothing, everything, or only the heading."""
    repetitions: str = AUTO
    """The column of b that rises once a repetition; `auto`: the angle that moves most; `none`: no cutting."""
    mask: str = ""
    """A column of b, true where rows count."""
    columns: tuple[str, ...] = ()
    """Only these columns, and orientations by their stems; * stands for anything."""
    from_s: float | None = None
    """Only from this time on, in b's own time."""
    to_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Aligned:
    """What aligning in time and frame took out of the errors: the mean RMSE before and after, by unit."""

    lag_s: float
    frame: Removed | None
    before: dict[str, float]
    after: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class PerRepetition:
    """One number, repetition by repetition."""

    rmse: ErrorFigures
    """Of the repetitions' own RMSE: bias is their mean, sd their spread."""
    highest: Agreement
    """Of the highest value in each repetition."""
    reach: Agreement
    """Of highest less lowest: the range of motion."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What `compare` found. Everything is over rows of b that count and where both are known."""

    a: str
    b: str
    rows: int
    """Rows of b that count."""
    lag_s: float
    mask: str = ""
    aligned: Aligned | None = None
    """None when neither a lag nor a frame was asked for."""
    columns: dict[str, ErrorFigures] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    orientations: dict[str, OrientationFigures] = field(default_factory=dict)
    relative: dict[str, ErrorFigures] = field(default_factory=dict)
    """Of one orientation as seen from another, by `forearm_r_sensor from upper_arm_r_sensor`, deg."""
    agreement: dict[str, Agreement] = field(default_factory=dict)
    """Of every common number, row by row."""
    repetitions_of: str = ""
    """The column that cut them; empty when there are fewer than three."""
    repetitions: list[Repetition] = field(default_factory=list)
    per_repetition: dict[str, PerRepetition] = field(default_factory=dict)
    """Only over rows in which a number was measured."""
    assumed: dict[str, dict[str, float]] = field(default_factory=dict)
    """Of columns not measured throughout: the share of rows that rests on an assumption, in a and in b."""

    def to_json(self) -> dict[str, Any]:
        """Return the same as maps, text and numbers."""
        return asdict(self)


def settings_beside(reference: Path) -> CompareSettings:
    """Return how a capture's truth is to be compared, by the capture.toml beside it; else the defaults."""
    path = reference.parent / "capture.toml"
    if reference.stem != "truth" or not path.is_file():
        return CompareSettings()
    truth = read_settings(path).truth
    if truth.max_lag_samples:
        return CompareSettings(lag="estimate", max_lag_samples=truth.max_lag_samples, mask=truth.mask)
    return CompareSettings(mask=truth.mask)


def compare(a: Path, b: Path, settings: CompareSettings | None = None) -> tuple[Comparison, Matched]:
    """Compare two result files, CSV or Parquet; without settings as `settings_beside(b)` says.

    Return also the rows that it rests on. Raises table.TableError (or a capture error) when a file is no
    table or nothing in them can be compared.
    """
    chosen = settings_beside(b) if settings is None else settings
    return matched(table.read(a), table.read(b), chosen, names=(str(a), str(b)))


def matched(
    a: Table, b: Table, settings: CompareSettings, names: tuple[str, str] = ("a", "b")
) -> tuple[Comparison, Matched]:
    """Return the comparison and the rows it rests on."""
    if settings.lag != "estimate" and not np.isfinite(settings.lag):
        raise TableError(f"lag = {settings.lag}: expected seconds, a finite number, or the word estimate")
    if settings.frame not in FRAMES:
        raise TableError(f"frame = {settings.frame!r}: expected {', '.join(FRAMES)}")
    pair = Pair(a, b, names, leave_out=settings.mask, columns=settings.columns)
    counts = _counts(b, pair.b_time, settings, names[1])
    lag_s = pair.best_lag_s(counts, settings.max_lag_samples) if settings.lag == "estimate" else settings.lag
    rows, removed = pair.at(lag_s, counts).in_one_frame(settings.frame)
    columns, orientations = rows.columns(), rows.orientation_figures()
    if not columns and not orientations:
        raise TableError(f"{names[0]} and {names[1]} share no instant at which both are known")
    cut_by, cut = _cut(rows, pair.units, settings.repetitions, names[1])
    aligned = None
    if lag_s or removed is not None:
        aligned = Aligned(
            lag_s=lag_s,
            frame=removed,
            before=_by_unit(pair.at(0.0, counts), pair.units),
            after=_by_unit(rows, pair.units),
        )
    known = {n: agreement(x[counts], y[counts]) for n, (x, y) in rows.numbers.items()}
    found = Comparison(
        a=names[0],
        b=names[1],
        rows=int(counts.sum()),
        lag_s=lag_s,
        mask=settings.mask,
        aligned=aligned,
        columns=columns,
        units={n: u for n, u in pair.units.items() if n in columns},
        orientations=orientations,
        relative=rows.relative(),
        agreement={n: figures for n, figures in known.items() if figures is not None},
        repetitions_of=cut_by,
        repetitions=cut,
        per_repetition=_per_repetition(rows, cut),
        assumed=rows.assumed_shares(),
    )
    return found, rows


def _by_unit(rows: Matched, units: dict[str, str]) -> dict[str, float]:
    """Return the mean RMSE of all orientations, of what lies between neighbours, and of columns by unit."""
    kinds = {
        "orientations, deg": [o.total.rmse for o in rows.orientation_figures().values()],
        "between neighbours, deg": [e.rmse for e in rows.relative().values()],
    }
    for name, figures in rows.columns().items():
        kinds.setdefault(f"columns, {units[name]}" if units[name] else "columns", []).append(figures.rmse)
    return {kind: float(np.mean(errors)) for kind, errors in kinds.items() if errors}


FEWEST = 3
"""Repetitions below which nothing is said about them."""


def _cut(rows: Matched, units: dict[str, str], chosen: str, name: str) -> tuple[str, list[Repetition]]:
    """Return the column that cuts the movement into repetitions, and these."""
    if chosen == NONE:
        return "", []
    if chosen == AUTO:
        known = {n: rows.measured(n)[1][rows.counts] for n in rows.numbers if units[n] == "deg"}
        angles = {n: float(np.ptp(b[np.isfinite(b)])) for n, b in known.items() if np.isfinite(b).any()}
        if not angles:
            return "", []
        chosen = max(angles, key=angles.__getitem__)
    elif chosen not in rows.numbers:
        raise TableError(
            f"{name}: repetitions by {chosen!r}: expected a column of both, {', '.join(rows.numbers)}"
        )
    values = np.where(rows.counts, rows.numbers[chosen][1], np.nan)
    found = repetitions(rows.time, values)
    return (chosen, found) if len(found) >= FEWEST else ("", [])


def _per_repetition(rows: Matched, cut: list[Repetition]) -> dict[str, PerRepetition]:
    inside = [rows.counts & (rows.time >= r.from_s) & (rows.time <= r.to_s) for r in cut]
    found = {}
    for name in rows.numbers:
        a, b = rows.measured(name)
        known = [i & np.isfinite(a) & np.isfinite(b) for i in inside]
        parts = [(a[k], b[k]) for k in known if k.any()]
        if len(parts) < FEWEST:
            continue
        rmse = error_figures([float(np.sqrt(np.mean((x - y) ** 2))) for x, y in parts])
        highest = agreement(*_each(parts, np.max))
        reach = agreement(*_each(parts, np.ptp))
        assert rmse is not None
        assert highest is not None
        assert reach is not None
        found[name] = PerRepetition(rmse=rmse, highest=highest, reach=reach)
    return found


def _each(parts: list[tuple[Floats, Floats]], what: Any) -> tuple[list[float], list[float]]:
    return [float(what(a)) for a, _ in parts], [float(what(b)) for _, b in parts]


def _counts(b: Table, time: Floats, settings: CompareSettings, name: str) -> Mask:
    counts = np.ones(len(time), dtype=np.bool_)
    if settings.mask:
        if settings.mask not in b.columns:
            raise TableError(f"{name}: no column {settings.mask!r} to choose rows by")
        mask = b.columns[settings.mask]
        if mask.dtype.kind not in "bif":
            raise TableError(f"{name}: column {settings.mask!r} must hold true and false, or 1 and 0")
        counts &= np.nan_to_num(mask.astype(np.float64)) > 0.5
    if settings.from_s is not None:
        counts &= time >= settings.from_s
    if settings.to_s is not None:
        counts &= time <= settings.to_s
    return counts
