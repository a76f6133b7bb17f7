"""A recording through the pipeline: its snapshot, the changes that fusion applied, and every batch as it
came. Pure.

With the settings of the recording the skeletons are those that were live; with others they are what these
settings
would have given.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
import numpy.typing as npt

from brachium_fusion.best_material import Material, TimedSpan
from brachium_fusion.pipeline import Pipeline, Solved
from brachium_fusion.settings import Change, Settings
from brachium_fusion.uniform import Series
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_batch, decode_topic
from brachium_wire.messages import Event, Info, Session, Skeleton, Snapshot
from brachium_wire.recording import Recorded
from brachium_wire.samples import Samples, read_samples
from brachium_wire.topics import TOPICS

Floats = npt.NDArray[np.float64]

DRAIN = 512
"""Messages between two rounds of kinematics: large rounds are cheap, and how large plays no part in the
result."""


@dataclass(slots=True)
class Contents:
    """What a recording holds of one subject."""

    samples: list[tuple[keys.Key, bytes]] = field(default_factory=list)
    """`imu` and `info` messages in order of arrival."""
    changes: list[Change] = field(default_factory=list)
    snapshot: Snapshot | None = None
    settings: Settings | None = None
    """What fusion said of itself, where there is no snapshot."""
    live: list[Skeleton] = field(default_factory=list)
    """The skeletons that were published."""
    live_arrived_ns: list[int] = field(default_factory=list)
    """When each was recorded."""
    foreign_snapshot: bool = False
    """Found while solving: the snapshot is of another version of fusion."""


def sort_out(messages: Iterable[Recorded]) -> dict[str, Contents]:
    """Return what a recording holds, by subject. What cannot be read is left aside: it was so live, too."""
    subjects: dict[str, Contents] = {}
    for key, payload, arrived_ns in messages:
        try:
            parsed = keys.parse(key)
            if parsed.topic in ("imu", "info"):
                subjects.setdefault(parsed.subject, Contents()).samples.append((parsed, payload))
            elif parsed.topic in ("event", "snapshot", "skeleton"):
                contents = subjects.setdefault(parsed.subject, Contents())
                _sort_message(contents, parsed.topic, payload, arrived_ns)
        except (keys.BadKey, WireError, TypeError):
            continue
    return subjects


def _sort_message(contents: Contents, topic: str, payload: bytes, arrived_ns: int) -> None:
    message = decode_topic(payload, topic)
    if isinstance(message, Event) and message.kind == "applied":
        contents.changes.append(Change(message.time_ns, message.text, message.data))
    elif isinstance(message, Event) and message.kind == "settings" and contents.settings is None:
        contents.settings = Settings(**message.data)
    elif isinstance(message, Snapshot) and contents.snapshot is None:
        contents.snapshot = message
    elif isinstance(message, Skeleton):
        contents.live.append(message)
        contents.live_arrived_ns.append(arrived_ns)


def settings_of(contents: Contents) -> Settings:
    """Return the settings that were live, as far as the recording tells."""
    if contents.snapshot is not None:
        return Settings(**contents.snapshot.settings)
    return contents.settings or Settings()


def solve(subject: str, contents: Contents, settings: Settings) -> tuple[Pipeline, list[Solved]]:
    """Return the pipeline after all messages of one subject, and its skeletons."""
    pipeline = Pipeline(settings)
    changes = list(contents.changes)
    if contents.snapshot is not None and settings == settings_of(contents):
        try:
            pipeline.restore(subject, contents.snapshot)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError):
            contents.foreign_snapshot, pipeline = True, Pipeline(settings)
        begun = pipeline.subject(subject)
        known = begun.pending()
        changes = [c for c in changes if c.from_ns >= begun.next_tick_ns() and c not in known]
    for change in changes:
        with suppress(ValueError):  # not by this fusion: live, nothing of the kind was applied
            pipeline.apply(subject, change)
    solved: list[Solved] = []
    for first in range(0, len(contents.samples), DRAIN):
        pipeline.feed_all(contents.samples[first : first + DRAIN])
        solved.extend(pipeline.skeletons())
    pipeline.finish()
    solved.extend(pipeline.skeletons())
    return pipeline, solved


def material(contents: Contents) -> Material:
    """Return what `--mode best` starts from: of each segment the samples of the sensor that was last there,
    those that came late among them. Raises ValueError when there are none."""
    infos: dict[str, Info] = {}
    found: dict[str, list[Samples]] = {}
    for key, payload in contents.samples:
        with suppress(WireError):
            if key.topic == "imu":
                found.setdefault(key.detail, []).append(
                    read_samples(decode_batch(payload, TOPICS["imu"].max_bytes))
                )
                continue
            info = decode_topic(payload, "info")
            assert isinstance(info, Info)
            if key.detail in infos and infos[key.detail] != info:
                found.pop(key.detail, None)
            infos[key.detail] = info
    zero_ns = min((b.time_ns[0] for s, batches in found.items() if s in infos for b in batches), default=0)
    joined = {s: _joined(batches, zero_ns) for s, batches in found.items() if s in infos}
    return Material(
        series={s: replace(one, rate_hz=infos[s].rate_hz) for s, (one, _) in joined.items()},
        infos={s: infos[s] for s in joined},
        sequences={s: numbers for s, (_, numbers) in joined.items()},
        session=_session(contents),
        spans=_spans(contents, zero_ns),
        find_pose=True,
        zero_ns=zero_ns,
    )


def _joined(batches: list[Samples], zero_ns: int) -> tuple[Series, npt.NDArray[np.int64]]:
    """Return a sensor's samples in order of time, each once."""
    times = np.concatenate([np.array(b.time_ns, dtype=np.int64) for b in batches])
    numbers = np.concatenate([b.sequence + np.arange(len(b)) for b in batches])
    _, order = np.unique(times, return_index=True)
    blocks = {name: _block(batches, name) for name in ("gyr", "acc", "mag", "quat")}
    chosen = {name: None if block is None else block[order] for name, block in blocks.items()}
    time_s = (times[order] - zero_ns).astype(np.float64) * 1e-9
    return Series(time_s=time_s, rate_hz=1.0, **chosen), numbers[order]


def _block(batches: list[Samples], name: str) -> Floats | None:
    """Return one block of all batches (n, width), NaN where a batch has none; None when no batch has it."""
    width = 4 if name == "quat" else 3
    rows = []
    for batch in batches:
        values = getattr(batch, name)
        full = np.full((len(batch), width), np.nan)
        if values is not None:
            full[list(batch.mag_index) if name == "mag" and batch.mag_index is not None else slice(None)] = (
                values
            )
        rows.append(full)
    block = np.concatenate(rows)
    return None if np.isnan(block).all() else block


def _session(contents: Contents) -> Session:
    """Return the session as it was at the end."""
    told = [change.data for change in contents.changes if change.kind == "session"]
    return msgspec.convert(told[-1], Session) if told else Session()


def _spans(contents: Contents, zero_ns: int) -> tuple[TimedSpan, ...]:
    """Return what the last alignment by movement was made from."""
    told = [change.data.get("spans", []) for change in contents.changes if change.kind == "align"]
    return tuple(
        TimedSpan(kind=kind, from_s=1e-9 * (a - zero_ns), to_s=1e-9 * (b - zero_ns), angles_deg=angles)
        for kind, a, b, angles in (told[-1] if told else ())
    )


def largest_difference(solved: Iterable[Skeleton], live: Iterable[Skeleton]) -> tuple[int, float, float]:
    """Return how many instants both have, and the largest difference there of angles (rad) and positions (m).

    A number that only one of the two has counts as infinite.
    """
    again = {(s.time_ns, s.side): s for s in solved}
    compared, angle, position = 0, 0.0, 0.0
    for skeleton in live:
        other = again.get((skeleton.time_ns, skeleton.side))
        if other is None:
            continue
        compared += 1
        if (
            skeleton.angles.keys() != other.angles.keys()
            or skeleton.positions.keys() != other.positions.keys()
        ):
            return compared, float("inf"), float("inf")
        for name, value in skeleton.angles.items():
            angle = max(angle, abs(value - other.angles[name]))
        for name, place in skeleton.positions.items():
            position = max(position, *(abs(a - b) for a, b in zip(place, other.positions[name], strict=True)))
    return compared, angle, position
