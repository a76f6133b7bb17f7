"""What is measured of each repetition of an exercise. Pure."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from brachium_viewer.exercises import PLANE_FROM_DEG, PLANES_DEG, Exercise
from brachium_viewer.metrics import kinematics
from brachium_viewer.metrics.arm_motion import ArmMotion, Floats
from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, why_not, withheld
from brachium_viewer.metrics.repetitions import FLOOR_DEG, MovementSet, Repetition, movement_set
from brachium_viewer.metrics.smoothness import LDLJ_RATE_HZ, ldlj, sparc
from brachium_viewer.metrics.way_there import Way, way_there


@dataclass(frozen=True, kw_only=True)
class RepetitionMeasures:
    """One repetition: when, and its numbers by name (NAMES)."""

    from_s: float
    to_s: float
    peak_s: float
    measures: dict[str, Measure]


NAMES: dict[str, str] = {
    "start": "deg",
    "peak": "deg",
    "range": "deg",
    "peak_speed": "deg/s",
    "mean_speed": "deg/s",
    "movement_time": "s",
    "time_to_goal": "s",
    "hold_time": "s",
    "sparc": "1",
    "ldlj": "1",
    "hand_path": "m",
    "straightness": "1",
    "shoulder_shift": "m",
    "trunk_lean": "deg",
}
"""Every measure of a repetition, with its unit. `start`: where the angle was before it went; `peak`: how far
it went; `shoulder_shift`: the farthest that the shoulder moved (or shoulder and trunk, without a sternum
sensor). Of the way there (`way_there`), be it up or down: `movement_time`; `mean_speed`, what the angle went
over that time, so that a tremor on the way adds nothing; `peak_speed`, a tremor's too; `time_to_goal`, from
its begin; smoothness; `hand_path` and `straightness`, of the set's one point (`point_of`)."""

ABOUT_S = 0.5
"""About the instant of its base an arm rests."""
AROUND_S = 2.0
"""So much before and after a repetition is looked at for where its way there begins and ends."""
SMOOTH_GAP_S = 0.2
"""A longer gap in the way there may hide a jerk. So long a one changes LDLJ of a reach of 0.8 to 1 s by at
most 0.07, one of 0.3 s by 0.18; of longer reaches noise changes it by more than either."""
OF_PLACES = ("hand_path", "straightness", "shoulder_shift", "trunk_lean")
"""Of NAMES, what does not come from the exercise's angle."""
SURE_SD = 2.0
"""A shoulder that moved by less than so many standard deviations may not have moved."""
NO_STERNUM = "a sensor on the sternum gives it"
NO_SHIFT = "two sensors with raw samples on upper arm and forearm give it"
NO_GOAL = "no goal was set"
NO_WAY = "the way there has a gap or is too short"

Point = Literal["hand", "wrist"]
"""Of which a path is measured."""
OF_THE_POINT = ("hand_path", "straightness")
NEARLY = 0.05
"""Of the time: a wrist that was measured for no more than that longer than the hand is not taken for it."""


def rising(motion: ArmMotion, exercise: Exercise) -> Floats:
    """Return the exercise's angle (n,) deg where it is measured, turned so that a repetition rises."""
    known = motion.known(exercise.angle)
    return known if exercise.rises else -known


def count(motion: ArmMotion, exercise: Exercise) -> MovementSet:
    """Return the repetitions and tries of an exercise."""
    return movement_set(motion.time_s, rising(motion, exercise), FLOOR_DEG)


def point_of(motion: ArmMotion) -> Point:
    """Return whose path a whole set tells: the hand's, or the wrist's when that was measured for longer."""
    hand, wrist = (kinematics.coverage(motion.time_s, motion.measured(point)) for point in ("hand", "wrist"))
    return "wrist" if wrist > hand + NEARLY else "hand"


def repetition_measures(
    motion: ArmMotion,
    exercise: Exercise,
    repetition: Repetition,
    point: Point,
    goal_deg: float | None = None,
) -> RepetitionMeasures:
    """Return the measures of one repetition; what cannot be trusted is withheld with its reason."""
    part = motion.between(repetition.from_s, repetition.to_s + 1e-6)
    base = motion.between(repetition.base_s - ABOUT_S, repetition.base_s + ABOUT_S)
    around = motion.between(repetition.low_s - AROUND_S, repetition.to_s + AROUND_S)
    way = way_there(around.time_s, rising(around, exercise), repetition)
    found = {
        **_of_the_angle(part, base, exercise),
        **_of_the_way(around, way, exercise),
        **_of_the_path(around, way, point),
        **_of_the_trunk(part),
    }
    found["time_to_goal"] = _time_to_goal(part, way, exercise, goal_deg, found["range"])
    return RepetitionMeasures(
        from_s=repetition.from_s,
        to_s=repetition.to_s,
        peak_s=repetition.peak_s,
        measures={name: found[name] for name in NAMES},
    )


def _of_the_angle(part: ArmMotion, base: ArmMotion, exercise: Exercise) -> dict[str, Measure]:
    sign = 1.0 if exercise.rises else -1.0
    angle = rising(part, exercise)
    coverage = kinematics.coverage(part.time_s, np.isfinite(angle))
    _, high = kinematics.extremes(part.time_s, angle)
    low, _ = kinematics.extremes(base.time_s, rising(base, exercise))
    reason = _off_plane(part, exercise) or (
        why_not(part.quality[exercise.angle]) if coverage < ENOUGH else ""
    )
    numbers = {
        "start": sign * low,
        "peak": sign * high,
        "range": high - low,
        "hold_time": kinematics.hold_s(part.time_s, angle),
    }
    found = {name: measure(value, NAMES[name], coverage) for name, value in numbers.items()}
    if reason:
        for name in ("start", "peak", "range"):
            found[name] = withheld(reason, NAMES[name], coverage)
    return found


def _off_plane(part: ArmMotion, exercise: Exercise) -> str:
    """Return why an elevation is not the exercise's: empty when its plane is measured throughout the top, and
    lies in the band."""
    if exercise.plane is None:
        return ""
    elevation, plane = part.known("isb_elevation"), part.known("isb_plane")
    high = elevation >= max(PLANE_FROM_DEG, 0.8 * np.nanmax(elevation, initial=0.0))
    if not high.any():
        return f"below {PLANE_FROM_DEG:.0f} deg of elevation the plane is undefined"
    if kinematics.coverage(part.time_s[high], np.isfinite(plane[high])) < ENOUGH:
        return f"plane: {why_not(part.quality['isb_plane'][high])}"
    high &= np.isfinite(plane)
    about = np.exp(1j * np.radians(plane[high]))
    middle = float(np.degrees(np.angle(about.mean())))
    low, top = PLANES_DEG[exercise.plane]
    if low <= middle <= top:
        return ""
    return f"went in plane {middle:.0f} deg, not in {exercise.plane} ({low:.0f} to {top:.0f})"


def _of_the_way(around: ArmMotion, way: Way | None, exercise: Exercise) -> dict[str, Measure]:
    names = ("movement_time", "mean_speed", "peak_speed", "sparc", "ldlj")
    angle, times = rising(around, exercise), around.time_s
    velocity = np.empty(0) if way is None else kinematics.angular_velocity(times, angle, way.from_s, way.to_s)
    if way is None or not len(velocity):
        return {name: withheld(NO_WAY, NAMES[name]) for name in names}
    known = np.isfinite(angle)
    there = (times >= way.from_s) & (times <= way.to_s)
    coverage = kinematics.coverage(times[there], known[there])
    seconds, speed = way.to_s - way.from_s, np.abs(velocity)
    numbers = (
        seconds,
        way.went / seconds,
        speed.max(),
        sparc(speed, LDLJ_RATE_HZ),
        ldlj(velocity, LDLJ_RATE_HZ),
    )
    found = {name: measure(float(x), NAMES[name], coverage) for name, x in zip(names, numbers, strict=True)}
    gap = kinematics.longest_gap_s(times, known, way.from_s, way.to_s)
    if gap > SMOOTH_GAP_S + 1e-3:
        why = f"a gap of {gap:.2f} s in the way there may hide a jerk"
        found |= {name: withheld(why, "1", coverage) for name in ("sparc", "ldlj")}
    return found


def _time_to_goal(
    part: ArmMotion, way: Way | None, exercise: Exercise, goal_deg: float | None, of_range: Measure
) -> Measure:
    if goal_deg is None:
        return withheld(NO_GOAL, "s", of_range.coverage)
    if of_range.value is None:
        return withheld(of_range.withheld, "s", of_range.coverage)
    if way is None:
        return withheld(NO_WAY, "s", of_range.coverage)
    sign = 1.0 if exercise.rises else -1.0
    at_s = kinematics.reached_s(part.time_s, rising(part, exercise), sign * goal_deg)
    if np.isnan(at_s):
        return withheld("the goal was not reached", "s", of_range.coverage)
    return measure(max(at_s - way.from_s, 0.0), "s", of_range.coverage)


def _of_the_path(around: ArmMotion, way: Way | None, point: Point) -> dict[str, Measure]:
    if way is None:
        return {name: withheld(NO_WAY, NAMES[name]) for name in OF_THE_POINT}
    there = around.between(way.from_s, way.to_s + 1e-6)
    known = there.measured(point)
    found = kinematics.path(there.time_s, np.where(known[:, None], there.positions_m[point], np.nan))
    pairs = zip(OF_THE_POINT, found, strict=True)
    coverage = kinematics.coverage(there.time_s, known)
    return {name: measure(value, NAMES[name], coverage) for name, value in pairs}


def _of_the_trunk(part: ArmMotion) -> dict[str, Measure]:
    lean, lean_seen = _lean(part)
    return {
        "shoulder_shift": _moved(part),
        "trunk_lean": (measure(lean, "deg", lean_seen) if part.with_sternum else withheld(NO_STERNUM, "deg")),
    }


def _moved(part: ArmMotion) -> Measure:
    """Return the farthest that the shoulder moved from where it was, unless that may be none."""
    shift = part.shoulder_shift_m
    known = np.isfinite(shift).all(axis=1)
    if not known.any():
        return withheld(NO_SHIFT, "m")
    moved = np.linalg.norm(shift - shift[known][0], axis=1)
    farthest = int(np.nanargmax(moved))
    coverage = kinematics.coverage(part.time_s, known)
    if moved[farthest] < SURE_SD * np.linalg.norm(part.shoulder_shift_sd_m[farthest]):
        return withheld("no more than its own error", "m", coverage)
    return measure(float(moved[farthest]), "m", coverage)


def _lean(part: ArmMotion) -> tuple[float, float]:
    """Return the farthest that the trunk leaned from where it was, deg, and how much of it was measured."""
    if not part.with_sternum:
        return np.nan, 0.0
    pair = np.stack([part.known("trunk_flexion"), part.known("trunk_lateral")], axis=1)
    known = np.isfinite(pair).all(axis=1)
    if not known.any():
        return np.nan, 0.0
    leaned = float(np.linalg.norm(pair[known] - pair[known][0], axis=1).max())
    return leaned, kinematics.coverage(part.time_s, known)
