"""Asks a service for what takes a while, and shows how far it is until the answer comes."""

import threading
from collections.abc import Callable
from typing import Any

from brachium_wire.bus import Bus, Inbox
from brachium_wire.codec import decode, encode
from brachium_wire.messages import Answer, Calibration, Command

LOOK_S = 0.1


def asked(
    bus: Bus,
    key: str,
    arguments: dict[str, Any],
    news: Inbox,
    show: Callable[[Calibration], None],
    stop: threading.Event,
    timeout_s: float,
) -> Answer | None:
    """Return the answer, or None when nobody gave one or `stop` was set; `news` holds the progress."""
    answered = threading.Event()
    found: list[bytes | None] = []

    def ask() -> None:
        found.append(bus.ask(key, encode(Command(arguments=arguments)), timeout_s=timeout_s))
        answered.set()

    threading.Thread(target=ask, daemon=True).start()
    while True:
        over = answered.is_set() or stop.is_set()  # looked at first: what was told before the answer is shown
        for _, payload in news.drain():
            show(decode(payload, Calibration))
        if over:
            break
        news.wait(LOOK_S)
    return decode(found[0], Answer) if found and found[0] is not None else None
