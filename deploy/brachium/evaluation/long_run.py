"""Half an hour of shrugging with rests: does anything grow, and what a disturbed field or none does."""

from typing import NamedTuple

import numpy as np

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated, Estimate
from brachium.evaluation.errors import angle_error, relative_angle, rms
from brachium.evaluation.solving import word
from brachium.evaluation.tables import Cell, Limit, Table
from brachium.evaluation.trials import GUIDED, Trial
from brachium_body.segments import arm_segments

RATE_HZ, SECONDS, QUICK_SECONDS = 25.0, 1800.0, 240.0
END_S = 120.0
"""Length of the pieces at both ends that are compared."""
GROWTH, ELBOW_DEG, DISTURBED_DEG = 1.2, 0.5, 1.5


class Setting(NamedTuple):
    """One half hour."""

    words: str
    magnetometer: bool
    disturbance_ut: float
    methods: tuple[str, ...]


SETTINGS: tuple[Setting, ...] = (
    Setting("9 axes", True, 0.0, ("best",)),
    Setting("9 axes, field disturbed by 8 uT", True, 8.0, ("auto", "best")),
    Setting("6 axes", False, 0.0, ("best",)),
)


def long_run(context: Context) -> list[Table]:
    """Return the first and the last two minutes of half an hour, at one seed."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    limits: list[Limit] = []
    for setting in SETTINGS:
        trial = Trial(
            exercise="shrugging",
            level="ideal",
            seed=context.seeds[0],
            rate_hz=RATE_HZ,
            seconds=QUICK_SECONDS if context.quick else SECONDS,
            routine=GUIDED,
            magnetometer=setting.magnetometer,
            disturbance_ut=setting.disturbance_ut,
        )
        made = Emulated(trial)  # not kept: it is large
        for method in setting.methods:
            context.progress(f"long run: {setting.words}, {method}")
            found = made.solved(method)
            first, last = (_figures(made, found, at_end=at_end) for at_end in (False, True))
            label = f"{setting.words}, {word(method)}"
            rows.append((label, (first[0], last[0], first[1], last[1], first[2], last[2])))
            if setting == SETTINGS[0]:
                growth = None if not first[0] or last[0] is None else last[0] / first[0]
                limits.append(
                    Limit(what=f"{label}: shoulder, last over first", value=growth, at_most=GROWTH, unit="")
                )
            if not setting.magnetometer:
                limits.append(
                    Limit(what=f"{label}: elbow at the end", value=last[1], at_most=ELBOW_DEG, unit="deg")
                )
            if setting.disturbance_ut:
                limits.append(
                    Limit(
                        what=f"{label}: relative at the end", value=last[2], at_most=DISTURBED_DEG, unit="deg"
                    )
                )
    minutes = (QUICK_SECONDS if context.quick else SECONDS) / 60.0
    return [
        Table(
            name="long-run",
            title=f"{minutes:g} minutes of shrugging with rests, ideal, first and last two minutes",
            unit="shoulder mm 3-D RMS; elbow flexion and forearm seen from upper arm deg RMS",
            columns=tuple(
                f"{what}, {when}" for what in ("shoulder", "elbow", "relative") for when in ("first", "last")
            ),
            rows=tuple(rows),
            limits=tuple(limits),
            notes=(
                f"Upper-arm and forearm sensors, 25 Hz, seed {context.seeds[0]} alone. The wearer comes back "
                "to exactly the same place; a person's own repeatability adds to the shoulder's figures.",
            ),
        )
    ]


def _figures(made: Emulated, found: Estimate, *, at_end: bool) -> tuple[float | None, ...]:
    """Return shoulder mm, elbow flexion deg and relative orientation deg of one end."""
    length = round(END_S * RATE_HZ)
    begin = made.counts.start
    rows = slice(-length, None) if at_end else slice(begin, begin + length)
    shift = np.where(np.isfinite(found.shift), found.shift, 0.0)
    shoulder = rms((shift - made.truth.shoulder_shift)[rows])
    elbow = rms(angle_error(found.angles["elbow_flexion"], made.truth.angles["elbow_flexion"])[rows])
    upper, fore, _ = arm_segments(made.trial.side)
    true = made.truth.world_from_segment
    relative = rms(
        relative_angle(
            found.world_from_segment[upper], found.world_from_segment[fore], true[upper], true[fore]
        )[rows]
    )
    return (
        None if shoulder is None else 1e3 * shoulder,
        None if elbow is None else float(np.degrees(elbow)),
        None if relative is None else float(np.degrees(relative)),
    )
