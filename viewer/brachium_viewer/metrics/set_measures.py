"""What is measured of a whole set of an exercise: counts, medians, change within the set. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from brachium_viewer.exercises import Exercise
from brachium_viewer.metrics import kinematics
from brachium_viewer.metrics.arm_motion import ArmMotion
from brachium_viewer.metrics.holes import unseen
from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, why_not, withheld
from brachium_viewer.metrics.medians import best, first_to_last, medians, values
from brachium_viewer.metrics.repetition_measures import (
    ABOUT_S,
    NAMES,
    NO_GOAL,
    NO_SHIFT,
    NO_STERNUM,
    OF_PLACES,
    OF_THE_POINT,
    Point,
    RepetitionMeasures,
    count,
    point_of,
    repetition_measures,
)
from brachium_viewer.metrics.repetitions import Repetition

SHOULDER, SHOULDER_OR_TRUNK = "shoulder", "shoulder or trunk movement"
NO_REPETITION = "no repetition"


@dataclass(frozen=True, kw_only=True)
class SetMeasures:
    """One set of one exercise by one arm."""

    exercise: str
    side: str
    mode: str
    """active, assisted or passive."""
    goal_deg: float | None
    from_s: float
    to_s: float
    tries: int
    """Movements that went less than half the way, and were seen whole: not repetitions."""
    repetitions: tuple[RepetitionMeasures, ...]
    medians: dict[str, Measure]
    """Of the repetitions, by NAMES; coverage is the share of those that have it."""
    best_peak: Measure
    """The farthest that the angle went in a repetition."""
    first_to_last: dict[str, Measure]
    """Median of the last repetitions minus that of the first, by NAMES."""
    extension_deficit: Measure
    """By how much the elbow stayed short of straight, deg; 0 when it went straight."""
    shoulder_word: str
    """What a shift of the shoulder may be: `shoulder` alone, or `shoulder or trunk movement`."""
    measured: float | None = None
    """Part of the set's time in which its angle was measured; None of a set measured before this was told."""
    path_of: Point | Literal[""] = ""
    """Whose paths are told; empty where it was not always the same, or was not told when it was measured."""


def set_measures(
    motion: ArmMotion,
    exercise: Exercise,
    *,
    goal_deg: float | None = None,
    mode: str = "active",
) -> SetMeasures:
    """Return the measures of a set; the motion is of the set alone."""
    done = count(motion, exercise)
    holes = unseen(motion.time_s, motion.measured(exercise.angle))
    point = point_of(motion)
    found = tuple(_seen(motion, exercise, one, point, goal_deg, holes) for one in done.repetitions)
    none = _why_none(motion, exercise) | ({"time_to_goal": NO_GOAL} if goal_deg is None else {})
    return SetMeasures(
        exercise=exercise.name,
        side=motion.side,
        mode=mode,
        goal_deg=goal_deg,
        from_s=float(motion.time_s[0]) if len(motion.time_s) else 0.0,
        to_s=float(motion.time_s[-1]) if len(motion.time_s) else 0.0,
        tries=sum(_hole_of(one, holes) is None for one in done.tries),
        repetitions=found,
        medians=medians(found, none),
        best_peak=best(found, none, rises=exercise.rises),
        first_to_last=first_to_last(found),
        extension_deficit=_deficit(motion, exercise),
        shoulder_word=_shoulder_word(motion, found),
        measured=kinematics.coverage(motion.time_s, motion.measured(exercise.angle)),
        path_of=point,
    )


def _seen(
    motion: ArmMotion,
    exercise: Exercise,
    repetition: Repetition,
    point: Point,
    goal_deg: float | None,
    holes: Sequence[tuple[float, float]],
) -> RepetitionMeasures:
    """Return the measures of one repetition; none when a hole is in it or beside its base.

    What was done meanwhile may have been its farthest point, or the end of it and the begin of another.
    """
    made = repetition_measures(motion, exercise, repetition, point, goal_deg)
    if made.measures["shoulder_shift"].withheld == NO_SHIFT and np.isfinite(motion.shoulder_shift_m).any():
        made.measures["shoulder_shift"] = measure(np.nan, "m", 0.0)  # its sensors are worn
    hole = _hole_of(repetition, holes)
    if hole is None:
        return made
    from_s, to_s = hole
    why = why_not(motion.between(from_s, to_s).quality[exercise.angle])
    said = f"not measured for {to_s - from_s:.1f} s of it: {why}"
    own = {n: one for n, one in made.measures.items() if one.withheld in (NO_GOAL, NO_STERNUM, NO_SHIFT)}
    hidden = {name: withheld(said, one.unit, one.coverage) for name, one in made.measures.items()}
    return replace(made, measures=hidden | own)


def _hole_of(repetition: Repetition, holes: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Return the longest hole in a repetition or beside its base; None when there is none."""
    base = repetition.base_s
    spans = ((repetition.from_s, repetition.to_s), (base - ABOUT_S, base + ABOUT_S))
    found = [hole for hole in holes if any(hole[0] <= to and hole[1] >= begin for begin, to in spans)]
    return max(found, key=lambda hole: hole[1] - hole[0], default=None)


def _shoulder_word(motion: ArmMotion, found: Sequence[RepetitionMeasures]) -> str:
    """Return what the shift may be: the shoulder's alone where the trunk is measured beside it."""
    shifted = np.isfinite(motion.shoulder_shift_m).all(axis=1)
    t = motion.time_s
    spans = [(t >= one.from_s) & (t <= one.to_s) & shifted for one in found]
    used = [motion.sternum[rows] for rows in spans if rows.any()] or [motion.sternum]
    enough = all(len(rows) and float(rows.mean()) >= ENOUGH for rows in used)
    return SHOULDER if enough else SHOULDER_OR_TRUNK


def together(sets: Sequence[SetMeasures], exercise: Exercise) -> SetMeasures:
    """Return several sets of one exercise by one arm in one mode as if they had been one.

    The paths of a hand and of a wrist are not taken together: where sets tell both they are withheld. Raises
    ValueError when there is none, or they are of different exercises, arms or modes.
    """
    if len({(one.exercise, one.side, one.mode) for one in sets}) != 1:
        raise ValueError("sets of one exercise by one arm in one mode can be taken together")
    found = tuple(repetition for one in sets for repetition in one.repetitions)
    points = {one.path_of for one in sets if values(one.repetitions, "hand_path")} or {sets[0].path_of}
    if len(points) > 1:
        found = tuple(_without_path(one) for one in found)
    none = {name: median.withheld for name, median in sets[0].medians.items()}
    deficits = [one.extension_deficit for one in sets if one.extension_deficit.value is not None]
    return replace(
        sets[0],
        to_s=sets[-1].to_s,
        tries=sum(one.tries for one in sets),
        repetitions=found,
        medians=medians(found, none),
        best_peak=best(found, none, rises=exercise.rises),
        first_to_last=first_to_last(found),
        extension_deficit=min(deficits, key=lambda one: one.value or 0.0, default=sets[0].extension_deficit),
        shoulder_word=min((one.shoulder_word for one in sets), key=[SHOULDER_OR_TRUNK, SHOULDER].index),
        measured=_measured(sets),
        path_of=points.pop() if len(points) == 1 else "",
    )


def _without_path(one: RepetitionMeasures) -> RepetitionMeasures:
    why = "of the hand in one set, of the wrist in another"
    return replace(one, measures=one.measures | {name: withheld(why, NAMES[name]) for name in OF_THE_POINT})


def _measured(sets: Sequence[SetMeasures]) -> float | None:
    known = [(one.measured, one.to_s - one.from_s) for one in sets if one.measured is not None]
    seconds = sum(length for _, length in known)
    if len(known) < len(sets) or not seconds:
        return None
    return sum(share * length for share, length in known) / seconds


def _why_none(motion: ArmMotion, exercise: Exercise) -> dict[str, str]:
    """Return by NAMES why a set without repetitions has none: its angle was not measured, or nobody moved so;
    what comes from elsewhere may not have been worn."""
    why = NO_REPETITION
    if len(motion.time_s) and kinematics.coverage(motion.time_s, motion.measured(exercise.angle)) < ENOUGH:
        why = why_not(motion.quality[exercise.angle])
    found = {**dict.fromkeys(NAMES, why), **dict.fromkeys(OF_PLACES, NO_REPETITION)}
    return found if motion.with_sternum else {**found, "trunk_lean": NO_STERNUM}


def _deficit(motion: ArmMotion, exercise: Exercise) -> Measure:
    if not exercise.straightens:
        return withheld("nobody was asked to straighten the elbow", "deg")
    known = motion.known("elbow_flexion")
    coverage = kinematics.coverage(motion.time_s, np.isfinite(known))
    why = why_not(motion.quality["elbow_flexion"])
    if coverage < ENOUGH and why:
        return withheld(why, "deg", coverage)
    low, _ = kinematics.extremes(motion.time_s, known)
    return measure(max(0.0, low) if np.isfinite(low) else np.nan, "deg", coverage)


def loss_between(active: SetMeasures, passive: SetMeasures, *, rises: bool) -> Measure:
    """Return by how much less far the arm goes by itself than when it is moved, deg ("active lag").

    Below 0 it went farther by itself. `rises` says whether farther is up.
    """
    if active.best_peak.value is None or passive.best_peak.value is None:
        why = active.best_peak.withheld or passive.best_peak.withheld
        return withheld(f"one of both is not known: {why}", "deg")
    coverage = min(active.best_peak.coverage, passive.best_peak.coverage)
    farther = passive.best_peak.value - active.best_peak.value
    return measure(farther if rises else -farther, "deg", coverage)
