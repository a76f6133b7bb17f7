"""Waiting for a pose: all sensors still for long enough, or a reason why nobody stood still. Pure."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_fusion.pose import PoseName
from brachium_fusion.timeline import Reading

Floats = npt.NDArray[np.float64]

STILL_S = 3.0
"""A pose counts once all sensors were still for this long."""
POSE_USED_NS = 2_000_000_000
"""Of the pose, the last two seconds are used: the filters have settled by then."""
POSE_PATIENCE_S = 30.0
"""A pose that was asked for is refused when nobody stood still for this long."""
MOVED_NS = 500_000_000
"""Whoever moved within this is moving: an arm that swings is still for an instant at each end."""
TOLD_NS = 1_000_000_000
"""Who moves is told no more often, and not before a person had this long to come to rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseWish:
    """A pose that is waited for."""

    pose: PoseName = "n-pose"
    seconds: float = STILL_S
    angles_deg: dict[str, float] = field(default_factory=dict)
    from_ns: int = 0
    patient: bool = True
    """It is never refused."""


class HeldPose(NamedTuple):
    """A pose that was held."""

    pose: PoseName
    angles_deg: dict[str, float]
    world_from_sensor: dict[str, Floats]
    """Per segment (k, 4), while it was held."""


class Moving(NamedTuple):
    """Whose sensors a pose that was asked for waits for; nobody's any more where there are none."""

    segments: list[str]


class PoseWatch:
    """Collects orientations as long as all sensors are still."""

    def __init__(self, wish: PoseWish) -> None:
        self.wish = wish
        self._held: dict[str, list[tuple[int, Floats]]] = {}
        self._told, self._told_ns = Moving([]), wish.from_ns

    def forget(self, segment: str) -> None:
        """Leave aside what a sensor showed that is not there any more."""
        self._held.pop(segment, None)

    def see(
        self, now: int, live: Mapping[str, Reading], still_since: Mapping[str, int]
    ) -> HeldPose | Moving | str | None:
        """Take the sensors that are there at an instant, and since when each is still, host time ns.

        Return the pose once it was held, or why it was refused; while it is waited for None, or who moves
        when that changed.
        """
        wish = self.wish
        start = max((still_since[s] for s in live), default=now + 1)
        start = max(start, wish.from_ns)
        if start > now:
            self._held.clear()
        else:
            for segment, reading in live.items():
                # Still: the sample next to the instant is as good as one in between, and costs nothing.
                self._held.setdefault(segment, []).append((now, reading.after))
            if now - start >= wish.seconds * 1e9:
                used = {s: [q for t, q in held if t >= now - POSE_USED_NS] for s, held in self._held.items()}
                return HeldPose(wish.pose, wish.angles_deg, {s: np.array(q) for s, q in used.items() if q})
        if not wish.patient and now - wish.from_ns > (POSE_PATIENCE_S + wish.seconds) * 1e9:
            moving = max(live, key=lambda s: still_since[s], default="no sensor")
            return (
                f"{moving} was not still for {wish.seconds:g} s within {POSE_PATIENCE_S:g} s; "
                "stand still (slower than 0.15 rad/s) and ask again"
            )
        return None if wish.patient else self._moving(now, live, still_since)

    def _moving(self, now: int, live: Mapping[str, Reading], still_since: Mapping[str, int]) -> Moving | None:
        moving = Moving(sorted(s for s in live if now - still_since[s] < MOVED_NS))
        if moving == self._told or now - self._told_ns < TOLD_NS:
            return None
        self._told, self._told_ns = moving, now
        return moving

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "wish": asdict(self.wish),
            "held": {s: [[t, q.tolist()] for t, q in rows] for s, rows in self._held.items()},
            "told": [self._told.segments, self._told_ns],
        }

    @staticmethod
    def from_state(state: dict[str, Any]) -> "PoseWatch":
        """Return the watch whose state this is."""
        watch = PoseWatch(PoseWish(**state["wish"]))
        watch._held = {s: [(t, np.array(q)) for t, q in rows] for s, rows in state["held"].items()}
        segments, watch._told_ns = state["told"]
        watch._told = Moving(segments)
        return watch
