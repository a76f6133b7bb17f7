"""One, two and three sensors, right and left: what each set measures, against the truth."""

from typing import NamedTuple

from brachium.evaluation.arm_tables import angle_deg, place_mm
from brachium.evaluation.context import Context
from brachium.evaluation.solving import word
from brachium.evaluation.tables import Cell, Table
from brachium.evaluation.trials import GUIDED, Trial, stated_angles
from brachium_body.segments import SIDES, Side
from brachium_nodes.sensors import Level


class Set(NamedTuple):
    """Which segments carry a sensor, what is done, and what is measured."""

    words: str
    parts: tuple[str, ...]
    exercise: str
    angles: tuple[str, ...]
    places: tuple[str, ...] = ()


ALL = ("isb_elevation", "elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation")
SETS: tuple[Set, ...] = (
    Set("forearm alone", ("forearm",), "elbow-flexion", ("elbow_flexion",)),
    Set("upper arm alone", ("upper_arm",), "shoulder-abduction", ("isb_elevation",)),
    Set("hand alone", ("hand",), "wrist-flexion", ("wrist_flexion",)),
    Set("upper arm and forearm", ("upper_arm", "forearm"), "free", ALL[:3], ("wrist",)),
    Set("all three", ("upper_arm", "forearm", "hand"), "free", ALL, ("wrist", "hand")),
    Set("all three and sternum", ("sternum", "upper_arm", "forearm", "hand"), "free", ALL, ("wrist", "hand")),
)
METHODS = ("auto", "best")


def sensor_sets(context: Context) -> list[Table]:
    """Return every set on both sides, live and best, at the last level that was asked for."""
    return [_table(context, context.levels[-1])]


def _table(context: Context, level: Level) -> Table:
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for worn in SETS:
        context.progress(f"sensor sets, {level}: {worn.words}")
        figures = [(name.replace("_", " ") + ", deg", angle_deg(name)) for name in worn.angles]
        figures += [(f"{joint}, mm", place_mm(joint)) for joint in worn.places]
        for i, (label, _) in enumerate(figures):
            cells = tuple(
                _figure(context, worn, level, side, method, i, context.seeds[0])
                for method in METHODS
                for side in SIDES
            )
            rows.append((f"{worn.words}: {label}", cells))
    return Table(
        name=f"sensor-sets-{level}",
        title=f"One, two and three sensors, right and left, {level}",
        unit="RMS, 3-D for places",
        columns=tuple(f"{word(m)}, {side}" for m in METHODS for side in SIDES),
        rows=tuple(rows),
        notes=(
            "50 Hz, 20 s. A single sensor does its exercise of Tsilomitrou's, whose other angles are stated; "
            "two and more are calibrated by the guided routine and follow free movement. "
            f"Seed {context.seeds[0]} alone.",
        ),
    )


def _figure(
    context: Context, worn: Set, level: Level, side: Side, method: str, which: int, seed: int
) -> float | None:
    trial = Trial(
        exercise=worn.exercise,
        level=level,
        seed=seed,
        side=side,
        parts=worn.parts,
        routine=GUIDED if len(worn.parts) > 1 else "",
        assumed_angles_deg=stated_angles(worn.exercise) if len(worn.parts) == 1 else (),
    )
    made = context.emulated(trial)
    figures = [angle_deg(name) for name in worn.angles] + [place_mm(joint) for joint in worn.places]
    return figures[which](made, made.solved(method))
