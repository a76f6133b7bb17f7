"""A gateway's side of the connection, played on real sockets: it can refuse, fall silent, break off."""

import base64
import binascii
import contextlib
import hashlib
import select
import socket
import struct
import time
from collections.abc import Callable

from brachium_nodes import websocket_frames as ws
from brachium_nodes.conformance.heard import Heard
from brachium_nodes.node_frames import ClockAsk
from brachium_wire.codec import encode
from brachium_wire.messages import Message

ASK_S, ASK_OFTEN_S, OFTEN_FOR_S = 0.25, 0.125, 3.0
"""As docs/node-protocol.md says of clock questions."""
HEAD_WITHIN_S = 3.0
LOOK_S = 0.01
_GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class Caller:
    """One connection of the node under trial."""

    def __init__(self, way: socket.socket, head: bytes) -> None:
        self._way, self.head = way, head
        self.heard = Heard()
        self._next_id, self._ask_s, self._since_s = 0, 0.0, 0.0
        way.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def header(self, name: str) -> str:
        """Return a header of the request, empty when it is not there."""
        for line in self.head.split(b"\r\n")[1:]:
            key, _, value = line.partition(b":")
            if key.strip().lower() == name.lower().encode():
                return value.strip().decode("latin-1")
        return ""

    def request_fault(self) -> str:
        """Return what is wrong with the request, or nothing."""
        words = self.head.split(b"\r\n")[0].split(b" ")
        if len(words) != 3 or words[0] != b"GET" or words[1] != b"/node" or words[2] != b"HTTP/1.1":
            return repr(self.head.split(b"\r\n")[0][:80].decode("latin-1"))
        if (
            self.header("upgrade").lower() != "websocket"
            or "upgrade" not in self.header("connection").lower()
        ):
            return "no upgrade to websocket"
        if self.header("sec-websocket-version") != "13":
            return f"version {self.header('sec-websocket-version')!r}"
        try:
            key = base64.b64decode(self.header("sec-websocket-key"), validate=True)
        except binascii.Error:
            key = b""
        return "" if len(key) == 16 else "a key that is not 16 bytes"

    def refuse(self) -> None:
        """Answer 401 and close."""
        self._write(b"HTTP/1.1 401 Unauthorized\r\nConnection: close\r\nContent-Length: 0\r\n\r\n")
        self._way.close()

    def upgrade(self) -> None:
        """Let it in, as far as the WebSocket goes."""
        key = self.header("sec-websocket-key").encode()
        accept = base64.b64encode(hashlib.sha1(key + _GUID).digest()).decode()
        self.heard.began_ns = time.monotonic_ns()
        self._since_s = self._ask_s = time.monotonic()
        self._write(
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Accept: {accept}\r\n\r\n".encode()
        )

    def say(self, message: Message) -> None:
        """Send a message."""
        self.frame(ws.BINARY, encode(message))

    def frame(self, kind: int, payload: bytes) -> None:
        """Send a frame."""
        self._write(ws.frame(kind, payload))

    def ask(self, times: int = 1) -> None:
        """Ask for the clock, so many times at once."""
        asks = b""
        for _ in range(times):
            self._next_id = (self._next_id + 1) & 0xFFFF
            self.heard.asked[self._next_id] = time.monotonic_ns()
            asks += ws.frame(ws.BINARY, encode(ClockAsk(id=self._next_id)))
        self._write(asks)

    def attend(
        self, seconds: float, *, ask: bool = True, until: Callable[[Heard], object] | None = None
    ) -> bool:
        """Listen for so long, asking for the clock; return early, True, when `until` holds."""
        end_s = time.monotonic() + seconds
        while not self.heard.gone:
            if until is not None and until(self.heard):
                return True
            now_s = time.monotonic()
            if now_s >= end_s:
                return False
            if ask and now_s >= self._ask_s:
                self._ask_s = now_s + (ASK_OFTEN_S if now_s - self._since_s < OFTEN_FOR_S else ASK_S)
                self.ask()
            self.read(min(LOOK_S, end_s - now_s))
        return until is not None and bool(until(self.heard))

    def read(self, within_s: float) -> None:
        """Read what is there, waiting at most so long."""
        if not select.select([self._way], [], [], within_s)[0]:
            return
        try:
            data = self._way.recv(65536)
        except OSError:
            data = b""
        if not data:
            self.heard.end()
            return
        for payload in self.heard.take(data, time.monotonic_ns()):
            self.frame(ws.PONG, payload)

    def close(self, code: int, reason: str, within_s: float = 2.0) -> None:
        """Close, and read to the end what still comes."""
        self._write(ws.close_frame(code, reason))
        end_s = time.monotonic() + within_s
        while self.heard.closed is None and not self.heard.gone and time.monotonic() < end_s:
            self.read(LOOK_S)
        with contextlib.suppress(OSError):
            self._way.shutdown(socket.SHUT_WR)
        while not self.heard.gone and time.monotonic() < end_s:
            self.read(LOOK_S)
        self._way.close()

    def reset(self) -> None:
        """Break off."""
        self._way.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._way.close()

    def acknowledge_late(self) -> None:
        """Let the kernel wait with its acknowledgements, as long as it may."""
        quick = getattr(socket, "TCP_QUICKACK", None)
        if quick is not None:
            self._way.setsockopt(socket.IPPROTO_TCP, quick, 0)

    def _write(self, data: bytes) -> None:
        try:
            self._way.sendall(data)
        except OSError:
            self.heard.end()


class Stage:
    """Where the node calls: one port of loopback, open or shut."""

    def __init__(self) -> None:
        self._door: socket.socket | None = None
        self._ways: list[socket.socket] = []
        self.first: Caller | None = None
        """One that called already and is to be accepted next."""
        self.port = 0
        self.open()

    def open(self) -> None:
        """Listen."""
        door = socket.create_server(("127.0.0.1", self.port), backlog=8)
        self.port = int(door.getsockname()[1])
        self._door = door

    def shut(self) -> None:
        """Listen no more: who calls is refused."""
        if self._door is not None:
            self._door.close()
            self._door = None

    def end(self) -> None:
        """Shut the door, and end what is still open."""
        self.shut()
        for way in self._ways:
            way.close()

    def accept(self, within_s: float) -> Caller | None:
        """Return the next that calls and asks for something, None when nobody does in time."""
        first, self.first = self.first, None
        if first is not None:
            return first
        end_s = time.monotonic() + within_s
        while self._door is not None and (left_s := end_s - time.monotonic()) > 0.0:
            if not select.select([self._door], [], [], min(left_s, 0.1))[0]:
                continue
            way, _ = self._door.accept()
            self._ways.append(way)
            head = _head(way)
            if head is not None:
                return Caller(way, head)
            way.close()
        return None


def _head(way: socket.socket) -> bytes | None:
    way.settimeout(HEAD_WITHIN_S)
    head = b""
    try:
        while b"\r\n\r\n" not in head and len(head) < 8192:
            data = way.recv(1)  # one by one: nothing that follows is taken
            if not data:
                return None
            head += data
    except OSError:
        return None
    return head
