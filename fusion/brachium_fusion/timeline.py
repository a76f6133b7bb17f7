"""What a sensor showed over the last moments: orientation and motion at any instant between samples. Pure."""

from bisect import bisect_left, bisect_right
from collections import deque
from math import acos, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_fusion.sample_block import Block, block_of
from brachium_wire.messages import Quality

Floats = npt.NDArray[np.float64]


class Reading(NamedTuple):
    """The orientation at an instant lies at `fraction` of the way between two samples."""

    before: Floats
    after: Floats
    fraction: float
    quality: Quality
    sequence: int
    received_ns: int


def at_instant(reading: Reading) -> Floats:
    """Return the orientation (4,) of one reading: what rotation.slerp gives of arrays, at a tenth of its
    time."""
    if reading.fraction == 0.0 or reading.before is reading.after:
        return reading.before
    a, b = reading.before.tolist(), reading.after.tolist()
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = 1.0 if dot >= 0.0 else -1.0
    angle = acos(min(sign * dot, 1.0))
    first, second = 1.0 - reading.fraction, sign * reading.fraction
    if angle > 1e-4:
        first = sin(first * angle) / sin(angle)
        second = sign * sin(reading.fraction * angle) / sin(angle)
    w, x, y, z = (first * p + second * q for p, q in zip(a, b, strict=True))
    length = sqrt(w * w + x * x + y * y + z * z)
    return np.array([w / length, x / length, y / length, z / length])


class Motion(NamedTuple):
    """Calibrated angular rate (3,) rad/s and specific force (3,) m/s^2 at an instant, in sensor axes."""

    gyr: Floats
    acc: Floats


class SensorNow(NamedTuple):
    """One sensor at an instant: orientation (4,), its heading as the pose set it, rate and force."""

    world_from_sensor: Floats
    motion: Motion


class Shift(NamedTuple):
    """Displacement of a shoulder since the pose, and its standard deviation: (3,) m in world axes."""

    metres: Floats
    sd: Floats


class Timeline:
    """The newest batches of one sensor."""

    def __init__(self) -> None:
        self._blocks: deque[Block] = deque()

    def __bool__(self) -> bool:
        return bool(self._blocks)

    @property
    def first_ns(self) -> int:
        """Host time of the oldest sample still held; 0 before any."""
        return self._blocks[0].times[0] if self._blocks else 0

    @property
    def last(self) -> Block:
        """The newest batch; there must be one."""
        return self._blocks[-1]

    def append(self, block: Block) -> None:
        """Take the next batch."""
        self._blocks.append(block)

    def _block_at(self, time_ns: int) -> Block | None:
        for block in self._blocks:
            if time_ns <= block.times[-1]:
                return block
        return None

    def at(self, time_ns: int, *, unseen: bool = False) -> Reading | None:
        """Return the orientation at an instant up to `last_ns`, or None where nothing was measured.

        `unseen`: also in a gap that was bridged although it is too long to be shown.
        """
        block = self._block_at(time_ns)
        if block is None:
            return None
        quality: Quality = "disturbed" if block.disturbed else "good"
        after = bisect_left(block.times, time_ns)
        t1, behind = block.times[after], block.quats[after]
        if after > 0:
            t0, before = block.times[after - 1], block.quats[after - 1]
        elif time_ns == t1:
            t0, before = t1, block.quats[0]
        elif not block.shows(time_ns, unseen=unseen):
            return None
        else:
            t0, t1, before, behind = block.before_first(time_ns)
            quality = block.gap or quality
        return Reading(
            before,
            behind,
            (time_ns - t0) / (t1 - t0) if t1 > t0 else 1.0,
            quality,
            block.first_sequence + after,
            block.received_ns,
        )

    def motion_at(self, time_ns: int, *, unseen: bool = False) -> Motion | None:
        """Return rate and force on the straight line between the samples around an instant.

        None where `at` gives nothing, and for a sensor that delivers orientation only.
        """
        block = self._block_at(time_ns)
        if block is None or block.moved is None:
            return None
        rows = block.moved.rows()
        after = bisect_left(block.times, time_ns)
        t1, value = block.times[after], rows[after + 1]
        if time_ns < t1:
            if after > 0:
                t0, before = block.times[after - 1], rows[after]
            elif not block.shows(time_ns, unseen=unseen):
                return None
            elif block.carried is None:
                t0, before = block.before_ns, rows[0]
            else:
                times, _, carried = block.carried
                i = bisect_right(times, time_ns)
                t0, before = times[i - 1], carried[i - 1]
                if i < len(times):
                    t1, value = times[i], carried[i]
            value = before + (time_ns - t0) / (t1 - t0) * (value - before)
        return Motion(value[:3], value[3:])

    def next_sample_ns(self, after_ns: int) -> int | None:
        """Return the time of the first sample later than an instant, or None while there is none."""
        for block in self._blocks:
            if block.times[-1] > after_ns:
                return next(t for t in block.times if t > after_ns)
        return None

    def latest(self) -> Reading | None:
        """Return the last orientation there is, marked held."""
        if not self._blocks:
            return None
        block = self._blocks[-1]
        sequence = block.first_sequence + len(block.times) - 1
        return Reading(block.quats[-1], block.quats[-1], 0.0, "held", sequence, block.received_ns)

    def forget(self, before_ns: int) -> None:
        """Let go of batches that end before an instant; the last one is always kept."""
        blocks = self._blocks
        while len(blocks) > 1 and blocks[0].times[-1] < before_ns:
            blocks.popleft()

    def state(self) -> list[Any]:
        """Return all that is held, as plain values."""
        return [block.state() for block in self._blocks]

    def restore(self, state: list[Any]) -> None:
        """Go on as the timeline whose state this is would have."""
        self._blocks = deque(map(block_of, state))
