"""What a report says of sets as a whole, as a table: one row a number. Pure but for the file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from brachium_viewer.metrics.both_arms import Components
from brachium_viewer.metrics.measure import Measure, withheld
from brachium_viewer.report import words
from brachium_viewer.report.groups import Group, Symmetry
from brachium_viewer.sessions.records import SessionRecord
from brachium_wire import table

COLUMNS = ("subject", "origin", "recording", "exercise", "side", "mode", "sets", "kind", "quantity", "of",
           "value", "unit", "coverage", "withheld")  # fmt: skip
NUMBERS = ("value", "coverage")


class Row(NamedTuple):
    """One number of the sets of one exercise by one arm in one mode."""

    kind: str
    """set, median, last_to_first, both_arms, active_passive, or component_1, component_2 and so on."""
    quantity: str
    measure: Measure
    of: str = ""
    """What it is of where the quantity does not say it: hand or wrist, shoulder, the other arm or mode."""


def beside(path: Path) -> Path:
    """Return the file of this table beside that of repetitions: p01.csv has p01.sets.csv."""
    return path.with_suffix(f".sets{path.suffix}")


def write(path: Path, session: SessionRecord, found: Sequence[tuple[Group, Row]]) -> None:
    """Write the table, .csv or .parquet; raises TableError for another ending."""
    rows = [_line(session, group, row) for group, row in found]
    columns = {
        name: np.array([row[name] for row in rows], dtype=np.float64 if name in NUMBERS else np.str_)
        for name in COLUMNS
    }
    about = {"title": "sets", "method": session.method, "settings": session.settings}
    table.write(path, columns, {"coverage": "1"}, about)


def _line(session: SessionRecord, group: Group, row: Row) -> dict[str, Any]:
    one = row.measure
    numbers = [str(i) for i, s in enumerate(session.sets, start=1) if s.what == group.sets[0].what]
    return {
        "subject": session.subject,
        "origin": session.origin,
        "recording": session.recording,
        "exercise": group.exercise.name,
        "side": group.side,
        "mode": group.mode,
        "sets": " ".join(numbers),
        "kind": row.kind,
        "quantity": row.quantity,
        "of": row.of,
        "value": np.nan if one.value is None else one.value,
        "unit": one.unit,
        "coverage": one.coverage,
        "withheld": one.withheld,
    }


def rows(
    groups: Sequence[Group],
    symmetries: Sequence[Symmetry],
    lags: Sequence[tuple[Group, Measure]],
    parts: Sequence[tuple[Group, Components | None]],
) -> list[tuple[Group, Row]]:
    """Return every number that the report says of sets, those that are withheld too."""
    found = [(group, row) for group in groups for row in _of_group(group)]
    for s in symmetries:
        found.append((s.group, Row("both_arms", "range", s.range_percent, s.other.side)))
        found.append((s.group, Row("both_arms", "ldlj", s.ldlj_change, s.other.side)))
    found += [(group, Row("active_passive", "peak", lag, "passive")) for group, lag in lags]
    return found + [(group, row) for group, some in parts for row in _of_parts(some)]


def _of_group(group: Group) -> Iterator[Row]:
    pooled = group.pooled
    share = pooled.measured
    yield Row("set", "repetitions", _count(len(pooled.repetitions), share))
    yield Row("set", "tries", _count(pooled.tries, share))
    yield Row("set", "best_peak", pooled.best_peak)
    if group.exercise.straightens:
        yield Row("set", "extension_deficit", pooled.extension_deficit)
    of = {"shoulder_shift": pooled.shoulder_word, "hand_path": pooled.path_of, "straightness": pooled.path_of}
    for name, median in pooled.medians.items():
        yield Row("median", name, median, of.get(name, ""))
    for name, change in pooled.first_to_last.items():
        yield Row("last_to_first", name, change, of.get(name, ""))


def _count(number: int, share: float | None) -> Measure:
    return Measure(value=float(number), unit="1", coverage=np.nan if share is None else share)


def _of_parts(parts: Components | None) -> Iterator[Row]:
    if parts is None:
        yield Row("component_1", "variance_explained", withheld(words.NO_COMPONENTS, "1"))
        return
    for i, (share, direction) in enumerate(zip(parts.explained, parts.directions, strict=True), start=1):
        yield Row(f"component_{i}", "variance_explained", _known(float(share)))
        for name, weight in zip(parts.names, direction, strict=True):
            yield Row(f"component_{i}", name, _known(float(weight)))


def _known(value: float) -> Measure:
    return Measure(value=value, unit="1", coverage=np.nan)
