"""Hands that take one sensor through its calibration, as they are told, well or badly. Pure in the time."""

from dataclasses import dataclass, field
from math import pi
from typing import Literal, get_args

import numpy as np

from brachium_body import rotation
from brachium_nodes.calibration_bench import FACE_ERROR_DEG, FACES, to_up, turning
from brachium_nodes.mounting import random_turn
from brachium_nodes.movement import Array, eased, minimum_jerk
from brachium_nodes.sensors import FIELD_UT, generator
from brachium_wire.sensor_records import SensorStep

Mistake = Literal["", "restless", "four-faces", "tilted", "one-axis", "iron", "magnet"]
MISTAKES: tuple[Mistake, ...] = get_args(Mistake)
"""Nothing; moved while it must lie still; two faces left out; one face laid down 35 deg off; turned about one
axis; turned beside a steel table; turned beside a strong magnet."""

MOVE_S, HOLD_S = 0.9, 2.6
"""From one face to the next, and on each."""
SWAY_RAD, SWAY_HZ = 0.05, 0.7
TILT_DEG = 35.0
IRON_UT = 20.0
"""What a steel table bends the field by, some decimetres away, as the hand moves over it."""
MAGNET_UT = 3000.0


@dataclass(frozen=True, slots=True)
class _Leg:
    """From `begin_s` on: move to `to` within MOVE_S and hold it, or turn."""

    begin_s: float
    start: Array
    to: Array
    turns: bool = False


@dataclass(slots=True)
class Hands:
    """One sensor's orientation over time. `follow` must be called in order of time."""

    seed: int
    segment: str
    mistake: Mistake = ""
    _step: SensorStep | None = None
    _legs: list[_Leg] = field(default_factory=lambda: [_Leg(-10.0, rotation.IDENTITY, rotation.IDENTITY)])
    _laid: int = 0

    def follow(self, step: SensorStep | None, until_s: float) -> None:
        """Do this step from the last instant known on, with plans up to `until_s`."""
        if step != self._step:
            self._step, self._laid = step, 0
            self._begin(until_s)
        elif step == "faces" and until_s >= self._legs[-1].begin_s + MOVE_S + HOLD_S:
            self._begin(self._legs[-1].begin_s + MOVE_S + HOLD_S)

    def _begin(self, now_s: float) -> None:
        at = self.orientations(np.array([now_s]))[0]
        if self._step == "faces":
            to = self._face(self._laid)
            self._laid += 1
        else:
            to = rotation.IDENTITY
        self._legs = [self._legs[-1], _Leg(now_s, at, to, turns=self._step == "turn")]

    def _face(self, number: int) -> Array:
        """Return how a sensor lies on a face: a little off, each time by another turn."""
        faces = FACES[:4] if self.mistake == "four-faces" else FACES
        face = faces[number % len(faces)]
        up = (1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])]
        off = rotation.from_rotation_vector(
            random_turn(FACE_ERROR_DEG, generator(self.seed, self.segment, "hands", number))
        )
        laid = rotation.multiply(off, to_up(up))
        if self.mistake == "tilted" and face == FACES[-1]:
            return rotation.multiply(rotation.about(0, np.radians(TILT_DEG)), laid)
        return laid

    def orientations(self, t: Array) -> Array:
        """Return world_from_sensor (n, 4) at times (n,) s."""
        before, last = self._legs[0], self._legs[-1]
        old, new = self._leg(before, t), self._leg(last, t)
        result: Array = np.where((t >= last.begin_s)[:, None], new, old)
        return result

    def _leg(self, leg: _Leg, t: Array) -> Array:
        since = t - leg.begin_s
        if leg.turns:
            eased_s = eased(since, MOVE_S)
            turned = (
                rotation.about(2, 2.0 * pi * 0.2 * eased_s)
                if self.mistake == "one-axis"
                else turning(eased_s)
            )
            return rotation.multiply(leg.start, turned)
        share = minimum_jerk(since / MOVE_S)
        way = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(leg.start), leg.to))
        held = rotation.multiply(leg.start, rotation.from_rotation_vector(share[:, None] * way))
        if self.mistake == "restless" and self._step != "faces":
            held = rotation.multiply(rotation.about(0, SWAY_RAD * np.sin(2.0 * pi * SWAY_HZ * t)), held)
        return held

    def field(self, t: Array) -> Array:
        """Return the magnetic field (n, 3) uT in world axes where the sensor is."""
        field_ut: Array = np.tile(FIELD_UT, (len(t), 1))
        if self.mistake == "iron" and self._step == "turn":
            over = np.sin(2.0 * pi * 0.13 * t), np.cos(2.0 * pi * 0.21 * t), np.sin(2.0 * pi * 0.17 * t + 1.0)
            field_ut = field_ut + IRON_UT * np.stack(over, axis=-1)
        elif self.mistake == "magnet" and self._step == "turn":
            field_ut = field_ut + np.array([0.0, 0.0, MAGNET_UT])
        return field_ut
