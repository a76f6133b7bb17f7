"""How long a node waits before it connects again: longer each time, with some chance in it. Pure.

The firmware's rule (firmware/node.py). A constant wait would bring every node of a room back in step: all of
them lose a gateway that starts anew at the same instant.
"""

import random

FIRST_S = 0.5
LONGEST_S = 30.0
"""What a node waits between two tries if nothing else is configured."""
STEADY_S = 3.0
"""Who was welcome for so long is soon back, once cut off."""


class Pauses:
    """One node's waits. They are its own, and the same in every run: `node` is their seed.

    They grow once it has been let in. Before that the wearer has not begun to move: who starts everything at
    once is not to wait for nodes that were there before their gateway.
    """

    def __init__(self, node: str) -> None:
        self._chance = random.Random(node)
        self._pause_s = FIRST_S
        self._joined_s: float | None = None
        self._known = False

    def joined(self, now_s: float) -> None:
        """Take that the node was let in now."""
        self._joined_s, self._known = now_s, True

    def next_s(self, now_s: float, wanted_s: float = 0.0) -> float:
        """Return how long to wait from now on; `wanted_s` is what the gateway asked for."""
        if self._joined_s is not None and now_s - self._joined_s > STEADY_S:
            self._pause_s = FIRST_S
        pause_s, self._joined_s = self._pause_s, None
        if self._known:
            self._pause_s = min(2.0 * pause_s, LONGEST_S)
        return max(min(wanted_s, LONGEST_S), pause_s * (0.5 + self._chance.random()))
