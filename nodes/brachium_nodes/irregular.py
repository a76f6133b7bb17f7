"""Sets as people do them: repetitions of unequal pace and extent, pauses, tries that give up, stops on the
way, and an arm that trembles or cannot go far."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import tau
from typing import NamedTuple

import numpy as np

from brachium_nodes.motions import ANGLES, SHIFTS, Build, Posture, posture
from brachium_nodes.movement import Array, Variation, minimum_jerk

TREMOR_HZ = 5.0
TREMOR_DEG = 2.0


class Step(NamedTuple):
    """One minimum-jerk movement, by its share of the way from base to peak."""

    from_s: float
    to_s: float
    change: float


class Plan(NamedTuple):
    """All that will be done."""

    steps: tuple[Step, ...]
    whole: int
    """Repetitions; the rest were tries."""
    end_s: float
    """When the arm is back for the last time; it rests ever after."""


@dataclass(frozen=True, slots=True)
class Irregular:
    """A set from `base` to `peak` (deg) and back, different for every seed and side.

    Whole repetitions go 85 to 110 % of the way. An impaired arm begins 10 to 45 deg above
    neutral in the angle that moves most, goes 6 to 20 deg, stops on the way for up to 2 s, and trembles.
    """

    base: Mapping[str, float]
    peak: Mapping[str, float]
    impaired: bool = False
    tries: float = 0.15
    """How often a movement gives up before it has gone two fifths of the way."""

    def plan(self, variation: Variation) -> Plan:
        """Return what will be done."""
        draw = _Draws(variation)
        steps: list[Step] = []
        now, whole = 0.5, 0
        for _ in range(6 + draw.below(7)):
            complete = draw.uniform() >= self.tries
            whole += complete
            share = draw.between(0.85, 1.1) if complete else draw.between(0.18, 0.4)
            now = self._way(steps, now, share, draw)
            now += draw.between(0.0, 0.6) if draw.uniform() < 0.7 else draw.between(1.0, 3.0)
            now = self._way(steps, now, -share, draw)
            now += draw.between(0.2, 0.8) if draw.uniform() < 0.7 else draw.between(1.0, 4.0)
        return Plan(tuple(steps), whole, now)

    def _way(self, steps: list[Step], now: float, change: float, draw: "_Draws") -> float:
        """Append the movement of `change`, whole or with a stop on the way; return when it has ended."""
        pace = (1.2, 2.4) if self.impaired else (0.7, 1.6)
        parts = [1.0]
        if draw.uniform() < (0.5 if self.impaired else 0.1):
            first = draw.between(0.3, 0.7)
            parts = [first, 1.0 - first]
        for i, part in enumerate(parts):
            now += draw.between(0.2, 2.0) if i else 0.0
            seconds = draw.between(*pace) * part**0.5
            steps.append(Step(now, now + seconds, part * change))
            now += seconds
        return now

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:  # noqa: ARG002 (any build does it)
        """Return the posture at times (n,) s."""
        way = np.zeros(len(t))
        for step in self.plan(variation).steps:
            way = way + step.change * minimum_jerk((t - step.from_s) / (step.to_s - step.from_s))
        base, peak = self._ends(variation)
        values = {
            name: base.get(name, 0.0) + (peak.get(name, base.get(name, 0.0)) - base.get(name, 0.0)) * way
            for name in (*ANGLES, *SHIFTS)
        }
        if self.impaired:
            phase = tau * float(variation.uniform("irregular/phase", 0))
            size = TREMOR_DEG * minimum_jerk(t)  # it begins with the exercise, within a second
            values[self._main] = values[self._main] + size * np.sin(tau * TREMOR_HZ * t + phase)
        return posture(values)

    @property
    def _main(self) -> str:
        """The angle that moves most."""
        return max(self.peak, key=lambda name: abs(self.peak[name] - self.base.get(name, 0.0)))

    def _ends(self, variation: Variation) -> tuple[Mapping[str, float], Mapping[str, float]]:
        if not self.impaired:
            return self.base, self.peak
        start, way = (float(x) for x in variation.uniform("irregular/ends", np.arange(2)))
        low = 10.0 + 35.0 * start
        return {**self.base, self._main: low}, {self._main: low + 6.0 + 14.0 * way}


class _Draws:
    """Numbers drawn one after the other."""

    def __init__(self, variation: Variation) -> None:
        self._variation, self._index = variation, 0

    def uniform(self) -> float:
        self._index += 1
        return float(self._variation.uniform("irregular", self._index))

    def between(self, low: float, high: float) -> float:
        return low + (high - low) * self.uniform()

    def below(self, count: int) -> int:
        return int(count * self.uniform())
