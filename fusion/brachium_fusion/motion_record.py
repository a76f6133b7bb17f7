"""What all sensors of a subject did over a while, to align them from. Pure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.sensor_to_segment import SensorRecord
from brachium_fusion.steady_heading import steady
from brachium_fusion.timeline import Reading, at_instant
from brachium_fusion.track import SegmentTrack

Floats = npt.NDArray[np.float64]

_WIDTH = 10
"""Orientation, rate and force in one row."""


class MotionRecord:
    """Rows at instants, one after another; float32, so that a snapshot of a minute stays small."""

    def __init__(self) -> None:
        self.times_ns: list[int] = []
        self._rows: dict[str, list[tuple[int, npt.NDArray[np.float32]]]] = {}

    def take(
        self, now: int, readings: Mapping[str, Reading | None], tracks: Mapping[str, SegmentTrack]
    ) -> None:
        """Add the instant."""
        for segment, reading in readings.items():
            if reading is None:
                continue
            row = np.full(_WIDTH, np.nan, dtype=np.float32)
            row[:4] = at_instant(reading)
            motion = tracks[segment].timeline.motion_at(now)
            if motion is not None:
                row[4:7], row[7:] = motion.gyr, motion.acc
            self._rows.setdefault(segment, []).append((len(self.times_ns), row))
        self.times_ns.append(now)

    def turned(self, segment: str) -> float:
        """Return by how much a sensor turned between the last two instants, rad; 0 unless both have it."""
        rows = self._rows.get(segment, [])[-2:]
        if [index for index, _ in rows] != [len(self.times_ns) - 2, len(self.times_ns) - 1]:
            return 0.0
        before, after = (row[:4].astype(np.float64) for _, row in rows)
        return float(rotation.angle_between(rotation.normalize(before), rotation.normalize(after)))

    def records(self, tracks: Mapping[str, SegmentTrack]) -> dict[str, SensorRecord]:
        """Return all sensors' records, of equal length; NaN where one was not there.

        A magnetometer's heading is held steady by the gyroscope.
        """
        found = {}
        rate_hz = 1e9 / float(np.median(np.diff(self.times_ns))) if len(self.times_ns) > 1 else 1.0
        for segment, rows in self._rows.items():
            track = tracks.get(segment)
            if track is None:
                continue
            block = np.full((len(self.times_ns), _WIDTH), np.nan)
            block[[index for index, _ in rows]] = [row for _, row in rows]
            raw = not track.info.orientation_only
            world_from_sensor = rotation.normalize(block[:, :4])
            if track.magnetometer:
                world_from_sensor = steady(world_from_sensor, block[:, 4:7], block[:, 7:], rate_hz)
            found[segment] = SensorRecord(
                world_from_sensor=world_from_sensor,
                magnetometer=track.shares_world,
                nominal_mounting=None if track.info.mounting is None else np.array(track.info.mounting),
                gyr=block[:, 4:7] if raw else None,
                acc=block[:, 7:] if raw else None,
            )
        return found

    def forget(self, segment: str) -> None:
        """Leave aside what a sensor showed that is not there any more."""
        self._rows.pop(segment, None)

    def state(self) -> dict[str, Any]:
        """Return all that is held, as plain values."""
        return {
            "times_ns": self.times_ns,
            "rows": {
                s: [[i for i, _ in rows], b"".join(row.tobytes() for _, row in rows)]
                for s, rows in self._rows.items()
            },
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the record whose state this is would have."""
        self.times_ns = list(state["times_ns"])
        self._rows = {}
        for segment, (indices, rows) in state["rows"].items():
            block = np.frombuffer(rows, dtype=np.float32).reshape(-1, _WIDTH)
            self._rows[segment] = list(zip(indices, block, strict=True))
