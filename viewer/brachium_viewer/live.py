"""The live view: skeletons of a room on a screen, in a window or in a browser on this machine."""

import importlib.util
import logging
import os
import threading
import time
import webbrowser
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING

from brachium_viewer.picture import Picture
from brachium_viewer.viewer_process import ViewerProcess, ViewError, free_port
from brachium_viewer.web_view import PageServer
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus, Inbox
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.heart import Heart

if TYPE_CHECKING:
    from brachium_viewer.screen import Screen

log = logging.getLogger(__name__)

_TAILS = ("skeleton/*", "truth/*", "imu/*/status", "calibration")
_INBOX = 4096
MEMORY_LIMIT = "256MB"
"""A quarter of an hour of both arms; a viewer that runs all day takes no more."""


@dataclass(frozen=True, kw_only=True)
class ViewSettings:
    """What to show, and where."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    subject: str = "*"
    web: bool | None = None
    """In a browser; None: in a window if there is a display, else in a browser."""
    web_port: int = 9090
    """Port of the page on loopback; 0 takes any free one."""
    grpc_port: int = 9876
    """Port of the stream on loopback; 0 takes any free one."""
    memory_limit: str = MEMORY_LIMIT
    """What the viewer and its server may keep of the past; the oldest goes first."""
    rate_hz: float = 30.0
    """Pictures a second; a machine without a graphics card keeps up with 10."""
    raw: bool = False
    """Show what the sensors send, too."""
    open_browser: bool = False
    on_address: Callable[[str], None] | None = None
    """Called with the page's address when it can be opened."""


def run(settings: ViewSettings, stop: threading.Event) -> None:
    """Show the room until `stop` is set or the window is closed.

    Raises ViewError when Rerun is missing, a port is taken or the viewer fails, NoRouter without a router.
    """
    with ExitStack() as stack:
        bus = stack.enter_context(Bus.open(settings.endpoint, stop=stop))
        heart = Heart(bus, settings.room, "view", f"view-{os.getpid()}")
        tails = (*_TAILS, "imu/*") if settings.raw else _TAILS
        inboxes = [
            bus.subscribe(keys.subjects(settings.room, tail, settings.subject), _INBOX) for tail in tails
        ]
        viewer, heart.text = opened(stack, settings, stop)
        _show(settings, stop, bus, heart, inboxes, viewer)


def opened(stack: ExitStack, settings: ViewSettings, stop: threading.Event) -> tuple[ViewerProcess, str]:
    """Return the viewer, ready, and where it is seen; it ends with the stack.

    Raises ViewError when Rerun is missing, a port is taken or the viewer fails.
    """
    if importlib.util.find_spec("rerun") is None:
        raise ViewError("the live view needs Rerun: pip install 'brachium[view]'")
    web = settings.web if settings.web is not None else not has_display()
    grpc_port = free_port(settings.grpc_port, "the viewer's stream")
    files_port = free_port(0, "the viewer's files") if web else None
    viewer = stack.enter_context(
        ViewerProcess(grpc_port=grpc_port, memory_limit=settings.memory_limit, web_files_port=files_port)
    )
    viewer.wait_ready(stop)
    if files_port is None:
        return viewer, "in a window"
    page = PageServer(port=settings.web_port, grpc_port=grpc_port, viewer_files_port=files_port)
    stack.enter_context(page)
    _tell(page.address, settings)
    return viewer, page.address


def has_display() -> bool:
    """Return whether a window can be opened here."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _tell(address: str, settings: ViewSettings) -> None:
    log.info("live view: %s", address)
    if settings.on_address is not None:
        settings.on_address(address)
    if settings.open_browser:
        webbrowser.open(address)


def _show(
    settings: ViewSettings,
    stop: threading.Event,
    bus: Bus,
    heart: Heart,
    inboxes: list[Inbox],
    viewer: ViewerProcess,
) -> None:
    import rerun as rr

    from brachium_viewer.screen import APPLICATION, Screen

    recording = rr.RecordingStream(APPLICATION, recording_id=f"{settings.room}-{time.time_ns()}")
    recording.connect_grpc(viewer.url)
    screen = Screen(recording)
    picture = Picture()
    start_s = time.monotonic()
    retained = bus.fetch(keys.subjects(settings.room, "calibration", settings.subject))
    try:
        while not stop.is_set() and viewer.running() and screen.error is None:
            due_s = time.monotonic() + 1.0 / settings.rate_hz
            news = retained + [item for inbox in inboxes for item in inbox.drain()]
            retained = []
            draw(newest(news), picture, screen, time.monotonic() - start_s, heart.drops)
            heart.counts["received"] = sum(inbox.received for inbox in inboxes)
            heart.counts["overflow"] = sum(inbox.dropped for inbox in inboxes)
            heart.counts["delivered"] = screen.delivered
            heart.counts["turned_away"] = picture.turned_away
            heart.counts["replaced"] = screen.mailbox.replaced
            heart.beat()
            stop.wait(max(0.0, due_s - time.monotonic()))
        if screen.error is not None:
            raise screen.error
        if not stop.is_set() and viewer.code:
            raise ViewError(f"the viewer ended with code {viewer.code}: {viewer.last_words()}")
        log.info("the live view ends: %s", "stopped" if stop.is_set() else "its window was closed")
    finally:
        screen.close(0.5)  # a frozen viewer does not let the thread end; its death, next, does


def newest(messages: list[tuple[str, bytes]]) -> list[tuple[str, bytes]]:
    """Return the last payload of each key, but all raw samples: a view shows what is, not all that was."""
    raw = [item for item in messages if _is_raw(item[0])]
    return [*{key: payload for key, payload in messages if not _is_raw(key)}.items(), *raw]


def _is_raw(key: str) -> bool:
    return key.rpartition("/")[0].endswith("/imu")  # not its status


def draw(
    news: list[tuple[str, bytes]], picture: Picture, screen: "Screen", now_s: float, drops: Counter[str]
) -> None:
    """Put one tick's news on the screen; what cannot be read is counted by its reason."""
    for key, payload in news:
        try:
            where = keys.parse(key)
            moment = picture.feed(
                where.subject, where.topic, where.detail, decode_topic(payload, where.topic), now_s
            )
        except (WireError, keys.BadKey) as error:
            drops[error.drop.value if isinstance(error, WireError) else "bad_key"] += 1
            continue
        if moment is not None:
            screen.mailbox.put(*moment)
    due = picture.tick(now_s)
    if due:
        screen.mailbox.put(now_s, due)
