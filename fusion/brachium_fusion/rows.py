"""Rows: one arm at one instant each, with all that it is computed from. Pure."""

from math import radians
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.assumptions import StatedAngles
from brachium_body.segments import SIDES, Side, arm_segments
from brachium_fusion.pose import Alignment
from brachium_fusion.session_terms import lengths_of, stated_angles
from brachium_fusion.subject import Instant, Subject
from brachium_fusion.timeline import Reading, Shift
from brachium_wire.messages import Forward, Origin, Quality, Session

Floats = npt.NDArray[np.float64]

HEADING_SD_DEG = 2.0
HEADING_DRIFT_DEG_S = 0.02
"""Heading without a magnetometer: uncertain by 2 deg after a pose, then by what a bias estimated at rests
leaves of a cheap gyroscope (0.02 deg/s). A working assumption, stated in docs/conventions.md."""
WITHHOLD_DEG = 15.0
"""Angles that rest on heading are left out when it is less certain than this."""

SLOTS: dict[Side, tuple[str, str, str, str]] = {side: ("sternum", *arm_segments(side)) for side in SIDES}


class Row(NamedTuple):
    """One arm at one instant, and all that it is computed from."""

    subject: str
    side: Side
    time_ns: int
    received_ns: int
    readings: tuple[Reading | None, ...]
    qualities: tuple[Quality | None, ...]
    """Per slot; None where the subject wears no sensor there."""
    frame: "Frame"
    withhold_heading: bool
    shift: Shift | None = None
    heading_sd: tuple[float | None, float | None, float | None] = (None, None, None)
    """rad, of shoulder, elbow and wrist; None where nothing tells it."""


def rows_of(subject_id: str, subject: Subject, instant: Instant) -> list[Row]:
    """Return a row for each side of which an arm segment is known at the instant."""
    rows = []
    found = instant.readings
    for side, slots in SLOTS.items():
        readings = (found.get(slots[0]), found.get(slots[1]), found.get(slots[2]), found.get(slots[3]))
        if readings[1] is None and readings[2] is None and readings[3] is None:
            continue
        frame = _frame(subject, instant, side)
        qualities: tuple[Quality | None, ...] = tuple(
            [
                None if reading is None and slot not in found else _quality(reading, aligned)
                for slot, reading, aligned in zip(slots, readings, frame.aligned, strict=True)
            ]
        )
        uncertain, shoulder_sd = False, None
        if frame.drifts:
            age_s = 1e-9 * (instant.time_ns - subject.calibrating.reference_ns)
            sd_deg = HEADING_SD_DEG + HEADING_DRIFT_DEG_S * age_s
            uncertain, shoulder_sd = sd_deg > WITHHOLD_DEG, radians(sd_deg)
        rows.append(
            Row(
                subject_id,
                side,
                instant.time_ns,
                instant.received_ns,
                readings,
                qualities,
                frame,
                uncertain,
                instant.shifts.get(side),
                (shoulder_sd, *subject.binding.heading_sd(side)),
            )
        )
    return rows


def _quality(reading: Reading | None, aligned: Quality) -> Quality:
    """Return the worse of how a segment was measured at an instant and how it was aligned."""
    if reading is None:
        return "missing"
    return reading.quality if aligned == "good" or reading.quality == "held" else aligned


class Frame(NamedTuple):
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


def _frame(subject: Subject, instant: Instant, side: Side) -> Frame:
    """Return the arm's frame, made anew only when something it rests on was replaced."""
    known = subject.frames.get(side)
    if isinstance(known, Frame) and known.revision == subject.revision:
        return known
    slots = SLOTS[side]
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
    frame = Frame(
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
        stated=stated_angles(instant.session),
        forward=alignment.forward,
        origin="emulated" if "emulated" in origins else "playback" if "playback" in origins else "worn",
        drifts=not any(t.shares_world for t in tracks) and "sternum" not in subject.tracks,
        sternum="sternum" in alignment.mounting,
    )
    subject.frames[side] = frame
    return frame


def _facing(session: Session, subject: Subject) -> Floats:
    if session.facing_deg is None or not any(track.magnetometer for track in subject.tracks.values()):
        return rotation.IDENTITY
    return rotation.about(2, -radians(session.facing_deg))
