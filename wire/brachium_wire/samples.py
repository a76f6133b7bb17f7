"""The numbers of a batch: blocks of bytes to arrays and back, checked once, here."""

from collections.abc import Sequence
from math import isfinite
from operator import lt
from struct import unpack
from typing import NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from brachium_wire.codec import Drop, WireError
from brachium_wire.messages import SampleBatch
from brachium_wire.plausible import LENGTH_TOLERANCE

Floats = npt.NDArray[np.float64]

# What no sensor that is worn can measure. MPU-9150 full scales are 157 m/s^2, 35 rad/s, 1229 uT; the bounds
# leave room for 50 g and 5700 deg/s parts and for a magnet close by.
MAX_ACC = 500.0
MAX_GYR = 100.0
MAX_MAG = 10_000.0
MAX_SAMPLES = 256
"""Samples in one batch; more than a second at any usual rate would be a burst, not a batch."""
_FAR = 1 << 62
"""Bound of all counters and times, so that sums of them stay within int64."""
MAX_SPAN_NS = 4_000_000_000
"""Offsets are u32 ns, so a batch spans at most 4.29 s."""


class Samples(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """The samples of one batch as arrays; blocks that the sensor does not deliver are None."""

    sequence: int
    time_ns: list[int]
    """Host time of each sample."""
    device_us: int
    """The node's clock at the first sample."""
    device_offsets: bytes
    """n x u32 us from there, as on the wire: only the recorder's readers want them."""
    received_ns: int
    uncertainty_ns: int
    acc: Floats | None
    gyr: Floats | None
    mag: Floats | None
    """(k, 3); row j belongs to sample mag_index[j]."""
    mag_index: tuple[int, ...] | None
    """k sample positions, or None when mag has one row a sample."""
    quat: Floats | None
    late: bool

    def __len__(self) -> int:
        return len(self.time_ns)


def read_samples(batch: SampleBatch) -> Samples:
    """Return the arrays of a batch, or raise WireError naming what is wrong with it."""
    result = read_many([batch])[0]
    if isinstance(result, WireError):
        raise result
    return result


def read_many(batches: Sequence[SampleBatch]) -> list[Samples | WireError]:
    """Return each batch's arrays, or what is wrong with it; the numbers of all are looked at together."""
    heads = [_head(batch) for batch in batches]
    blocks: list[bytes] = []
    for head in heads:
        if isinstance(head, _Head):
            blocks += head.blocks
    numbers = np.frombuffer(b"".join(blocks), dtype="<f4").astype(np.float64).reshape(-1, 3)
    # One look settles nearly all: MAX_GYR is the smallest of the limits. NaN compares false.
    sound = len(numbers) == 0 or bool(np.maximum.reduce(np.abs(numbers), axis=None) <= MAX_GYR)
    results: list[Samples | WireError] = []
    row = 0
    for batch, head in zip(batches, heads, strict=True):
        if isinstance(head, WireError):
            results.append(head)
            continue
        begin, row = row, row + sum(map(len, head.blocks)) // 12
        try:
            results.append(_samples(batch, head, numbers[begin:row], sound))
        except WireError as error:
            results.append(error)
    return results


class _Head(NamedTuple):
    """The shape of a batch, checked."""

    samples: int
    offsets: tuple[int, ...]
    mag_index: tuple[int, ...] | None
    blocks: tuple[bytes, ...]
    """acc, gyr and mag, as far as they are there."""


def _head(batch: SampleBatch) -> _Head | WireError:
    try:
        return _checked_head(batch)
    except WireError as error:
        return error


def _checked_head(batch: SampleBatch) -> _Head:
    if not (
        0 <= batch.sequence < _FAR
        and 0 < batch.time_ns < _FAR
        and 0 <= batch.device_us < _FAR
        and 0 <= batch.uncertainty_ns < _FAR
        and 0 < batch.received_ns < _FAR
    ):
        raise WireError(Drop.OUT_OF_RANGE, "imu/1: seq, t, dev, rx and unc must be positive and below 2^62")
    n, tail = divmod(len(batch.offsets), 4)
    if tail or not 1 <= n <= MAX_SAMPLES:
        raise WireError(
            Drop.WRONG_SHAPE, f"imu/1: dt of {len(batch.offsets)} bytes; 1 to {MAX_SAMPLES} u32 are taken"
        )
    offsets = unpack(f"<{n}I", batch.offsets)
    if offsets[0] != 0 or offsets[-1] > MAX_SPAN_NS or not all(map(lt, offsets, offsets[1:])):
        raise WireError(Drop.TIME_BACKWARDS, "imu/1: dt must begin with 0 and grow from sample to sample")
    _sized(batch.device_offsets, 4 * n, "ddt")
    _together(batch)
    index = None if batch.mag_index is None else _mag_index(batch.mag_index, n)
    blocks: tuple[bytes, ...] = ()
    if batch.acc is not None and batch.gyr is not None:
        blocks = (_sized(batch.acc, 12 * n, "acc"), _sized(batch.gyr, 12 * n, "gyr"))
        if batch.mag is not None:
            blocks += (_sized(batch.mag, 12 * (n if index is None else len(index)), "mag"),)
    return _Head(n, offsets, index, blocks)


def _samples(batch: SampleBatch, head: _Head, numbers: Floats, sound: bool) -> Samples:
    n = head.samples
    acc = gyr = mag = None
    if head.blocks:
        acc, gyr = numbers[:n], numbers[n : 2 * n]
        mag = numbers[2 * n :] if len(head.blocks) == 3 else None
        if not sound:
            _within(acc, MAX_ACC, "acc", "m/s^2")
            _within(gyr, MAX_GYR, "gyr", "rad/s")
            if mag is not None:
                _within(mag, MAX_MAG, "mag", "uT")
    start = batch.time_ns
    return Samples(
        sequence=batch.sequence,
        time_ns=[start + offset for offset in head.offsets],
        device_us=batch.device_us,
        device_offsets=batch.device_offsets,
        received_ns=batch.received_ns,
        uncertainty_ns=batch.uncertainty_ns,
        acc=acc,
        gyr=gyr,
        mag=mag,
        mag_index=head.mag_index,
        quat=None if batch.quat is None else _orientations(batch.quat, n),
        late=batch.late,
    )


def _orientations(block: bytes, n: int) -> Floats:
    quat = np.frombuffer(_sized(block, 16 * n, "quat"), dtype="<f4").astype(np.float64).reshape(n, 4)
    length = np.sqrt((quat * quat).sum(axis=1))
    worst = float(np.abs(length - 1.0).max())
    if not worst <= LENGTH_TOLERANCE:
        drop = Drop.OUT_OF_RANGE if np.isfinite(worst) else Drop.NOT_FINITE
        raise WireError(drop, f"imu/1: quat is not of length 1 (off by {worst:.2g})")
    unit: Floats = quat / length[:, None]
    return unit


def write_samples(
    *,
    sequence: int,
    time_ns: npt.ArrayLike,
    device_us: npt.ArrayLike,
    received_ns: int,
    uncertainty_ns: int,
    acc: npt.ArrayLike | None = None,
    gyr: npt.ArrayLike | None = None,
    mag: npt.ArrayLike | None = None,
    mag_index: npt.ArrayLike | None = None,
    quat: npt.ArrayLike | None = None,
    late: bool = False,
) -> SampleBatch:
    """Return the batch that holds these arrays: times (n,) ns and us, blocks (n, 3) or (n, 4), mag (k, 3).

    Raises ValueError for times that u32 offsets from the first cannot hold; read_samples checks the rest.
    """
    times, device = np.asarray(time_ns, dtype=np.int64), np.asarray(device_us, dtype=np.int64)
    for offsets, name in ((times - times[0], "time_ns"), (device - device[0], "device_us")):
        if int(offsets.min()) < 0 or int(offsets.max()) > MAX_SPAN_NS:
            raise ValueError(
                f"{name} of one batch must begin with its earliest and span at most {MAX_SPAN_NS}"
            )
    return SampleBatch(
        sequence=sequence,
        time_ns=int(times[0]),
        offsets=(times - times[0]).astype("<u4").tobytes(),
        device_us=int(device[0]),
        device_offsets=(device - device[0]).astype("<u4").tobytes(),
        received_ns=received_ns,
        uncertainty_ns=uncertainty_ns,
        acc=_bytes(acc, "<f4"),
        gyr=_bytes(gyr, "<f4"),
        mag=_bytes(mag, "<f4"),
        mag_index=_bytes(mag_index, "<u2"),
        quat=_bytes(quat, "<f4"),
        late=late,
    )


def _bytes(values: npt.ArrayLike | None, dtype: str) -> bytes | None:
    return None if values is None else np.ascontiguousarray(values, dtype=dtype).tobytes()


def _together(batch: SampleBatch) -> None:
    if (batch.acc is None) != (batch.gyr is None) or (batch.acc is None and batch.quat is None):
        raise WireError(Drop.WRONG_SHAPE, "imu/1: expected acc and gyr together, or quat")
    if (batch.mag is not None and batch.acc is None) or (batch.mag_index is not None and batch.mag is None):
        raise WireError(Drop.WRONG_SHAPE, "imu/1: mag comes with acc and gyr only, mi with mag only")


def _sized(data: bytes, size: int, name: str) -> bytes:
    if len(data) != size:
        raise WireError(Drop.WRONG_SHAPE, f"imu/1: {name} holds {len(data)} bytes; expected {size}")
    return data


def _mag_index(data: bytes, n: int) -> tuple[int, ...]:
    count, tail = divmod(len(data), 2)
    index: tuple[int, ...] = unpack(f"<{count}H", data) if not tail else ()
    if not index or index[-1] >= n or not all(map(lt, index, index[1:])):
        raise WireError(Drop.WRONG_SHAPE, f"imu/1: mi must name samples 0 to {n - 1}, each once, in order")
    return index


def _within(block: Floats, limit: float, name: str, unit: str) -> None:
    reach = float(np.abs(block).max())
    if reach <= limit:  # false for NaN too
        return
    if not isfinite(reach):
        raise WireError(Drop.NOT_FINITE, f"imu/1: {name} holds NaN or infinity")
    raise WireError(
        Drop.OUT_OF_RANGE, f"imu/1: {name} reaches {reach:.4g} {unit}; at most {limit:g} is believed"
    )
