"""Kinematics of many arms at once: orientations of sensors at solved instants in, skeletons out. Pure.

A row is one arm at one instant. Everything but the memory of each arm's last angles is computed for all
rows in one
go; the memory takes each arm's rows one after another.
"""

from collections.abc import Sequence
from dataclasses import fields
from functools import lru_cache
from math import radians
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.angles import CLAVICLE, COLUMNS, ELBOW, INDEX, SHOULDER, TRUNK, WRIST, joint_angles
from brachium_body.assumptions import (
    AS_STATED_BY_DEFAULT,
    ASSUMED,
    StatedAngles,
    complete,
    known_set,
    provenance,
    withhold,
)
from brachium_body.continuation import AngleTracker
from brachium_body.denavit_hartenberg import printed_angles
from brachium_body.kinematics import JOINTS, TRUNK_FROM_THORAX, SegmentOrientations, between, positions
from brachium_body.lengths import ArmLengths, from_measured
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.pose import Alignment
from brachium_fusion.subject import Instant, Settings, Subject
from brachium_fusion.track import Reading
from brachium_wire.messages import Forward, Origin, Quality, SegmentPose, Session, Skeleton

Floats = npt.NDArray[np.float64]

DEFAULT_HEIGHT_M = 1.75
"""Used for lengths while nobody said how tall the subject is."""
HEADING_SD_DEG = 2.0
HEADING_DRIFT_DEG_S = 0.02
"""Heading without a magnetometer: uncertain by 2 deg after a pose, then by what a bias estimated at rests
leaves of a
cheap gyroscope (0.02 deg/s). A working assumption, stated in docs/conventions.md."""
WITHHOLD_DEG = 15.0
"""Angles that rest on heading are left out when it is less certain than this."""

_SLOTS: dict[Side, tuple[str, str, str, str]] = {side: ("sternum", *arm_segments(side)) for side in SIDES}
_NOTHING = Reading(np.full(4, np.nan), np.full(4, np.nan), 0.0, "missing", 0, 0)
_ON_HEADING = np.array([INDEX[n] for n in SHOULDER if n != "isb_elevation"])
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


_GOOD: frozenset[Quality | None] = frozenset({"good", None})


class Row(NamedTuple):
    """One arm at one instant, and all that it is computed from."""

    subject: str
    side: Side
    time_ns: int
    received_ns: int
    readings: tuple[Reading | None, ...]
    qualities: tuple[Quality | None, ...]
    """Per slot; None where the subject wears no sensor there."""
    frame: "_Frame"
    withhold_heading: bool


def rows_of(subject_id: str, subject: Subject, instant: Instant) -> list[Row]:
    """Return a row for each side of which an arm segment is known at the instant."""
    rows = []
    found = instant.readings
    for side, slots in _SLOTS.items():
        readings = (found.get(slots[0]), found.get(slots[1]), found.get(slots[2]), found.get(slots[3]))
        if readings[1] is None and readings[2] is None and readings[3] is None:
            continue
        frame = _frame(subject, instant, side)
        qualities = tuple(
            [
                None if reading is None and slot not in found else _quality(reading, aligned)
                for slot, reading, aligned in zip(slots, readings, frame.aligned, strict=True)
            ]
        )
        uncertain = False
        if frame.drifts:
            age_s = 1e-9 * (instant.time_ns - subject.reference_ns)
            uncertain = HEADING_SD_DEG + HEADING_DRIFT_DEG_S * age_s > WITHHOLD_DEG
        rows.append(
            Row(subject_id, side, instant.time_ns, instant.received_ns, readings, qualities, frame, uncertain)
        )
    return rows


def _quality(reading: Reading | None, aligned: Quality) -> Quality:
    """Return the worse of how a segment was measured at an instant and how it was aligned."""
    if reading is None:
        return "missing"
    return reading.quality if aligned == "good" or reading.quality == "held" else aligned


class _Frame(NamedTuple):
    """What stays the same for an arm between two calibrations."""

    revision: int
    aligned: tuple[Quality, ...]
    """Per slot: good, heading_assumed or uncalibrated."""
    numbers: Floats
    """(40,): per slot the turn of its heading and sensor_from_segment, then trunk_from_world while no sternum
    sensor says otherwise, then the four lengths."""
    turned: bool
    """Some heading is turned."""
    stated: StatedAngles
    forward: Forward
    origin: Origin
    drifts: bool
    """Nothing keeps the heading: no magnetometer, no sternum sensor."""
    sternum: bool
    """A sternum sensor is aligned."""


def _frame(subject: Subject, instant: Instant, side: Side) -> _Frame:
    """Return the arm's frame, made anew only when something it rests on was replaced."""
    known = subject.frames.get(side)
    if isinstance(known, _Frame) and known.revision == subject.revision:
        return known
    slots = _SLOTS[side]
    alignment = instant.alignment or Alignment(world_from_trunk=_facing(instant.session, subject))
    turn = np.tile(rotation.IDENTITY, (len(slots), 1))
    sensor_from_segment = turn.copy()
    for index, segment in enumerate(slots):
        track = subject.tracks.get(segment)
        if segment in alignment.mounting:
            sensor_from_segment[index] = rotation.inverse(alignment.mounting[segment])
            turn[index] = rotation.about(2, alignment.heading[segment])
        elif track is not None and track.info.mounting is not None:
            sensor_from_segment[index] = rotation.inverse(track.info.mounting)
    tracks = [subject.tracks[s] for s in slots if s in subject.tracks]
    origins = {track.info.origin for track in tracks}
    frame = _Frame(
        revision=subject.revision,
        aligned=tuple(
            "uncalibrated"
            if s not in alignment.mounting
            else "heading_assumed"
            if s in alignment.assumed
            else "good"
            for s in slots
        ),
        numbers=np.concatenate(
            [
                turn.ravel(),
                sensor_from_segment.ravel(),
                rotation.inverse(alignment.world_from_trunk),
                np.asarray(lengths_of(instant.session)),
            ]
        ),
        turned=any(alignment.heading.values()),
        stated=_stated(instant.session),
        forward=alignment.forward,
        origin="emulated" if "emulated" in origins else "playback" if "playback" in origins else "worn",
        drifts=not any(t.magnetometer or t.info.orientation_only for t in tracks)
        and "sternum" not in subject.tracks,
        sternum="sternum" in alignment.mounting,
    )
    subject.frames[side] = frame
    return frame


def lengths_of(session: Session) -> ArmLengths:
    """Return the arm lengths a session states, completed from height."""
    return from_measured(session.lengths_m, session.height_m or DEFAULT_HEIGHT_M)


def check_session(session: Session) -> None:
    """Raise ValueError naming what of a session no arm has, or what nobody can use."""
    lengths_of(session)
    unknown = sorted(set(session.assumed_angles_deg) - {f.name for f in fields(StatedAngles)})
    if unknown:
        raise ValueError(f"assumed_angles_deg cannot use {unknown[0]!r}")


def _facing(session: Session, subject: Subject) -> Floats:
    if session.facing_deg is None or not any(track.magnetometer for track in subject.tracks.values()):
        return rotation.IDENTITY
    return rotation.about(2, -radians(session.facing_deg))


def _stated(session: Session) -> StatedAngles:
    angles = {name: radians(value) for name, value in session.assumed_angles_deg.items()}
    return StatedAngles(**angles) if angles else AS_STATED_BY_DEFAULT


class Arms:
    """The arms' memory, and the solving of rows."""

    def __init__(self, settings: Settings) -> None:
        self._printed = settings.filter == "complementary-printed"
        self._tracker = AngleTracker()
        self._index: dict[tuple[str, Side], int] = {}

    def solve(self, rows: Sequence[Row]) -> list[Skeleton]:
        """Return one skeleton a row, in the order of the rows."""
        if not rows:
            return []
        left = np.array([row.side == "left" for row in rows])
        frames = [row.frame for row in rows]
        numbers = np.concatenate([frame.numbers for frame in frames]).reshape(-1, 40)
        world_from_sensor = _orientations(rows)
        if any(frame.turned for frame in frames):
            world_from_sensor = rotation.multiply(numbers[:, :16].reshape(-1, 4, 4), world_from_sensor)
        world_from_segment = rotation.multiply(world_from_sensor, numbers[:, 16:32].reshape(-1, 4, 4))
        trunk_from_world = numbers[:, 32:36]
        thorax_known = np.array([row.frame.sternum and row.readings[0] is not None for row in rows])
        from_pose = None
        if thorax_known.any():
            thorax_from_world = rotation.inverse(world_from_segment[:, 0])
            moving = rotation.multiply(TRUNK_FROM_THORAX, thorax_from_world)
            world_from_pose = rotation.multiply(rotation.inverse(trunk_from_world), TRUNK_FROM_THORAX)
            from_pose = rotation.multiply(rotation.inverse(world_from_pose), world_from_segment[:, 0])
            from_pose[~thorax_known] = np.nan
            trunk_from_world = np.where(thorax_known[:, None], moving, trunk_from_world)
        in_trunk = rotation.multiply(trunk_from_world[:, None], world_from_segment[:, 1:])
        measured = SegmentOrientations(in_trunk[:, 0], in_trunk[:, 1], in_trunk[:, 2])
        known = known_set(measured)
        full = measured
        if not (known == 7).all():
            full = complete(measured, left, _stated_rows(rows))
        joints = between(full)
        raw = joint_angles(*joints, left, calibration_from_thorax=from_pose)
        codes = provenance(known, thorax_known)
        angles = withhold(self._follow(rows, raw, joints.thorax_from_upper_arm, left), codes.angles)
        if self._printed:
            angles[:, :7] = withhold(printed_angles(joints, left), codes.angles[:, :7])
        drifting = np.array([row.withhold_heading for row in rows])
        if drifting.any():
            angles[np.ix_(drifting, _ON_HEADING)] = np.nan
        places = withhold(positions(*full, numbers[:, 36:], left), codes.positions)
        return _messages(
            rows,
            world_from_sensor,
            world_from_segment,
            trunk_from_world,
            angles,
            codes.angles,
            places,
            codes.positions,
        )

    def _follow(
        self, rows: Sequence[Row], raw: Floats, thorax_from_upper_arm: Floats, left: npt.NDArray[np.bool_]
    ) -> Floats:
        """Let each arm's angles follow its last ones, its rows in order of time."""
        arms = np.array([self._arm(row.subject, row.side) for row in rows])
        self._tracker.grow(len(self._index))
        result = np.empty_like(raw)
        turns = _turns(arms)
        for turn in range(int(turns.max()) + 1):
            now = turns == turn
            result[now] = self._tracker.step(arms[now], raw[now], thorax_from_upper_arm[now], left[now])
        return result

    def _arm(self, subject: str, side: Side) -> int:
        return self._index.setdefault((subject, side), len(self._index))

    def state(self, subject: str) -> dict[str, Any]:
        """Return the memory of one subject's arms, as plain values: NaN (nothing yet) as None."""
        last = self._tracker.state()
        return {
            side: [None if np.isnan(v) else v for v in last[i].tolist()]
            for (who, side), i in self._index.items()
            if who == subject and i < len(last)
        }

    def restore(self, subject: str, state: dict[str, Any]) -> None:
        """Go on as the arms whose memory this is would have."""
        rows = {
            self._arm(subject, side): [np.nan if v is None else v for v in values]
            for side, values in state.items()
            if side in SIDES
        }
        self._tracker.grow(len(self._index))
        last = self._tracker.state()
        for index, values in rows.items():
            last[index] = values
        self._tracker.restore(last)


def _orientations(rows: Sequence[Row]) -> Floats:
    """Return world_from_sensor (n, 4 slots, 4) at the rows' instants, NaN where nothing is known."""
    readings = [reading or _NOTHING for row in rows for reading in row.readings]
    before = np.concatenate([reading.before for reading in readings]).reshape(-1, 4)
    after = np.concatenate([reading.after for reading in readings]).reshape(-1, 4)
    fraction = np.array([reading.fraction for reading in readings])
    return rotation.slerp(before, after, fraction).reshape(-1, 4, 4)


def _turns(arms: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Return for each row how many rows of the same arm stand before it."""
    seen: dict[int, int] = {}
    turns = np.empty(len(arms), dtype=np.intp)
    for i, arm in enumerate(arms.tolist()):
        turns[i] = seen[arm] = seen.get(arm, -1) + 1
    return turns


def _stated_rows(rows: Sequence[Row]) -> StatedAngles:
    return StatedAngles(
        elbow_flexion=np.array([row.frame.stated.elbow_flexion for row in rows]),
        forearm_pronation=np.array([row.frame.stated.forearm_pronation for row in rows]),
        wrist_flexion=np.array([row.frame.stated.wrist_flexion for row in rows]),
        wrist_deviation=np.array([row.frame.stated.wrist_deviation for row in rows]),
    )


# -- messages --------------------------------------------------------------------------------------------

_NEEDS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(SHOULDER, (0, 1)),
    **dict.fromkeys(ELBOW, (1, 2)),
    **dict.fromkeys(WRIST, (2, 3)),
    **dict.fromkeys(TRUNK, (0,)),
    **dict.fromkeys(CLAVICLE, (1, 2)),
    "shoulder": (0,),
    "elbow": (0, 1),
    "wrist": (0, 1, 2),
    "hand": (0, 1, 2, 3),
}
"""Which slots an angle or position rests on."""


def _messages(
    rows: Sequence[Row],
    world_from_sensor: Floats,
    world_from_segment: Floats,
    trunk_from_world: Floats,
    angles: Floats,
    angle_codes: npt.NDArray[np.uint8],
    places: Floats,
    place_codes: npt.NDArray[np.uint8],
) -> list[Skeleton]:
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
            assumed = _qualities(row.qualities, angle_codes[i], place_codes[i], given.keys() | known.keys())
        frame = row.frame
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
                received_ns=row.received_ns,
            )
        )
    return skeletons


def _poses(row: Row, sensors: list[list[float]], segments: list[list[float]]) -> dict[str, SegmentPose]:
    poses: dict[str, SegmentPose] = {}
    for slot, segment in enumerate(_SLOTS[row.side]):
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


def _qualities(
    slots: tuple[Quality | None, ...],
    angle_codes: npt.NDArray[np.uint8],
    place_codes: npt.NDArray[np.uint8],
    names: set[str],
) -> dict[str, Quality]:
    """Return the quality of every named angle and position that is not plainly good."""
    codes = dict(zip((*COLUMNS, *JOINTS), (*angle_codes.tolist(), *place_codes.tolist()), strict=True))
    result: dict[str, Quality] = {}
    for name in (*COLUMNS, *JOINTS):
        if name not in names:
            continue
        if codes[name] == ASSUMED:
            result[name] = "assumed"
            continue
        worst = max((slots[s] or "good" for s in _NEEDS[name]), key=_RANK.__getitem__)
        if worst != "good":
            result[name] = worst
    return result
