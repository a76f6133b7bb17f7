"""One arm's skeletons as arrays. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_wire.messages import Skeleton

Floats = npt.NDArray[np.float64]

_MEASURED = ("good", "disturbed", "heading_assumed", "assumed")
"""Qualities of a segment that is calibrated and was measured at the instant itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One subject's skeletons at n instants; NaN where nothing was measured."""

    time_s: Floats
    trunk_from: dict[str, Floats]
    """By segment, (n, 4)."""
    sensor: dict[str, Floats]
    """world_from_sensor by segment, (n, 4)."""
    segment_from_sensor: dict[str, Floats]
    """(4,), as fusion has found it: the newest."""
    places: dict[str, Floats]
    """Joints in trunk axes, (n, 3) m."""


def track(skeletons: Sequence[Skeleton], origin_ns: int, *, truth: bool = False) -> Track:
    """Return skeletons of one arm, in order, as arrays; times count from `origin_ns`.

    With `truth` they are what an emulated wearer does: nothing of it is uncalibrated.
    """
    n = len(skeletons)
    names = sorted({name for s in skeletons for name in s.segments})
    joints = sorted({name for s in skeletons for name in s.positions})
    segments, sensors = ({name: np.full((n, 4), np.nan) for name in names} for _ in range(2))
    places = {name: np.full((n, 3), np.nan) for name in joints}
    trunks = np.array([s.trunk_from_world for s in skeletons]).reshape(n, 4)
    mountings: dict[str, Floats] = {}
    for i, skeleton in enumerate(skeletons):
        known = True
        for name, pose in skeleton.segments.items():
            if pose.world_from_segment is None or not (truth or pose.quality in _MEASURED):
                known = False
                continue
            segments[name][i] = pose.world_from_segment
            if pose.world_from_sensor is not None:
                sensors[name][i] = pose.world_from_sensor
                mountings[name] = rotation.multiply(rotation.inverse(segments[name][i]), sensors[name][i])
        if known:
            for name, place in skeleton.positions.items():
                places[name][i] = place
    time_s = np.array([1e-9 * (s.time_ns - origin_ns) for s in skeletons])
    trunk_from = {name: rotation.multiply(trunks, q) for name, q in segments.items()}
    return Track(time_s, trunk_from, sensors, mountings, places)
