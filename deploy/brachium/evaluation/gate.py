"""A few figures that stand for the tables: made in two minutes, held by a test at 10 % worse than stored."""

from collections.abc import Mapping
from typing import NamedTuple

from brachium.evaluation import alignment_tables, arm_tables, tsilomitrou_tables, zhou_limits, zhou_trial
from brachium.evaluation.arm_tables import Figure, angle_deg, place_mm, shoulder_mm
from brachium.evaluation.context import Context
from brachium.evaluation.trials import GUIDED, Trial
from brachium_nodes.sensors import Level

SEED, RATE_HZ = 1, 25.0
WORSE = 1.10
"""A figure may be this many times the stored one."""
ROUNDING = 0.005
"""And, whatever its unit, this much more: other libraries round otherwise."""


class Held(NamedTuple):
    """One figure of an arm with two sensors."""

    exercise: str
    label: str
    figure: Figure


HELD: tuple[Held, ...] = (
    Held("shrugging", "shoulder mm", shoulder_mm),
    Held("reaching", "wrist mm", place_mm("wrist")),
    Held("reaching", "elbow flexion deg", angle_deg("elbow_flexion")),
    Held("reaching", "forearm pronation deg", angle_deg("forearm_pronation")),
)
LEVELS: tuple[Level, ...] = ("ideal", "typical")


def figures(context: Context | None = None) -> dict[str, float]:
    """Return every figure by its name, at one seed; what could not be measured is left out."""
    context = context or Context(seeds=(SEED,), quick=True, progress=lambda _: None)
    found: dict[str, float | None] = {}
    for level in LEVELS:
        for held in HELD:
            trial = Trial(exercise=held.exercise, level=level, seed=SEED, rate_hz=RATE_HZ, routine=GUIDED)
            made = context.emulated(trial)
            for method in ("auto", "best"):
                name = f"{held.exercise}, {level}, {method}: {held.label}"
                found[name] = held.figure(made, made.solved(method))
        errors = alignment_tables.errors(context, level, alignment_tables.CARRYING_DEG[0], SEED)
        found |= {
            f"alignment, {level}: {what} deg": value
            for what, value in zip(alignment_tables.COLUMNS, errors, strict=True)
        }
    lossy = Trial(
        exercise="reaching",
        level="typical",
        seed=SEED,
        rate_hz=RATE_HZ,
        loss=arm_tables.LOSS,
        burst=arm_tables.BURST,
    )
    made = context.emulated(lossy)
    found["reaching, 5 % lost, auto: elbow flexion deg"] = angle_deg("elbow_flexion")(
        made, made.solved("auto")
    )
    elbow = tsilomitrou_tables.EXPERIMENTS[0]
    made = context.emulated(tsilomitrou_tables.trial_of(context, elbow, "typical", SEED))
    for method in ("corrected", "vqf", "auto", "best"):
        found[f"forearm alone, typical, {method}: elbow flexion deg"] = angle_deg("theta4")(
            made, made.solved(method)
        )
    zhou = zhou_limits.errors(context, zhou_trial.CORRECTED, SEED)
    found |= {
        f"Zhou, corrected: {what}": value for what, value in zip(zhou_limits.COLUMNS, zhou, strict=True)
    }
    return {name: value for name, value in found.items() if value is not None}


def worse(now: Mapping[str, float], stored: Mapping[str, float]) -> list[str]:
    """Return what is worse than stored by more than WORSE allows, or not there any more, in words."""
    said = []
    for name, before in stored.items():
        value = now.get(name)
        if value is None:
            said.append(f"{name}: was {before:.3g}, is not there")
        elif not value <= WORSE * before + ROUNDING:
            said.append(f"{name}: was {before:.3g}, is {value:.3g}")
    return said
