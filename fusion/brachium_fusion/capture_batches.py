"""A capture's samples as batches, numbered as their sensor may have counted them. Pure."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from brachium_body.segments import Segment
from brachium_fusion.uniform import NEAR
from brachium_wire.capture import Capture, CaptureSegment
from brachium_wire.samples import Samples

ZERO_NS = 1_000_000_000_000_000
"""Host time given to t = 0 of a capture, so that times are positive whatever its t."""
BATCH_S = 0.1
"""A batch is as long as a node's: what waits for a sensor waits longer than this."""
SURE_GAP = 2.5
"""Periods: in a longer time than this a sample is missing, however its neighbours lie."""


def nanoseconds(t: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Return a capture's times (n,) s as host time in ns."""
    return np.round(np.asarray(t, dtype=np.float64) * 1e9).astype(np.int64) + ZERO_NS


def numbers(data: CaptureSegment) -> npt.NDArray[np.int64]:
    """Return the samples' numbers (n,) as the sensor may have counted them, missing ones included.

    Times that jitter are no gap: an interval that is too long by up to a period and a half, and made up for
    by one beside it, misses nothing.
    """
    periods = np.diff(data.t) * data.rate_hz
    missing = np.maximum(np.round(periods) - 1.0, 0.0).astype(np.int64)
    with_next, with_last = np.full((2, len(periods)), np.inf)
    with_next[:-1] = with_last[1:] = periods[:-1] + periods[1:]
    made_up = np.minimum(with_next, with_last) <= SURE_GAP
    missing[(periods <= NEAR) | (made_up & (periods <= SURE_GAP))] = 0
    return np.concatenate([[0], np.cumsum(missing + 1)])


def batches(capture: Capture, until_s: float | None = None) -> Iterator[tuple[str, Samples]]:
    """Yield all segments' samples in small batches, in order of their last sample's time.

    A gap in time never lies within a batch.
    """
    pieces: list[tuple[float, Segment, int, int]] = []
    counted: dict[str, npt.NDArray[np.int64]] = {}
    for segment, data in capture.segments.items():
        sequence = counted[segment] = numbers(data)
        breaks = np.flatnonzero(np.diff(sequence) > 1) + 1
        regular = np.arange(0, len(data.t), max(1, round(BATCH_S * data.rate_hz)))
        edges = np.unique(np.concatenate([regular, breaks, [len(data.t)]]))
        for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            pieces.append((float(data.t[end - 1]), segment, start, end))
    for last, segment, start, end in sorted(pieces):
        if until_s is not None and last > until_s + 1.0:
            return
        yield segment, _samples(capture.segments[segment], start, end, counted[segment])


def _samples(data: CaptureSegment, start: int, end: int, counted: npt.NDArray[np.int64]) -> Samples:
    times = nanoseconds(data.t[start:end])
    mag, index = None, None
    if data.mag is not None:
        mag = data.mag[start:end]
        there = ~np.isnan(mag[:, 0])
        if not there.all():
            mag, index = np.ascontiguousarray(mag[there]), tuple(np.flatnonzero(there).tolist())
    return Samples(
        sequence=int(counted[start]),
        time_ns=times.tolist(),
        device_us=0,
        device_offsets=b"",
        received_ns=int(times[-1]),
        uncertainty_ns=0,
        acc=None if data.acc is None else np.ascontiguousarray(data.acc[start:end]),
        gyr=None if data.gyr is None else np.ascontiguousarray(data.gyr[start:end]),
        mag=None if mag is not None and len(mag) == 0 else mag,
        mag_index=index,
        quat=None if data.quat is None else np.ascontiguousarray(data.quat[start:end]),
        late=False,
    )
