"""Two sensors on an arm: shoulder, wrist and angles of live and recorded defaults, against the truth."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated, Estimate
from brachium.evaluation.errors import angle_error, rms
from brachium.evaluation.solving import word
from brachium.evaluation.tables import Cell, Limit, Table, middle
from brachium.evaluation.trials import GUIDED, Trial
from brachium_nodes.sensors import Level

RATES_HZ = (25.0, 50.0)
METHODS = ("vqf", "auto", "best")
Figure = Callable[[Emulated, Estimate], float | None]


class Goal(NamedTuple):
    """One row: an exercise and its figure, and what it shall not exceed, ideal and typical."""

    label: str
    exercise: str
    figure: Figure
    unit: str
    best: tuple[float, float] | None = None
    live: tuple[float, float] | None = None
    routine: str = GUIDED
    """What comes before it; standing alone is enough for a shoulder whose arm hangs."""


def shoulder_mm(made: Emulated, found: Estimate) -> float | None:
    """Return the RMS of the shoulder's translation, mm; a method that gives none says it stands still."""
    known = np.where(np.isfinite(found.shift), found.shift, 0.0)
    return _mm(rms((known - made.truth.shoulder_shift)[made.counts]))


def place_mm(joint: str) -> Figure:
    """Return the figure of a joint's position: its 3-D RMS error, mm."""

    def figure(made: Emulated, found: Estimate) -> float | None:
        return _mm(rms((found.positions[joint] - made.truth.trunk_positions[joint])[made.counts]))

    return figure


def angle_deg(column: str) -> Figure:
    """Return the figure of an angle: its RMS error, deg."""

    def figure(made: Emulated, found: Estimate) -> float | None:
        error = rms(angle_error(found.angles[column], made.truth.angles[column])[made.counts])
        return None if error is None else float(np.degrees(error))

    return figure


GOALS: tuple[Goal, ...] = (
    Goal("shrug: shoulder", "shrugging", shoulder_mm, "mm", best=(3.0, 8.0), live=(4.5, 12.0), routine=""),
    Goal("shrug after the routine: shoulder", "shrugging", shoulder_mm, "mm"),
    Goal("reaching: wrist", "reaching", place_mm("wrist"), "mm", best=(4.0, 14.0)),
    Goal("reaching: elbow flexion", "reaching", angle_deg("elbow_flexion"), "deg", best=(0.3, 2.5)),
    Goal("elbow: elbow flexion", "elbow-flexion", angle_deg("elbow_flexion"), "deg", best=(0.3, 2.5)),
    Goal("circle: wrist", "circle", place_mm("wrist"), "mm", best=(4.0, 15.0)),
    Goal("rectangle: wrist", "rectangle", place_mm("wrist"), "mm", best=(4.0, 15.0)),
    Goal(
        "rotation: forearm pronation",
        "forearm-rotation",
        angle_deg("forearm_pronation"),
        "deg",
        best=(0.5, 2.5),
    ),
    Goal("reaching: shoulder", "reaching", shoulder_mm, "mm"),
    Goal("shrug: wrist", "shrugging", place_mm("wrist"), "mm"),
)
LIMITED: tuple[Level, ...] = ("ideal", "typical")


def arm(context: Context) -> list[Table]:
    """Return one table a level: every goal at both rates by each method."""
    return [_arm(context, level) for level in context.levels]


def _arm(context: Context, level: Level) -> Table:
    columns = [(rate, method) for rate in RATES_HZ for method in METHODS]
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for goal in GOALS:
        context.progress(f"arm, {level}: {goal.label}")
        cells: list[Cell] = []
        for rate, method in columns:
            bound = {"best": goal.best, "auto": goal.live}.get(method)
            seeds = context.seeds if bound is not None else context.seeds[:1]
            value = middle([_value(context, goal, level, rate, method, seed) for seed in seeds])
            cells.append(value)
            if bound is not None and level in LIMITED:
                limits.append(
                    Limit(
                        what=f"{goal.label}, {level}, {rate:g} Hz, {word(method)}",
                        value=value,
                        at_most=bound[LIMITED.index(level)],
                        unit=goal.unit,
                    )
                )
        rows.append((f"{goal.label}, {goal.unit}", tuple(cells)))
    return Table(
        name=f"arm-{level}",
        title=f"Upper-arm and forearm sensors, 20 s, {level}",
        unit="RMS, 3-D for places",
        columns=tuple(f"{rate:g} Hz {word(method)}" for rate, method in columns),
        rows=tuple(rows),
        limits=tuple(limits),
        notes=(
            "Calibrated by the guided routine first (standing, elbow flexions, pronations, both), the first "
            "row by standing alone. Emulated "
            f"right arm; figures with a limit: median of seeds {', '.join(map(str, context.seeds))}, others: "
            f"seed {context.seeds[0]}.",
        ),
    )


def _value(context: Context, goal: Goal, level: Level, rate: float, method: str, seed: int) -> float | None:
    trial = Trial(exercise=goal.exercise, level=level, seed=seed, rate_hz=rate, routine=goal.routine)
    made = context.emulated(trial)
    return goal.figure(made, made.solved(method))


def _mm(metres: float | None) -> float | None:
    return None if metres is None else 1e3 * metres


LOSS, BURST = 0.05, 5
LOSS_RATIO = 1.5
LOSS_ANGLES = (("reaching", "elbow_flexion"), ("elbow-flexion", "elbow_flexion"),
               ("forearm-rotation", "forearm_pronation"))  # fmt: skip


def loss(context: Context) -> list[Table]:
    """Return what 5 % loss in bursts of 5 does to angles, beside the same recording without loss."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for level in context.levels:
        for exercise, column in LOSS_ANGLES:
            context.progress(f"loss, {level}: {exercise}")
            for method in ("auto", "best"):
                seed = context.seeds[0]
                whole, lossy = (
                    _lossy(context, exercise, column, level, method, part, seed) for part in (0.0, LOSS)
                )
                ratio = None if not whole or lossy is None else lossy / whole
                label = f"{exercise}: {column}, {level}, {word(method)}"
                rows.append((label, (whole, lossy, ratio)))
                if level in LIMITED:
                    limits.append(Limit(what=label, value=ratio, at_most=LOSS_RATIO, unit="times"))
    return [
        Table(
            name="loss",
            title="5 % of the samples lost, 5 in a row, 50 Hz",
            unit="deg RMS",
            columns=("nothing lost", "5 % lost", "ratio"),
            rows=tuple(rows),
            limits=tuple(limits),
            notes=(
                "Each sensor loses its own samples. A gap of up to 100 ms is bridged; in a longer one the "
                "segment is missing and its rows do not count. "
                f"Seed {context.seeds[0]} alone.",
            ),
        )
    ]


def _lossy(
    context: Context, exercise: str, column: str, level: Level, method: str, part: float, seed: int
) -> float | None:
    burst = BURST if part else 1
    trial = Trial(exercise=exercise, level=level, seed=seed, routine=GUIDED, loss=part, burst=burst)
    made = context.emulated(trial)
    return angle_deg(column)(made, made.solved(method))
