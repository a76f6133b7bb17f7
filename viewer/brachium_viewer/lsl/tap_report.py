"""Triple taps in a recording's raw accelerations, and how far a camera's time is from the samples'."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brachium_viewer.lsl.taps import Floats, Times, triple_taps
from brachium_wire import capture, keys, recording
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import SampleBatch
from brachium_wire.samples import read_samples

CAPTURE = "capture"
"""Stands for the subject of a capture folder, which names none."""


@dataclass(frozen=True, kw_only=True)
class Tapped:
    """One triple tap in a recording."""

    subject: str
    segment: str
    times_ns: tuple[int, int, int]
    """Host time of each tap."""
    first_s: float
    """The first one's time from the subject's first sample."""
    camera_lag_s: float | None = None
    """Added to a time from the first sample: the camera's time. None: nobody said when it saw the tap."""


def taps_in(path: Path, camera_s: float | None = None) -> list[Tapped]:
    """Return the triple taps of a recording or a capture folder, in order of time.

    `camera_s` is the time in a camera's film at which the first tap of the first of them is seen.
    Raises recording.RecordingError, or CaptureError for a folder that is no capture.
    """
    streams = _captured(path) if path.is_dir() else _recorded(path)
    zero_ns: dict[str, int] = {}
    for (subject, _), (times, _acc) in streams.items():
        zero_ns[subject] = min(zero_ns.get(subject, int(times[0])), int(times[0]))
    found = [
        Tapped(
            subject=subject,
            segment=segment,
            times_ns=taps.times_ns,
            first_s=(taps.times_ns[0] - zero_ns[subject]) * 1e-9,
        )
        for (subject, segment), (times, acc) in streams.items()
        for taps in triple_taps(times, acc)
    ]
    found.sort(key=lambda one: one.times_ns)
    if camera_s is None or not found:
        return found
    seen_ns = found[0].times_ns[0]
    return [replace(one, camera_lag_s=camera_s - (seen_ns - zero_ns[one.subject]) * 1e-9) for one in found]


_Streams = dict[tuple[str, str], tuple[Times, Floats]]
"""By subject and segment: times (n,) ns that grow, and raw accelerations (n, 3)."""


def _captured(folder: Path) -> _Streams:
    segments = capture.load(folder).segments
    return {
        (CAPTURE, name): (np.rint(one.t * 1e9).astype(np.int64), one.acc)
        for name, one in segments.items()
        if one.acc is not None
    }


def _recorded(path: Path) -> _Streams:
    """Return what every sensor sent, late samples too."""
    came: dict[tuple[str, str], list[tuple[list[int], Floats]]] = {}
    with recording.read(path) as reading:
        for key, payload, _ in reading:
            try:
                parsed = keys.parse(key)
                if parsed.topic != "imu":
                    continue
                batch = decode_topic(payload, "imu")
                assert isinstance(batch, SampleBatch)
                samples = read_samples(batch)
            except (keys.BadKey, WireError):
                continue  # a recording holds what came, sound or not
            if samples.acc is not None:
                came.setdefault((parsed.subject, parsed.detail), []).append((samples.time_ns, samples.acc))
    streams: _Streams = {}
    for who, batches in came.items():
        times = np.concatenate([np.array(t, dtype=np.int64) for t, _ in batches])
        times, order = np.unique(times, return_index=True)
        streams[who] = times, np.concatenate([acc for _, acc in batches])[order]
    return streams
