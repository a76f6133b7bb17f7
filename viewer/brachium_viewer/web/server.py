"""The server of the pages: the bus on one side, browsers on the other."""

import asyncio
import json
import logging
import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from aiohttp import web

from brachium_viewer.web import frames
from brachium_viewer.web.desk import Desk
from brachium_viewer.web.door import Door, is_loopback
from brachium_viewer.web.pace import Bell, Pace
from brachium_viewer.web.page_state import PageState
from brachium_viewer.web.rooms import Rooms
from brachium_viewer.web.seats import Seat
from brachium_viewer.web.session_desk import SessionDesk
from brachium_wire import keys
from brachium_wire.bus import DEFAULT_ENDPOINT, Bus, Inbox
from brachium_wire.heart import Heart
from brachium_wire.hosttime import HostClock

log = logging.getLogger(__name__)

RATE_HZ = 30.0
"""Frames a second to each screen."""
PATIENCE_S = 0.025
"""The next skeleton at 50 Hz comes within this; a slower one is not waited for with what came before."""
TOGETHER_S = 0.002
"""Both arms of a person are solved at once: the second's skeleton comes right behind the first's."""
STATE_S = 0.2
"""Between two states; one that says nothing new is not sent."""
END_S = 1.0
_TAILS = ("skeleton/*", "imu/*", "imu/*/info", "imu/*/status", "calibration", "session")
_RETAINED = ("imu/*/info", "calibration", "session")


class WebError(RuntimeError):
    """The server cannot start; the text says what to do."""


@dataclass(frozen=True, kw_only=True)
class WebSettings:
    """Where the pages are served, and to whom."""

    endpoint: str = DEFAULT_ENDPOINT
    room: str = keys.DEFAULT_ROOM
    bind: str = "127.0.0.1"
    """One address; only programs of this machine reach a loopback one."""
    port: int = 8080
    """0 takes any free one."""
    subject: str | None = None
    """Who is shown first; None: the first that is heard of."""
    sessions: Path = Path("sessions")
    """Folder of recordings and results."""
    password: str | None = None
    """What every screen must say once; None: pairing codes."""
    open_door: bool = False
    """Nobody is asked for anything; on loopback only."""
    on_ready: Callable[[str], None] | None = None
    """Called with the address of the pages once they can be opened."""
    on_code: Callable[[str], None] | None = None
    """Called with each new pairing code."""


def run(settings: WebSettings, stop: threading.Event) -> None:
    """Serve the pages until `stop` is set.

    Raises WebError when the port is taken or the door would stand open to others, BadKey for a subject that
    cannot be one, NoRouter without a router.
    """
    if settings.subject is not None:
        keys.subject_chunk(settings.subject)
    if settings.open_door and not is_loopback(settings.bind):
        raise WebError(
            f"without a password the pages are for this machine only; {settings.bind} is reached by others: "
            "leave --no-password out"
        )
    with Bus.open(settings.endpoint, stop=stop) as heard, Bus.open(settings.endpoint, stop=stop) as doing:
        asyncio.run(_Server(settings, heard, doing).serve(stop))


class _Server:
    """One run of the server; everything here happens on one event loop.

    What is heard and what is done have a bus each: on the one that watches tokens, a token that is asked for
    may not be found, and a recorder that is there would be called unreachable.
    """

    def __init__(self, settings: WebSettings, heard: Bus, doing: Bus) -> None:
        self._settings, self._bus, self._doing = settings, heard, doing
        self._clock = HostClock()
        self._id = f"web-{os.getpid()}"
        recorder = f"{self._id}-session"
        self._state = PageState(settings.room, settings.subject, own_recorder=recorder)
        self._sessions = SessionDesk(settings.sessions, settings.endpoint, settings.room, recorder)
        self._desk = Desk(doing, self._state, self._sessions, self._clock)
        self._seats: set[Seat] = set()
        self._left = 0
        self._state_text = ""
        self._state_due = 0.0
        self._tokens: list[tuple[str, bool]] = []
        door = None if settings.open_door else Door(settings.password, settings.on_code)
        self._rooms = Rooms(
            bind=settings.bind,
            door=door,
            greet=self._greet,
            leave=self._leave,
            asked=self._asked,
            report=self._sessions.report_file,
        )

    async def serve(self, stop: threading.Event) -> None:
        """Serve until `stop` is set."""
        inboxes = await asyncio.to_thread(self._listen)  # it waits for answers
        heart = Heart(self._bus, self._settings.room, "web", self._id)
        runner, address = await self._open()
        heart.text = address
        try:
            pace, bell = Pace(RATE_HZ), Bell(inboxes[0])
            while not stop.is_set():
                await self._news(inboxes, bell)
                self._tell()
                pace.gone(time.monotonic())
                heart.counts["screens"] = len(self._seats)
                heart.counts["frames_skipped"] = self._left + sum(seat.skipped for seat in self._seats)
                heart.drops["overflow"] = sum(inbox.dropped for inbox in inboxes)
                heart.beat()
                await asyncio.sleep(pace.pause_s(time.monotonic()) if self._seats else STATE_S)
        finally:
            await runner.cleanup()
            await asyncio.to_thread(self._sessions.close)
            self._doing.close()  # a question that nobody has answered yet is waited for no longer

    def _listen(self) -> list[Inbox]:
        room = self._settings.room
        self._bus.watch_alive(
            keys.services(room, "*/*/alive"), lambda key, up: self._tokens.append((key, up))
        )
        inboxes = [self._bus.subscribe(keys.subjects(room, tail), 4096) for tail in _TAILS]
        inboxes.append(self._bus.subscribe(keys.services(room), 4096))
        now_ns = self._clock.now_ns()
        for tail in _RETAINED:
            for key, payload in self._bus.fetch(keys.subjects(room, tail)):
                self._state.feed(key, payload, now_ns)
        return inboxes

    async def _open(self) -> tuple[web.AppRunner, str]:
        settings = self._settings
        runner = web.AppRunner(self._rooms.application(), access_log=None, shutdown_timeout=END_S)
        await runner.setup()
        try:
            await web.TCPSite(runner, settings.bind, settings.port).start()
        except OSError as error:
            await runner.cleanup()
            raise WebError(
                f"the pages cannot be served at {settings.bind} port {settings.port} "
                f"({error.strerror or error}): choose another with --port or --bind"
            ) from None
        port = int(runner.addresses[0][1])
        self._rooms.opened(port)
        host = f"[{settings.bind}]" if ":" in settings.bind else settings.bind
        address = f"http://{host}:{port}/"
        log.info("pages at %s", address)
        if settings.on_ready is not None:
            settings.on_ready(address)
        return runner, address

    async def _news(self, inboxes: list[Inbox], bell: Bell) -> None:
        """Take what came, and for a screen that looks also the skeletons that come next."""
        bell.arm()
        self._take(inboxes)
        if self._seats and await bell.rings(PATIENCE_S):
            await asyncio.sleep(TOGETHER_S)
            self._take(inboxes)

    def _take(self, inboxes: list[Inbox]) -> None:
        now_ns = self._clock.now_ns()
        for inbox in inboxes:
            for key, payload in inbox.drain():
                self._state.feed(key, payload, now_ns)
        while self._tokens:
            self._state.token(*self._tokens.pop(0))

    def _tell(self) -> None:
        """Give every screen what is new: the frame now, the state at most five times a second."""
        now_ns = self._clock.now_ns()
        frame = self._state.frame(now_ns) if self._seats else None
        if frame is not None:
            text = _text({**frame, "sent": now_ns / 1e6})
            for seat in self._seats:
                seat.put_frame(text)
        if time.monotonic() >= self._state_due:
            self._state_due = time.monotonic() + STATE_S
            text = self._state_now(now_ns)
            if text != self._state_text:
                self._state_text = text
                for seat in self._seats:
                    seat.put_state(text)

    def _state_now(self, now_ns: int) -> str:
        session = self._sessions.state(self._state.subject, connected=self._bus.connected())
        state = self._state.state(now_ns)
        alarms = {alarm["reason"]: alarm for alarm in state["alarms"] + session["alarms"]}
        return _text({**state, **session, "alarms": list(alarms.values())})

    def _greet(self) -> Seat:
        seat = Seat()
        seat.put_answer(_text(frames.hello(self._settings.room)))
        seat.put_state(self._state_text or self._state_now(self._clock.now_ns()))
        self._seats.add(seat)
        return seat

    def _leave(self, seat: Seat) -> None:
        self._left += seat.skipped
        self._seats.discard(seat)

    async def _asked(self, seat: Seat, text: str) -> None:
        seat.put_answer(_text(await self._desk.do(text)))


def _text(message: object) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False, default=str)
