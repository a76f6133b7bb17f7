"""What the router is told: settings to the JSON5 that Zenoh reads; a zenohd takes the same text. Pure."""

import ipaddress
import json
from dataclasses import dataclass
from typing import Any

from brachium_wire import keys
from brachium_wire.topics import TOPICS

LARGEST_MESSAGE = 2 << 20
"""Bytes of one transport message; above every topic's own limit, far below Zenoh's 1 GiB."""
DATA_QUEUE = 16
"""Batches of 64 kB that may wait for a reader before messages are dropped: Zenoh's most. A tick of a hundred
arms is more than its usual two."""
OTHER_LIMIT = 262_144
"""Bytes of a question or an answer, when no topic of the table is larger."""


class BadRouterSettings(ValueError):
    """A setting that the router cannot be started with; the text says what to write instead."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RouterSettings:
    """One router. `bind` is the address of one interface, never all of them."""

    bind: str = "127.0.0.1"
    port: int = 7447
    room: str = keys.DEFAULT_ROOM
    """The room in which the router shows its own health."""
    max_sessions: int = 256
    """Programs attached at once; one more is refused."""
    users_file: str | None = None
    """A file of lines `user:password`; with it, only these may attach."""


def endpoint(settings: RouterSettings) -> str:
    """Return the endpoint a client on the same host dials, or raise BadRouterSettings."""
    address = _address(settings.bind)
    host = f"[{address}]" if address.version == 6 else str(address)
    if not 1 <= settings.port <= 65535:
        raise BadRouterSettings(f"port {settings.port} cannot be used: write 1 to 65535")
    return f"tcp/{host}:{settings.port}"


def router_json5(settings: RouterSettings) -> str:
    """Return the router's whole configuration as JSON5, or raise BadRouterSettings."""
    if settings.max_sessions < 1:
        raise BadRouterSettings(f"max_sessions {settings.max_sessions} cannot be used: write 1 or more")
    transport: dict[str, Any] = {
        "unicast": {"max_sessions": settings.max_sessions, "accept_pending": 64, "accept_timeout": 5000},
        "link": {
            "protocols": ["tcp"],
            "rx": {"max_message_size": LARGEST_MESSAGE},
            "tx": {"queue": {"size": {"data": DATA_QUEUE}}},
        },
        "shared_memory": {"enabled": False},
    }
    if settings.users_file is not None:
        transport["auth"] = {"usrpwd": {"dictionary_file": settings.users_file}}
    return json.dumps(
        {
            "mode": "router",
            "listen": {"endpoints": [endpoint(settings)], "exit_on_failure": True},
            # Clients dial the router by its address: nothing is announced, start-up waits for nobody.
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
            "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}},
            "transport": transport,
            "low_pass_filter": size_limits(),
        },
        indent=2,
    )


def size_limits() -> list[dict[str, Any]]:
    """Return the filters that keep each topic within the size that the topic table promises."""
    limits = [
        {
            "id": f"size-{row.name}",
            "flows": ["ingress"],
            "messages": ["put"],
            "key_exprs": [_key_expression(row.pattern)],
            "size_limit": row.max_bytes,
        }
        for row in TOPICS.values()
    ]
    rest = {
        "id": "size-other",
        "flows": ["ingress"],
        "messages": ["delete", "query", "reply"],
        "key_exprs": ["**"],
        "size_limit": max(OTHER_LIMIT, *(row.max_bytes for row in TOPICS.values())),
    }
    return [*limits, rest]


def _key_expression(pattern: str) -> str:
    chunks = ["*" if chunk.startswith("<") else chunk for chunk in pattern.split("/")]
    return "/".join([keys.ROOT, "*", *chunks])


def _address(bind: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    what = "write the address of one interface, such as 127.0.0.1 or 192.168.1.10"
    try:
        address = ipaddress.ip_address("127.0.0.1" if bind == "localhost" else bind)
    except ValueError:
        raise BadRouterSettings(f"bind {bind!r} is not an address: {what}") from None
    if address.is_unspecified:
        raise BadRouterSettings(f"bind {bind!r} would open every interface of this machine: {what}")
    return address
