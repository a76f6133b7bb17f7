"""Captures and recordings as streams of nodes: pure, but for the iterators that are handed in."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from brachium_nodes.node_frames import Batch, Hello
from brachium_nodes.node_stream import NodeStream, Outgoing
from brachium_wire import keys
from brachium_wire.capture import Capture, CaptureSegment
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Info, SampleBatch, SensorCalibration, Session
from brachium_wire.recording import RecordingError
from brachium_wire.samples import Samples, read_samples

Integers = npt.NDArray[np.int64]
BATCH_S = 0.05
"""A node sends about this much at once."""
MAX_BATCH_SAMPLES = 64
CLOCK_START_US = 1_000_000


@dataclass(frozen=True, eq=False, kw_only=True)
class Source:
    """What is played."""

    streams: list[NodeStream]
    sessions: dict[str, Session]
    warnings: tuple[str, ...] = ()


def capture_source(capture: Capture, subject: str, boot: int) -> Source:
    """Return the nodes of a capture folder; source time 0 is the first sample of the earliest segment."""
    settings = capture.settings
    first_s = min(float(segment.t[0]) for segment in capture.segments.values())
    streams = []
    for name, segment in capture.segments.items():
        hello = Hello(
            node=f"play-{subject}-{name}"[:64],
            boot=boot,
            chip="capture",
            rate_hz=segment.rate_hz,
            firmware="playback",
            magnetometer=segment.mag is not None,
            orientation_only=segment.acc is None,
            calibration=settings.sensor.get(name, SensorCalibration()),
            origin="playback",
        )
        streams.append(
            NodeStream(
                subject=subject,
                segment=name,
                hello=hello,
                mounting=settings.mounting.get(name),
                packets=capture_packets(segment, first_s),
                clock_us=lambda time_s: CLOCK_START_US + round(time_s * 1e6),
            )
        )
    session = Session(
        side=settings.side,
        height_m=settings.height_m,
        lengths_m={str(name): length for name, length in settings.lengths_m.items()},
        facing_deg=settings.facing_deg,
    )
    return Source(streams=streams, sessions={subject: session}, warnings=capture.warnings)


def capture_packets(segment: CaptureSegment, first_s: float) -> Iterator[Outgoing]:
    """Yield the packets of one segment; each is due when its last sample was taken."""
    time_s = segment.t - first_s
    ticks = CLOCK_START_US + np.rint(time_s * 1e6).astype(np.int64)
    steps = np.arange(len(ticks))
    ticks = np.maximum.accumulate(ticks - steps) + steps  # grows, even where t does by less than 1 us
    spans = np.floor(time_s / BATCH_S).astype(np.int64)
    starts = [0, *(np.flatnonzero(np.diff(spans)) + 1).tolist(), len(ticks)]
    for start, end in pairwise(starts):
        for first in range(start, end, MAX_BATCH_SAMPLES):
            cut = slice(first, min(first + MAX_BATCH_SAMPLES, end))
            yield Outgoing(
                float(time_s[cut][-1]), _capture_batch(segment, first, ticks[cut], cut), time_s[cut]
            )


def _capture_batch(segment: CaptureSegment, first: int, ticks: Integers, cut: slice) -> Batch:
    mag, index = None, None
    if segment.mag is not None:
        there = np.flatnonzero(np.isfinite(segment.mag[cut]).all(axis=1))
        if len(there):
            mag = segment.mag[cut][there]
            index = None if len(there) == len(ticks) else there.astype("<u2").tobytes()
    return Batch(
        sequence=first,
        device_us=int(ticks[0]),
        offsets=(ticks - ticks[0]).astype("<u4").tobytes(),
        acc=_block(None if segment.acc is None else segment.acc[cut]),
        gyr=_block(None if segment.gyr is None else segment.gyr[cut]),
        mag=_block(mag),
        mag_index=index,
        quat=_block(None if segment.quat is None else segment.quat[cut]),
    )


def _block(rows: npt.NDArray[np.float64] | None) -> bytes | None:
    return None if rows is None else rows.astype("<f4").tobytes()


Messages = Iterable[tuple[str, bytes, int]]


def recording_source(read: Callable[[], Messages], boot: int) -> Source:
    """Return the nodes of a recording; `read` begins it anew. Source time 0 is its first batch.

    A node's clock is the recorded host time, so that a gateway finds the recorded times again.
    Raises RecordingError when there is no batch in it.
    """
    infos: dict[tuple[str, str], Info] = {}
    sessions: dict[str, Session] = {}
    start_ns, first_log_ns = 0, 0
    for key, payload, log_ns in read():
        where = keys.parse(key)
        try:
            if where.topic == "info":
                info = decode_topic(payload, "info")
                assert isinstance(info, Info)
                infos.setdefault((where.subject, where.detail), info)
            elif where.topic == "session":
                session = decode_topic(payload, "session")
                assert isinstance(session, Session)
                sessions[where.subject] = session
            elif where.topic == "imu" and not start_ns:
                start_ns, first_log_ns = _samples(payload).time_ns[0], log_ns
        except WireError:
            continue
    if not start_ns:
        raise RecordingError("the recording holds no sensor batch; there is nothing to play")
    streams = [
        NodeStream(
            subject=subject,
            segment=segment,
            hello=_recorded_hello(info, boot),
            mounting=info.mounting,
            packets=recording_packets(read, subject, segment, start_ns, first_log_ns),
            clock_us=lambda time_s: start_ns // 1000 + round(time_s * 1e6),
        )
        for (subject, segment), info in infos.items()
    ]
    return Source(streams=streams, sessions=sessions)


def recording_packets(
    read: Callable[[], Messages], subject: str, segment: str, start_ns: int, first_log_ns: int
) -> Iterator[Outgoing]:
    """Yield the recorded batches of one segment, due as long after the first as they were recorded."""
    for key, payload, log_ns in read():
        where = keys.parse(key)
        if where.topic != "imu" or (where.subject, where.detail) != (subject, segment):
            continue
        try:
            samples = _samples(payload)
        except WireError:
            continue
        batch = decode_topic(payload, "imu")
        assert isinstance(batch, SampleBatch)
        times = np.array(samples.time_ns, dtype=np.int64)
        ticks = times // 1000
        frame = Batch(
            sequence=batch.sequence,
            device_us=int(ticks[0]),
            offsets=(ticks - ticks[0]).astype("<u4").tobytes(),
            acc=batch.acc,
            gyr=batch.gyr,
            mag=batch.mag,
            mag_index=batch.mag_index,
            quat=batch.quat,
            late=batch.late,
        )
        yield Outgoing((log_ns - first_log_ns) * 1e-9, frame, (times - start_ns) / np.float64(1e9))


def _samples(payload: bytes) -> Samples:
    batch = decode_topic(payload, "imu")
    assert isinstance(batch, SampleBatch)
    return read_samples(batch)


def _recorded_hello(info: Info, boot: int) -> Hello:
    return Hello(
        node=info.node,
        boot=boot,
        chip=info.chip or "recorded",
        rate_hz=info.rate_hz,
        firmware=info.firmware,
        magnetometer=info.magnetometer,
        orientation_only=info.orientation_only,
        calibration=info.calibration,
        origin="playback",
    )
