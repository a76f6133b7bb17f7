"""What watches a moving shoulder's estimate: rests, postures that return, whether it makes sense. Pure."""

from math import exp, sqrt
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion.shoulder_model import FARTHEST_M, Floats, Sizes
from brachium_fusion.shoulder_postures import FARTHEST_M as NOT_BACK_M
from brachium_fusion.shoulder_postures import MOST, SAME_RAD, SURE_M, Posture
from brachium_fusion.shoulder_rest import EARLY_M_S2, LISTEN_S, LOUDEST, RATE, SPREAD, WINDOW_S

FASTEST_M_S = 1.0
DISAGREE = 8.0
"""Normalised square of what the two sensors say differently, over some 2 s; 1 is as expected."""
RECOVER_S = 1.0
"""A rest as long as this begins anew."""
FADE_S = 15.0
"""In this time a shoulder that moved counts as one that is held still."""

EARLY_S = 0.3
"""Enough to show the rest of a shoulder that is slow and does not accelerate."""

AGAIN_S = 10.0
STEP_BACK = "hold the back still and let the arm rest for a second"


class Watch:
    """Judges from knot to knot."""

    def __init__(self, size: Sizes, world_from: Floats) -> None:
        self._size = size
        self.reason = ""
        self.rest_s = 0.0
        """Since when the arm has been at rest; 0: it is not."""
        self.since_rest_s = 0.0
        self.shift = size.still
        """m: how far this shoulder goes, at the moment."""
        self._recent: list[list[float]] = []
        """Accelerations by both sensors and the faster sensor's rate in the last intervals."""
        self._loud, self._apart = 0.0, 1.0
        self._known = [Posture(world_from, np.zeros(3), np.zeros(3))]
        self._tie_at = AGAIN_S
        """How long the rest must have lasted for the next tie."""

    def see(self, speed_gained: Floats, fastest: float, step_s: float, *, slow: bool) -> bool:
        """Take the interval that ended: (6,) m/s, rad/s, and whether the shoulder was slow as it began.
        Return whether the arm is at rest: a slow one needs less time to show it."""
        intervals = max(3, round(WINDOW_S / step_s))
        self._recent = [*self._recent, [*(speed_gained / step_s).tolist(), fastest]][-intervals:]
        seen = np.array(self._recent)
        early = seen[-max(2, round(EARLY_S / step_s)) :]
        rest = len(seen) == intervals and _quiet(seen)
        if slow and not rest and len(seen) > len(early):
            rest = _quiet(early) and bool(np.abs(early[:, :6].mean(axis=0)).max() < EARLY_M_S2)
        self.rest_s = self.rest_s + step_s if rest else 0.0
        self.since_rest_s = 0.0 if rest else self.since_rest_s + step_s
        if not rest:
            self._tie_at = 0.0
        share = 1.0 - exp(-step_s / LISTEN_S)
        acceleration = 0.5 * (seen[-1, :3] + seen[-1, 3:6])
        self._loud += share * (float(acceleration @ acceleration) - self._loud)
        return rest

    def judge(self, place: Floats, speed: Floats, sd: Floats, apart: float, step_s: float) -> None:
        """Take what was made of the interval; find the reason why it makes no sense, if so."""
        self._apart += (1.0 - exp(-step_s / LISTEN_S)) * (min(apart, 100.0) - self._apart)
        far = float(np.linalg.norm(place))
        faded = self.shift * exp(-step_s / FADE_S)
        sure = sqrt(max(far**2 - 4.0 * float(sd @ sd), 0.0))
        self.shift = min(max(faded, sure, self._size.still), self._size.shift)
        if self.reason:
            return
        if self._loud > LOUDEST**2:
            self.reason = f"the shoulder shakes as in walking: {STEP_BACK}"
        elif far > FARTHEST_M or float(np.linalg.norm(speed)) > FASTEST_M_S:
            self.reason = f"the shoulder seems to go farther than a girdle can: {STEP_BACK}"
        elif self._apart > DISAGREE:
            self.reason = f"the sensors of upper arm and forearm contradict each other: {STEP_BACK}"
        elif float(sd.max()) > 0.5 * FARTHEST_M:
            self.reason = f"the arm has not rested for too long: {STEP_BACK}"

    def recovered(self) -> bool:
        """Return whether a rest long enough ends what made no sense; it does so once."""
        if not self.reason or self.rest_s < RECOVER_S:
            return False
        self.reason, self._apart, self._loud, self._tie_at = "", 1.0, 0.0, 0.0
        return True

    def stop(self, reason: str) -> None:
        """Believe nothing until the next rest."""
        self.reason = self.reason or f"{reason}: {STEP_BACK}"
        self._recent, self.rest_s = [], 0.0

    def tie(self, world_from: Floats, place: Floats, sd: Floats) -> Posture | None:
        """Return the posture, known before, in which the arm now rests; once a rest, and every AGAIN_S of it.

        `world_from` (2, 4) are the sensors' orientations, `place` (3,) m where the shoulder seems, `sd` (3,).
        """
        if self.rest_s == 0.0 or self.rest_s < self._tie_at:
            return None
        self._tie_at = self.rest_s + AGAIN_S
        for posture in self._known:
            if float(np.max(rotation.angle_between(posture.world_from, world_from))) < SAME_RAD:
                near = float(np.linalg.norm(posture.place - place)) < NOT_BACK_M
                return posture if near else None
        self._known.append(Posture(world_from.copy(), place.copy(), np.maximum(sd, SURE_M)))
        if len(self._known) > MOST + 1:
            del self._known[1]
        return None

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "reason": self.reason,
            "rest_s": self.rest_s,
            "since_rest_s": self.since_rest_s,
            "shift": self.shift,
            "recent": [list(row) for row in self._recent],
            "loud": self._loud,
            "apart": self._apart,
            "tie_at": self._tie_at,
            "postures": [[p.world_from.tolist(), p.place.tolist(), p.sd.tolist()] for p in self._known],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the one whose state this is."""
        self.reason, self._tie_at = state["reason"], state["tie_at"]
        self.rest_s, self.since_rest_s, self.shift = state["rest_s"], state["since_rest_s"], state["shift"]
        self._recent = [list(row) for row in state["recent"]]
        self._loud, self._apart = state["loud"], state["apart"]
        self._known = [Posture(*(np.array(part) for part in posture)) for posture in state["postures"]]


def _quiet(seen: Floats) -> bool:
    spread = np.sqrt(seen[:, :6].var(axis=0).reshape(2, 3).sum(axis=1).max())
    return bool(spread < SPREAD and seen[:, 6].max() < RATE)
