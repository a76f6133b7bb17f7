"""The lines of a report's figures: repetitions over their own time, and paths, as arrays. Pure."""

from collections.abc import Iterable, Sequence

import numpy as np

from brachium_viewer.metrics.arm_motion import JOINTS, ArmMotion, Floats
from brachium_viewer.metrics.even_grid import BRIDGED_S
from brachium_viewer.metrics.repetition_measures import RepetitionMeasures

SHARES = np.linspace(0.0, 100.0, 51)
"""Per cent of a repetition."""
DRAWN = 24
"""More lines one over the other are a block of ink: of more repetitions, so many are drawn, evenly chosen."""
PATH_POINTS = 41


def chosen(repetitions: Sequence[RepetitionMeasures], most: int = DRAWN) -> list[RepetitionMeasures]:
    """Return at most so many, evenly chosen, the first and the last among them."""
    if len(repetitions) <= most:
        return list(repetitions)
    return [repetitions[i] for i in np.linspace(0, len(repetitions) - 1, most).round().astype(int).tolist()]


def middle(repetitions: Sequence[RepetitionMeasures]) -> RepetitionMeasures | None:
    """Return the one whose range is nearest to the median; the middle one in time when none has a range."""
    known = [(r, value) for r in repetitions if (value := r.measures["range"].value) is not None]
    if not known:
        return repetitions[len(repetitions) // 2] if repetitions else None
    median = float(np.median([value for _, value in known]))
    return min(known, key=lambda one: abs(one[1] - median))[0]


def at(time_s: Floats, values: Floats, wanted_s: Floats) -> Floats:
    """Return values (n, k) at wanted times (m,), NaN where what is known around them is too far apart."""
    out = np.full((len(wanted_s), values.shape[1]), np.nan)
    known = np.isfinite(values).all(axis=1)
    t = time_s[known]
    if len(t) < 2:
        return out
    for column, target in zip(values[known].T, out.T, strict=True):
        target[:] = np.interp(wanted_s, t, column)
    after = np.clip(np.searchsorted(t, wanted_s), 1, len(t) - 1)
    far = (t[after] - t[after - 1] > BRIDGED_S) | (wanted_s < t[0] - 0.1) | (wanted_s > t[-1] + 0.1)
    out[far] = np.nan
    return out


def overlays(motion: ArmMotion, angle: str, repetitions: Iterable[RepetitionMeasures]) -> Floats:
    """Return an angle (repetitions, len(SHARES)) deg over the repetitions' own time, NaN in gaps."""
    wanted = [r.from_s + (r.to_s - r.from_s) * SHARES / 100.0 for r in repetitions]
    return _all_at(motion.time_s, motion.known(angle)[:, None], wanted)[:, :, 0]


def _all_at(time_s: Floats, values: Floats, wanted_s: Sequence[Floats]) -> Floats:
    """Return values (n, k) at lists of as many wanted times each, (lists, times, k): asked for at once, for a
    session is long and each question goes through all of it."""
    if not wanted_s:
        return np.zeros((0, 0, values.shape[1]))
    found = at(time_s, values, np.concatenate(wanted_s))
    return found.reshape(len(wanted_s), -1, values.shape[1])


def measured_places(motion: ArmMotion) -> dict[str, Floats]:
    """Return elbow, wrist and hand (n, 3) cm in trunk axes where they are measured; those that never are
    are left out."""
    found = {}
    for joint in JOINTS[1:]:
        seen = motion.measured(joint)
        if seen.any():
            found[joint] = 100.0 * np.where(seen[:, None], motion.positions_m[joint], np.nan)
    return found


def paths(motion: ArmMotion, repetitions: Iterable[RepetitionMeasures]) -> dict[str, Floats]:
    """Return the way of each measured joint (repetitions, PATH_POINTS, 3) cm."""
    places = measured_places(motion)
    wanted = [np.linspace(r.from_s, r.to_s, PATH_POINTS) for r in repetitions]
    return {joint: _all_at(motion.time_s, place, wanted) for joint, place in places.items()}


def over_time(motion: ArmMotion, from_s: float, to_s: float) -> tuple[Floats, dict[str, Floats]]:
    """Return even times (m,) s from `from_s`, and each measured joint's place (m, 3) cm."""
    wanted = np.linspace(from_s, to_s, max(2, min(400, round((to_s - from_s) * 10.0) + 1)))
    return wanted - from_s, {
        joint: at(motion.time_s, place, wanted) for joint, place in measured_places(motion).items()
    }
