"""Two sensors on one segment, as Tsilomitrou et al. 2021 compared their node with a Shimmer3. Pure.

Between both lie a clock's offset, how each was found to sit on the segment, and two headings. The figures
are stated with all that as it was worn (but for the clock's offset, without which nothing belongs together),
and again with it taken out; what was taken out is stated too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_body.segments import ARM_PARTS, Side, part_of
from brachium_viewer import alignment as al
from brachium_viewer.arm_track import Track
from brachium_viewer.clock_offset import ClockOffset, Rates, Unrelated, clock_offset, wahba
from brachium_viewer.pairing import OrientationFigures
from brachium_viewer.statistics import (
    ErrorFigures,
    NormFigures,
    eq17,
    error_figures,
    interpolate,
    orientation_errors_deg,
)

Floats = npt.NDArray[np.float64]

ENDS = dict(zip(ARM_PARTS, ("elbow", "wrist", "hand"), strict=True))
"""The joint at each segment's far end; `hand` is the fingertip, the paper's end effector."""
_TELLING = 0.02
"""Part of all directions that must lie beside the two main ones: less does not tell how two sensors sit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceFigures:
    """How far one joint's two places are apart, m."""

    eq17: NormFigures
    """The paper's: of the distances from the chest; blind to most of an error."""
    apart: ErrorFigures
    """In three dimensions: of the distance between both; `bias` is its mean."""
    axes: dict[str, ErrorFigures]
    """The reference's place less the other's, along x right, y forward, z up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreed:
    """All figures of one way to compare."""

    places: dict[str, PlaceFigures]
    orientations: dict[str, OrientationFigures]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seat:
    """What lies between both sensors of a segment, and was taken out."""

    mounting_deg: float | None
    """By how much the two segments' axes differ, each as fusion found them; None when the movement does not
    tell it: then it was left in."""
    heading_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoSensors:
    """What two sets of sensors on one arm tell of it."""

    segment: str
    """By whose movement the clocks were compared."""
    rows: int
    clock: ClockOffset
    as_worn: Agreed
    aligned: Agreed
    removed: dict[str, Seat] = field(default_factory=dict)
    truth: dict[str, dict[str, ErrorFigures]] = field(default_factory=dict)
    """Of an emulated wearer: distance of each set's places, as worn, from where they are, m."""


def two_sensors(
    a: Track, b: Track, rates: dict[str, tuple[Rates, Rates]], side: Side, truth: Track | None = None
) -> TwoSensors:
    """Compare b with a. `rates` are both sensors' by segment. Raises Unrelated."""
    common = [s for s in a.trunk_from if s in b.trunk_from and s in rates and s.endswith(f"_{side[0]}")]
    if not common:
        raise Unrelated("no segment carries a sensor of both; put both on one and give it to both")
    segment = max(common, key=lambda s: float(np.nanmean((rates[s][0].gyr ** 2).sum(axis=1))))
    clock = clock_offset(*rates[segment])
    time = a.time_s
    late = Track(
        time,
        {s: al.orientations_at(time + clock.offset_s, b.time_s, q) for s, q in b.trunk_from.items()},
        {s: al.orientations_at(time + clock.offset_s, b.time_s, q) for s, q in b.sensor.items()},
        b.segment_from_sensor,
        {j: interpolate(time + clock.offset_s, b.time_s, p, al.MAX_GAP_S) for j, p in b.places.items()},
    )
    seats: dict[str, Seat] = {}
    turned: dict[str, Floats] = {}
    for name in common:
        turned[name], seats[name] = _seated(a, late, name)
    nearest = _nearest(common)
    moved = _moved(late, turned, nearest)
    joints = [ENDS[part] for part in ARM_PARTS if nearest.get(part) and ENDS[part] in a.places]
    worn = _agreed(a, late.places, late.trunk_from, joints, common)
    aligned = _agreed(a, moved, turned, joints, common)
    if not worn.places and not worn.orientations:
        raise Unrelated("the two were never both calibrated and measured at one time")
    both = np.isfinite(a.trunk_from[segment] + late.trunk_from[segment]).all(axis=1)
    found = {} if truth is None else {"a": _against(truth, a, joints), "b": _against(truth, late, joints)}
    return TwoSensors(
        segment=segment,
        rows=int(both.sum()),
        clock=clock,
        as_worn=worn,
        aligned=aligned,
        removed=seats,
        truth=found,
    )


def _seated(a: Track, b: Track, segment: str) -> tuple[Floats, Seat]:
    """Return b's orientations of a segment (n, 4) with mounting and heading between both taken out."""
    first, second = a.trunk_from[segment], b.trunk_from[segment]
    between, mounting = rotation.IDENTITY, None
    turn = _sensor_from_sensor(a.sensor[segment], b.sensor[segment])
    if turn is not None:
        of_a, of_b = a.segment_from_sensor[segment], b.segment_from_sensor[segment]
        between = rotation.multiply(rotation.multiply(of_b, rotation.inverse(turn)), rotation.inverse(of_a))
        mounting = float(np.degrees(rotation.angle_between(rotation.IDENTITY, between)))
    seated = rotation.multiply(second, between)
    errors = rotation.multiply(first, rotation.inverse(seated))
    known = errors[np.isfinite(errors).all(axis=1)]
    heading = float(rotation.heading(rotation.mean(known))) if len(known) else 0.0
    result = rotation.multiply(rotation.about(2, heading), seated)
    return result, Seat(mounting_deg=mounting, heading_deg=float(np.degrees(heading)))


def _sensor_from_sensor(a: Floats, b: Floats) -> Floats | None:
    """Return a_sensor_from_b_sensor (4,), or None when the movement does not tell it.

    Both see the vertical; as the segment tilts it passes through many directions. How the segment turns
    about the vertical adds nothing that the headings would not spoil.
    """
    up = np.array([0.0, 0.0, 1.0])
    known = np.isfinite(a + b).all(axis=1)
    if known.sum() < 3:
        return None
    first, second = (rotation.rotate(rotation.inverse(q[known]), up) for q in (a, b))
    spread = np.linalg.svd(first.T @ second / known.sum(), compute_uv=False)
    return rotation.from_matrix(wahba(first, second)) if spread[1] > _TELLING else None


def _nearest(common: Sequence[str]) -> dict[str, str]:
    """Return for each part of the arm the segment of both that moves it: its own, else the next nearer."""
    found: dict[str, str] = {}
    nearest = ""
    for part in ARM_PARTS:
        nearest = next((s for s in common if part_of(s) == part), nearest)
        if nearest:
            found[part] = nearest
    return found


def _moved(b: Track, turned: dict[str, Floats], nearest: dict[str, str]) -> dict[str, Floats]:
    """Return b's places with each part of the arm turned as its sensor was."""
    places, shift = dict(b.places), np.zeros(3)
    starts = dict(zip(ARM_PARTS, ("shoulder", "elbow", "wrist"), strict=True))
    for part in ARM_PARTS:
        start, end = starts[part], ENDS[part]
        if start not in b.places or end not in b.places:
            continue
        if part in nearest:
            s = nearest[part]
            correction = rotation.multiply(turned[s], rotation.inverse(b.trunk_from[s]))
            bone = b.places[end] - b.places[start]
            shift = shift + rotation.rotate(correction, bone) - bone
        places[end] = b.places[end] + shift
    return places


def _agreed(
    a: Track, places: dict[str, Floats], orientations: dict[str, Floats], joints: list[str], common: list[str]
) -> Agreed:
    near = {joint: _place(places[joint], a.places[joint]) for joint in joints if joint in places}
    turned = {name: _orientation(orientations[name], a.trunk_from[name]) for name in common}
    return Agreed(
        places={joint: figures for joint, figures in near.items() if figures is not None},
        orientations={name: figures for name, figures in turned.items() if figures is not None},
    )


def _place(found: Floats, reference: Floats) -> PlaceFigures | None:
    off = found - reference
    norms, apart = eq17(found, reference), error_figures(np.linalg.norm(off, axis=1))
    if norms is None or apart is None:
        return None
    axes = {axis: f for axis, o in zip("xyz", off.T, strict=True) if (f := error_figures(o)) is not None}
    return PlaceFigures(eq17=norms, apart=apart, axes=axes)


def _orientation(found: Floats, reference: Floats) -> OrientationFigures | None:
    total, heading, inclination = (error_figures(e) for e in orientation_errors_deg(found, reference))
    if total is None or heading is None or inclination is None:
        return None
    return OrientationFigures(total=total, heading=heading, inclination=inclination)


def _against(truth: Track, found: Track, joints: Sequence[str]) -> dict[str, ErrorFigures]:
    errors = {
        j: error_figures(
            np.linalg.norm(
                found.places[j] - interpolate(found.time_s, truth.time_s, truth.places[j], al.MAX_GAP_S),
                axis=1,
            )
        )
        for j in joints
        if j in truth.places and j in found.places
    }
    return {joint: figures for joint, figures in errors.items() if figures is not None}
