"""A chip on a bench before it is worn: the raw readings from which its calibration can be found.

The chip is the one that the same seed puts on the same segment of the wearer, with its own noise.
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from brachium_body import rotation
from brachium_nodes.mounting import random_turn
from brachium_nodes.movement import Array
from brachium_nodes.sensors import FIELD_UT, GRAVITY, LEVELS, Chip, generator
from brachium_nodes.wearer import WearerSettings
from brachium_wire.messages import SensorCalibration
from brachium_wire.tuples import vector

FACE_ERROR_DEG = 1.0
"""3-D rms of the angle by which a face laid down by hand is off."""
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""The axis that points up."""

_UP: Array = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class BenchReadings:
    """Raw readings (n, 3) in sensor axes, at `rate_hz`."""

    rate_hz: float
    gyr: Array
    acc: Array
    mag: Array


@dataclass(frozen=True, slots=True)
class CalibrationBench:
    """One chip of one wearer on the bench."""

    settings: WearerSettings
    segment: str

    @property
    def chip(self) -> Chip:
        """The chip."""
        return Chip.draw(
            self.settings.errors or LEVELS[self.settings.level], self.settings.seed, self.segment
        )

    def at_rest(self, seconds: float = 5.0) -> BenchReadings:
        """Return readings of the chip lying still: for the gyro's bias."""
        return self._still("rest", rotation.IDENTITY, seconds)

    def six_faces(self, seconds: float = 2.0, error_deg: float = FACE_ERROR_DEG) -> dict[str, BenchReadings]:
        """Return readings with each axis up and down, by FACES, each laid down with some error."""
        found: dict[str, BenchReadings] = {}
        for number, face in enumerate(FACES):
            up = (1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])]
            off = rotation.from_rotation_vector(random_turn(error_deg, self._random("face", number)))
            found[face] = self._still(f"face/{face}", rotation.multiply(off, to_up(up)), seconds)
        return found

    def still_poses(self, count: int = 16, seconds: float = 2.0) -> list[BenchReadings]:
        """Return readings in this many arbitrary still poses, spread over the sphere: for an ellipsoid."""
        k, random = np.arange(count) + 0.5, self._random("poses")
        height, turn = 1.0 - 2.0 * k / count, pi * (1.0 + sqrt(5.0)) * k
        flat: Array = np.sqrt(1.0 - height**2)
        ups = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=-1)
        anyhow = rotation.about(2, random.uniform(0.0, 2.0 * pi, count))
        poses = rotation.multiply(anyhow, np.stack([to_up(up) for up in ups]))
        return [self._still(f"pose/{number}", pose, seconds) for number, pose in enumerate(poses)]

    def turned_everywhere(self, seconds: float = 60.0) -> BenchReadings:
        """Return readings while the chip is turned slowly in every direction: for the magnetometer."""
        t = np.arange(round(seconds * self.settings.rate_hz)) / self.settings.rate_hz
        return self._read("turns", *(turning(t + step) for step in (-_STEP_S, 0.0, _STEP_S)))

    def perfect_calibration(self) -> SensorCalibration:
        """Return the calibration that leaves no error of bias, scale or iron: what a fit is judged by.

        The gyro's scale, which no calibration here knows, stays.
        """
        chip, c = self.chip, self.chip.calibration
        scale, matrix = np.array(c.accel_scale), np.array(c.mag_matrix)
        return SensorCalibration(
            gyro_bias=vector(np.array(c.gyro_bias) + chip.gyro_bias),
            accel_scale=vector(scale / chip.accel_factor),
            accel_bias=vector(np.array(c.accel_bias) + chip.accel_bias / scale),
            mag_offset=vector(np.array(c.mag_offset) + np.linalg.solve(matrix, chip.mag_bias)),
            mag_matrix=c.mag_matrix,
        )

    def _still(self, what: str, world_from_sensor: Array, seconds: float) -> BenchReadings:
        many = np.tile(world_from_sensor, (round(seconds * self.settings.rate_hz), 1))
        return self._read(what, many, many, many)

    def _read(self, what: str, before: Array, at: Array, after: Array) -> BenchReadings:
        sensor_from_world, rate_hz = rotation.inverse(at), self.settings.rate_hz
        turn = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(before), after))
        acc, gyr, mag = self.chip.read(
            rotation.rotate(sensor_from_world, -GRAVITY),
            turn / (2.0 * _STEP_S),
            rotation.rotate(sensor_from_world, FIELD_UT),
            rate_hz,
            np.zeros_like(turn),
            self._random(what).standard_normal((3, *turn.shape)),
        )
        return BenchReadings(rate_hz, gyr, acc, mag)

    def _random(self, what: str, number: int = 0) -> np.random.Generator:
        return generator(self.settings.seed, self.segment, f"bench/{what}", number)


_STEP_S = 0.001


def turning(t: Array) -> Array:
    """Return world_from_sensor (n, 4) of a chip that is turned by hand about three axes at once."""
    turns = [rotation.about(axis, 2.0 * pi * hz * t) for axis, hz in ((2, 0.11), (0, 0.071), (1, 0.29))]
    return rotation.multiply(rotation.multiply(turns[0], turns[1]), turns[2])


def to_up(up: Array) -> Array:
    """Return a world_from_sensor (4,) that turns the direction `up` (3,) of sensor axes to the world's up."""
    axis, cosine = np.cross(up, _UP), float(up @ _UP)
    if np.linalg.norm(axis) < 1e-9:
        return rotation.IDENTITY if cosine > 0.0 else rotation.about(0, pi)
    return rotation.from_rotation_vector(axis / np.linalg.norm(axis) * np.arccos(cosine))
