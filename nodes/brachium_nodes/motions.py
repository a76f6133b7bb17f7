"""Ways to move an arm: clinical joint angles and shoulder translation as functions of time.

Angles are anatomical (docs/conventions.md), so the same movement serves both arms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Protocol

import numpy as np
import numpy.typing as npt

from brachium_body.lengths import ArmLengths
from brachium_body.segments import Side
from brachium_nodes.movement import Array, Variation, eased, minimum_jerk
from brachium_nodes.sensors import generator

ANGLES = (
    "shoulder_flexion",
    "shoulder_abduction",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_pronation",
    "wrist_flexion",
    "wrist_deviation",
)
SHIFTS = ("shift_out", "shift_forward", "shift_up")
"""Translation of the shoulder in m: away from the body's middle, forward, up."""

DEG = pi / 180.0

SHOULDER_SWAY_DEG = 0.2
"""Standard deviation of each shoulder angle: no one holds a shoulder perfectly still."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """What an exercise must know of the arm that does it."""

    lengths: ArmLengths
    carrying: float
    """The elbow's angle about X in rad, ISB's sign: valgus is negative."""
    contracture_deg: float = 0.0
    """The elbow does not straighten further; 0: it does."""
    pose_error_deg: Mapping[str, float] = field(default_factory=dict[str, float])
    """By how much each angle is off when this arm means to hold a pose."""


def pose_error(size_deg: float, seed: int, side: Side) -> dict[str, float]:
    """Return by how much one arm's angles are off in every pose that is meant, deg.

    The upper arm is off by `size_deg` (3-D rms), and so is the forearm on it. No arm hangs into the trunk and
    no elbow is stretched beyond straight, so abduction and elbow flexion are off to one side.
    """
    random = generator(seed, side, "pose")
    off = size_deg * random.standard_normal(5) / np.sqrt([3.0, 3.0, 3.0, 2.0, 2.0])
    named = dict(zip(ANGLES[:5], off.tolist(), strict=True))
    return {**named, **{name: abs(named[name]) for name in ("shoulder_abduction", "elbow_flexion")}}


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joint angles in rad by name, each (n,), and the shoulder's translation (n, 3) in m, by SHIFTS."""

    angles: dict[str, Array]
    shift: Array

    def scaled(self, share: Array) -> "Posture":
        """Return the posture `share` (n,) of the way from neutral."""
        return Posture({k: v * share for k, v in self.angles.items()}, self.shift * share[:, None])

    def turned(self, angles: Mapping[str, Array]) -> "Posture":
        """Return the posture with angles (n,) rad more."""
        return Posture({k: v + angles[k] if k in angles else v for k, v in self.angles.items()}, self.shift)

    def added(self, other: "Posture", where: npt.NDArray[np.bool_]) -> "Posture":
        """Return the sum with another posture, whose rows are the instants where `where` (n,) is true."""

        def total(mine: Array, theirs: Array) -> Array:
            result = mine.copy()
            result[where] += theirs
            return result

        angles = {name: total(v, other.angles[name]) for name, v in self.angles.items()}
        return Posture(angles, total(self.shift, other.shift))


class Motion(Protocol):
    """A movement that begins at t = 0 in its first posture and goes on for ever."""

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:
        """Return the posture at times (n,) s."""
        ...


Frame = tuple[float, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Keyframes:
    """Repetitions through stated postures (deg, m), with a minimum-jerk movement from each to the next.

    A frame is the fraction of the repetition at which it is reached, and its angles; the last equals the
    first. `elevation` and `plane` may stand for flexion and abduction.
    """

    period_s: float
    frames: tuple[Frame, ...]
    sway_deg: float = SHOULDER_SWAY_DEG

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:  # noqa: ARG002 (any build does it)
        """Return the posture at times (n,) s."""
        number, fraction = variation.repetitions(t, self.period_s)
        names = {name for _, frame in self.frames for name in frame}
        values: dict[str, Array] = dict.fromkeys((*ANGLES, *SHIFTS), np.zeros(len(t)))
        for name in names:
            values[name] = self._value(name, fraction, variation.extent(number))
        if "elevation" in names:
            plane = DEG * values["plane"]
            values["shoulder_flexion"] = values["elevation"] * np.sin(plane)
            values["shoulder_abduction"] = values["elevation"] * np.cos(plane)
        for name in ANGLES[:3]:
            values[name] = values[name] + self.sway_deg * variation.wander(name, t, 0.05, 0.4)
        return posture(values)

    def _value(self, name: str, fraction: Array, extent: Array) -> Array:
        (_, first), *_ = self.frames
        way = np.zeros_like(fraction)
        for (begin, frame), (end, target) in zip(self.frames, self.frames[1:], strict=False):
            change = target[name] - frame[name]
            if change:
                way = way + change * minimum_jerk((fraction - begin) / (end - begin))
        return first[name] + extent * way


def there_and_back(
    base: Mapping[str, float],
    peak: Mapping[str, float],
    period_s: float = 4.0,
    move: float = 0.42,
    hold: float = 0.08,
    sway_deg: float = SHOULDER_SWAY_DEG,
) -> Keyframes:
    """Return repetitions from base to peak, a hold, back, and a rest; `move` and `hold` are fractions."""
    both = dict.fromkeys((*base, *peak), 0.0)
    low, high = {**both, **base}, {**both, **base, **peak}
    frames = ((0.0, low), (move, high), (move + hold, high), (2.0 * move + hold, low), (1.0, low))
    return Keyframes(period_s, frames, sway_deg)


@dataclass(frozen=True, slots=True)
class Free:
    """Random daily movement within comfortable ranges (deg): of every 15 s the last `pause_s` are a pause."""

    ranges: Mapping[str, tuple[float, float]]
    shift_m: tuple[float, float, float]
    """Standard deviation of the shoulder's translation, by SHIFTS."""
    pause_s: float = 3.0
    fastest_hz: float = 0.45

    def __call__(self, t: Array, variation: Variation, build: Build) -> Posture:  # noqa: ARG002 (any build does it)
        """Return the posture at times (n,) s."""
        tau = self._active_time(t, variation)
        values: dict[str, Array] = {}
        for name, (low, high) in self.ranges.items():
            reach = np.tanh(0.9 * variation.wander(name, tau, 0.03, self.fastest_hz))
            values[name] = 0.5 * (low + high) + 0.5 * (high - low) * reach
        for name, size in zip(SHIFTS, self.shift_m, strict=True):
            values[name] = size * variation.wander(name, tau, 0.03, 0.4)
        return posture(values)

    def _active_time(self, t: Array, variation: Variation) -> Array:
        """Return a time that stands still in the pauses; its pace rises and falls within 0.8 s."""
        period, ramp, pause = 15.0, 0.8, self.pause_s
        if not pause:
            return t
        number, fraction = variation.repetitions(t, period)
        within = fraction * period
        return number * (period - pause) + eased(within, ramp) - eased(within - (period - pause), ramp)


def posture(values: Mapping[str, Array]) -> Posture:
    """Return the posture of values (n,) by ANGLES in deg and by SHIFTS in m."""
    angles = {name: DEG * values[name] for name in ANGLES}
    return Posture(angles, np.stack([values[name] for name in SHIFTS], axis=-1))
