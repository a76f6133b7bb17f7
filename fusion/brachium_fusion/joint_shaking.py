"""How much skin lets the sensors of a joint swing against the bone, from how violently they shake. Pure.

A sensor on skin is a mass on a damped spring that swings at some 7 Hz. Of an arm that trembles at 5 Hz, what
two sensors then find for the velocity of one joint centre is decimetres a second apart, and each tips by
degrees several times a second. None of that is an error of attitude or heading, and no noise that is white
and learnt over seconds says so in time: it is measured, as what of the acceleration alternates from node to
node.
"""

from dataclasses import dataclass, replace
from math import exp, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

SWING_S = 0.02
"""m/s of a sensor against the bone per m/s^2 of its shaking: at 5 Hz on a spring of 7 Hz, damped by 0.3."""
TIP_M = 0.06
"""A shift by this much along the skin would tip the sensor by 1 rad."""
SWING_RATE = 31.0
"""rad/s: of 5 Hz, as hands tremble."""
ALTERNATING = 13.0
"""The mean square of a second difference from node to node, per mean square of what trembles at 5 Hz; of a
movement of 1 Hz it is a fiftieth of that."""
RISES, FADES = 0.25, 0.04
"""Shares of what a node shows: shaking begins within a third of a second, and is believed for two."""
LEAST, MOST = 1e-3, 1.0
"""Shares of that swing, as a variance: of a sensor that is screwed to the bone, and of one on skin."""
LEARN_S, FORGET_S = 1.0, 5.0
"""Over these a joint's residuals make the share larger, and smaller: a tremor begins within a second."""
FARTHEST = 9.0
"""A residual's normalised square counts as no more."""


@dataclass(frozen=True, slots=True, eq=False)
class Shaking:
    """What the last nodes showed."""

    before: tuple[Floats, ...] = ()
    """Accelerations (2, 3) of both sensors at the last two nodes, m/s^2."""
    squared: float = 0.0
    """Mean square of what alternates, of both together, m^2/s^4."""
    share: float = MOST

    def then(self, acceleration: Floats) -> "Shaking":
        """Return it after another node."""
        before = (*self.before, acceleration)[-2:]
        if len(self.before) < 2:
            return replace(self, before=before)
        change = acceleration - 2.0 * self.before[1] + self.before[0]
        now = float(np.einsum("si,si->", change, change)) / ALTERNATING
        part = RISES if now > self.squared else FADES
        return replace(self, before=before, squared=self.squared + part * (now - self.squared))

    def learnt(self, residual: float, variance: float, span_s: float) -> "Shaking":
        """Return it after a residual of this length, in standard deviations, 1 as expected. `variance`,
        m^2/s^2, was expected without any swing: where swing adds little, little is learnt of it."""
        more = min(residual * residual, FARTHEST) - 1.0
        whole = SWING_S**2 * self.squared
        part = whole / (whole + variance) * span_s / (LEARN_S if more > 0.0 else FORGET_S)
        return replace(self, share=min(MOST, max(LEAST, self.share * exp(part * more))))

    def after_gap(self) -> "Shaking":
        """Return it as it goes on where no node came before."""
        return replace(self, before=())

    @property
    def speed(self) -> float:
        """Standard deviation of how fast sensors swing against the bone, m/s."""
        return SWING_S * sqrt(self.share * self.squared)

    def state(self) -> list[Any]:
        """Return all as plain values."""
        return [[one.tolist() for one in self.before], self.squared, self.share]

    @staticmethod
    def of(state: list[Any]) -> "Shaking":
        """Return what has this state."""
        before, squared, share = state
        return Shaking(tuple(np.array(one) for one in before), squared, share)
