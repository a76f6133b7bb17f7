"""What is said to a SlimeVR tracker, as bytes. Its receive buffer holds 128 of them."""

from struct import pack

WELCOME = b"\x03Hey OVR =D 5".ljust(64, b"\0")
"""The answer to a handshake: it alone has its type in the first byte. Who sends it becomes the server."""
HEARTBEAT = pack(">IQ", 1, 0)
"""A tracker answers it at once; after 3 s without any it seeks another server."""
_BUNDLES, _PACKED = 1, 2
FEATURES = pack(">IQB", 22, 0, _BUNDLES | _PACKED)
"""Several packets may come in one datagram, and rotation and acceleration in one packet."""


def ping(ping_id: int) -> bytes:
    """Return what the tracker sends back as it came; `ping_id` is a u32."""
    return pack(">IQI", 10, 0, ping_id)


def known(sensor: int, status: int) -> bytes:
    """Return that a sensor's state was taken; without it the tracker tells it again each second."""
    return pack(">IBB", 15, sensor, status)
