"""The HTTP side: files, the door, the WebSocket. Thin: who may come in is decided by the door."""

import asyncio
import contextlib
import logging
import socket
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

from aiohttp import WSMsgType, web

from brachium_viewer.web import door as doors
from brachium_viewer.web.files import File, pages
from brachium_viewer.web.requests import MAX_BYTES
from brachium_viewer.web.seats import Seat

log = logging.getLogger(__name__)

POLICY = "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; object-src 'none'"
"""Nothing from elsewhere, nothing inline."""
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; frame-ancestors 'none'"
)
"""A report is one file with its own style, and without any script."""
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-DNS-Prefetch-Control": "off",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "no-cache",
}
OUTSIDE = ("/door", "/style/", "/words/", "/app/door.js", "/app/words.js", "/app/theme.js", "/icon.svg")
"""What who stands before the door needs."""
SCREENS = 32
"""At once."""
BUFFER_BYTES = 16384
"""What may wait in a connection: a dozen frames; then its screen is slow, and skips some."""
HEARTBEAT_S = 10.0
ASKING = 32
"""Requests of one screen at once."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Rooms:
    """The application of aiohttp; `greet`, `leave` and `asked` are what the server does with a screen."""

    def __init__(
        self,
        *,
        bind: str,
        door: doors.Door | None,
        greet: Callable[[], Seat],
        leave: Callable[[Seat], None],
        asked: Callable[[Seat, str], Awaitable[None]],
        report: Callable[[str], Path | None],
    ) -> None:
        self._bind, self._door = bind, door
        self._greet, self._leave, self._asked, self._report = greet, leave, asked, report
        self._files = pages()
        self._hosts: frozenset[str] = frozenset()
        self._screens: set[web.WebSocketResponse] = set()

    def opened(self, port: int) -> None:
        """Take note of the port, which is part of the names that we answer to."""
        self._hosts = doors.hosts(self._bind, port)

    def application(self) -> web.Application:
        """Return the application."""
        app = web.Application(middlewares=[self._guard], client_max_size=MAX_BYTES)
        app.router.add_get("/ws", self._socket)
        app.router.add_post("/door", self._enter)
        app.router.add_get("/report/{name}", self._give_report)
        app.router.add_get("/{path:.*}", self._give_file)
        app.on_shutdown.append(self._close)
        return app

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        try:
            response = await self._guarded(request, handler)
        except web.HTTPException as error:
            response = web.Response(status=error.status, text=error.reason)
            if isinstance(error, web.HTTPSeeOther):
                response.headers["Location"] = error.headers["Location"]
        if not response.prepared:
            response.headers.update(HEADERS)
            response.headers.setdefault("Content-Security-Policy", POLICY)
        return response

    async def _guarded(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if request.host not in self._hosts:
            raise web.HTTPForbidden(reason="asked for under another name: open the address that was printed")
        if not request.path.startswith(OUTSIDE) and not self._may(request):
            if request.method == "GET" and request.path in ("/", "/patient"):
                raise web.HTTPSeeOther(f"/door?to={request.path}")
            raise web.HTTPUnauthorized(reason="not paired: open the first page and enter the code")
        return await handler(request)

    def _may(self, request: web.Request) -> bool:
        key = request.cookies.get(doors.COOKIE)
        return self._door is None or self._door.knows(key, time.monotonic())

    async def _give_file(self, request: web.Request) -> web.StreamResponse:
        file: File | None = self._files.get(request.path)
        if file is None:
            raise web.HTTPNotFound(reason="there is no such page")
        headers = {"ETag": file.tag, "Vary": "Accept-Encoding"}
        if request.headers.get("If-None-Match") == file.tag:
            return web.Response(status=304, headers=headers)
        headers["Content-Type"] = file.kind
        if file.squeezed is not None and "gzip" in request.headers.get("Accept-Encoding", ""):
            return web.Response(body=file.squeezed, headers=headers | {"Content-Encoding": "gzip"})
        return web.Response(body=file.body, headers=headers)

    async def _give_report(self, request: web.Request) -> web.StreamResponse:
        path = self._report(request.match_info["name"])
        if path is None:
            raise web.HTTPNotFound(reason="there is no such report")
        body = await asyncio.to_thread(path.read_bytes)
        headers = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": REPORT_POLICY}
        return web.Response(body=body, headers=headers)

    async def _enter(self, request: web.Request) -> web.StreamResponse:
        """Answer who says a word at the door: 204 and a key, 403 for a wrong word, 429 to who must wait."""
        if not doors.same_origin(request.headers.get("Origin"), request.host, self._hosts):
            raise web.HTTPForbidden(reason="not from one of our pages")
        word = (await request.read()).decode("utf-8", "replace")[:200]
        if self._door is None:
            return web.Response(status=204)
        try:
            key = self._door.enter(word, request.remote or "", time.monotonic())
        except doors.Wait as wait:
            seconds = str(round(wait.seconds + 0.5))
            return web.Response(status=429, headers={"Retry-After": seconds}, text=seconds)
        if key is None:
            return web.Response(status=403, text="wrong")
        response = web.Response(status=204)
        response.set_cookie(
            doors.COOKIE, key, max_age=round(doors.KEY_S), httponly=True, samesite="Strict", path="/"
        )
        return response

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if not doors.same_origin(request.headers.get("Origin"), request.host, self._hosts):
            raise web.HTTPForbidden(reason="not from one of our pages")
        if len(self._screens) >= SCREENS:
            raise web.HTTPServiceUnavailable(reason=f"{SCREENS} screens watch already")
        screen = web.WebSocketResponse(
            heartbeat=HEARTBEAT_S, compress=False, max_msg_size=MAX_BYTES, writer_limit=1
        )
        await screen.prepare(request)
        _hold_little(request.transport)
        self._screens.add(screen)
        seat = self._greet()
        sending = asyncio.create_task(_send(screen, seat))
        asking: set[asyncio.Task[None]] = set()
        try:
            async for message in screen:
                if message.type is not WSMsgType.TEXT:
                    continue
                while len(asking) >= ASKING:  # who asks faster waits: no question stays without its answer
                    await asyncio.wait(asking, return_when=asyncio.FIRST_COMPLETED)
                task = asyncio.create_task(self._ask(seat, message.data))
                asking.add(task)
                task.add_done_callback(asking.discard)
        finally:
            self._leave(seat)
            self._screens.discard(screen)
            for task in (sending, *asking):
                task.cancel()
        return screen

    async def _ask(self, seat: Seat, text: str) -> None:
        await self._asked(seat, text)

    async def _close(self, app: web.Application) -> None:
        del app
        for screen in list(self._screens):
            await screen.close(code=1001, message=b"the server ends")


def _hold_little(transport: asyncio.Transport | None) -> None:
    """Let little wait in a connection, in this process and in the system."""
    if transport is None:
        return
    transport.set_write_buffer_limits(high=BUFFER_BYTES)
    plain = transport.get_extra_info("socket")
    if plain is not None:
        plain.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)


async def _send(screen: web.WebSocketResponse, seat: Seat) -> None:
    with contextlib.suppress(ConnectionError):
        while True:
            for text in await seat.take():
                await screen.send_str(text)
