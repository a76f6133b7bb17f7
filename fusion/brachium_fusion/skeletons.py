"""Solved rows as messages: what is not known is left out, what is not plainly good is named. Pure."""

from collections.abc import Sequence
from functools import lru_cache
from math import hypot, radians
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body.angles import CLAVICLE, COLUMNS, ELBOW, SHOULDER, TRUNK, WRIST
from brachium_body.assumptions import ASSUMED
from brachium_body.kinematics import JOINTS
from brachium_fusion.rows import SLOTS, Row
from brachium_wire.messages import Quality, SegmentPose, Skeleton

Floats = npt.NDArray[np.float64]

_RANK: dict[Quality, int] = {
    "good": 0,
    "disturbed": 1,
    "heading_assumed": 2,
    "uncalibrated": 3,
    "held": 4,
    "missing": 5,
    "assumed": 6,
}
"""The worse quality wins where several segments meet; `held` tells more about now than how it was aligned."""


TILT_SD = radians(1.0)
"""Of an angle by the tilt of its sensors in movement: a working assumption (docs/conventions.md)."""
_CLINICAL = (
    ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation"),
    ("elbow_flexion", "forearm_pronation"),
    ("wrist_flexion", "wrist_deviation"),
)
_GOOD: frozenset[Quality | None] = frozenset({"good", None})
_NEEDS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(SHOULDER, (0, 1)),
    **dict.fromkeys(ELBOW, (1, 2)),
    **dict.fromkeys(WRIST, (2, 3)),
    **dict.fromkeys(TRUNK, (0,)),
    **dict.fromkeys(CLAVICLE, (0, 1, 2)),
    "shoulder": (0,),
    "elbow": (0, 1),
    "wrist": (0, 1, 2),
    "hand": (0, 1, 2, 3),
}
"""Which slots an angle or position rests on."""


def messages(
    rows: Sequence[Row],
    world_from_sensor: Floats,
    world_from_segment: Floats,
    trunk_from_world: Floats,
    angles: Floats,
    angle_codes: npt.NDArray[np.uint8],
    places: Floats,
    place_codes: npt.NDArray[np.uint8],
    shift: Floats | None = None,
) -> list[Skeleton]:
    """Return one skeleton a row.

    Orientations (n, 4 slots, 4), trunk_from_world (n, 4), angles (n, columns) rad, places (n, joints, 3) m,
    shift (n, 2, 3) m, the shoulder's and its standard deviation;
    NaN where nothing is known; the codes say what rests on an assumption (brachium_body.assumptions).
    """
    sensors, segments = world_from_sensor.tolist(), world_from_segment.tolist()
    trunks, values, points = trunk_from_world.tolist(), angles.tolist(), places.tolist()
    rests_on = ((angle_codes == ASSUMED).any(axis=1) | (place_codes == ASSUMED).any(axis=1)).tolist()
    patterns = [_pattern(row.tobytes()) for row in np.logical_not(np.isnan(angles))]
    complete_places = np.all(~np.isnan(places[..., 0]), axis=1).tolist()
    skeletons = []
    for i, row in enumerate(rows):
        given = patterns[i].named(values[i])
        known = {
            name: (p[0], p[1], p[2])
            for name, p in zip(JOINTS, points[i], strict=True)
            if complete_places[i] or p[0] == p[0]
        }
        assumed: dict[str, Quality] = {}
        if rests_on[i] or not _GOOD.issuperset(row.qualities):
            codes = angle_codes[i].tobytes() + place_codes[i].tobytes()
            assumed = dict(_qualities(row.qualities, codes, (*given, *known)))
        frame = row.frame
        moved = None if shift is None or shift[i, 0, 0] != shift[i, 0, 0] else shift[i].tolist()
        skeletons.append(
            Skeleton(
                time_ns=row.time_ns,
                side=row.side,
                origin=frame.origin,
                forward=frame.forward,
                trunk_from_world=_four(trunks[i]),
                segments=_poses(row, sensors[i], segments[i]),
                positions=known,
                angles=given,
                assumed=assumed,
                shoulder_shift=None if moved is None else _three(moved[0]),
                shoulder_shift_sd=None if moved is None else _three(moved[1]),
                received_ns=row.received_ns,
                angle_sd=_deviations(row.heading_sd, given),
            )
        )
    return skeletons


def _deviations(heading_sd: tuple[float | None, ...], given: dict[str, float]) -> dict[str, float]:
    """Return the standard deviations of clinical angles whose heading is known so well, rad.

    A heading may turn an angle by all of itself, or less: this is the most.
    """
    result: dict[str, float] = {}
    for names, sd in zip(_CLINICAL, heading_sd, strict=True):
        if sd is not None:
            whole = hypot(TILT_SD, sd)
            result |= {name: whole for name in names if name in given}
    return result


def _poses(row: Row, sensors: list[list[float]], segments: list[list[float]]) -> dict[str, SegmentPose]:
    poses: dict[str, SegmentPose] = {}
    for slot, segment in enumerate(SLOTS[row.side]):
        quality, reading = row.qualities[slot], row.readings[slot]
        if quality is None:
            continue
        if reading is None:
            poses[segment] = SegmentPose(quality="missing")
        else:
            poses[segment] = SegmentPose(
                quality=quality,
                sequence=reading.sequence,
                world_from_segment=_four(segments[slot]),
                world_from_sensor=_four(sensors[slot]),
            )
    return poses


def _three(values: list[float]) -> tuple[float, float, float]:
    return (values[0], values[1], values[2])


def _four(values: list[float]) -> tuple[float, float, float, float]:
    return (values[0], values[1], values[2], values[3])


class _Pattern(NamedTuple):
    """Which of a row's angles are known; the same few patterns come again and again."""

    names: tuple[str, ...]
    indices: tuple[int, ...]

    def named(self, values: list[float]) -> dict[str, float]:
        """Return the known angles by name."""
        return dict(zip(self.names, [values[i] for i in self.indices], strict=True))


@lru_cache(maxsize=64)
def _pattern(bits: bytes) -> _Pattern:
    indices = tuple(i for i, bit in enumerate(bits) if bit)
    return _Pattern(tuple(COLUMNS[i] for i in indices), indices)


@lru_cache(maxsize=256)
def _qualities(
    slots: tuple[Quality | None, ...], codes: bytes, names: tuple[str, ...]
) -> tuple[tuple[str, Quality], ...]:
    """Return the quality of every named angle and position that is not plainly good."""
    code = dict(zip((*COLUMNS, *JOINTS), codes, strict=True))
    result: list[tuple[str, Quality]] = []
    for name in names:
        worst: Quality = "assumed" if code[name] == ASSUMED else "good"
        for slot in _NEEDS[name]:
            quality = slots[slot]
            if quality is not None and _RANK[quality] > _RANK[worst]:
                worst = quality
        if worst != "good":
            result.append((name, worst))
    return tuple(result)
