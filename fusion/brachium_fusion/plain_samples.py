"""Batches of samples as plain values, for snapshots. Pure."""

from typing import Any

import msgspec
import numpy as np

from brachium_wire.samples import Samples

_BLOCKS = ("acc", "gyr", "mag", "quat")


def plain_samples(samples: Samples) -> dict[str, Any]:
    """Return all of a batch as plain values."""
    plain = msgspec.structs.asdict(samples)
    return plain | {b: None if plain[b] is None else plain[b].tolist() for b in _BLOCKS}


def samples_of(plain: dict[str, Any]) -> Samples:
    """Return the batch of plain values."""
    index = plain["mag_index"]
    blocks = {b: None if plain[b] is None else np.array(plain[b], dtype=np.float64) for b in _BLOCKS}
    return Samples(**{**plain, **blocks, "mag_index": None if index is None else tuple(index)})
