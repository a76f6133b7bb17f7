"""Exported tables through Python's own csv and through pyarrow."""

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from brachium.export_readers.found import Floats, Found


def read_csv(path: Path) -> Found:
    """Read with the standard library's csv."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    columns = dict(
        zip((head.partition(" [")[0] for head in rows[0]), zip(*rows[1:], strict=True), strict=True)
    )
    return _of_columns("csv of Python", columns, lambda cells: np.array([float(c or "nan") for c in cells]))


def read_parquet(path: Path) -> Found:
    """Read with pyarrow."""
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(path)
    columns = {name: table.column(name).to_pylist() for name in table.schema.names}
    return _of_columns("pyarrow", columns, lambda cells: np.array(cells, dtype=np.float64))


def _of_columns(reader: str, columns: dict[str, Any], numbers: Callable[[Any], Floats]) -> Found:
    numeric = {name: numbers(v) for name, v in columns.items() if not name.startswith("quality_")}
    return Found(
        reader=reader,
        time_s=numeric["time"],
        angles_deg=numeric,
        places_mm={
            name.replace("_x", "", 1): 1000.0
            * np.stack([numeric[name.replace("_x", f"_{a}", 1)] for a in "xyz"], 1)
            for name in numeric
            if name.removesuffix("_r").removesuffix("_l")
            in [f"{j}_x" for j in ("shoulder", "elbow", "wrist", "hand")]
        },
    )


def read_motion_bids(folder: Path) -> Found:
    """Read the one recording of a study's folder with the standard library's csv."""
    (path,) = folder.rglob("*_motion.tsv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = [[float(c.replace("n/a", "nan")) for c in row] for row in csv.reader(file, delimiter="\t")]
    with path.with_name(path.name.replace("_motion.tsv", "_channels.tsv")).open(newline="") as file:
        channels = list(csv.DictReader(file, delimiter="\t"))
    cells = np.array(rows)
    places: dict[str, Floats] = {}
    for i, channel in enumerate(channels):
        if channel["type"] == "POS":
            block = places.setdefault(channel["tracked_point"], np.full((len(cells), 3), np.nan))
            block[:, "xyz".index(channel["component"])] = 1000.0 * cells[:, i]
    return Found(
        reader="csv of Python",
        time_s=np.full(len(cells), math.nan),
        angles_deg={c["name"]: cells[:, i] for i, c in enumerate(channels) if c["type"] == "JNTANG"},
        places_mm=places,
    )
