"""What an enemy of the gateway sends, drawn from a seed: handshakes and frames that are wrong in every way.

Bytes in no particular order come from Random alone: the same seed makes the same attack.
"""

import base64
import struct
from collections import Counter
from collections.abc import Callable
from random import Random

from brachium_nodes.gateway import PATH
from brachium_nodes.node_frames import MAX_FRAME_BYTES, Batch, Bye, ClockAnswer, Hello, NodeStatus
from brachium_nodes.websocket_frames import BINARY, CLOSE, PING, PONG, TEXT, masked
from brachium_wire.codec import encode

FRAMES_A_CONNECTION = 100
"""On average; a frame that breaks the WebSocket itself ends it sooner."""
NAN, INFINITY = struct.pack("<f", float("nan")), struct.pack("<f", float("inf"))


def client_frame(kind: int, payload: bytes, key: bytes, *, first: int = 0x80, mask: bool = True) -> bytes:
    """Return a client's frame; `first` holds the bits beside the opcode."""
    size = len(payload)
    length = bytes([size]) if size < 126 else b"\x7e" + struct.pack(">H", size)
    head = bytes([first | kind, length[0] | (0x80 if mask else 0)]) + length[1:]
    return head + (key + masked(payload, key) if mask else payload)


class Enemy:
    """One attack. `sent` counts what was made, by its name."""

    def __init__(self, seed: int, token: str, node: str) -> None:
        self._random = Random(seed)
        self._token, self._node = token, node
        self._sequence, self._us = 0, 1 << 33
        self.sent: Counter[str] = Counter()
        still = struct.pack("<3f", 0.0, 0.0, 9.8)
        self._good = Batch(sequence=0, device_us=0, offsets=bytes(4), acc=still, gyr=still)
        self._kinds = (self._messages, self._messages, self._messages, self._fragments, self._controls)

    def handshake(self) -> bytes:
        """Return a request that must not be let in, or must not do harm."""
        random = self._random
        good = request(self._token)
        name, made = random.choice(
            (
                ("handshake: noise", random.randbytes(random.randrange(1, 600))),
                ("handshake: one byte changed", self._changed(good)),
                ("handshake: cut short", good[: random.randrange(1, len(good))]),
                ("handshake: wrong token", request(f"{random.getrandbits(64):x}")),
                ("handshake: elsewhere", good.replace(PATH.encode(), b"/" + b"x" * random.randrange(500))),
                ("handshake: endless", b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 2000),
                ("handshake: TLS", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + random.randbytes(200)),
            )
        )
        self.sent[name] += 1
        return made

    def connection(self) -> tuple[bytes, int]:
        """Return all that one connection sends, and how many frames these are."""
        random = self._random
        self._sequence, self._us = 0, self._us + 1_000_000_000
        parts = [request(self._token)]
        if random.random() < 0.1:
            parts += [self._message("before hello", random.randbytes(random.randrange(200)))]
            return b"".join(parts), 1
        parts.append(self._frame(BINARY, encode(self._hello())))
        count = random.randrange(1, 2 * FRAMES_A_CONNECTION)
        parts += [random.choice(self._kinds)() for _ in range(count)]
        if random.random() < 0.5:
            parts += [self._fatal()]
            count += 1
        parts.append(self._frame(BINARY, encode(Bye(next_sequence=self._sequence))))
        return b"".join(parts), count

    def _hello(self) -> Hello:
        return Hello(node=self._node, boot=self._random.getrandbits(32), chip="x", rate_hz=100.0)

    def _frame(self, kind: int, payload: bytes, *, first: int = 0x80, mask: bool = True) -> bytes:
        return client_frame(kind, payload, self._random.randbytes(4), first=first, mask=mask)

    def _message(self, name: str, payload: bytes, kind: int = BINARY) -> bytes:
        self.sent[name] += 1
        return self._frame(kind, payload)

    def _changed(self, good: bytes) -> bytes:
        made = bytearray(good)
        made[self._random.randrange(len(made))] = self._random.getrandbits(8)
        return bytes(made)

    def _messages(self) -> bytes:
        name, make = self._random.choice(MESSAGES)
        return self._message(name, make(self))

    def _fragments(self) -> bytes:
        """Return one message in many pieces, some of them empty, with pings between."""
        self.sent["fragmented"] += 1
        payload = encode(self.good())
        cuts = sorted(self._random.randrange(len(payload)) for _ in range(self._random.randrange(1, 12)))
        made = [self._frame(BINARY, payload[: cuts[0]], first=0)]
        for begin, end in zip(cuts, [*cuts[1:], len(payload)], strict=True):
            made += [self._frame(PING, b"?")] if self._random.random() < 0.2 else []
            made += [self._frame(0, payload[begin:end], first=0x80 if end == len(payload) else 0)]
        return b"".join(made)

    def _controls(self) -> bytes:
        kind = self._random.choice((PING, PONG))
        return self._message("control", self._random.randbytes(self._random.randrange(126)), kind)

    def _fatal(self) -> bytes:
        """Return what ends the connection."""
        size = struct.pack(">Q", self._random.getrandbits(64))
        name, made = self._random.choice(
            (
                ("unmasked", self._frame(BINARY, b"x", mask=False)),
                ("oversize", self._frame(BINARY, bytes(MAX_FRAME_BYTES + 1))),
                ("oversize by its head", b"\x82\xff" + size + b"abcd"),
                (
                    "oversize in pieces",
                    self._frame(BINARY, bytes(4000), first=0) + self._frame(0, bytes(4000)),
                ),
                ("bad UTF-8", self._frame(TEXT, b"\xff\xfe\xc0")),
                ("reserved bits", self._frame(BINARY, b"x", first=0x80 | self._random.choice((16, 32, 64)))),
                ("unknown opcode", self._frame(self._random.choice((3, 7, 11, 15)), b"x")),
                ("long control", self._frame(PING, bytes(126))),
                ("lost continuation", self._frame(0, b"x")),
                ("bad close", self._frame(CLOSE, self._random.choice((b"x", b"\x03\xed", b"\x03\xe8\xff")))),
                ("cut off", self._frame(BINARY, bytes(100))[:50]),
                ("noise", self._random.randbytes(self._random.randrange(1, 300))),
            )
        )
        self.sent[name] += 1
        return made

    def good(self) -> Batch:
        """Return a batch that is right."""
        self._sequence += 1
        self._us += 10_000
        return replaced(self._good, sequence=self._sequence, device_us=self._us)

    def mutated(self) -> bytes:
        """Return a frame that was right before a byte of it changed."""
        kinds = (
            self.good(),
            NodeStatus(battery_v=3.9),
            self._hello(),
            ClockAnswer(id=1, came_us=1, left_us=2),
        )
        return self._changed(encode(self._random.choice(kinds[:2])))

    def noise(self) -> bytes:
        """Return bytes that are probably nothing."""
        return self._random.randbytes(self._random.randrange(300))

    def number(self) -> int:
        """Return a number that is large, or negative."""
        return self._random.choice((-1, 1 << 48, 1 << 53, (1 << 63) - 1, (1 << 64) - 1))


def replaced(batch: Batch, **fields: object) -> Batch:
    """Return the batch with other fields."""
    import msgspec

    return msgspec.structs.replace(batch, **fields)


def request(token: str) -> bytes:
    """Return the upgrade that a node asks for."""
    key = base64.b64encode(bytes(16)).decode()
    return (
        f"GET {PATH} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\nAuthorization: Bearer {token}\r\n\r\n"
    ).encode()


def _wrong(**fields: object) -> Callable[[Enemy], bytes]:
    return lambda enemy: encode(replaced(enemy.good(), **fields))


def _raw(payload: bytes) -> Callable[[Enemy], bytes]:
    return lambda _: payload


MESSAGES: tuple[tuple[str, Callable[[Enemy], bytes]], ...] = (
    ("good", lambda enemy: encode(enemy.good())),
    ("NaN", _wrong(acc=NAN * 3)),
    ("infinity", _wrong(gyr=INFINITY * 3)),
    ("beyond belief", _wrong(acc=struct.pack("<3f", 1e30, 0.0, 0.0))),
    ("wrong shape", _wrong(acc=bytes(11))),
    ("half a batch", _wrong(acc=None)),
    ("no samples", _wrong(offsets=b"")),
    ("times that stand", _wrong(offsets=bytes(8))),
    ("replayed", _wrong(sequence=1, device_us=1)),
    ("in the future", _wrong(device_us=1 << 52)),
    ("numbers without end", lambda enemy: encode(replaced(enemy.good(), sequence=enemy.number()))),
    ("late", _wrong(late=True, sequence=0)),
    ("answer to no question", lambda enemy: encode(ClockAnswer(id=enemy.number(), came_us=5, left_us=1))),
    ("impossible status", lambda _: encode(NodeStatus(battery_v=float("nan"), rssi_dbm=1e9))),
    ("unknown kind", _raw(b"\x81\xa1m\xa8spoon/99")),
    ("no kind", _raw(b"\x81\xa1n\x01")),
    ("bad MessagePack", _raw(b"\xc1")),
    ("deep", _raw(b"\x91" * 3000)),
    ("claims millions", _raw(b"\xdf\xff\xff\xff\xff")),
    ("claims gigabytes", _raw(b"\x81\xa1m\xc6\xff\xff\xff\xff")),
    ("bad key", _raw(b"\x81\xc4\x02xx\x01")),
    ("bad UTF-8 in MessagePack", _raw(b"\x81\xa1m\xa3\xff\xfe\xfd")),
    ("nothing", _raw(b"")),
    ("mutated", Enemy.mutated),
    ("noise in a message", Enemy.noise),
)
"""Messages that leave the WebSocket whole: what each is, and how it is made."""
