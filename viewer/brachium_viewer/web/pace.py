"""When a frame goes out: as soon as a skeleton came, and no more often than screens are promised.

Looked for at fixed instants, a skeleton would wait half its period for nothing; told of each message, the
server of a full room would do nothing but wake up.
"""

import asyncio
import contextlib

from brachium_wire.bus import Inbox


class Pace:
    """A clock of debts, s: what a frame is late is taken off the pause before the next. Pure.

    So skeletons at 50 Hz go out after 40, 40 and 20 ms: each the moment it comes, and 30 in a second.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s, self._due_s = 1.0 / rate_hz, 0.0

    def pause_s(self, now_s: float) -> float:
        """Return how long nothing goes out any more."""
        return max(0.0, self._due_s - now_s)

    def gone(self, now_s: float) -> None:
        """Take note of a frame. A debt of more than a period is forgotten: nobody wants two at once."""
        self._due_s = max(self._due_s + self._period_s, now_s)


class Bell:
    """Rings in the event loop, once, at the first message that an inbox receives after the bell was armed."""

    def __init__(self, inbox: Inbox) -> None:
        """Must be made in the event loop that waits for it."""
        self._loop, self._rung, self._armed = asyncio.get_running_loop(), asyncio.Event(), False
        inbox.on_arrival(self._pull)

    def arm(self) -> None:
        """Wait for what comes from now on; drain the inbox afterwards: what waits in it does not ring."""
        self._rung.clear()
        self._armed = True

    async def rings(self, timeout_s: float) -> bool:
        """Return True as soon as it rings, False after `timeout_s`."""
        try:
            async with asyncio.timeout(timeout_s):
                return await self._rung.wait()
        except TimeoutError:
            return False
        finally:
            self._armed = False

    def _pull(self) -> None:
        """Run on Zenoh's thread."""
        if self._armed:
            self._armed = False
            with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                self._loop.call_soon_threadsafe(self._rung.set)
