"""The gateway's reading of WebSocket frames, beside another implementation of the same RFC."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.client import ClientProtocol
from websockets.frames import CloseCode, Frame, Opcode
from websockets.protocol import OPEN
from websockets.server import ServerProtocol
from websockets.uri import parse_uri

from brachium_nodes import websocket_frames as ws

LIMIT = 4096


def client_frame(kind: int, payload: bytes, *, final: bool = True, mask: bool = True, rsv: int = 0) -> bytes:
    size, key = len(payload), b"\x12\x34\x56\x78"
    length = bytes([size]) if size < 126 else b"\x7e" + struct.pack(">H", size & 0xFFFF)
    if size > 65535:
        length = b"\x7f" + struct.pack(">Q", size)
    head = bytes([(0x80 if final else 0) | rsv | kind, length[0] | (0x80 if mask else 0)]) + length[1:]
    return head + (key + ws.masked(payload, key) if mask else payload)


def judged(data: bytes) -> tuple[list[tuple[int, bytes]], int | None]:
    """What the library makes of the same bytes: frames put together, and its close code when it fails."""
    server = ServerProtocol(state=OPEN, max_size=LIMIT)
    server.receive_data(data)
    came: list[tuple[int, bytes]] = []
    message: list[bytes] = []
    kind = 0
    for frame in server.events_received():
        assert isinstance(frame, Frame)
        if frame.opcode >= Opcode.CLOSE:
            came.append((frame.opcode, bytes(frame.data)))
            continue
        kind = frame.opcode or kind
        message.append(bytes(frame.data))
        if frame.fin:
            came.append((kind, b"".join(message)))
            message = []
    failed = server.parser_exc is not None and server.close_sent
    return came, server.close_sent.code if failed and server.close_sent else None


def read(data: bytes, pieces: list[int]) -> tuple[list[tuple[int, bytes]], int | None]:
    reader, came, at = ws.FrameReader(LIMIT), [], 0
    for size in [*pieces, len(data)]:
        got, broken = reader.feed(data[at : at + size])
        came += [(c.kind, c.payload) for c in got]
        at += size
        if broken is not None:
            return came, broken.code
    return came, None


messages = st.tuples(st.sampled_from([ws.BINARY, ws.PING, ws.PONG]), st.binary(max_size=300))
pieces = st.lists(st.integers(0, 40), max_size=30)


@given(st.lists(messages, max_size=6), st.lists(st.binary(max_size=90), max_size=4), pieces)
def test_messages_come_whole_however_they_are_cut(sent, fragments, cuts) -> None:
    data, expected = b"", []
    for kind, payload in sent:
        payload = payload[:125] if kind >= ws.CLOSE else payload
        data += client_frame(kind, payload)
        expected.append((kind, payload))
    for number, part in enumerate(fragments):
        last = number == len(fragments) - 1
        data += client_frame(ws.BINARY if number == 0 else 0, part, final=last)
        if not last:
            data += client_frame(ws.PING, b"between")
            expected.append((ws.PING, b"between"))
    if fragments:
        expected.append((ws.BINARY, b"".join(fragments)))
    assert read(data, cuts) == (expected, None)
    assert judged(data) == (expected, None)


@given(st.binary(max_size=200), pieces)
def test_any_bytes_are_read_or_refused_and_cutting_changes_nothing(data: bytes, cuts: list[int]) -> None:
    assert read(data, cuts) == read(data, [])


WRONG = {
    "unmasked": (client_frame(2, b"x", mask=False), ws.PROTOCOL_ERROR),
    "reserved bit": (client_frame(2, b"x", rsv=0x40), ws.PROTOCOL_ERROR),
    "unknown opcode": (client_frame(3, b"x"), ws.PROTOCOL_ERROR),
    "unknown control opcode": (client_frame(11, b"x"), ws.PROTOCOL_ERROR),
    "ping in fragments": (client_frame(9, b"x", final=False), ws.PROTOCOL_ERROR),
    "ping too long": (client_frame(9, bytes(126)), ws.PROTOCOL_ERROR),
    "continuation of nothing": (client_frame(0, b"x"), ws.PROTOCOL_ERROR),
    "message inside a message": (client_frame(2, b"x", final=False) + client_frame(2, b"y"), 1002),
    "too large": (client_frame(2, bytes(LIMIT + 1)), ws.TOO_BIG),
    "far too large": (client_frame(2, bytes(70_000)), ws.TOO_BIG),
    "too large in fragments": (
        client_frame(2, bytes(4000), final=False) + client_frame(0, bytes(4000)),
        ws.TOO_BIG,
    ),
    "text that is none": (client_frame(1, b"\xff\xfe"), ws.BAD_TEXT),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_the_rfc_forbids_closes_with_its_code(name: str) -> None:
    data, code = WRONG[name]
    assert read(client_frame(2, b"good") + data, []) == ([(2, b"good")], code)
    if name != "text that is none":  # the library leaves text to its other layer
        assert judged(data)[1] == code


def test_a_length_is_written_as_shortly_as_it_can_be() -> None:
    long_way = b"\x82\xfe" + struct.pack(">H", 5) + bytes(4) + b"hello"
    assert read(long_way, [])[1] == ws.PROTOCOL_ERROR


@given(st.sampled_from([ws.BINARY, ws.PING]), st.binary(max_size=125))
def test_what_the_gateway_writes_the_library_reads(kind: int, payload: bytes) -> None:
    client = ClientProtocol(parse_uri("ws://x/"), state=OPEN)
    client.receive_data(
        ws.frame(kind, payload) + ws.frame(ws.BINARY, bytes(3000)) + ws.close_frame(4400, "é" * 90)
    )
    first, second, last = client.events_received()
    assert isinstance(first, Frame)
    assert isinstance(second, Frame)
    assert isinstance(last, Frame)
    assert (first.opcode, bytes(first.data), len(second.data), last.opcode) == (
        kind,
        payload,
        3000,
        Opcode.CLOSE,
    )


def test_close_codes() -> None:
    assert ws.close_code(b"") == 1005
    assert ws.close_code(struct.pack(">H", CloseCode.NORMAL_CLOSURE) + b"bye") == 1000
    assert ws.close_code(struct.pack(">H", 4409)) == 4409
    for wrong in (b"x", struct.pack(">H", 1005), struct.pack(">H", 999), struct.pack(">H", 1000) + b"\xff"):
        with pytest.raises(ws.Broken):
            ws.close_code(wrong)


def test_a_limit_beyond_two_bytes_of_length_is_refused() -> None:
    with pytest.raises(ValueError, match="65535"):
        ws.FrameReader(1 << 16)
