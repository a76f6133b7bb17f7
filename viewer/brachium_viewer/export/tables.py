"""CSV and Parquet: every column with its unit, as `brachium solve` writes them."""

from pathlib import Path

from brachium_viewer.export.motion import Motion
from brachium_wire import table


def write_table(motion: Motion, path: Path) -> list[Path]:
    """Write the table; `.csv` or `.parquet` decides. Raises table.TableError, table.MissingExtra."""
    table.write(path, motion.table.columns, motion.table.units, motion.about)
    return [path]
