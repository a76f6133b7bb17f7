"""Which reader judges which format."""

from collections.abc import Callable
from pathlib import Path

from brachium.export_readers.found import Found
from brachium.export_readers.opensim import read_mot, read_sto, read_trc
from brachium.export_readers.scenes import read_bvh, read_c3d, read_rrd
from brachium.export_readers.tables import read_csv, read_motion_bids, read_parquet

READERS: dict[str, Callable[[Path], Found]] = {
    "csv": read_csv,
    "parquet": read_parquet,
    "sto": read_sto,
    "mot": read_mot,
    "trc": read_trc,
    "c3d": read_c3d,
    "bvh": read_bvh,
    "rrd": read_rrd,
    "motion-bids": read_motion_bids,
}
