"""The front door of Brachium: what a network shows, in five lines.

    import brachium

    for key, skeleton in brachium.skeletons(room="lab"):
        print(key.subject, skeleton.side, skeleton.angles)

`skeletons`, `samples`, `health` and `events` each return a `Stream`: `for` reads it in a plain program,
`async for` with asyncio, and it closes when the loop ends. `import brachium` alone loads neither Zenoh nor
numpy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brachium.client import Stream, events, health, samples, skeletons
    from brachium_wire.bus import NoRouter
    from brachium_wire.keys import Key
    from brachium_wire.messages import Event, Health, SegmentPose, Skeleton
    from brachium_wire.samples import Samples

_HOME = {
    "Stream": "brachium.client",
    "events": "brachium.client",
    "health": "brachium.client",
    "samples": "brachium.client",
    "skeletons": "brachium.client",
    "NoRouter": "brachium_wire.bus",
    "Key": "brachium_wire.keys",
    "Event": "brachium_wire.messages",
    "Health": "brachium_wire.messages",
    "SegmentPose": "brachium_wire.messages",
    "Skeleton": "brachium_wire.messages",
    "Samples": "brachium_wire.samples",
}

__all__ = [
    "Event",
    "Health",
    "Key",
    "NoRouter",
    "Samples",
    "SegmentPose",
    "Skeleton",
    "Stream",
    "events",
    "health",
    "samples",
    "skeletons",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'brachium' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
