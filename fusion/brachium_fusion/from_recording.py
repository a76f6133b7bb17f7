"""A recording through the pipeline: its snapshot, the changes that fusion applied, and every batch as it
came. Pure.

With the settings of the recording the skeletons are those that were live; with others they are what these
settings
would have given.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field

from brachium_fusion.pipeline import Pipeline, Solved
from brachium_fusion.settings import Change, Settings
from brachium_wire import keys
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Event, Skeleton, Snapshot
from brachium_wire.recording import Recorded

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


def sort_out(messages: Iterable[Recorded]) -> dict[str, Contents]:
    """Return what a recording holds, by subject. What cannot be read is left aside: it was so live, too."""
    subjects: dict[str, Contents] = {}
    for key, payload, _ in messages:
        try:
            parsed = keys.parse(key)
            if parsed.topic in ("imu", "info"):
                subjects.setdefault(parsed.subject, Contents()).samples.append((parsed, payload))
            elif parsed.topic in ("event", "snapshot", "skeleton"):
                _sort_message(subjects.setdefault(parsed.subject, Contents()), parsed.topic, payload)
        except (keys.BadKey, WireError, TypeError):
            continue
    return subjects


def _sort_message(contents: Contents, topic: str, payload: bytes) -> None:
    message = decode_topic(payload, topic)
    if isinstance(message, Event) and message.kind == "applied":
        contents.changes.append(Change(message.time_ns, message.text, message.data))
    elif isinstance(message, Event) and message.kind == "settings" and contents.settings is None:
        contents.settings = Settings(**message.data)
    elif isinstance(message, Snapshot) and contents.snapshot is None:
        contents.snapshot = message
    elif isinstance(message, Skeleton):
        contents.live.append(message)


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
        pipeline.restore(subject, contents.snapshot)
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
