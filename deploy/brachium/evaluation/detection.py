"""The smallest movement that is seen: a shrug and an elbow flexion, each in small, against standing still."""

from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

from brachium.evaluation import zhou_trial
from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Estimate
from brachium.evaluation.tables import Cell, Table
from brachium.evaluation.trials import Trial

Floats = npt.NDArray[np.float64]

RATE_HZ, SECONDS = 25.0, 120.0
PERIOD_S = 4.0
"""One repetition of either exercise: one trial."""
FALSE_ALARMS, SEEN = 0.05, 0.95
EXTENTS = (0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.0)
METHODS = ("Zhou, drift reset", "live", "best")

Signal = Callable[[Estimate], Floats]


def shrug_mm(found: Estimate) -> Floats:
    """Return the lift of the shoulder (n,) mm; a method that gives none says it stands still."""
    return 1e3 * np.nan_to_num(found.shift[:, 2])


def elbow_deg(found: Estimate) -> Floats:
    """Return the elbow's flexion (n,) deg."""
    return np.degrees(found.angles["elbow_flexion"])


MOVEMENTS: tuple[tuple[str, str, float, str, Signal], ...] = (
    ("shrug", "shrugging", 80.0, "mm", shrug_mm),
    ("elbow movement", "elbow-flexion", 80.0, "deg", elbow_deg),
)
"""Name, exercise, how far it goes, unit, what is looked at."""


def detection(context: Context) -> list[Table]:
    """Return the smallest extent seen in 95 % of repetitions at no more than 5 % false alarms."""
    extents = EXTENTS[2::3] if context.quick else EXTENTS
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for name, exercise, full, unit, signal in MOVEMENTS:
        context.progress(f"detection: {name}")
        cells = [_smallest(context, exercise, full, signal, method, extents) for method in METHODS]
        rows.append((f"{name}, {unit}", tuple(cells)))
    return [
        Table(
            name="detection",
            title="The smallest movement seen in 95 % of repetitions, at most 5 % false alarms, typical",
            unit="",
            columns=METHODS,
            rows=tuple(rows),
            notes=(
                "A repetition counts as seen when the estimate goes up and down by more than it does in 95 % "
                "of as many repetitions of standing still. The paper misses movements under 5 mm or 2 deg. "
                f"25 Hz. Tried: {', '.join(f'{80 * e:g}' for e in extents)} mm or deg; dash: none of these.",
            ),
        )
    ]


def _smallest(
    context: Context, exercise: str, full: float, signal: Signal, method: str, extents: tuple[float, ...]
) -> float | None:
    ranges = partial(_ranges, context, exercise, signal, method)
    threshold = float(np.quantile(ranges(0.0), 1.0 - FALSE_ALARMS, method="higher"))
    for extent in extents:
        if float((ranges(extent) > threshold).mean()) >= SEEN:
            return extent * full
    return None


def _ranges(context: Context, exercise: str, signal: Signal, method: str, extent: float) -> Floats:
    """Return how far the estimate goes up and down in each repetition of all seeds."""
    found = []
    for seed in context.seeds[:1]:
        trial = Trial(
            exercise=exercise,
            level="typical",
            seed=seed,
            rate_hz=RATE_HZ,
            seconds=SECONDS,
            more=(("extent", extent),),
        )
        made = context.emulated(trial)
        if method in ("live", "best"):
            estimate = made.solved({"live": "auto"}.get(method, method))
        else:
            beats = zhou_trial.beats(made)
            estimate = zhou_trial.estimate(made, zhou_trial.motion(made, zhou_trial.CORRECTED, beats))
        values, step = signal(estimate)[made.counts], round(PERIOD_S * RATE_HZ)
        pieces = values[: len(values) // step * step].reshape(-1, step)
        found.append(np.nanmax(pieces, axis=1) - np.nanmin(pieces, axis=1))
    return np.concatenate(found)
