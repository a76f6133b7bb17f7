"""How a node comes to its gateway. Loaded when it must, given back once it has joined: memory is short."""

import asyncio
import binascii
import gc
import hashlib
import os

from keeping import calibration
from web_socket import WebSocket

FIRMWARE = "brachium 0.1"
_WITHIN_S = 5
_GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


async def join(about, sensor, boot, writer):
    """Find the gateway, connect and say hello; return the connection and the gateway's first message.

    Raises OSError, EOFError, ValueError or TimeoutError.
    """
    url, seek = about["gateway"], about["discovery"]
    if not url:
        from discovery import discover

        url = await discover(about["id"], about["token"], seek["address"], seek["port"])
    host, port, path = address_of(url)
    gc.collect()
    reader, stream = await asyncio.wait_for(asyncio.open_connection(host, port), _WITHIN_S)
    try:
        await asyncio.wait_for(_handshake(reader, stream, host, port, path, about["token"]), _WITHIN_S)
        link = WebSocket(reader, stream, writer)
        gc.collect()
        await link.send(_hello, about, sensor, boot)
        gc.collect()
        return link, await asyncio.wait_for(link.receive(), _WITHIN_S)
    except BaseException:
        stream.s.close()  # a Stream's own close() does nothing
        raise


def address_of(url):
    """Return host, port and path of ws://host:port/path, or raise ValueError."""
    if not url.startswith("ws://"):
        raise ValueError("no gateway's address: %r" % url)
    place, _, path = url[5:].partition("/")
    host, _, port = place.rpartition(":")
    if not host:
        host, port = place, "80"
    return host, int(port), "/" + path


async def _handshake(reader, stream, host, port, path, token):
    try:
        stream.s.setsockopt(6, 1, 1)  # TCP_NODELAY: clock answers must not wait for acknowledgements
    except (AttributeError, OSError):
        pass
    key = binascii.b2a_base64(os.urandom(16)).strip()
    stream.write(
        "GET %s HTTP/1.1\r\nHost: %s:%d\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: %s\r\nAuthorization: Bearer %s\r\n\r\n"
        % (path, host, port, key.decode(), token)
    )
    await stream.drain()
    status = await reader.readline()
    if b" 401" in status:
        raise OSError("the gateway does not know this node's token")
    if b" 101" not in status:
        raise OSError("no gateway answers there: %r" % status[:40])
    expected = binascii.b2a_base64(hashlib.sha1(key + _GUID).digest()).strip()
    agreed = False
    while True:
        line = (await reader.readline()).strip()
        if not line:
            break
        name, _, value = line.partition(b":")
        if name.lower() == b"sec-websocket-accept":
            agreed = value.strip() == expected
    if not agreed:
        raise OSError("no WebSocket answers there")


def _hello(writer, about, sensor, boot):
    driver, kept = sensor.driver, calibration()
    writer.begin(7 + driver.magnetometer + driver.big_endian + bool(kept), "hello/1")
    writer.text("id", about["id"])
    writer.whole("boot", boot)
    writer.text("chip", driver.chip)
    writer.real("rate", sensor.rate_hz)
    writer.text("fw", FIRMWARE)
    writer.text("org", about["origin"])
    if driver.magnetometer:
        writer.yes("mag")
    if driver.big_endian:
        writer.yes("be")
    if kept:
        writer.group("cal", len(kept))
        for name, values in kept.items():
            writer.reals(name, values)
    writer.group("sc", 3 if driver.magnetometer else 2)
    writer.reals("acc", (driver.acc_step,) * 3)
    writer.reals("gyr", (driver.gyr_step,) * 3)
    if driver.magnetometer:
        writer.reals("mag", driver.mag_step)
