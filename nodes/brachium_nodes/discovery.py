"""Nodes that ask the network for their gateway are answered, with a proof that their gateway it is.

docs/node-protocol.md has the two messages. Who does not know a node's token cannot pass for its gateway.
"""

import asyncio
import hashlib
import hmac
import ipaddress
import json
import logging
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import cast

log = logging.getLogger(__name__)

PORT = 8766
LONGEST_QUESTION = 256
_TEXT = 64


def answer(question: bytes, url: str, token_sha256_of: Callable[[str], str | None]) -> bytes | None:
    """Return what to answer, or None for what is no question or whose node is not known here."""
    if len(question) > LONGEST_QUESTION:
        return None
    try:
        asked = json.loads(question)
    except (ValueError, RecursionError):
        return None
    if not isinstance(asked, dict) or asked.get("m") != "seek/1":
        return None
    node, nonce = asked.get("id"), asked.get("nonce")
    if not isinstance(node, str) or not isinstance(nonce, str) or not 8 <= len(nonce) <= _TEXT:
        return None
    key = token_sha256_of(node)
    if key is None:
        return None
    proof = hmac.new(key.encode(), f"{nonce} {url}".encode(), hashlib.sha256).hexdigest()
    return json.dumps({"m": "here/1", "url": url, "proof": proof}).encode()


class _Answering(asyncio.DatagramProtocol):
    def __init__(self, url: str, token_sha256_of: Callable[[str], str | None]) -> None:
        self._url, self._token_sha256_of = url, token_sha256_of
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the way back."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: tuple[str | int, ...]) -> None:
        """Answer whoever asks for a gateway that is his."""
        said = answer(data, self._url, self._token_sha256_of)
        if said is not None and self._transport is not None:
            self._transport.sendto(said, addr)


@asynccontextmanager
async def answer_seekers(
    address: str, port: int | None, url: str, token_sha256_of: Callable[[str], str | None]
) -> AsyncIterator[None]:
    """Answer on the broadcast address that reaches `address` as long as the context lasts; port None: do not.

    Where that cannot be had it is logged once: nodes then need the gateway's address typed in.
    """
    if port is None:
        yield
        return
    transport: asyncio.BaseTransport | None = None
    try:
        transport = await _listen(address, port, lambda: _Answering(url, token_sha256_of))
    except OSError as error:
        log.warning(
            "nodes that seek a gateway by UDP port %d are not heard (%s): give this gateway another "
            "--discovery-port and its nodes the same (discovery.port in their brachium.json), or write "
            '"gateway": "%s" there',
            port,
            error.strerror or error,
            url,
        )
    try:
        yield
    finally:
        if transport is not None:
            transport.close()


def broadcast_address(address: str) -> str:
    """Return where broadcasts arrive that reach the IPv4 address of an interface."""
    return "127.255.255.255" if ipaddress.ip_address(address).is_loopback else "255.255.255.255"


async def _listen(
    address: str, port: int, protocol: Callable[[], asyncio.DatagramProtocol]
) -> asyncio.BaseTransport:
    here = ipaddress.ip_address(address)
    if here.version != 4:
        raise OSError(f"{address} is no IPv4 address, and only that has broadcasts")
    door = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        door.setblocking(False)
        door.bind((broadcast_address(address), port))
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(protocol, sock=door)
    except OSError:
        door.close()
        raise
    return transport
