"""WebSocket frames (RFC 6455, section 5) as a server reads and writes them: bytes in, messages out.

A gateway reads thousands of small frames a second; this does no more for each than the RFC asks.
"""

from struct import pack, unpack_from
from typing import NamedTuple

try:
    from websockets.speedups import apply_mask
except ImportError:  # built without its compiled part
    from websockets.utils import apply_mask

masked = apply_mask
"""Masks bytes, or unmasks them, with a key of 4."""

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
PROTOCOL_ERROR, BAD_TEXT, TOO_BIG = 1002, 1007, 1009
MAX_CONTROL = 125
_CONTINUED = 0
_KINDS = (_CONTINUED, TEXT, BINARY, CLOSE, PING, PONG)
_CODES = (1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 1012, 1013, 1014)


class Broken(ValueError):
    """The peer does not keep to the protocol: close with `code`."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class Came(NamedTuple):
    """One message or control frame; the text of a text message is UTF-8."""

    kind: int
    payload: bytes


class FrameReader:
    """Puts a client's bytes together. A message may come in any pieces, and in fragments."""

    def __init__(self, max_bytes: int) -> None:
        if max_bytes >= 1 << 16:
            raise ValueError(f"messages of {max_bytes} bytes are not taken here; give at most 65535")
        self._max = max_bytes
        self._rest = b""
        self._message: bytearray | None = None
        self._kind = BINARY

    def feed(self, data: bytes) -> tuple[list[Came], Broken | None]:
        """Return what is complete with these bytes, and what was wrong after it; then feed no more."""
        if self._rest:
            data, self._rest = self._rest + data, b""
        plain = self._plain(data)
        if plain is not None:
            return [plain], None
        came: list[Came] = []
        at = 0
        try:
            while (end := self._frame_end(data, at)) is not None:
                whole = self._frame(data, at, end)
                at = end
                if whole is not None:
                    came.append(whole)
        except Broken as broken:
            return came, broken
        self._rest = data[at:]
        return came, None

    def _plain(self, data: bytes) -> Came | None:
        """Return the message when the bytes are one, binary and whole, as nearly always: a quick look."""
        have = len(data)
        if have < 8 or data[0] != 0x80 | BINARY or self._message is not None:
            return None
        size, head = data[1] - 128, 6
        if size == 126:
            size, head = data[2] << 8 | data[3], 8
            if size < 126:
                return None
        if have != head + size or size > self._max:
            return None
        return Came(BINARY, masked(data[head:], data[head - 4 : head]))

    def _frame_end(self, data: bytes, at: int) -> int | None:
        """Check the head of the frame at `at`; return where the frame ends, None when it is not all here."""
        have = len(data) - at
        if have < 2:
            return None
        first, second = data[at], data[at + 1]
        kind, size = first & 15, second & 127
        if first & 0x70 or kind not in _KINDS:
            raise Broken(PROTOCOL_ERROR, "reserved bits or an unknown opcode")
        if not second & 128:
            raise Broken(PROTOCOL_ERROR, "a client's frames are masked")
        if kind >= CLOSE:
            if size > MAX_CONTROL or not first & 128:
                raise Broken(PROTOCOL_ERROR, "control frames are short and whole")
        elif (kind == _CONTINUED) != (self._message is not None):
            raise Broken(PROTOCOL_ERROR, "a fragment without its beginning, or a message inside another")
        head = 6
        if size >= 126:
            head = 8 if size == 126 else 14
            if have < head - 4:
                return None
            size = unpack_from(">H" if head == 8 else ">Q", data, at + 2)[0]
            if size < (126 if head == 8 else 65536):
                raise Broken(PROTOCOL_ERROR, "a length is written as shortly as it can be")
        if size + len(self._message or b"") > self._max:
            raise Broken(TOO_BIG, f"messages have at most {self._max} bytes")
        return at + head + size if have >= head + size else None

    def _frame(self, data: bytes, at: int, end: int) -> Came | None:
        size = data[at + 1] & 127
        begin = at + (6 if size < 126 else 8)  # none is longer than 65535
        payload = masked(data[begin:end], data[begin - 4 : begin])
        first = data[at]
        kind = first & 15
        if kind >= CLOSE:
            return Came(kind, payload)
        if self._message is None and first & 128:
            return Came(kind, _checked(kind, payload))
        if self._message is None:
            self._message, self._kind = bytearray(), kind
        self._message += payload
        if not first & 128:
            return None
        payload, self._message = bytes(self._message), None
        return Came(self._kind, _checked(self._kind, payload))


def _checked(kind: int, payload: bytes) -> bytes:
    if kind == TEXT:
        try:
            payload.decode()
        except UnicodeDecodeError:
            raise Broken(BAD_TEXT, "text is UTF-8") from None
    return payload


def frame(kind: int, payload: bytes) -> bytes:
    """Return a server's frame."""
    size = len(payload)
    if size < 126:
        return bytes((0x80 | kind, size)) + payload
    return pack(">BBH", 0x80 | kind, 126, size) + payload


def close_frame(code: int, reason: str) -> bytes:
    """Return a server's close frame; the reason is cut to what fits."""
    said = reason.encode()[: MAX_CONTROL - 2].decode(errors="ignore")  # not within a character
    return frame(CLOSE, pack(">H", code) + said.encode())


def close_code(payload: bytes) -> int:
    """Return the code in a close frame, 1005 when there is none. Raises Broken."""
    if not payload:
        return 1005
    code = unpack_from(">H", payload)[0] if len(payload) >= 2 else 0
    if code not in _CODES and not 3000 <= code < 5000:
        raise Broken(PROTOCOL_ERROR, "a close code that may not be sent")
    _checked(TEXT, payload[2:])
    return int(code)
