"""A node's batch to the bus's: steps to SI, every number checked once, times left to the clock."""

from dataclasses import dataclass
from math import isfinite
from operator import lt
from struct import unpack

import numpy as np

from brachium_nodes.node_frames import MAX_FRAME_SAMPLES, MAX_SPAN_US, Batch, Hello
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import SampleBatch, Vector
from brachium_wire.samples import MAX_GYR, read_samples

MAX_SEQUENCE = 1 << 48
MAX_DEVICE_US = 1 << 53
"""285 years: room for a clock that counts from 1970."""


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A checked batch. `batch` has every field but host times, which only the clock can give."""

    batch: SampleBatch
    device_us: list[int]
    """The node's clock at each sample."""

    def __len__(self) -> int:
        return len(self.device_us)


def measure(frame: Batch, hello: Hello) -> Measured:
    """Return what a batch of this node holds, in SI, or raise WireError."""
    if not 0 <= frame.sequence < MAX_SEQUENCE or not 0 <= frame.device_us < MAX_DEVICE_US:
        raise WireError(Drop.OUT_OF_RANGE, "batch/1: seq and t must be positive, below 2^48 and 2^53")
    n, tail = divmod(len(frame.offsets), 4)
    if tail or not 1 <= n <= MAX_FRAME_SAMPLES:
        raise WireError(
            Drop.WRONG_SHAPE,
            f"batch/1: dt of {len(frame.offsets)} bytes; 1 to {MAX_FRAME_SAMPLES} u32 are taken",
        )
    offsets = unpack(f"<{n}I", frame.offsets)
    if offsets[0] != 0 or offsets[-1] > MAX_SPAN_US or not all(map(lt, offsets, offsets[1:])):
        raise WireError(Drop.TIME_BACKWARDS, "batch/1: dt must begin with 0, grow, and end within 4 s")
    scales = hello.scales
    batch = SampleBatch(
        sequence=frame.sequence,
        time_ns=1,
        offsets=frame.offsets,
        device_us=frame.device_us,
        device_offsets=frame.offsets,
        received_ns=1,
        uncertainty_ns=0,
        acc=_si(frame.acc, scales.acc, hello.big_endian),
        gyr=_si(frame.gyr, scales.gyr, hello.big_endian),
        mag=_si(frame.mag, scales.mag, hello.big_endian),
        mag_index=frame.mag_index,
        quat=frame.quat,
        late=frame.late,
    )
    if not _plainly_sound(batch, n):
        read_samples(batch)  # the one check of shapes, finiteness and ranges; it says what is wrong
    first_us = frame.device_us
    return Measured(batch, [first_us + offset for offset in offsets])


def _plainly_sound(batch: SampleBatch, n: int) -> bool:
    """Return whether nothing can be wrong with the blocks, as with nearly all batches: a quick look."""
    acc, gyr, mag, index = batch.acc, batch.gyr, batch.mag, batch.mag_index
    if acc is None or gyr is None or batch.quat is not None or not len(acc) == len(gyr) == 12 * n:
        return False
    if mag is None:
        if index is not None:
            return False
    elif index is None:
        if len(mag) != 12 * n:
            return False
    else:
        which = unpack(f"<{len(index) // 2}H", index) if len(index) % 2 == 0 else ()
        if not which or len(mag) != 12 * len(which) or which[-1] >= n or not all(map(lt, which, which[1:])):
            return False
    blocks = b"".join((acc, gyr, mag or b""))
    numbers = unpack(f"<{len(blocks) // 4}f", blocks)
    # The smallest limit. Where NaN hides from the comparisons, the sum has it.
    return min(numbers) >= -MAX_GYR and max(numbers) <= MAX_GYR and isfinite(sum(numbers))


def _si(block: bytes | None, scale: Vector | None, big_endian: bool) -> bytes | None:
    if block is None or scale is None:
        return block
    if len(block) % 6:
        raise WireError(
            Drop.WRONG_SHAPE, f"batch/1: a block of {len(block)} bytes does not hold triples of i16"
        )
    steps = np.frombuffer(block, dtype=">i2" if big_endian else "<i2").reshape(-1, 3)
    return bytes((steps * np.array(scale)).astype("<f4").tobytes())
