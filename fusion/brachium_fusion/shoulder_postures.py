"""Rests that repeat: an arm that stands as it stood before has its shoulder where it was. Pure.

Displacement drifts between rests, for nothing sees where the shoulder is. But a person who comes back to a
posture comes back to it with the girdle too, within some millimetres; each return closes a loop. The posture
of the start has displacement 0; the place of any other is found at its visits.
"""

from dataclasses import dataclass

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_equations import Ties
from brachium_fusion.shoulder_model import Bools, Floats, Sizes
from brachium_fusion.still_stretches import runs

SAME_RAD = 0.052
"""3 deg: as near must both sensors stand to how they stood."""
SHORTEST_S = 0.3
FARTHEST_M = 0.04
"""A shoulder that seems farther than this from where it was has not come back: a shrug that is held."""
UNKNOWN_M = 0.08
SURE_M = 0.001
"""No place is known better: people do not come back more exactly, however often."""
MOST = 5
START = -1
NO_HEADING = 1e3
"""rad: the first visit says nothing of heading."""


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """A posture in which the arm rested, and where its shoulder was."""

    world_from: Floats
    """(2, 4) both sensors."""
    place: Floats
    """(3,) m."""
    sd: Floats


class Postures:
    """The postures of one recording, from window to window."""

    def __init__(self, start: Floats) -> None:
        self.start = start
        self.known: list[Posture] = []

    def ties(
        self, knots: Floats, at_rest: Bools, step_s: float, place: Floats, size: Sizes
    ) -> tuple[Ties, list[Posture]]:
        """Return the ties of a window, and the postures they number.

        `knots` (2, k + 1, 4) are the sensors' orientations, `place` (k + 1, 3) m where the shoulder seems.
        """
        postures = [Posture(self.start, np.zeros(3), np.zeros(3)), *self.known]
        old = len(postures)
        rows: list[tuple[int, int, bool]] = []
        for first, end in runs(at_rest):
            if (end - first) * step_s < SHORTEST_S:
                continue
            knot = (first + end) // 2
            here = knots[:, knot]
            number = next((i for i, p in enumerate(postures) if _same(p, here)), None)
            if number is None and len(postures) <= MOST:
                number = len(postures)
                postures.append(Posture(here.copy(), place[knot].copy(), np.full(3, UNKNOWN_M)))
                rows.append((knot, number, True))
            elif number is not None and _near(postures[number].place, place[knot]):
                rows.append((knot, number, False))
        visited = sorted({number for _, number, _ in rows} - {0})
        column = {number: i for i, number in enumerate(visited)} | {0: START}
        heading, sd = np.zeros((len(rows), 2)), np.full((len(rows), 2), NO_HEADING)
        for i, (knot, number, new) in enumerate(rows):
            if not new:
                back = rotation.multiply(postures[number].world_from, rotation.inverse(knots[:, knot]))
                heading[i], sd[i] = rotation.heading(back), size.rest_heading
        ties = Ties(
            np.array([knot for knot, _, _ in rows], dtype=np.int64),
            np.array([column[number] for _, number, _ in rows], dtype=np.int64),
            heading,
            sd,
        )
        fresh = [
            Posture(postures[n].world_from, np.zeros(3), np.full(3, UNKNOWN_M)) if n >= old else postures[n]
            for n in visited
        ]
        return ties, fresh

    def learn(self, used: list[Posture], places: Floats, sds: Floats) -> None:
        """Keep the postures of a window, with places (m, 3) and their standard deviations."""
        found = [
            Posture(p.world_from, place, np.maximum(sd, SURE_M))
            for p, place, sd in zip(used, places, sds, strict=True)
        ]
        old = [p for p in self.known if not any(p.world_from is f.world_from for f in found)]
        self.known = (found + old)[:MOST]


def _same(posture: Posture, here: Floats) -> bool:
    return bool(np.max(rotation.angle_between(posture.world_from, here)) < SAME_RAD)


def _near(a: Floats, b: Floats) -> bool:
    return float(np.linalg.norm(a - b)) < FARTHEST_M
