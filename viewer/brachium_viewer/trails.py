"""The path that a hand has left in the last seconds. Pure."""

from collections import deque

import numpy as np

from brachium_viewer.drawings import Colour, Floats, Trail

TRAIL_S = 4.0
STEP_S = 0.04
"""The path of a reach is smooth at 25 points a second."""
BREAK_S = 0.3
"""Where nothing was measured for so long, no line is drawn."""
FADES = ((TRAIL_S / 3.0, 220), (2.0 * TRAIL_S / 3.0, 120), (TRAIL_S, 55))
"""Opacity up to an age in s: the older, the fainter."""


class HandTrail:
    """One hand's path; times are s on the picture's axis, and a time that goes back begins it anew."""

    def __init__(self, colour: Colour) -> None:
        self._colour = colour
        self._points: deque[tuple[float, Floats]] = deque()

    def take(self, time_s: float, hand: Floats | None) -> Trail | None:
        """Return the path as it is with the hand at (3,) m, or None while it looks as before."""
        if self._points and time_s < self._points[-1][0]:
            self._points.clear()
        if hand is None or (self._points and time_s < self._points[-1][0] + STEP_S):
            return None
        self._points.append((time_s, hand))
        while self._points[0][0] < time_s - TRAIL_S:
            self._points.popleft()
        return self._drawn(time_s)

    def end(self) -> Trail:
        """Forget the path; return what is drawn then: nothing."""
        self._points.clear()
        return Trail((), ())

    def _drawn(self, now_s: float) -> Trail:
        strips: list[list[Floats]] = []
        colours: list[Colour] = []
        before: tuple[float, Floats, int] | None = None
        for time_s, at in self._points:
            opacity = next((o for age, o in FADES if now_s - time_s <= age), FADES[-1][1])
            joined = before is not None and time_s - before[0] <= BREAK_S
            if before is None or not joined or opacity != before[2]:
                # A fainter part ends where the next begins, so that the line has no hole.
                strips.append([before[1]] if joined and before is not None else [])
                colours.append((*self._colour[:3], opacity))
            strips[-1].append(at)
            before = time_s, at, opacity
        lines = [(np.array(strip), colour) for strip, colour in zip(strips, colours, strict=True)]
        whole = [(strip, colour) for strip, colour in lines if len(strip) > 1]
        return Trail(tuple(strip for strip, _ in whole), tuple(colour for _, colour in whole))
