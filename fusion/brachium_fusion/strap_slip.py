"""Straps that slip during a session: which sensor turned on its segment, when, by how much. Pure, causal.

Seen at rests: a sensor that feels gravity elsewhere in postures that are otherwise the same
(slip_postures.py). Seen while moving: rates that a joint of two known axes cannot have (slip_joints.py),
unless postures felt just as before contradict. Not seen: a turn about the vertical of every posture in which
the arm rests, or, by movement, about the joint's own axis in that sensor (a turn about the length of a
forearm that rests only hanging is neither, without a sensor on the hand); the slip of the only sensor worn. A
habit that changes by a few degrees in the last segment's joint alone looks like a slip of its sensor: there
more rests are asked for.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_fusion.joint_model import Joint
from brachium_fusion.slip_joints import JointTurned, JointTurns
from brachium_fusion.slip_postures import NEAR, evidence_of, turned_since
from brachium_fusion.timeline import SensorNow
from brachium_fusion.wear_words import place

Floats = npt.NDArray[np.float64]

STILL_RAD_S = 0.12
"""A sensor that turns slower rests; a hand that trembles does too."""
REST_S = 0.24
"""Of stillness of all sensors makes a rest: holds between repetitions are short."""
LONG_S = 1.0
"""Of a rest that is used."""
ANOTHER = np.radians(2.0)
"""Stillness that follows stillness is another rest only if some sensor tilted this far."""
MOVED_RAD_S = 0.3
"""... or turned this fast in between."""
KEPT_NS = 180_000_000_000
KEPT = 60
"""Rests that are remembered: three minutes of them, and no more than this."""
SURE = 12.0
"""Evidence for a slip: no single rest gives as much."""
SURE_AT_THE_END = 20.0
"""For the sensor at the arm's end, three rests,"""
BEFORE_AT_THE_END = 4
"""... and so many rests before."""
SURE_BY_MOVEMENT = 14.0
"""Skin that follows rotation in part and postures that change over a session reach 9."""
LARGE_RAD = np.radians(4.0)
"""Less may be skin that settles,"""
LEAST_RAD = np.radians(3.0)
SURE_OF_LESS = 40.0
"""... unless rest after rest, five at least, says the same of what gravity may show only in part."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slip:
    """A sensor turned on its segment."""

    segment: str
    after_ns: int
    """Until here it still sat as before; what follows is disturbed."""
    time_ns: int
    """From here on it certainly sits otherwise."""
    found_ns: int
    size_deg: float
    """As far as gravity or movement shows it."""
    turn: tuple[float, float, float]
    """before_from_now: rotation vector in sensor axes, rad; what cannot be seen of it is 0."""
    evidence: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rest:
    from_ns: int
    to_ns: int
    ups: list[list[float]]
    """Unit vectors, by sensor."""


class SlipWatch:
    """Watches the sensors of one arm, named from the shoulder on. `step` takes every instant."""

    def __init__(
        self, segments: Sequence[str], rate_hz: float = 50.0, joints: Sequence[Joint | None] = ()
    ) -> None:
        """Watch an arm; `joints` are those between neighbours, None where the axes are not known.

        `rate_hz` is that of the instants.
        """
        self.segments = tuple(segments)
        self._joints = {
            upper: JointTurns(joint, rate_hz)
            for upper, joint in enumerate(joints)
            if joint is not None and joint.has_axes and joint.axes == 2
        }
        self._rests: list[_Rest] = []
        self._from_ns, self._to_ns, self._count = 0, 0, 0
        self._force = np.zeros((len(self.segments), 3))
        """Sum of specific forces over the present stillness."""
        self._done = False
        """The present stillness is on record, or is the one before going on."""
        self._moved = True

    def step(self, now_ns: int, sensors: Mapping[str, SensorNow]) -> Slip | None:
        """Take all sensors at an instant, calibrated; return a slip when one became certain.

        Orientations share one heading, by magnetometers or by the joints, up to some degrees.
        """
        if any(s not in sensors for s in self.segments):
            return self._end()
        return self._move(now_ns, sensors) or self._rest(now_ns, sensors)

    def _move(self, now_ns: int, sensors: Mapping[str, SensorNow]) -> Slip | None:
        slip = None
        for upper, turns in self._joints.items():
            pair = [sensors[s] for s in self.segments[upper : upper + 2]]
            quats = np.array([s.world_from_sensor for s in pair])
            found = turns.step(now_ns, quats, np.array([s.motion.gyr for s in pair]))
            if found is not None and slip is None:
                slip = self._judge_joint(now_ns, upper, turns, found)
        return slip

    def _judge_joint(self, now_ns: int, upper: int, turns: JointTurns, found: JointTurned) -> Slip | None:
        if found.evidence < SURE_BY_MOVEMENT or not LARGE_RAD <= np.linalg.norm(found.turn) <= NEAR:
            return None
        time_ns, sensor = turns.blocks[found.block].from_ns, upper + found.sensor
        split = bisect_left([r.from_ns for r in self._rests], time_ns)
        ups = np.array([r.ups for r in self._rests])
        evidence = found.evidence + evidence_of(ups, split, sensor, found.turn)
        if evidence < SURE_BY_MOVEMENT:
            return None
        return self._said(
            sensor, turns.blocks[found.block - 1].from_ns, time_ns, now_ns, found.turn, evidence
        )

    def _rest(self, now_ns: int, sensors: Mapping[str, SensorNow]) -> Slip | None:
        motions = [sensors[s].motion for s in self.segments]
        fastest = max(float(m.gyr @ m.gyr) for m in motions)
        if fastest > STILL_RAD_S**2:
            self._moved = self._moved or fastest > MOVED_RAD_S**2
            return self._end()
        if self._done:
            return None
        if not self._count:
            self._from_ns = now_ns
        self._force += np.array([m.acc for m in motions])
        self._count, self._to_ns = self._count + 1, now_ns
        return self._end() if now_ns - self._from_ns >= LONG_S * 1e9 else None

    def forget(self) -> None:
        """A pose was taken or a sensor replaced: what was felt before says nothing about now."""
        self._rests.clear()
        for turns in self._joints.values():
            turns.blocks.clear()
            turns.forget(0)
        self._begin()
        self._moved = True

    def _begin(self) -> None:
        self._count, self._done = 0, False
        self._force = np.zeros((len(self.segments), 3))

    def _end(self) -> Slip | None:
        """Take the stillness that ends here, or has lasted long enough, as a rest if it is one."""
        long_enough = self._count > 1 and self._to_ns - self._from_ns >= REST_S * 1e9
        force, spent = self._force, self._to_ns - self._from_ns >= LONG_S * 1e9 and self._count > 1
        rest = None
        if long_enough:
            ups = force / np.linalg.norm(force, axis=1, keepdims=True)
            rest = _Rest(from_ns=self._from_ns, to_ns=self._to_ns, ups=ups.tolist())
        self._begin()
        self._done = spent
        if rest is None or not (self._moved or self._another(rest)):
            return None
        self._moved = False
        self._rests = [r for r in self._rests if rest.to_ns - r.to_ns <= KEPT_NS][1 - KEPT :]
        self._rests.append(rest)
        return self._judge(rest.to_ns)

    def _another(self, rest: _Rest) -> bool:
        if not self._rests:
            return True
        together = np.einsum("sx,sx->s", np.array(rest.ups), np.array(self._rests[-1].ups))
        return bool(together.min() < np.cos(ANOTHER))

    def _judge(self, now_ns: int) -> Slip | None:
        found = turned_since(np.array([r.ups for r in self._rests]))
        if found is None or found.evidence < self._sure(found.sensor, found.split, found.turn):
            return None
        before, first = self._rests[found.split - 1], self._rests[found.split]
        return self._said(found.sensor, before.to_ns, first.from_ns, now_ns, found.turn, found.evidence)

    def _sure(self, sensor: int, split: int, turn: Floats) -> float:
        """Return how much evidence of rests such a turn needs."""
        size, last = float(np.linalg.norm(turn)), sensor == len(self.segments) - 1
        if last and split < BEFORE_AT_THE_END:
            return np.inf
        if size < LARGE_RAD:
            return SURE_OF_LESS if size >= LEAST_RAD else np.inf
        return SURE_AT_THE_END if last else SURE

    def _said(
        self, sensor: int, after_ns: int, time_ns: int, now_ns: int, turn: Floats, evidence: float
    ) -> Slip:
        """Return the finding, and compare with nothing before it from now on."""
        segment, size = self.segments[sensor], float(np.degrees(np.linalg.norm(turn)))
        self._rests = [r for r in self._rests if r.from_ns >= time_ns]
        for turns in self._joints.values():
            turns.forget(time_ns)
        x, y, z = turn.tolist()
        return Slip(
            segment=segment,
            after_ns=after_ns,
            time_ns=time_ns,
            found_ns=now_ns,
            size_deg=size,
            turn=(x, y, z),
            evidence=evidence,
            text=f"the sensor on the {place(segment)} has turned by about {size:.0f} deg or more, "
            f"{(now_ns - time_ns) / 1e9:.0f} s ago: tighten its strap and take the pose again",
        )

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "rests": [asdict(r) for r in self._rests],
            "still": [self._from_ns, self._to_ns, self._count],
            "force": self._force.tolist(),
            "flags": [self._done, self._moved],
            "joints": [[upper, turns.state()] for upper, turns in self._joints.items()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the watch whose state this is would have."""
        self._rests = [_Rest(**r) for r in state["rests"]]
        self._from_ns, self._to_ns, self._count = state["still"]
        self._force = np.array(state["force"])
        self._done, self._moved = state["flags"]
        for upper, turns in state["joints"]:
            self._joints[upper].restore(turns)
