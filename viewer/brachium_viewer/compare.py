"""Error statistics between two results, or a result and a reference: b is the reference, errors are a - b."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from brachium_body.rotation import inverse, multiply
from brachium_viewer import alignment as al
from brachium_viewer.statistics import ErrorFigures, error_figures, orientation_errors_deg
from brachium_wire import table
from brachium_wire.capture_settings import read_settings
from brachium_wire.table import Table, TableError

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ROUNDING_DEG = 1e-9
"""Smaller angles are what float64 leaves over; people are shown 0."""


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """How two results are compared."""

    lag: float | Literal["estimate"] = 0.0
    """Seconds by which a is late: its row at t + lag belongs to b's at t. `estimate`: the best whole number
    of b's samples within `max_lag_samples`."""
    max_lag_samples: int = 2
    mask: str = ""
    """A column of b, true where rows count."""
    from_s: float | None = None
    """Only from this time on, in b's own time."""
    to_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class OrientationFigures:
    """Errors of one orientation, deg: the whole angle, and its parts about the vertical and from it."""

    total: ErrorFigures
    heading: ErrorFigures
    inclination: ErrorFigures


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What `compare` found. Everything is over rows of b that count and where both are known."""

    a: str
    b: str
    rows: int
    """Rows of b that count."""
    lag_s: float
    mask: str = ""
    columns: dict[str, ErrorFigures] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    orientations: dict[str, OrientationFigures] = field(default_factory=dict)
    relative: dict[str, ErrorFigures] = field(default_factory=dict)
    """Of one orientation as seen from another, by `forearm_r_sensor from upper_arm_r_sensor`, deg."""

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


def compare(a: Path, b: Path, settings: CompareSettings | None = None) -> Comparison:
    """Compare two result files, CSV or Parquet; without settings as `settings_beside(b)` says.

    Raises table.TableError (or a capture error) when a file is no table or nothing in them can be compared.
    """
    chosen = settings_beside(b) if settings is None else settings
    return compare_tables(table.read(a), table.read(b), chosen, names=(str(a), str(b)))


def compare_tables(
    a: Table, b: Table, settings: CompareSettings, names: tuple[str, str] = ("a", "b")
) -> Comparison:
    """Compare two tables: every common column of numbers, and every common orientation."""
    if settings.lag != "estimate" and not np.isfinite(settings.lag):
        raise TableError(f"lag = {settings.lag}: expected seconds, a finite number, or the word estimate")
    both = _Pair(a, b, settings, names)
    if not both.stems and not both.numbers:
        raise TableError(f"{names[0]} and {names[1]} have no column in common that could be compared")
    lag_s = settings.lag
    if lag_s == "estimate":
        period = float(np.median(np.diff(both.b_time)))
        lags = sorted(range(-settings.max_lag_samples, settings.max_lag_samples + 1), key=abs)
        lag_s = period * min(lags, key=lambda k: both.score(k * period))
    comparison = Comparison(
        a=names[0],
        b=names[1],
        rows=int(both.counts.sum()),
        lag_s=lag_s,
        mask=settings.mask,
        columns=both.columns(lag_s),
        orientations=both.orientations(lag_s),
        relative=both.relative(lag_s),
    )
    if not comparison.columns and not comparison.orientations:
        raise TableError(f"{names[0]} and {names[1]} share no instant at which both are known")
    return replace(comparison, units={n: u for n, u in both.units.items() if n in comparison.columns})


class _Pair:
    """Two tables, what they have in common, and errors at any lag."""

    def __init__(self, a: Table, b: Table, settings: CompareSettings, names: tuple[str, str]) -> None:
        self._a, self._b = a.columns, b.columns
        a_name, self.a_time = al.time_of(a, names[0])
        b_name, self.b_time = al.time_of(b, names[1])
        common = [n for n in b.columns if n in a.columns and n not in (a_name, b_name, settings.mask)]
        stems = al.orientation_stems(common)
        self.stems = sorted(stems, key=al.outwards)
        self.numbers = [
            n
            for n in common
            if not al.is_orientation(n)
            and a.columns[n].dtype.kind in "if"
            and b.columns[n].dtype.kind in "if"
        ]
        self.units = {n: a.units.get(n) or b.units.get(n, "") for n in self.numbers}
        for n in self.numbers:
            if a.units.get(n) and b.units.get(n) and a.units[n] != b.units[n]:
                raise TableError(f"column {n}: {names[0]} is in {a.units[n]}, {names[1]} in {b.units[n]}")
        self.counts = _counts(b, self.b_time, settings, names[1])

    def _times(self, lag_s: float) -> Floats:
        return al.snapped(self.b_time + lag_s, self.a_time)

    def _errors(self, error: Floats) -> ErrorFigures | None:
        return error_figures(error[self.counts])

    def columns(self, lag_s: float) -> dict[str, ErrorFigures]:
        """Return the error of every common number; degrees within half a turn."""
        found = {}
        for n in self.numbers:
            turns = self.units[n] == "deg"
            a, b = (side[n].astype(np.float64) for side in (self._a, self._b))
            error = al.difference(
                al.numbers_at(self._times(lag_s), self.a_time, a, turns=turns), b, turns=turns
            )
            if (figures := self._errors(error)) is not None:
                found[n] = figures
        return found

    def _pair_of(self, stem: str, lag_s: float) -> tuple[Floats, Floats]:
        a = al.orientations_at(self._times(lag_s), self.a_time, al.quaternions(self._a, stem))
        return a, al.quaternions(self._b, stem)

    def orientations(self, lag_s: float) -> dict[str, OrientationFigures]:
        """Return the error of every common orientation."""
        found = {}
        for stem in self.stems:
            parts = [self._errors(e) for e in orientation_errors_deg(*self._pair_of(stem, lag_s))]
            total, heading, inclination = parts
            if total is not None and heading is not None and inclination is not None:
                found[stem] = OrientationFigures(total=total, heading=heading, inclination=inclination)
        return found

    def relative(self, lag_s: float) -> dict[str, ErrorFigures]:
        """Return the error of each orientation as seen from the one before it on the same arm."""
        found = {}
        for first, second in al.neighbours(self.stems):
            a, b = zip(self._pair_of(first, lag_s), self._pair_of(second, lag_s), strict=True)
            total, _, _ = orientation_errors_deg(_seen_from(*a), _seen_from(*b))
            if (figures := self._errors(total)) is not None:
                found[f"{second} from {first}"] = figures
        return found

    def score(self, lag_s: float) -> float:
        """Return what the best lag makes smallest: errors between neighbours, else whole, else of columns."""
        kinds: tuple[Callable[[], list[float]], ...] = (
            lambda: [e.rmse for e in self.relative(lag_s).values()],
            lambda: [o.total.rmse for o in self.orientations(lag_s).values()],
            lambda: [e.rmse / (self._spread(n) or 1.0) for n, e in self.columns(lag_s).items()],
        )
        for kind in kinds:
            if errors := kind():
                return float(np.mean(errors))
        return float("inf")

    def _spread(self, name: str) -> float:
        values = self._b[name].astype(np.float64)[self.counts]
        return float(np.nanstd(values)) if np.isfinite(values).any() else 0.0


def _seen_from(first: Floats, second: Floats) -> Floats:
    return multiply(inverse(first), second)


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


def text(comparison: Comparison) -> str:
    """Return the comparison as a table for people."""
    c = comparison
    lines = [f"{c.a} against {c.b}: {c.rows} rows" + (f" where {c.mask}" if c.mask else "")]
    if c.lag_s:
        lines.append(f"lag {1e3 * c.lag_s:.1f} ms")
    lines += ["", f"{'':<44}{'RMSE':>10}{'bias':>10}{'SD':>10}{'largest':>10}{'n':>9}"]
    for stem, o in c.orientations.items():
        lines += [_line(f"{stem}, whole angle, deg", o.total)]
        lines += [_line("  heading, deg", o.heading), _line("  inclination, deg", o.inclination)]
    lines += [_line(f"{pair}, deg", e) for pair, e in c.relative.items()]
    for name, e in c.columns.items():
        unit = c.units.get(name, "")
        lines.append(_line(f"{name}, {unit}" if unit else name, e))
    return "\n".join(lines) + "\n"


def _line(name: str, e: ErrorFigures) -> str:
    rmse, bias, sd, largest = (
        0.0 if name.endswith("deg") and abs(x) < ROUNDING_DEG else x
        for x in (e.rmse, e.bias, e.sd, e.max_abs)
    )
    return f"{name:<44}{rmse:>10.4g}{bias:>10.3g}{sd:>10.3g}{largest:>10.4g}{e.n:>9}"
