"""Triple taps in a recording's raw accelerations, and how far a camera's time is from the samples'."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from brachium_viewer.lsl.taps import Floats, triple_taps
from brachium_wire import keys, recording
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import SampleBatch
from brachium_wire.samples import read_samples


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
    """Return the triple taps of a recording in order of time.

    `camera_s` is the time in a camera's film at which the first tap of the first of them is seen.
    Raises recording.RecordingError for a file that is none.
    """
    found: list[Tapped] = []
    streams = _accelerations(path)
    zero = {subject: min(s[0][0] for (w, _), s in streams.items() if w == subject) for subject, _ in streams}
    for (subject, segment), (times, acc) in streams.items():
        order = np.unique(np.array(times, dtype=np.int64), return_index=True)[1]
        for taps in triple_taps(np.array(times, dtype=np.int64)[order], np.concatenate(acc)[order]):
            first_s = (taps.times_ns[0] - zero[subject]) * 1e-9
            found.append(Tapped(subject=subject, segment=segment, times_ns=taps.times_ns, first_s=first_s))
    found.sort(key=lambda one: one.times_ns)
    if camera_s is None:
        return found
    return [
        Tapped(
            subject=one.subject,
            segment=one.segment,
            times_ns=one.times_ns,
            first_s=one.first_s,
            camera_lag_s=camera_s - (found[0].times_ns[0] - zero[one.subject]) * 1e-9,
        )
        for one in found
    ]


def _accelerations(path: Path) -> dict[tuple[str, str], tuple[list[int], list[Floats]]]:
    """Return times and raw accelerations of every sensor, late samples too, as they came."""
    streams: dict[tuple[str, str], tuple[list[int], list[Floats]]] = {}
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
                times, acc = streams.setdefault((parsed.subject, parsed.detail), ([], []))
                times += samples.time_ns
                acc.append(samples.acc)
    return streams
