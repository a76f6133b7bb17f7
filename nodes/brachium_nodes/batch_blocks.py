"""A node's batch to the bus's: steps to SI, every number checked once, times left to the clock."""

from dataclasses import dataclass
from functools import lru_cache
from operator import lt
from struct import pack, unpack

import msgspec
import numpy as np

from brachium_nodes.node_frames import MAX_FRAME_SAMPLES, MAX_SPAN_US, Batch, Hello, Scales
from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import SampleBatch, Vector
from brachium_wire.samples import MAX_GYR, read_samples

MAX_SEQUENCE = 1 << 48
MAX_DEVICE_US = 1 << 53
"""285 years: room for a clock that counts from 1970."""


_FLOATS = Scales()


@dataclass(slots=True, eq=False)
class Measured:
    """A checked batch, in SI. Its times are the node's: host times only the clock can give."""

    batch: Batch | SampleBatch
    """`offsets` are us of the node's clock, its blocks float32; of a SampleBatch no other time is meant."""
    device_us: list[int]
    """The node's clock at each sample."""

    def __len__(self) -> int:
        return len(self.device_us)


def measure(frame: Batch, hello: Hello) -> Measured:
    """Return what a batch of this node holds, in SI, or raise WireError."""
    if not 0 <= frame.sequence < MAX_SEQUENCE or not 0 <= frame.device_us < MAX_DEVICE_US:
        raise WireError(Drop.OUT_OF_RANGE, "batch/1: seq and t must be positive, below 2^48 and 2^53")
    offsets = _offsets(frame.offsets)
    batch = frame if hello.scales == _FLOATS else _in_si(frame, hello)
    if not _plainly_sound(batch, len(offsets)):
        read_samples(_untimed(batch))  # the one check of shapes, finiteness and ranges; it says what is wrong
    first_us = frame.device_us
    return Measured(batch, [first_us + offset for offset in offsets])


@lru_cache(maxsize=256)  # a chip of even pace sends the same ones again and again
def _offsets(block: bytes) -> tuple[int, ...]:
    n, tail = divmod(len(block), 4)
    if tail or not 1 <= n <= MAX_FRAME_SAMPLES:
        raise WireError(
            Drop.WRONG_SHAPE, f"batch/1: dt of {len(block)} bytes; 1 to {MAX_FRAME_SAMPLES} u32 are taken"
        )
    offsets: tuple[int, ...] = unpack(f"<{n}I", block)
    if offsets[0] != 0 or offsets[-1] > MAX_SPAN_US or not all(map(lt, offsets, offsets[1:])):
        raise WireError(Drop.TIME_BACKWARDS, "batch/1: dt must begin with 0, grow, and end within 4 s")
    return offsets


def _in_si(frame: Batch, hello: Hello) -> Batch:
    scales = hello.scales
    return msgspec.structs.replace(
        frame,
        acc=_si(frame.acc, scales.acc, hello.big_endian),
        gyr=_si(frame.gyr, scales.gyr, hello.big_endian),
        mag=_si(frame.mag, scales.mag, hello.big_endian),
    )


def _untimed(batch: Batch) -> SampleBatch:
    """Return what the bus would carry, but for host times."""
    return SampleBatch(
        sequence=batch.sequence,
        time_ns=1,
        offsets=batch.offsets,
        device_us=batch.device_us,
        device_offsets=batch.offsets,
        received_ns=1,
        uncertainty_ns=0,
        acc=batch.acc,
        gyr=batch.gyr,
        mag=batch.mag,
        mag_index=batch.mag_index,
        quat=batch.quat,
        late=batch.late,
    )


def _plainly_sound(batch: Batch, n: int) -> bool:
    """Return whether nothing can be wrong with the blocks, as with nearly all batches: a quick look."""
    acc, gyr, mag, index = batch.acc, batch.gyr, batch.mag, batch.mag_index
    if acc is None or gyr is None or batch.quat is not None or not len(acc) == len(gyr) == 12 * n:
        return False
    if mag is None:
        return index is None and _all_within(acc + gyr)
    rows = n if index is None else _rows(index, n)
    return rows > 0 and len(mag) == 12 * rows and _all_within(acc + gyr + mag)


@lru_cache(maxsize=256)  # few ways in which a magnetometer is slower than the rest
def _rows(index: bytes, n: int) -> int:
    """Return how many of n samples are named, 0 when they are not named as they should."""
    which = unpack(f"<{len(index) // 2}H", index) if len(index) % 2 == 0 else ()
    sound = bool(which) and which[-1] < n and all(map(lt, which, which[1:]))
    return len(which) if sound else 0


def _all_within(floats: bytes) -> bool:
    """Return whether float32 numbers all lie within the smallest of the limits, MAX_GYR, either way.

    Without its sign a float's bits, as an integer, grow with it; infinity and NaN lie above all numbers. So
    one long integer holds them all, and one sum carries into the sign's place of each that is too large.
    """
    magnitudes, room, signs = _masks(len(floats) // 4)
    return not ((int.from_bytes(floats, "little") & magnitudes) + room) & signs


@lru_cache(maxsize=64)  # so few counts of numbers are usual, and the longest masks take 14 kB
def _masks(count: int) -> tuple[int, int, int]:
    room = (1 << 31) - 1 - int.from_bytes(pack("<f", MAX_GYR), "little")
    ones = int.from_bytes(pack("<I", 1) * count, "little")
    return ones * 0x7FFFFFFF, ones * room, ones << 31


def _si(block: bytes | None, scale: Vector | None, big_endian: bool) -> bytes | None:
    if block is None or scale is None:
        return block
    if len(block) % 6:
        raise WireError(
            Drop.WRONG_SHAPE, f"batch/1: a block of {len(block)} bytes does not hold triples of i16"
        )
    steps = np.frombuffer(block, dtype=">i2" if big_endian else "<i2").reshape(-1, 3)
    return bytes((steps * np.array(scale)).astype("<f4").tobytes())
