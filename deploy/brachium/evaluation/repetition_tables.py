"""Repetitions, range of motion and smoothness of emulated sessions, counted as pages and reports do."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated, Floats
from brachium.evaluation.tables import Cell, Limit, Table
from brachium.evaluation.trials import GUIDED, Trial
from brachium_body.angles import COLUMNS
from brachium_nodes.exercises import EXERCISES as EMULATED
from brachium_nodes.irregular import Irregular
from brachium_nodes.movement import Variation
from brachium_nodes.sensors import Level
from brachium_viewer.exercises import EXERCISES, Exercise
from brachium_viewer.metrics.arm_motion import JOINTS, ArmMotion
from brachium_viewer.metrics.medians import values
from brachium_viewer.metrics.set_measures import SetMeasures, set_measures

SESSIONS = {"sound": 60, "impaired": 40}
"""At each of two levels: 200 in all."""
QUICK = 4
"""Sessions of each kind for a look."""
AFTER_S = 1.5
"""The arm rests so long after its last movement."""
RANGE_DEG: dict[Level, float] = {"ideal": 2.0, "typical": 4.0}
"""How near a range of motion shall be."""
EXACT = {"sound": 98.0, "impaired": 95.0}
"""Per cent of sessions whose repetitions shall be counted exactly."""

PAIRS: dict[str, str] = {
    "elbow-irregular": "elbow-flexion",
    "shoulder-irregular": "shoulder-flexion",
    "elbow-impaired": "elbow-flexion",
    "shoulder-impaired": "shoulder-flexion",
}
"""What the emulated wearer does, and what the therapist chose."""


@dataclass(frozen=True, kw_only=True)
class Session:
    """One session as it was, and as it was measured."""

    done: int
    """Repetitions that the wearer made."""
    measured: SetMeasures
    true: SetMeasures

    @property
    def exact(self) -> bool:
        """Return whether every repetition was counted, and nothing else."""
        return len(self.measured.repetitions) == self.done

    def range_errors(self) -> list[float]:
        """Return by how much each range of motion is off, deg, where neither was withheld."""
        if not self.exact or len(self.true.repetitions) != self.done:
            return []
        pairs = zip(self.measured.repetitions, self.true.repetitions, strict=True)
        both = [(a.measures["range"].value, b.measures["range"].value) for a, b in pairs]
        return [a - b for a, b in both if a is not None and b is not None]


def repetitions(context: Context) -> list[Table]:
    """Return the table for each level."""
    return [_table(context, level) for level in context.levels if level in RANGE_DEG]


def _table(context: Context, level: Level) -> Table:
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for kind, whole in SESSIONS.items():
        count = QUICK if context.quick else whole
        names = [n for n in PAIRS if n.endswith("impaired") == (kind == "impaired")]
        seeds = range(1, count + 1)
        context.progress(f"repetitions, {level}, {kind}: {count} sessions")
        with ProcessPoolExecutor() as pool:
            sessions = list(pool.map(session, [names[i % 2] for i in seeds], [level] * count, seeds))
        errors = np.abs([e for s in sessions for e in s.range_errors()])
        exact = 100.0 * float(np.mean([s.exact for s in sessions]))
        within = float(np.percentile(errors, 95.0)) if len(errors) else None
        total = sum(len(s.measured.repetitions) for s in sessions)
        given = sum(len(values(s.measured.repetitions, "range")) for s in sessions)
        smooth = [off for s in sessions if s.exact and (off := _smoothness_off(s)) is not None]
        rows.append(
            (
                kind,
                (
                    float(count),
                    exact,
                    within,
                    float(np.median(errors)) if len(errors) else None,
                    100.0 * (1.0 - given / total) if total else None,
                    float(np.median(smooth)) if smooth else None,
                ),
            )
        )
        limits.append(
            Limit(
                what=f"{level}, {kind}: sessions counted exactly",
                value=exact,
                at_most=EXACT[kind],
                unit="%",
                at_least=True,
            )
        )
        limits.append(
            Limit(
                what=f"{level}, {kind}: range of motion, 95 % of repetitions",
                value=within,
                at_most=RANGE_DEG[level],
                unit="deg",
            )
        )
    return Table(
        name=f"repetitions-{level}",
        title=f"Repetitions and range of motion, {level}",
        unit="sessions, per cent, deg, per cent, 1",
        columns=(
            "sessions",
            "counted exactly",
            "range off, 95 %",
            "range off, median",
            "range withheld",
            "SPARC off, median",
        ),
        rows=tuple(rows),
        limits=tuple(limits),
        notes=(
            "Two sensors at 50 Hz, 5 % of the samples lost one by one, live. Pauses, tries that go less than "
            "two fifths of the way, and stops; impaired arms begin at 10 to 45 deg, go 6 to 20 deg, stop for "
            "up to 2 s and tremble by 2 deg at 5 Hz. The truth is measured in the same way.",
        ),
    )


def session(name: str, level: Level, seed: int) -> Session:
    """Return one session of an emulated wearer."""
    motion = EMULATED[name].motion
    assert isinstance(motion, Irregular)
    plan = motion.plan(Variation(seed, "right"))
    made = Emulated(
        Trial(
            exercise=name,
            level=level,
            seed=seed,
            seconds=plan.end_s + AFTER_S,
            loss=0.05,
            routine=GUIDED,
        )
    )
    found, exercise, rows = made.solved("auto"), EXERCISES[PAIRS[name]], made.counts
    time_s = made.session.time_s[rows]
    truth = {n: v[rows] for n, v in made.truth.angles.items()}
    measured = {n: v[rows] for n, v in found.angles.items()}
    return Session(
        done=plan.whole,
        measured=arm_measures(time_s, measured, found.positions, rows, exercise),
        true=arm_measures(time_s, truth, made.truth.trunk_positions, rows, exercise),
    )


def arm_measures(
    time_s: Floats, angles_rad: dict[str, Floats], places: dict[str, Floats], rows: slice, exercise: Exercise
) -> SetMeasures:
    """Return the measures of a right arm's set: angles (n,) by column, places (m, 3) whose `rows` count."""
    quality: dict[str, npt.NDArray[np.str_]] = {
        **{n: _words(v) for n, v in angles_rad.items()},
        **{j: _words(places[j][rows][:, 0]) for j in JOINTS},
    }
    motion = ArmMotion(
        side="right",
        origin="emulated",
        time_s=time_s,
        angles_deg={n: np.degrees(angles_rad[n]) for n in COLUMNS},
        quality=quality,
        positions_m={j: places[j][rows] for j in JOINTS},
        shoulder_shift_m=np.full((len(time_s), 3), np.nan),
        shoulder_shift_sd_m=np.full((len(time_s), 3), np.nan),
        sternum=np.zeros(len(time_s), dtype=np.bool_),
    )
    return set_measures(motion, exercise)


def _words(known: Floats) -> npt.NDArray[np.str_]:
    return np.where(np.isfinite(known), "good", "missing")


def _smoothness_off(one: Session) -> float | None:
    ours, true = one.measured.medians["sparc"].value, one.true.medians["sparc"].value
    return None if ours is None or true is None else abs(ours - true)
