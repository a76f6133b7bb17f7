"""Every sensor of a recording or a capture folder with its samples as the chip gave them."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from brachium.shell import Usage
from brachium_fusion.sensor_fits import RawSamples
from brachium_wire import capture, keys, recording
from brachium_wire.codec import WireError, decode_batch, decode_topic
from brachium_wire.messages import Info
from brachium_wire.samples import Samples, read_samples
from brachium_wire.topics import TOPICS


class RawSensor(NamedTuple):
    """One sensor. In a capture folder, which names no nodes, its node is called as the segment."""

    node: str
    segment: str
    chip: str
    samples: RawSamples


def read(path: Path, subject: str | None = None) -> list[RawSensor]:
    """Return the sensors of a recording (one subject's, if named) or a capture folder."""
    return _of_capture(path) if path.is_dir() else _of_recording(path, subject)


def chosen(sensors: list[RawSensor], node: str | None, segment: str | None) -> list[RawSensor]:
    """Return those that are asked for; raises Usage when none is."""
    found = [s for s in sensors if node in (None, s.node) and segment in (None, s.segment)]
    if not found:
        there = ", ".join(f"{s.node} on {s.segment}" for s in sensors) or "no sensor"
        raise Usage(f"no such sensor in the input; there is {there}")
    return found


def _of_capture(folder: Path) -> list[RawSensor]:
    sensors = []
    for name, segment in capture.load(folder).segments.items():
        mag = segment.mag
        if mag is not None:
            mag = mag[np.isfinite(mag).all(axis=1)]
        samples = RawSamples(segment.rate_hz, segment.gyr, segment.acc, mag)
        sensors.append(RawSensor(node=name, segment=name, chip="", samples=samples))
    return sensors


def _of_recording(path: Path, subject: str | None) -> list[RawSensor]:
    infos: dict[tuple[str, str], Info] = {}
    batches: dict[tuple[str, str, str], list[Samples]] = {}
    with recording.read(path) as messages:
        for key, payload, _ in messages:
            try:
                parsed = keys.parse(key)
                if parsed.topic not in ("info", "imu") or subject not in (None, parsed.subject):
                    continue
                place = (parsed.subject, parsed.detail or "")
                if parsed.topic == "info":
                    message = decode_topic(payload, "info")
                    if isinstance(message, Info):
                        infos[place] = message
                elif place in infos:
                    batch = read_samples(decode_batch(payload, TOPICS["imu"].max_bytes))
                    batches.setdefault((infos[place].node, *place), []).append(batch)
            except (keys.BadKey, WireError):  # what could not be read live cannot be read now
                continue
    return [_joined(node, place, infos, found) for (node, *place), found in batches.items()]


def _joined(
    node: str, place: list[str], infos: dict[tuple[str, str], Info], batches: list[Samples]
) -> RawSensor:
    info = infos[place[0], place[1]]
    batches = sorted((b for b in batches if b.gyr is not None), key=lambda b: b.sequence)
    gyr = [b.gyr for b in batches if b.gyr is not None]
    acc = [b.acc for b in batches if b.acc is not None]
    mag = [b.mag for b in batches if b.mag is not None]
    samples = RawSamples(
        info.rate_hz,
        np.concatenate(gyr) if gyr else None,
        np.concatenate(acc) if acc else None,
        np.concatenate(mag) if mag else None,
    )
    return RawSensor(node=node, segment=place[1], chip=info.chip, samples=samples)
