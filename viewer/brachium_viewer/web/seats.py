"""The screens that watch: each has room for the newest frame and the newest state, and for nothing older.

So a slow screen skips frames, and neither grows a queue nor holds up another.
"""

import asyncio
from collections import deque

ANSWERS = 64
"""Answers, and states told before one, wait for their screen; one that asks and does not read loses its
oldest."""


class Seat:
    """One screen's place. Answers are all given, in order, each after the state that was told before it; of
    frames and of states since the last answer only the newest."""

    def __init__(self) -> None:
        self._answers: deque[str] = deque(maxlen=ANSWERS)
        self._state: str | None = None
        self._frame: str | None = None
        self._something = asyncio.Event()
        self.skipped = 0

    def put_frame(self, text: str) -> None:
        """Give the newest frame; one that was not yet taken is forgotten."""
        self.skipped += self._frame is not None
        self._frame = text
        self._something.set()

    def put_state(self, text: str) -> None:
        """Give the newest state."""
        self._state = text
        self._something.set()

    def put_answer(self, text: str) -> None:
        """Give an answer; a state from before it never comes after it."""
        if self._state is not None:
            self._answers.append(self._state)
            self._state = None
        self._answers.append(text)
        self._something.set()

    async def take(self) -> list[str]:
        """Return what is there to be sent, as soon as something is."""
        await self._something.wait()
        self._something.clear()
        out = [*self._answers, *(text for text in (self._state, self._frame) if text is not None)]
        self._answers.clear()
        self._state = self._frame = None
        return out
