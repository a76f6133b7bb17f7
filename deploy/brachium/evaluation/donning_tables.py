"""The same movement twice, the sensors put on anew between: how often that would be shown as a change."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated
from brachium.evaluation.repetition_tables import arm_measures
from brachium.evaluation.tables import Limit, Table
from brachium.evaluation.trials import GUIDED, Trial
from brachium_nodes.sensors import Level
from brachium_viewer.exercises import EXERCISES
from brachium_viewer.metrics.change import FEWEST_PAIRS, Change, SmallestChange, smallest_change

PERSONS: tuple[str, ...] = ("elbow-flexion", "shoulder-abduction") * 2
"""What each of them does."""
PAIRS, LEARNT_FROM = 50, 10
"""Of each person, and how many more their own smallest detectable change is learnt from."""
QUICK_PAIRS = 2
SECONDS = 13.0
"""Of the exercise: three repetitions of the elbow, and two of the shoulder."""
RATE_HZ = 25.0
"""Zhou et al.'s: enough for movements as slow as these, at half the time."""
SHOWN_PERCENT = 5.0
"""At most so many of the pairs may be called a change: 1.96 standard deviations leave as many."""
WORKERS = 2
MEASURES = ("range", "best_peak")
"""What a report compares with the last session."""

Pair = tuple[dict[str, float], dict[str, float]]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What a report would have said of the pairs of all persons."""

    pairs: int
    stated: int
    """Pairs in which a measure is more apart than the stated smallest change."""
    learnt: int
    """The same with the one that is learnt from the person's own pairs."""
    smallest_deg: float
    """The learnt ones' median."""


def donnings(context: Context) -> list[Table]:
    """Return the table, at the level of typical sensors."""
    level: Level = "typical"
    persons = PERSONS[:2] if context.quick else PERSONS
    count, learn = (QUICK_PAIRS, FEWEST_PAIRS) if context.quick else (PAIRS, LEARNT_FROM)
    found: dict[str, list[Pair]] = {}
    with ProcessPoolExecutor(WORKERS) as pool:
        for person, exercise in enumerate(persons, start=1):
            context.progress(f"donnings, person {person} of {len(persons)}: {count + learn} pairs")
            seeds = [1000 * person + i for i in range(2 * (count + learn))]
            n = len(seeds)
            once = list(pool.map(measures_of, [exercise] * n, [level] * n, [person] * n, seeds))
            found[f"{person}, {exercise}"] = list(zip(once[::2], once[1::2], strict=True))
    rows = {name: shown(pairs[learn:], pairs[:learn]) for name, pairs in found.items()}
    total = sum(one.pairs for one in rows.values())
    stated = 100.0 * sum(one.stated for one in rows.values()) / total
    learnt = 100.0 * sum(one.learnt for one in rows.values()) / total
    return [
        Table(
            name="donnings",
            title="The same movement, sensors put on anew",
            unit="pairs, deg, per cent",
            columns=("pairs", "apart, 95 %", "learnt smallest change", "shown, stated", "shown, learnt"),
            rows=tuple(
                (
                    name,
                    (
                        float(one.pairs),
                        float(np.percentile(apart(found[name][learn:]), 95.0)),
                        one.smallest_deg,
                        100.0 * one.stated / one.pairs,
                        100.0 * one.learnt / one.pairs,
                    ),
                )
                for name, one in rows.items()
            ),
            limits=(
                Limit(what="stated: pairs shown as changed", value=stated, at_most=SHOWN_PERCENT, unit="%"),
                Limit(what="learnt: pairs shown as changed", value=learnt, at_most=SHOWN_PERCENT, unit="%"),
            ),
            notes=(
                "Each person makes the very same movement again and again; straps, sensors, their noise, and "
                "how the calibration's pose and movements are done are drawn anew each time. A pair is shown "
                f"as changed when one of {' and '.join(m.replace('_', ' ') for m in MEASURES)} is further "
                "apart than the smallest detectable change: the stated one, or one learnt from "
                f"{learn} other pairs of the same person.",
            ),
        )
    ]


def measures_of(exercise: str, level: Level, person: int, seed: int) -> dict[str, float]:
    """Return what a set of a person gives with sensors that this seed puts on; what is withheld is left
    out."""
    made = Emulated(
        Trial(
            exercise=exercise,
            level=level,
            seed=seed,
            seconds=SECONDS,
            rate_hz=RATE_HZ,
            routine=GUIDED,
            more=(("movement_seed", person),),
        )
    )
    found, rows = made.solved("auto"), made.counts
    angles = {name: values[rows] for name, values in found.angles.items()}
    measures = arm_measures(made.session.time_s[rows], angles, found.positions, rows, EXERCISES[exercise])
    numbers = {"range": measures.medians["range"].value, "best_peak": measures.best_peak.value}
    return {name: value for name, value in numbers.items() if value is not None}


def shown(pairs: Sequence[Pair], learnt_from: Sequence[Pair]) -> Shown:
    """Return how many pairs would be shown as changed, by the stated and by the learnt smallest change."""
    stated = {name: smallest_change(()) for name in MEASURES}
    learnt = {name: smallest_change(both(learnt_from, name)) for name in MEASURES}
    return Shown(
        pairs=len(pairs),
        stated=sum(changed(pair, stated) for pair in pairs),
        learnt=sum(changed(pair, learnt) for pair in pairs),
        smallest_deg=float(np.median([one.value_deg for one in learnt.values()])),
    )


def changed(pair: Pair, smallest: dict[str, SmallestChange]) -> bool:
    """Return whether any measure that both have would be shown as a change."""
    before, now = pair
    return any(
        Change(now=now[name], before=before[name], smallest=smallest[name]).detected
        for name in MEASURES
        if name in before and name in now
    )


def both(pairs: Sequence[Pair], name: str) -> list[tuple[float, float]]:
    """Return a measure of the pairs that have it twice."""
    return [(a[name], b[name]) for a, b in pairs if name in a and name in b]


def apart(pairs: Sequence[Pair]) -> list[float]:
    """Return by how much the pairs are apart, deg, in any measure."""
    return [abs(b - a) for name in MEASURES for a, b in both(pairs, name)]
