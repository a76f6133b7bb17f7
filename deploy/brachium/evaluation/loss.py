"""Which samples of a recording arrive when some are lost: one by one, or several in a row. Pure."""

from zlib import crc32

import numpy as np
import numpy.typing as npt


def kept(samples: int, loss: float, burst: int, name: str) -> npt.NDArray[np.bool_]:
    """Return which of n samples arrive (n,): the part `loss` is lost, `burst` in a row, the first never.

    Bursts lie anywhere, apart from one another; the same name loses the same samples.
    """
    there = np.ones(samples, dtype=np.bool_)
    blocks = max(0, samples - 1) // burst
    lost = round(loss * samples / burst)
    if not lost:
        return there
    random = np.random.default_rng(crc32(name.encode()))
    for block in random.choice(blocks, size=min(lost, blocks), replace=False).tolist():
        there[1 + block * burst : 1 + (block + 1) * burst] = False
    return there
