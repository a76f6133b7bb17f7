"""A row of postures with minimum-jerk movements between them: how a wearer is led through something.

Beside the arm's angles a routine moves three shares in 0..1: `posed`, how far a pose is held, with the error
of this person's poses; `sway`, how freely the shoulder moves along; `mixed`, how far the arm moves at random.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from brachium_nodes.motions import ANGLES, SHIFTS, Build, Free, Posture, posture
from brachium_nodes.movement import Array, Variation, minimum_jerk

SHARES = ("posed", "sway", "mixed")

_MIXED = Free(
    {
        "shoulder_flexion": (5, 45),
        "shoulder_abduction": (5, 30),
        "shoulder_rotation": (-15, 25),
        "elbow_flexion": (20, 110),
        "forearm_pronation": (-50, 60),
        "wrist_flexion": (-10, 10),
        "wrist_deviation": (-5, 5),
    },
    (0.0, 0.0, 0.0),
    pause_s=0.0,
    fastest_hz=0.7,
)


@dataclass(frozen=True, slots=True)
class Span:
    """What is done from when to when."""

    kind: str
    """n-pose, table, given, elbow-flexion, pronation, free; of the wear check: hang, raise, bend."""
    from_s: float
    to_s: float
    angles_deg: Mapping[str, float] = field(default_factory=dict[str, float])
    """Of a given pose, as a goniometer reads them in a person whose poses have no error."""

    def later(self, seconds: float) -> "Span":
        """Return the span by so much later."""
        return Span(self.kind, self.from_s + seconds, self.to_s + seconds, self.angles_deg)


@dataclass(frozen=True, slots=True)
class Move:
    """A movement of a routine."""

    from_s: float
    to_s: float
    change: Mapping[str, float]
    """Of angles in deg, shifts in m, shares."""
    repetition: int
    """Its extent is this repetition's; 0: just as stated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Routine:
    """Movements from neutral and back to it; time 0 is its beginning."""

    moves: tuple[Move, ...] = ()
    spans: tuple[Span, ...] = ()
    seconds: float = 0.0
    sway_deg: float = 2.0
    """Standard deviation of the shoulder's angles where it moves along."""
    habit_deg: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    """Where it does, each person is off by so much, from and to, in a way of their own."""
    sway_hz: tuple[float, float] = (0.05, 0.4)

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:
        """Return the posture at times (n,) s; before and after it is neutral, as this person holds it."""
        values: dict[str, Array] = {name: np.zeros(len(t)) for name in (*ANGLES, *SHIFTS, *SHARES)}
        values["posed"] += 1.0
        for move in self.moves:
            done = minimum_jerk((t - move.from_s) / (move.to_s - move.from_s))
            if move.repetition:
                done = done * variation.extent(np.array(float(move.repetition)))
            for name, change in move.change.items():
                values[name] += change * done
        for name, (low, high) in self.habit_deg.items():
            own = variation.uniform(f"routine/{name}/habit", np.zeros(1))[0]
            values[name] += values["sway"] * (low + (high - low) * own)
        for name, error in build.pose_error_deg.items():
            values[name] += error * values["posed"]
        for name in ANGLES[:3] if values["sway"].any() else ():
            values[name] += (
                values["sway"] * self.sway_deg * variation.wander(f"routine/{name}", t, *self.sway_hz)
            )
        made = posture(values)
        if not values["mixed"].any():
            return made
        everywhere = np.ones(len(t), dtype=np.bool_)
        mixed = _MIXED(t, variation, build).scaled(values["mixed"])
        return made.scaled(1.0 - values["mixed"]).added(mixed, everywhere)

    def held(self, t: Array) -> Array:
        """Return how far a pose is held at times (n,) s, 0 to 1."""
        share = np.ones(len(t))
        for move in self.moves:
            if "posed" in move.change:
                share += move.change["posed"] * minimum_jerk((t - move.from_s) / (move.to_s - move.from_s))
        return share


class Script:
    """A routine while it is written down."""

    def __init__(self) -> None:
        self.now, self._at = 0.0, {**dict.fromkeys((*ANGLES, *SHIFTS, *SHARES), 0.0), "posed": 1.0}
        self._moves: list[Move] = []
        self._spans: list[Span] = []

    def go(self, seconds: float, values: Mapping[str, float], repetition: int = 0) -> None:
        """Move to a posture; what is not named is 0."""
        target = {**dict.fromkeys(self._at, 0.0), **values}
        change = {name: target[name] - old for name, old in self._at.items() if target[name] != old}
        self._moves.append(Move(self.now, self.now + seconds, change, repetition))
        self.now, self._at = self.now + seconds, target

    def wait(self, seconds: float) -> None:
        """Stay."""
        self.now += seconds

    def span(self, kind: str, from_s: float, angles_deg: Mapping[str, float] | None = None) -> None:
        """Name what was done from then until now."""
        self._spans.append(Span(kind, from_s, self.now, angles_deg or {}))

    def hold(
        self,
        kind: str,
        angles_deg: Mapping[str, float],
        seconds: float = 4.0,
        told: Mapping[str, float] | None = None,
    ) -> None:
        """Go to a pose and hold it; `told` is what a goniometer says where that differs."""
        self.go(2.0, {"posed": 1.0, **angles_deg})
        begin = self.now
        self.wait(seconds)
        self.span(kind, begin, (told or angles_deg) if kind == "given" else None)

    def repeat(
        self,
        kind: str,
        base: Mapping[str, float],
        peak: Mapping[str, float],
        times: int = 5,
        period_s: float = 2.4,
    ) -> None:
        """Go to base, move to the peak and back so many times."""
        low = {"sway": 1.0, **base}
        self.go(1.5, low)
        begin = self.now
        for number in range(times):
            self.go(0.5 * period_s, {**low, **peak}, number + 1)
            self.go(0.5 * period_s, low, number + 1)
        self.span(kind, begin)

    def mix(self, seconds: float) -> None:
        """Move at random."""
        begin = self.now
        self.go(1.0, {"mixed": 1.0})
        self.wait(seconds - 2.0)
        self.go(1.0, {})
        self.span("free", begin)

    def end(
        self, habit_deg: Mapping[str, tuple[float, float]], rest_s: float = 3.0, sway_deg: float = 2.0
    ) -> Routine:
        """Go back to neutral, rest, and return the routine."""
        self.go(1.5, {"posed": 1.0})
        self.wait(rest_s)
        return Routine(
            moves=tuple(self._moves),
            spans=tuple(self._spans),
            seconds=self.now,
            sway_deg=sway_deg,
            habit_deg=habit_deg,
        )
