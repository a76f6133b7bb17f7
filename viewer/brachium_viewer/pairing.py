"""What two tables have in common, row beside row at any lag. Pure."""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase

import numpy as np
import numpy.typing as npt

from brachium_body.rotation import inverse, multiply
from brachium_viewer import alignment as al
from brachium_viewer import one_frame
from brachium_viewer.statistics import ErrorFigures, error_figures, orientation_errors_deg
from brachium_viewer.table_quality import assumed_rows
from brachium_wire.table import Table, TableError

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
WITHIN_S = 0.5
"""A lag is looked for up to this: radio, batches and filters together stay far below."""
NO_MEASURE = "shoulder_shift_sd_"
"""How uncertain a result says it is: no quantity of which two results could be right or wrong."""
COARSE = 5
"""Lags are first tried this many samples apart."""


@dataclass(frozen=True, kw_only=True)
class OrientationFigures:
    """Errors of one orientation, deg: the whole angle, and its parts about the vertical and from it."""

    total: ErrorFigures
    heading: ErrorFigures
    inclination: ErrorFigures


@dataclass(frozen=True, eq=False)
class Matched:
    """a and b at b's instants. Quaternions (n, 4), numbers (n,); degrees of a within half a turn of b's."""

    time: Floats
    orientations: one_frame.Pairs
    numbers: one_frame.Pairs
    counts: Mask
    assumed: dict[str, tuple[Mask, Mask]] = field(default_factory=dict)
    """Of numbers that one side only assumed: the rows (n,) of a and of b where it did."""

    def measured(self, name: str) -> tuple[Floats, Floats]:
        """Return a number of a and b, NaN where one of them is assumed."""
        a, b = self.numbers[name]
        if name not in self.assumed:
            return a, b
        either = self.assumed[name][0] | self.assumed[name][1]
        return np.where(either, np.nan, a), np.where(either, np.nan, b)

    def assumed_shares(self) -> dict[str, dict[str, float]]:
        """Return of every number not wholly measured the share of its rows that is assumed, in a and b."""
        shares = {}
        for name, masks in self.assumed.items():
            rows = self.counts & np.isfinite(self.numbers[name][0]) & np.isfinite(self.numbers[name][1])
            if any(mask[rows].any() for mask in masks):
                shares[name] = {
                    side: float(mask[rows].mean()) for side, mask in zip("ab", masks, strict=True)
                }
        return shares

    def columns(self) -> dict[str, ErrorFigures]:
        """Return the error of every common number."""
        found = {n: error_figures((a - b)[self.counts]) for n, (a, b) in self.numbers.items()}
        return {n: figures for n, figures in found.items() if figures is not None}

    def orientation_figures(self) -> dict[str, OrientationFigures]:
        """Return the error of every common orientation."""
        found = {}
        for stem, (a, b) in self.orientations.items():
            total, heading, inclination = (
                error_figures(e[self.counts]) for e in orientation_errors_deg(a, b)
            )
            if total is not None and heading is not None and inclination is not None:
                found[stem] = OrientationFigures(total=total, heading=heading, inclination=inclination)
        return found

    def relative(self) -> dict[str, ErrorFigures]:
        """Return the error of each orientation as seen from the one before it on the same arm."""
        found = {}
        for first, second in al.neighbours(list(self.orientations)):
            a, b = zip(self.orientations[first], self.orientations[second], strict=True)
            total, _, _ = orientation_errors_deg(_seen_from(*a), _seen_from(*b))
            if (figures := error_figures(total[self.counts])) is not None:
                found[f"{second} from {first}"] = figures
        return found

    def score(self) -> float:
        """Return what the best lag makes smallest: errors between neighbours, else whole, else of columns."""
        errors = [e.rmse for e in self.relative().values()]
        errors = errors or [o.total.rmse for o in self.orientation_figures().values()]
        errors = errors or [e.rmse / (self._spread(n) or 1.0) for n, e in self.columns().items()]
        return float(np.mean(errors)) if errors else float("inf")

    def in_one_frame(self, kind: one_frame.FrameName) -> "tuple[Matched, one_frame.Removed | None]":
        """Return the same with a in b's frame, and what that took out."""
        orientations, numbers, removed = one_frame.in_one_frame(
            self.orientations, self.numbers, self.counts, kind
        )
        return replace(self, orientations=orientations, numbers=numbers), removed

    def _spread(self, name: str) -> float:
        values = self.numbers[name][1][self.counts]
        return float(np.nanstd(values)) if np.isfinite(values).any() else 0.0


class Pair:
    """Two tables and what they have in common."""

    def __init__(
        self, a: Table, b: Table, names: tuple[str, str], leave_out: str = "", columns: Sequence[str] = ()
    ) -> None:
        self._a, self._b = a.columns, b.columns
        a_name, self.a_time = al.time_of(a, names[0])
        b_name, self.b_time = al.time_of(b, names[1])
        common = [n for n in b.columns if n in a.columns and n not in (a_name, b_name, leave_out)]
        self.stems = sorted(al.orientation_stems(common), key=al.outwards)
        self.numbers = [
            n
            for n in common
            if not al.is_orientation(n)
            and not n.startswith(NO_MEASURE)
            and a.columns[n].dtype.kind in "if"
            and b.columns[n].dtype.kind in "if"
        ]
        self.units = {n: a.units.get(n) or b.units.get(n, "") for n in self.numbers}
        for n in self.numbers:
            if a.units.get(n) and b.units.get(n) and a.units[n] != b.units[n]:
                raise TableError(f"column {n}: {names[0]} is in {a.units[n]}, {names[1]} in {b.units[n]}")
        if not self.stems and not self.numbers:
            raise TableError(f"{names[0]} and {names[1]} have no column in common that could be compared")
        if columns:
            self._choose(columns)
        told = {n: (assumed_rows(a, n), assumed_rows(b, n)) for n in self.numbers}
        self._assumed = {n: masks for n, masks in told.items() if any(m is not None for m in masks)}

    def _choose(self, columns: Sequence[str]) -> None:
        """Leave only what one of the names says, in which * stands for anything."""
        both = [*self.stems, *self.numbers]
        for name in columns:
            if not _among(both, [name]):
                near = difflib.get_close_matches(name, both, n=1)
                hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(both)}"
                raise TableError(f"column {name!r} is not in both; {hint}")
        self.stems, self.numbers = _among(self.stems, columns), _among(self.numbers, columns)

    def at(self, lag_s: float, counts: Mask) -> Matched:
        """Return a's row at t + lag beside b's at t."""
        time = al.snapped(self.b_time + lag_s, self.a_time)
        orientations = {
            s: (
                al.orientations_at(time, self.a_time, al.quaternions(self._a, s)),
                al.quaternions(self._b, s),
            )
            for s in self.stems
        }
        numbers = {}
        for n in self.numbers:
            turns = self.units[n] == "deg"
            a, b = (side[n].astype(np.float64) for side in (self._a, self._b))
            a = al.numbers_at(time, self.a_time, a, turns=turns)
            numbers[n] = (b + al.difference(a, b, turns=True) if turns else a, b)
        assumed = {
            n: (
                np.zeros(len(time), dtype=np.bool_) if a is None else np.interp(time, self.a_time, a) > 0.0,
                np.zeros(len(time), dtype=np.bool_) if b is None else b,
            )
            for n, (a, b) in self._assumed.items()
        }
        return Matched(self.b_time, orientations, numbers, counts, assumed)

    def best_lag_s(self, counts: Mask, max_samples: int | None) -> float:
        """Return the lag, a whole number of b's samples, at which a and b differ least."""
        period = float(np.median(np.diff(self.b_time)))
        limit = round(WITHIN_S / period) if max_samples is None else max_samples
        scores: dict[int, float] = {}

        def best(lags: range) -> int:
            for k in lags:
                if k not in scores:
                    scores[k] = self.at(k * period, counts).score()
            return min(sorted(lags, key=abs), key=scores.__getitem__)

        if limit <= 2 * COARSE:
            return period * best(range(-limit, limit + 1))
        near = best(range(-(limit // COARSE) * COARSE, limit + 1, COARSE))
        return period * best(range(max(-limit, near - COARSE), min(limit, near + COARSE) + 1))


def _among(names: Iterable[str], patterns: Sequence[str]) -> list[str]:
    return [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]


def _seen_from(first: Floats, second: Floats) -> Floats:
    return multiply(inverse(first), second)
