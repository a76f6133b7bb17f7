"""A table of figures: what it shows, its columns and rows, and which of them have a limit. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

Cell = float | str | None
"""A figure, a word, or nothing: not measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """One figure that has a limit."""

    what: str
    value: float | None
    at_most: float
    unit: str
    at_least: bool = False
    """The limit is a least value, not a largest."""

    @property
    def met(self) -> bool:
        """Whether it is measured and within its limit."""
        if self.value is None:
            return False
        return self.value >= self.at_most if self.at_least else self.value <= self.at_most

    def words(self) -> str:
        """Return the figure, its limit and whether it is met, in one line."""
        value = "not measured" if self.value is None else f"{shown(self.value)} {self.unit}"
        bound = "at least" if self.at_least else "at most"
        return f"{self.what}: {value}, {bound} {self.at_most:g}: {'met' if self.met else 'NOT MET'}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """One table. `rows` are labels and as many cells as there are columns."""

    name: str
    title: str
    unit: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Cell, ...]], ...]
    limits: tuple[Limit, ...] = ()
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Raise ValueError for a row that does not fit the columns."""
        for label, cells in self.rows:
            if len(cells) != len(self.columns):
                raise ValueError(
                    f"table {self.name}, row {label!r}: {len(cells)} cells, {len(self.columns)} columns"
                )

    def plain(self) -> dict[str, object]:
        """Return the same as maps, text and numbers."""
        return {
            "name": self.name,
            "title": self.title,
            "unit": self.unit,
            "columns": list(self.columns),
            "rows": [
                {"label": label, **dict(zip(self.columns, cells, strict=True))} for label, cells in self.rows
            ],
            "limits": [
                {
                    "what": limit.what,
                    "value": limit.value,
                    "limit": limit.at_most,
                    "least": limit.at_least,
                    "unit": limit.unit,
                    "met": limit.met,
                }
                for limit in self.limits
            ],
            "notes": list(self.notes),
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> "Table":
        """Return the table that `plain` told."""
        columns = tuple(plain["columns"])
        return cls(
            name=plain["name"],
            title=plain["title"],
            unit=plain["unit"],
            columns=columns,
            rows=tuple((row["label"], tuple(row[column] for column in columns)) for row in plain["rows"]),
            limits=tuple(
                Limit(
                    what=limit["what"],
                    value=limit["value"],
                    at_most=limit["limit"],
                    unit=limit["unit"],
                    at_least=limit["least"],
                )
                for limit in plain["limits"]
            ),
            notes=tuple(plain["notes"]),
        )

    def text(self) -> str:
        """Return the table for a terminal."""
        cells = [["", *self.columns], *([label, *map(shown, row)] for label, row in self.rows)]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns) + 1)]
        lines = [f"{self.title} ({self.unit})" if self.unit else self.title, ""]
        for row in cells:
            first, *others = row
            padded = [f"{c:>{w}}" for c, w in zip(others, widths[1:], strict=True)]
            lines.append("  ".join([f"{first:<{widths[0]}}", *padded]).rstrip())
        lines += ["", *(limit.words() for limit in self.limits)] if self.limits else []
        return "\n".join([*lines, *self.notes])

    def markdown(self) -> str:
        """Return the table as a section of a page."""
        lines = [f"### {self.title}", ""]
        if self.unit:
            lines += [f"In {self.unit}.", ""]
        lines += [_row(["", *self.columns]), "|" + "---|" * (len(self.columns) + 1)]
        lines += [_row([label, *map(shown, cells)]) for label, cells in self.rows]
        if self.limits:
            lines += ["", *(f"* {limit.words()}" for limit in self.limits)]
        for note in self.notes:
            lines += ["", note]
        return "\n".join(lines)


def shown(cell: Cell) -> str:
    """Return a cell as people read it: three figures, a dash for what was not measured."""
    if cell is None:
        return "-"
    if isinstance(cell, str):
        return cell
    size = abs(cell)
    if size >= 1e5:
        return f"{cell:.0e}"
    if size >= 100.0:
        return f"{cell:.0f}"
    if size >= 10.0:
        return f"{cell:.1f}"
    return f"{cell:.2f}" if size >= 0.095 or cell == 0.0 else f"{cell:.3f}"


def middle(values: Sequence[float | None]) -> float | None:
    """Return the median of the figures that are known, or None when there is none."""
    known = [v for v in values if v is not None]
    return median(known) if known else None


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
