"""An event loop that reads what came from many sockets together, instead of waking up for each."""

import asyncio
import selectors
import time

REST_S = 0.002
"""From one look at the sockets to the next, when the last one found something. A socket that was quiet for
so long is heard at once."""


class PacedSelector(selectors.DefaultSelector):
    """Waits as any selector does, but looks again no sooner than `REST_S` after it found something.

    Each wake-up costs as much as a small message: a thousand nodes' messages a second would cost twice.
    """

    def __init__(self) -> None:
        super().__init__()
        self._found_s = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return the sockets that are ready, with what for; empty when `timeout` s passed."""
        if timeout is None or timeout > 0.0:
            rest_s = self._found_s + REST_S - time.monotonic()
            if rest_s > 0.0:
                time.sleep(rest_s if timeout is None else min(rest_s, timeout))
                timeout = None if timeout is None else max(timeout - rest_s, 0.0)
        ready = super().select(timeout)
        if ready:
            self._found_s = time.monotonic()
        return ready


def paced_loop() -> asyncio.AbstractEventLoop:
    """Return a new event loop for many sockets."""
    return asyncio.SelectorEventLoop(PacedSelector())
