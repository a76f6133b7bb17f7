"""Does somebody else send with the ids of our arm: of two senders no machine could tell who is right."""

from collections import deque

REMEMBERED = 256
"""Own frames that may still come back: more than a second of an arm's, on an interface that echoes."""


class OtherSender(RuntimeError):
    """Frames with our ids come from elsewhere; the text says which and what to do."""


class OwnIds:
    """A run of ids that is ours alone.

    `echoes`: the interface gives our own frames back, once each. What comes back is told from a stranger's by
    counting: even a frame alike in every bit is a stranger's when we sent it once and it comes twice.
    """

    def __init__(self, ids: range, *, echoes: bool) -> None:
        self._ids, self._echoes = ids, echoes
        self._sent: deque[tuple[int, bytes]] = deque(maxlen=REMEMBERED)

    def sent(self, number: int, data: bytes) -> None:
        """Remember a frame that went out."""
        if self._echoes:
            self._sent.append((number, data))

    def is_strange(self, number: int, data: bytes | bytearray) -> bool:
        """Return whether a frame that came has one of our ids and is not ours."""
        if number not in self._ids:
            return False
        try:
            self._sent.remove((number, bytes(data)))
        except ValueError:
            return True
        return False
