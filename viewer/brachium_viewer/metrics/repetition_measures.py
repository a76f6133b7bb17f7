"""What is measured of each repetition of an exercise. Pure."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_viewer.exercises import PLANE_FROM_DEG, PLANES_DEG, Exercise
from brachium_viewer.metrics import kinematics
from brachium_viewer.metrics.arm_motion import ArmMotion, Floats
from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, why_not, withheld
from brachium_viewer.metrics.repetitions import FLOOR_DEG, MovementSet, Repetition, movement_set
from brachium_viewer.metrics.smoothness import LDLJ_RATE_HZ, at_ldlj_rate, ldlj, sparc


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
sensor); smoothness is of the way there, which ends at the peak."""


ABOUT_S = 0.5
"""About the instant of its base an arm rests."""


def rising(motion: ArmMotion, exercise: Exercise) -> Floats:
    """Return the exercise's angle (n,) deg where it is measured, turned so that a repetition rises."""
    known = motion.known(exercise.angle)
    return known if exercise.rises else -known


def count(motion: ArmMotion, exercise: Exercise) -> MovementSet:
    """Return the repetitions and tries of an exercise."""
    return movement_set(motion.time_s, rising(motion, exercise), FLOOR_DEG)


def repetition_measures(
    motion: ArmMotion, exercise: Exercise, repetition: Repetition, goal_deg: float | None = None
) -> RepetitionMeasures:
    """Return the measures of one repetition; what cannot be trusted is withheld with its reason."""
    part = motion.between(repetition.from_s, repetition.to_s + 1e-6)
    there = motion.between(repetition.from_s, repetition.peak_s + 1e-6)
    base = motion.between(repetition.base_s - ABOUT_S, repetition.base_s + ABOUT_S)
    found = {
        **_of_the_angle(part, base, exercise, goal_deg),
        **_of_the_way(there, exercise),
        **_of_places(part, there),
    }
    return RepetitionMeasures(
        from_s=repetition.from_s,
        to_s=repetition.to_s,
        peak_s=repetition.peak_s,
        measures={name: found[name] for name in NAMES},
    )


def _of_the_angle(
    part: ArmMotion, base: ArmMotion, exercise: Exercise, goal_deg: float | None
) -> dict[str, Measure]:
    sign = 1.0 if exercise.rises else -1.0
    angle = rising(part, exercise)
    coverage = _coverage(np.isfinite(angle))
    _, high = kinematics.extremes(part.time_s, angle)
    low, _ = kinematics.extremes(base.time_s, rising(base, exercise))
    reason = _off_plane(part, exercise) or (
        why_not(part.quality[exercise.angle]) if coverage < ENOUGH else ""
    )
    goal = np.nan if goal_deg is None else kinematics.reached_s(part.time_s, angle, sign * goal_deg)
    numbers = {
        "start": sign * low,
        "peak": sign * high,
        "range": high - low,
        "movement_time": float(part.time_s[-1] - part.time_s[0]) if len(part.time_s) else np.nan,
        "hold_time": kinematics.hold_s(part.time_s, angle),
        "time_to_goal": goal,
    }
    found = {name: measure(value, NAMES[name], coverage) for name, value in numbers.items()}
    if goal_deg is None or np.isnan(goal):
        why = "no goal was set" if goal_deg is None else "the goal was not reached"
        found["time_to_goal"] = withheld(why, "s", coverage)
    if reason:
        for name in ("start", "peak", "range", "time_to_goal"):
            found[name] = withheld(reason, NAMES[name], coverage)
    return found


def _off_plane(part: ArmMotion, exercise: Exercise) -> str:
    """Return why an elevation is not the exercise's: empty when its plane at the top lies in the band."""
    if exercise.plane is None:
        return ""
    elevation, plane = part.known("isb_elevation"), part.known("isb_plane")
    seen = np.isfinite(elevation) & np.isfinite(plane)
    high = seen & (elevation >= max(PLANE_FROM_DEG, 0.8 * np.nanmax(elevation, initial=0.0)))
    if not high.any():
        if seen.any():
            return f"below {PLANE_FROM_DEG:.0f} deg of elevation the plane is undefined"
        return f"plane: {why_not(part.quality['isb_plane'])}"
    about = np.exp(1j * np.radians(plane[high]))
    middle = float(np.degrees(np.angle(about.mean())))
    low, top = PLANES_DEG[exercise.plane]
    if low <= middle <= top:
        return ""
    return f"went in plane {middle:.0f} deg, not in {exercise.plane} ({low:.0f} to {top:.0f})"


def _of_the_way(there: ArmMotion, exercise: Exercise) -> dict[str, Measure]:
    angle = rising(there, exercise)
    coverage = _coverage(np.isfinite(angle))
    grid, velocity = kinematics.angular_speed(there.time_s, angle)
    names = ("peak_speed", "mean_speed", "sparc", "ldlj")
    if len(grid) < 8 or not np.isfinite(velocity).all():
        return {
            name: withheld("the way there has a gap or is too short", NAMES[name], coverage) for name in names
        }
    speed = np.abs(velocity)
    rate = kinematics.RATE_HZ
    numbers = (
        float(speed.max()),
        float(speed.mean()),
        sparc(speed, rate),
        ldlj(at_ldlj_rate(speed, rate), LDLJ_RATE_HZ),
    )
    return {name: measure(value, NAMES[name], coverage) for name, value in zip(names, numbers, strict=True)}


def _of_places(part: ArmMotion, there: ArmMotion) -> dict[str, Measure]:
    hand = "hand" if there.measured("hand").any() else "wrist"
    seen = _coverage(there.measured(hand))
    length, straightness = kinematics.path(
        there.time_s, np.where(there.measured(hand)[:, None], there.positions_m[hand], np.nan)
    )
    shift = part.shoulder_shift_m
    known = np.isfinite(shift).all(axis=1)
    moved = np.linalg.norm(shift - shift[known][0], axis=1)[known].max() if known.any() else np.nan
    lean, lean_seen = _lean(part)
    return {
        "hand_path": measure(length, "m", seen),
        "straightness": measure(straightness, "1", seen),
        "shoulder_shift": (
            measure(float(moved), "m", _coverage(known))
            if known.any()
            else withheld("two sensors with raw samples on upper arm and forearm give it", "m")
        ),
        "trunk_lean": (
            measure(lean, "deg", lean_seen)
            if part.with_sternum
            else withheld("a sensor on the sternum gives it", "deg")
        ),
    }


def _lean(part: ArmMotion) -> tuple[float, float]:
    """Return the farthest that the trunk leaned from where it was, deg, and how much of it was measured."""
    if not part.with_sternum:
        return np.nan, 0.0
    pair = np.stack([part.known("trunk_flexion"), part.known("trunk_lateral")], axis=1)
    known = np.isfinite(pair).all(axis=1)
    if not known.any():
        return np.nan, 0.0
    return float(np.linalg.norm(pair[known] - pair[known][0], axis=1).max()), _coverage(known)


def _coverage(known: npt.ArrayLike) -> float:
    array = np.asarray(known, dtype=np.bool_)
    return float(array.mean()) if array.size else 0.0
