"""Reading a network from a program of one's own; `brachium_wire` says what the messages mean."""

import asyncio
import logging
import threading
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Generic, TypeVar
from weakref import WeakSet

from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus, Inbox
from brachium_wire.codec import WireError, decode
from brachium_wire.keys import DEFAULT_ROOM, BadKey, Key
from brachium_wire.messages import Event, Health, Message, SampleBatch, Skeleton
from brachium_wire.samples import Samples, read_samples
from brachium_wire.topics import TOPICS

log = logging.getLogger(__name__)

LOOK_S = 0.5
"""A plain loop wakes this often without a message, so that a signal is answered."""

T = TypeVar("T")
M = TypeVar("M", bound=Message)


def skeletons(
    *, room: str = DEFAULT_ROOM, subject: str = "*", endpoint: str = DEFAULT_ENDPOINT
) -> "Stream[Skeleton]":
    """Return the skeletons of one subject, or of all; `key.detail` is the side."""
    return Stream(keys.subjects(room, "skeleton/*", subject), _message(Skeleton), endpoint)


def samples(
    *, room: str = DEFAULT_ROOM, subject: str = "*", segment: str = "*", endpoint: str = DEFAULT_ENDPOINT
) -> "Stream[Samples]":
    """Return the sensor samples, a batch at a time as arrays in SI units; `key.detail` is the segment."""
    tail = f"imu/{segment if segment == '*' else keys.chunk(segment, 'segment')}"
    return Stream(keys.subjects(room, tail, subject), _samples, endpoint)


def health(*, room: str = DEFAULT_ROOM, endpoint: str = DEFAULT_ENDPOINT) -> "Stream[Health]":
    """Return how every service fares, each once a second; `key.detail` is `<kind>/<id>`."""
    return Stream(keys.services(room), _message(Health), endpoint)


def events(
    *, room: str = DEFAULT_ROOM, subject: str = "*", endpoint: str = DEFAULT_ENDPOINT
) -> "Stream[Event]":
    """Return the marks in time: an exercise begins, a note, a change that fusion applied."""
    return Stream(keys.subjects(room, "event", subject), _message(Event), endpoint)


class Stream(Generic[T]):
    """Messages of one kind as they come, each with its key; read it with `for` or with `async for`.

    The network is joined when the loop begins (NoRouter after 10 s without a router) and left when it ends.
    A reader that is too slow loses its own oldest messages; what breaks the contract is dropped. `drops`
    counts both.
    """

    def __init__(self, expression: str, read: Callable[[str, bytes], T], endpoint: str) -> None:
        self._expression, self._read, self._endpoint = expression, read, endpoint
        self.drops: Counter[str] = Counter()

    def __iter__(self) -> Iterator[tuple[Key, T]]:
        with _join(self._endpoint) as bus:
            inbox = bus.subscribe(self._expression)
            while True:
                yield from self._take(inbox)
                inbox.wait(LOOK_S)

    async def __aiter__(self) -> AsyncIterator[tuple[Key, T]]:
        with await asyncio.to_thread(_join, self._endpoint) as bus:
            loop, arrived = asyncio.get_running_loop(), asyncio.Event()
            inbox = bus.subscribe(self._expression)
            inbox.on_arrival(lambda: _call(loop, arrived.set))
            while True:
                arrived.clear()
                for heard in self._take(inbox):
                    yield heard
                await arrived.wait()

    def _take(self, inbox: Inbox) -> Iterator[tuple[Key, T]]:
        for name, payload in inbox.drain():
            try:
                heard = keys.parse(name), self._read(keys.parse(name).topic, payload)
            except (BadKey, WireError) as error:
                reason = error.drop.value if isinstance(error, WireError) else "bad_key"
                if not self.drops[reason]:
                    log.warning("dropped from %r: %r", name[:80], str(error))
                self.drops[reason] += 1
                continue
            yield heard
        self.drops["overflow"] = inbox.dropped


def _message(kind: type[M]) -> Callable[[str, bytes], M]:
    return lambda topic, payload: decode(payload, kind, TOPICS[topic].max_bytes)


def _samples(topic: str, payload: bytes) -> Samples:
    return read_samples(decode(payload, SampleBatch, TOPICS[topic].max_bytes))


def _call(loop: asyncio.AbstractEventLoop, what: Callable[[], object]) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(what)


def _join(endpoint: str) -> Bus:
    try:
        return _close_at_exit(Bus.open(endpoint))
    except KeyboardInterrupt:  # it comes out when an attempt has failed: that error is none of the reader's
        raise KeyboardInterrupt from None


_open: "WeakSet[Bus]" = WeakSet()
_watching = threading.Event()


def _close_at_exit(bus: Bus) -> Bus:
    """Have `bus` closed when the main thread ends, even if an error left a loop over a stream unfinished.

    Zenoh delivers on threads that Python waits for before it exits, and before `atexit`: without this, such
    a program would never end.
    """
    _open.add(bus)
    if not _watching.is_set():
        _watching.set()
        threading.Thread(target=_close_all_after_main, name="brachium-exit", daemon=True).start()
    return bus


def _close_all_after_main() -> None:
    threading.main_thread().join()
    for bus in list(_open):
        bus.close()
