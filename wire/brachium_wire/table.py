"""Result tables at rest: named columns with units, as CSV or Parquet by the file's ending.

CSV: `# name: value` lines (value as JSON), one header line of `name [unit]`, one row a line, comma and
decimal point. Parquet: the unit in each field's metadata, the rest in the schema's under `brachium`.
A number that is not known is NaN in an array, an empty cell in CSV and null in Parquet; unknown text is "".
"""

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[Any]

_NAME = re.compile(r"[^\s#\[\]][^\[\]\r\n]*(?<!\s)\Z")
_HEAD = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\[\]]*)\])?\Z")
_WHOLE = re.compile(r"[+-]?[0-9]{1,18}\Z")


class TableError(ValueError):
    """The file is no table, or the columns make none: one line that says what to do."""


class MissingExtra(RuntimeError):
    """A package that this needs is not installed; the text names the extra that brings it."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of one length: float64, int64, bool or text arrays, in the file's order."""

    columns: dict[str, Column]
    units: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0


def write(
    path: Path, columns: Mapping[str, npt.ArrayLike], units: Mapping[str, str], metadata: Mapping[str, Any]
) -> None:
    """Write the table; `.csv` or `.parquet` decides. An existing file is replaced.

    `metadata` holds what JSON can. Raises TableError for columns of different lengths, names that a header
    cannot hold, units of no column, or infinite numbers.
    """
    arrays = {name: _checked(name, values) for name, values in columns.items()}
    if not arrays or len({len(a) for a in arrays.values()}) != 1:
        sizes = ", ".join(f"{name} {len(a)}" for name, a in arrays.items())
        raise TableError(f"a table has columns of one length; came {sizes or 'none'}")
    if unknown := sorted(set(units) - set(arrays)):
        raise TableError(f"units are given for columns that are not there: {', '.join(unknown)}")
    table = Table(arrays, dict(units), dict(metadata))
    if path.suffix == ".csv":
        _write_csv(path, table)
    elif path.suffix == ".parquet":
        _write_parquet(path, table)
    else:
        raise TableError(f"{path}: a table's name ends in .csv or .parquet")


def read(path: Path) -> Table:
    """Return the table in a CSV or Parquet file, also one that another program wrote.

    Whole numbers come as int64, true and false as bool, other numbers as float64 with NaN where nothing is
    known, all else as text. Raises TableError, or FileNotFoundError.
    """
    if path.suffix not in (".csv", ".parquet"):
        raise TableError(f"{path}: a table's name ends in .csv or .parquet")
    if path.stat().st_size == 0:
        raise TableError(f"{path}: the file is empty")
    return _read_csv(path) if path.suffix == ".csv" else _read_parquet(path)


def _checked(name: str, values: npt.ArrayLike) -> Column:
    if not _NAME.match(name):
        raise TableError(f"column {name!r}: a name is on one line, without [ ] and not beginning with #")
    array = np.asarray(values)
    if array.ndim != 1:
        raise TableError(f"column {name}: expected one number a row, came shape {array.shape}")
    if array.dtype.kind == "f":
        array = array.astype(np.float64)
        if np.isinf(array).any():
            raise TableError(f"column {name} holds infinity; a number that is not known is NaN")
    elif array.dtype.kind in "iu":
        array = array.astype(np.int64)
    elif array.dtype.kind not in "bU":
        array = array.astype(str)
    return array


# CSV


def _write_csv(path: Path, table: Table) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        for name, value in table.metadata.items():
            file.write(f"# {name}: {json.dumps(value, ensure_ascii=False)}\n")
        writer = csv.writer(file, lineterminator="\n")
        units = table.units
        writer.writerow([f"{name} [{units[name]}]" if units.get(name) else name for name in table.columns])
        writer.writerows(zip(*map(_cells, table.columns.values()), strict=True))


def _cells(array: Column) -> list[str]:
    """Return the cells of a column: numbers in the fewest digits that read back as the same float64."""
    if array.dtype.kind == "f":
        return ["" if x != x else repr(x) for x in array.tolist()]
    if array.dtype.kind == "b":
        return ["true" if x else "false" for x in array.tolist()]
    return [str(x) for x in array.tolist()]


def _read_csv(path: Path) -> Table:
    metadata: dict[str, Any] = {}
    # utf-8-sig: spreadsheets put a byte-order mark first.
    with path.open(encoding="utf-8-sig", newline="") as file:
        try:
            head = _after_comments(file, metadata)
            rows = list(csv.reader(file))
        except UnicodeDecodeError:
            raise TableError(f"{path}: not text (UTF-8)") from None
        except csv.Error as error:
            raise TableError(f"{path}: no CSV file ({error})") from None
    if "," not in head and ";" in head:
        raise TableError(f"{path}: separated by semicolons; write commas between cells and decimal points")
    names, units = _header(path, next(csv.reader([head]), []))
    rows = [row for row in rows if row]
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise TableError(f"{path}: data row {number} has {len(row)} cells, the header has {len(names)}")
    cells = zip(*rows, strict=True) if rows else ([] for _ in names)
    return Table(dict(zip(names, map(_array, map(list, cells)), strict=True)), units, metadata)


def _after_comments(file: Any, metadata: dict[str, Any]) -> str:
    """Read the `#` lines into `metadata` and return the header line."""
    for line in file:
        if not line.startswith("#"):
            return str(line).rstrip("\r\n")
        name, _, value = line[1:].strip().partition(": ")
        try:
            metadata[name] = json.loads(value)
        except ValueError:
            metadata[name] = value
    return ""


def _header(path: Path, cells: list[str]) -> tuple[list[str], dict[str, str]]:
    names: list[str] = []
    units: dict[str, str] = {}
    for cell in cells:
        match = _HEAD.match(cell.strip())
        name = match["name"] if match else cell
        if match and match["unit"]:
            units[name] = match["unit"]
        names.append(name)
    if not names or "" in names or len(set(names)) != len(names):
        raise TableError(f"{path}: the first line must name every column once")
    return names, units


def _array(cells: list[str]) -> Column:
    if cells and all(map(_WHOLE.match, cells)):
        return np.array([int(cell) for cell in cells], dtype=np.int64)
    if cells and all(cell in ("true", "false") for cell in cells):
        return np.array([cell == "true" for cell in cells])
    try:
        return np.array([float(cell) if cell.strip() else np.nan for cell in cells], dtype=np.float64)
    except ValueError:
        return np.array(cells, dtype=np.str_)


# Parquet


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra(
            "Parquet files need pyarrow: pip install 'brachium[parquet]', or use .csv"
        ) from None
    return pyarrow, pyarrow.parquet


def _write_parquet(path: Path, table: Table) -> None:
    arrow, parquet = _pyarrow()
    fields, arrays = [], []
    for name, column in table.columns.items():
        missing = None
        if column.dtype.kind == "f":
            missing = np.isnan(column)
        elif column.dtype.kind == "U":
            missing = column == ""
        array = arrow.array(column.tolist() if column.dtype.kind == "U" else column, mask=missing)
        unit = table.units.get(name)
        fields.append(arrow.field(name, array.type, metadata={"unit": unit} if unit else None))
        arrays.append(array)
    schema = arrow.schema(fields, metadata={"brachium": json.dumps(table.metadata, ensure_ascii=False)})
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=schema), path, compression="zstd")


def _read_parquet(path: Path) -> Table:
    arrow, parquet = _pyarrow()
    try:
        with path.open("rb") as file:
            content = parquet.read_table(file)
    except (arrow.ArrowInvalid, arrow.ArrowException, OSError) as error:
        if isinstance(error, FileNotFoundError):
            raise
        raise TableError(f"{path}: no Parquet file ({str(error).splitlines()[0]})") from None
    units = {
        f.name: f.metadata[b"unit"].decode() for f in content.schema if f.metadata and b"unit" in f.metadata
    }
    columns = {name: _from_arrow(arrow, content.column(name)) for name in content.schema.names}
    raw = (content.schema.metadata or {}).get(b"brachium", b"{}")
    return Table(columns, units, json.loads(raw))


def _from_arrow(arrow: Any, column: Any) -> Column:
    kind = column.type
    if arrow.types.is_boolean(kind) and not column.null_count:
        return np.array(column.to_pylist(), dtype=np.bool_)
    if arrow.types.is_integer(kind) and not column.null_count:
        return np.asarray(column.to_numpy(), dtype=np.int64)
    if arrow.types.is_floating(kind) or arrow.types.is_integer(kind):
        return np.asarray(column.cast(arrow.float64()).fill_null(float("nan")).to_numpy(), dtype=np.float64)
    return np.array(["" if value is None else str(value) for value in column.to_pylist()], dtype=np.str_)
