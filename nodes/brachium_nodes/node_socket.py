"""A node's WebSocket at the gateway: the handshake, then frames, and an end that always comes.

The library of the handshake (websockets) takes some 50 us for each message afterwards, with 256 nodes a
quarter of a core: the frames are read here, in the event loop's own callback.
"""

import asyncio
import logging
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import cast

from websockets.http11 import Request, Response
from websockets.server import ServerProtocol

from brachium_nodes import websocket_frames as ws
from brachium_nodes.websocket_frames import Broken, FrameReader

OPEN_WITHIN_S, CLOSE_WITHIN_S = 3.0, 1.0
PING_EVERY_S, PONG_WITHIN_S = 5.0, 10.0
MAX_HEAD_BYTES = 8192
MAX_UNREAD_BYTES = 65536
"""What may wait for a node that does not read, before it is taken for dead: 4 minutes of clock questions."""
MAX_STRANGERS = 512
"""Connections from one address that have not shaken hands; emulated rooms come all at once, from one."""
READ_BYTES = 8192
"""Read at a time from one node, so that none keeps the others waiting."""

_quiet = logging.getLogger(f"{__name__}.handshake")
_quiet.setLevel(logging.CRITICAL)  # every stranger's half handshake would be a traceback

_incoming = memoryview(bytearray(READ_BYTES))
"""One for all sockets: what was read is taken out before the next one reads."""


@dataclass(kw_only=True, eq=False)
class House:
    """What all connections of a gateway share."""

    door: Callable[[Request], tuple[HTTPStatus, str] | None]
    """Answers a request with what is wrong with it, or None."""
    opened: Callable[["NodeSocket", Request], None]
    """Called after the upgrade."""
    broken: Callable[[str], None]
    """Counts, by name, what was no WebSocket."""
    max_bytes: int
    """Of a message."""
    sockets: set["NodeSocket"] = field(default_factory=set)
    strangers: Counter[str] = field(default_factory=Counter)
    """Connections that have not shaken hands, by address."""

    def let_knock(self, address: str) -> bool:
        """Count a connection; return whether it may stay."""
        self.strangers += Counter()  # forget addresses that nobody knocks from any more
        self.strangers[address] += 1
        if self.strangers[address] <= MAX_STRANGERS:
            return True
        self.broken("too_many_strangers")
        return False


class NodeSocket(asyncio.BufferedProtocol):
    """One connection. Its owner sets `message` and `closed` when it has opened; `closed` comes once."""

    def __init__(self, house: "House") -> None:
        self._house = house
        self._head = b""
        self._reader: FrameReader | None = None
        self._transport: asyncio.Transport | None = None
        self._loop = asyncio.get_running_loop()
        self._end = self._loop.call_later(OPEN_WITHIN_S, self.abort)
        self._heard_s = self._pinged_s = 0.0
        self.message: Callable[[bytes | str], None] = lambda _: None
        self.closed: Callable[[bool], None] = lambda _: None
        """Called with whether the last message was too large."""
        self.closing = False
        """Nothing is taken or sent any more."""
        self._too_big = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the way back, unless too many strangers from there are at the door."""
        self._transport = cast(asyncio.Transport, transport)
        self._from = str((transport.get_extra_info("peername") or ("?",))[0])
        self._house.sockets.add(self)
        if not self._house.let_knock(self._from):
            self.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the owner."""
        del exc
        self.closing = True
        self._end.cancel()
        self._house.sockets.discard(self)
        if self._reader is None:
            self._house.strangers[self._from] -= 1
        closed, self.closed, self.message = self.closed, lambda _: None, lambda _: None
        closed(self._too_big)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Return where to read into."""
        del sizehint
        return _incoming

    def buffer_updated(self, nbytes: int) -> None:
        """Take what was read."""
        data = bytes(_incoming[:nbytes])
        if self._reader is None:
            self._shake_hands(data)
        else:
            self._take(self._reader, data)

    def eof_received(self) -> bool:
        """Close, too."""
        return False

    def send(self, payload: bytes) -> None:
        """Send a binary message; nothing once the connection ends."""
        if not self.closing:
            self._write(ws.frame(ws.BINARY, payload))

    def close(self, code: int, reason: str) -> None:
        """Say why and end, when the node has answered or has had a second for it."""
        if self._reader is None:
            self.abort()
        if self.closing:
            return
        self._write(ws.close_frame(code, reason))
        self.closing = True
        self._end = self._loop.call_later(CLOSE_WITHIN_S, self.abort)

    def abort(self) -> None:
        """End now."""
        self.closing = True
        if self._transport is not None:
            self._transport.abort()

    def keep_alive(self, now_s: float) -> None:
        """Ping each 5 s, give up 10 s after the last sign of life. Call it often."""
        if self.closing or self._reader is None or now_s - self._pinged_s < PING_EVERY_S:
            return
        if now_s - self._heard_s > PONG_WITHIN_S + PING_EVERY_S:
            self.close(1011, "no pong within 10 s")
            return
        self._pinged_s = now_s
        self._write(ws.frame(ws.PING, b""))

    def _write(self, data: bytes) -> None:
        if self._transport is None:
            return
        self._transport.write(data)
        if self._transport.get_write_buffer_size() > MAX_UNREAD_BYTES:
            self.abort()

    def _shake_hands(self, data: bytes) -> None:
        head, end, rest = (self._head + data).partition(b"\r\n\r\n")
        if self.closing:
            return
        if not end:
            self._head = head
            if len(head) > MAX_HEAD_BYTES:
                self._refuse()
            return
        self._head = b""
        protocol = ServerProtocol(logger=_quiet)
        try:
            protocol.receive_data(head + end)
            events = protocol.events_received()
        except Exception:  # whatever a stranger's bytes make the library raise
            events = []
        if not events or not isinstance(events[0], Request):
            self._refuse()
            return
        self._answer(protocol, events[0], rest)

    def _answer(self, protocol: ServerProtocol, request: Request, rest: bytes) -> None:
        wrong = self._house.door(request)
        response: Response = protocol.reject(*wrong) if wrong is not None else protocol.accept(request)
        self._write(response.serialize())
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            if wrong is None:
                self._house.broken("broken_handshake")
            self._hang_up()
            return
        self._end.cancel()
        self._house.strangers[self._from] -= 1
        self._reader = FrameReader(self._house.max_bytes)
        self._heard_s = self._pinged_s = self._loop.time()
        self._house.opened(self, request)
        if rest:
            self._take(self._reader, rest)

    def _refuse(self) -> None:
        self._house.broken("broken_handshake")
        self._write(b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Length: 0\r\n\r\n")
        self._hang_up()

    def _hang_up(self) -> None:
        self.closing = True
        assert self._transport is not None
        self._transport.close()

    def _take(self, reader: FrameReader, data: bytes) -> None:
        came, broken = reader.feed(data)
        self._heard_s = self._loop.time()
        for kind, payload in came:
            if kind == ws.CLOSE:
                self._closed_by_node(payload)
                return
            if self.closing:
                continue
            if kind == ws.BINARY:
                self.message(payload)
            elif kind == ws.TEXT:
                self.message(payload.decode())
            elif kind == ws.PING:
                self._write(ws.frame(ws.PONG, payload))
        if broken is not None:
            self._break(broken)

    def _closed_by_node(self, payload: bytes) -> None:
        if not self.closing:
            try:
                code = ws.close_code(payload)
            except Broken as broken:
                self._break(broken)
                return
            self._write(ws.frame(ws.CLOSE, payload[:2]) if code != 1005 else ws.frame(ws.CLOSE, b""))
        self._hang_up()

    def _break(self, broken: Broken) -> None:
        if broken.code == ws.TOO_BIG:
            self._too_big = True
        elif not self.closing:
            self._house.broken("broken_websocket")
        self.close(broken.code, str(broken))
        self._reader = _Deaf(0)
        if self._transport is not None and self._transport.can_write_eof():
            self._transport.write_eof()


class _Deaf(FrameReader):
    """After a fault the stream means nothing any more: what still comes is read and thrown away."""

    def feed(self, data: bytes) -> tuple[list[ws.Came], Broken | None]:
        """Return nothing."""
        del data
        return [], None
