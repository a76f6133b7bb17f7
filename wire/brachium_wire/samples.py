"""The numbers of a batch: blocks of bytes to arrays and back, checked once, here."""

from dataclasses import dataclass
from math import isfinite
from operator import lt
from struct import unpack

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
MAX_SPAN_NS = 4_000_000_000
"""Offsets are u32 ns, so a batch spans at most 4.29 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
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
    if (
        not 0 <= batch.sequence < 1 << 62
        or not 0 < batch.time_ns < 1 << 62
        or not 0 <= batch.device_us < 1 << 62
    ):
        raise WireError(Drop.OUT_OF_RANGE, "imu/1: seq, t and dev must be positive and below 2^62")
    if not 0 <= batch.uncertainty_ns < 1 << 62 or not 0 < batch.received_ns < 1 << 62:
        raise WireError(Drop.OUT_OF_RANGE, "imu/1: rx and unc must be positive and below 2^62")
    n, tail = divmod(len(batch.offsets), 4)
    if tail or not 1 <= n <= MAX_SAMPLES:
        raise WireError(
            Drop.WRONG_SHAPE, f"imu/1: dt of {len(batch.offsets)} bytes; 1 to {MAX_SAMPLES} u32 are taken"
        )
    offsets = unpack(f"<{n}I", batch.offsets)
    if offsets[0] != 0 or offsets[-1] > MAX_SPAN_NS or not all(map(lt, offsets, offsets[1:])):
        raise WireError(Drop.TIME_BACKWARDS, "imu/1: dt must begin with 0 and grow from sample to sample")
    if len(batch.device_offsets) != 4 * n:
        raise WireError(
            Drop.WRONG_SHAPE, f"imu/1: ddt holds {len(batch.device_offsets)} bytes; expected {4 * n}"
        )
    _together(batch)
    index = None if batch.mag_index is None else _mag_index(batch.mag_index, n)
    mag_rows = n if index is None else len(index)
    acc = gyr = mag = quat = None
    if batch.acc is not None and batch.gyr is not None:
        numbers = _numbers(batch.acc, 3 * n, "acc"), _numbers(batch.gyr, 3 * n, "gyr"), b""
        if batch.mag is not None:
            numbers = *numbers[:2], _numbers(batch.mag, 3 * mag_rows, "mag")
        block = np.frombuffer(b"".join(numbers), dtype="<f4").astype(np.float64).reshape(-1, 3)
        acc, gyr = block[:n], block[n : 2 * n]
        mag = block[2 * n :] if batch.mag is not None else None
        # One look at all numbers settles nearly every batch: MAX_GYR is the smallest of the three limits.
        if not np.maximum.reduce(np.abs(block), axis=None) <= MAX_GYR:  # NaN compares false
            for rows, limit, name, unit in (
                (acc, MAX_ACC, "acc", "m/s^2"),
                (gyr, MAX_GYR, "gyr", "rad/s"),
                (mag, MAX_MAG, "mag", "uT"),
            ):
                if rows is not None:
                    _within(rows, limit, name, unit)
    if batch.quat is not None:
        quat = (
            np.frombuffer(_numbers(batch.quat, 4 * n, "quat"), dtype="<f4").astype(np.float64).reshape(n, 4)
        )
    if quat is not None:
        length = np.sqrt((quat * quat).sum(axis=1))
        worst = float(np.abs(length - 1.0).max())
        if not worst <= LENGTH_TOLERANCE:
            drop = Drop.OUT_OF_RANGE if np.isfinite(worst) else Drop.NOT_FINITE
            raise WireError(drop, f"imu/1: quat is not of length 1 (off by {worst:.2g})")
        quat = quat / length[:, None]
    return Samples(
        sequence=batch.sequence,
        time_ns=[batch.time_ns + offset for offset in offsets],
        device_us=batch.device_us,
        device_offsets=batch.device_offsets,
        received_ns=batch.received_ns,
        uncertainty_ns=batch.uncertainty_ns,
        acc=acc,
        gyr=gyr,
        mag=mag,
        mag_index=index,
        quat=quat,
        late=batch.late,
    )


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


def _numbers(data: bytes, count: int, name: str) -> bytes:
    if len(data) != 4 * count:
        raise WireError(
            Drop.WRONG_SHAPE,
            f"imu/1: {name} holds {len(data)} bytes; expected {count} f32, {4 * count} bytes",
        )
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
