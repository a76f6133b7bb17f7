"""The steps of a sensor's calibration while they go on: what was seen, what is still wanted. Pure.

Each takes samples as the chip gives them and is looked at some times a second: a look says what to do, or
what was found, or raises Refused. `too_late` says why it found nothing in its `longest_s`. turn_step.py has
the magnetometer's.
"""

from typing import NamedTuple

import numpy as np

from brachium_fusion.sensor_calibration import (
    GRAVITY,
    MARGIN_S,
    Floats,
    Refused,
    SensorFit,
    accel_laid_faces,
    face_of,
    gyro_at_rest,
)
from brachium_fusion.still_stretches import WINDOW_S, still_stretches
from brachium_wire.calibration_file import Part
from brachium_wire.sensor_records import SensorStep

REST_HELD_S, REST_LONGEST_S = 5.0, 40.0
FACE_HELD_S, FACES_LONGEST_S = 1.6, 150.0
"""A face's mean over one second has 3 mm/s^2 of a cheap chip's noise, a third of what is left of its bias."""
BIAS_MOST = 0.7
"""rad/s: twice what the poorest data sheet allows; a sensor that reads more turns evenly."""
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


WORDS: dict[SensorStep, str] = {
    "rest": "put the sensor on a table, let go of it and leave it",
    "faces": "lay it on each of its six faces, letting go for two seconds on each",
    "turn": "pick it up and turn it slowly, in figures of eight, until each side has pointed everywhere; "
    "stay away from iron",
}
"""What to do, for each step."""


class Motion(NamedTuple):
    """Samples as the chip gives them: rates and forces (n, 3), and field (k, 3) if it measures it."""

    gyr: Floats
    acc: Floats
    mag: Floats | None


class Seen(NamedTuple):
    """What a look at a step gives."""

    words: str
    """What to do now."""
    still: bool = False
    left_s: float = 0.0
    found: SensorFit | None = None


class Tail:
    """The newest samples of a sensor, some seconds of them: `gyr` and `acc` (n, 3)."""

    def __init__(self, rate_hz: float, seconds: float) -> None:
        self.rate_hz, self._rows = rate_hz, round(rate_hz * seconds)
        self.gyr, self.acc = np.empty((0, 3)), np.empty((0, 3))

    def take(self, samples: Motion) -> None:
        """Take samples; the oldest go."""
        self.gyr = np.concatenate([self.gyr, samples.gyr])[-self._rows :]
        self.acc = np.concatenate([self.acc, samples.acc])[-self._rows :]

    def still_rows(self) -> int:
        """Return for how many rows up to now the sensor has lain still."""
        stretches = still_stretches(self.gyr, self.acc, self.rate_hz, WINDOW_S)
        if not stretches or stretches[-1].stop < len(self.gyr):
            return 0
        return int(stretches[-1].stop - stretches[-1].start)


class Rest:
    """Let it lie still: the gyroscope's bias."""

    part: Part = "gyro"
    longest_s = REST_LONGEST_S

    def __init__(self, rate_hz: float) -> None:
        self._held_s = REST_HELD_S + 2.0 * MARGIN_S
        self._tail = Tail(rate_hz, self._held_s)
        self._lay_s = 0.0
        self._moved = False

    def take(self, samples: Motion) -> None:
        """Take samples."""
        self._tail.take(samples)

    def look(self) -> Seen:
        """Say how long it has lain still."""
        tail = self._tail
        still_s = tail.still_rows() / tail.rate_hz
        self._moved = self._moved or (self._lay_s >= 1.0 and still_s < 0.5 * self._lay_s)
        self._lay_s = still_s
        left_s = max(0.0, self._held_s - still_s - 0.5 / tail.rate_hz)
        if left_s > 0.0:
            words = "it moved: let it lie still" if self._moved and not still_s else WORDS["rest"]
            return Seen(words, still_s > 0.0, left_s)
        found = gyro_at_rest(tail.gyr, tail.acc, tail.rate_hz)
        bias = float(np.linalg.norm(np.array(found.calibration.gyro_bias)))
        if bias > BIAS_MOST:
            raise Refused(
                f"it turned evenly, by {np.degrees(bias):.0f} deg/s: put it on something that stands still"
            )
        found.scores["gyro_bias_dps"] = float(np.degrees(bias))
        return Seen(WORDS["rest"], still=True, found=found)

    def too_late(self) -> str:
        """Say why."""
        moved = "it was moved while it had to rest" if self._moved else "it did not lie still"
        return f"{moved}: put the sensor on a table, let go of it and wait for {REST_HELD_S:g} s"


class Faces:
    """Lay it on each of its six faces: the accelerometer's scale and bias."""

    part: Part = "accel"
    longest_s = FACES_LONGEST_S

    def __init__(self, rate_hz: float) -> None:
        self._tail = Tail(rate_hz, 3.0)
        self._best: dict[str, tuple[int, Floats]] = {}
        """By face, or by a number where none is up: how many samples, and their mean."""
        self._tilted = 0
        self._laid = False
        self.last_rates: Floats | None = None
        """Mean angular rate (3,) on the face seen last."""

    @property
    def seen(self) -> list[str]:
        """The faces seen."""
        return [face for face in FACES if face in self._best]

    def take(self, samples: Motion) -> None:
        """Take samples."""
        self._tail.take(samples)

    def look(self) -> Seen:
        """Take the face it lies on, once it has lain there long enough."""
        tail = self._tail
        rows, need = tail.still_rows(), round(FACE_HELD_S * tail.rate_hz)
        if rows < need:
            self._laid = False
            return Seen(self._words(), rows > 0, (need - rows) / tail.rate_hz if rows else 0.0)
        margin = round(MARGIN_S * tail.rate_hz)
        lain = slice(len(tail.acc) - rows + margin, len(tail.acc) - margin)
        mean: Floats = tail.acc[lain].mean(axis=0)
        face = face_of(mean)
        if not self._laid and not face:
            self._tilted += 1
        self._laid = True
        name = face or f"tilted {self._tilted}"
        if rows > self._best.get(name, (0, mean))[0]:
            self._best[name] = rows, mean
        if not face:
            return Seen(_too_tilted(mean), still=True)
        self.last_rates = tail.gyr[lain].mean(axis=0)
        return Seen(self._words(), still=True, found=self._fit() if len(self.seen) == len(FACES) else None)

    def _words(self) -> str:
        if not self._best:
            return WORDS["faces"]
        missing = ", ".join(face for face in FACES if face not in self._best)
        return f"lay it on another face; still to point upwards: {missing}" if missing else "all six faces"

    def _fit(self) -> SensorFit:
        poses = np.array([mean for _, mean in self._best.values()])
        found = accel_laid_faces(poses)
        before = np.linalg.norm(poses, axis=1) - GRAVITY
        found.scores["gravity_off_before_m_s2"] = float(np.sqrt(np.mean(before**2)))
        after = found.scores.pop("residual_m_s2")
        if len(poses) > len(FACES):  # of six, six unknowns leave nothing over
            found.scores["gravity_off_m_s2"] = after
        return found

    def too_late(self) -> str:
        """Say why."""
        missing = ", ".join(face for face in FACES if face not in self._best)
        tilted = f" ({self._tilted} poses were too tilted for a face)" if self._tilted else ""
        return f"these faces never pointed upwards: {missing}{tilted}; lay the sensor on all six"


def _too_tilted(mean: Floats) -> str:
    tilt = np.degrees(np.arccos(np.abs(mean).max() / np.linalg.norm(mean)))
    return f"tilted by {tilt:.0f} deg, too much for a face: lay it flat, against a wall or a box if need be"
