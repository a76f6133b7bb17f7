"""What the system of Zhou et al. 2008 can do: erratum by erratum, with any lambda, with sensors anywhere."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np

from brachium.evaluation import zhou_trial
from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated, Estimate
from brachium.evaluation.errors import angle_error, rms
from brachium.evaluation.tables import Cell, Table
from brachium.evaluation.trials import Trial
from brachium_fusion.zhou import CORRECTED, MEAN_OF_BOTH, PRINTED, Erratum, ZhouSettings
from brachium_nodes.places import Arrangement

RATE_HZ = 25.0
COLUMNS = ("shrug: shoulder", "reaching: shoulder", "reaching: wrist", "reaching: elbow flexion")
SHORT: Mapping[Erratum, str] = {
    "Z2": "lengths the right way round",
    "Z3": "R stays a rotation",
    "Z4": "bias at rest for the high-pass",
    "Z5": "displacements, sensors where they are",
}


def errata(context: Context) -> list[Table]:
    """Return what each correction is worth: alone missing, and with the drift left in."""
    readings: dict[str, ZhouSettings] = {"printed": ZhouSettings(corrected=PRINTED, drift="cycle_reset")}
    for erratum in get_args(Erratum):
        label = f"corrected but for {erratum} ({SHORT[erratum]})"
        readings[label] = ZhouSettings(corrected=CORRECTED - {erratum}, drift="cycle_reset")
    readings["corrected"] = zhou_trial.CORRECTED
    readings["corrected, filters both ways (Z9)"] = replace(zhou_trial.CORRECTED, zero_phase=True)
    readings["corrected, drift left in"] = ZhouSettings()
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for label, settings in readings.items():
        context.progress(f"zhou errata: {label}")
        cells = context.over_seeds_each(partial(errors, context, settings))
        rows.append((label, tuple(cells)))
    return [
        Table(
            name="zhou-errata",
            title="The system of Zhou et al. 2008, erratum by erratum, ideal",
            unit="mm 3-D RMS, deg RMS, over whole repetitions",
            columns=COLUMNS,
            rows=tuple(rows),
            notes=(
                "20 s at 25 Hz. Drift is reset in each repetition where it is not said to be left in. Lambda "
                "is -1/2, the mean of both sensors.",
            ),
        )
    ]


def errors(context: Context, settings: ZhouSettings, seed: int) -> list[float | None]:
    """Return the errors by COLUMNS of one wearer."""
    figures: list[float | None] = []
    for exercise in ("shrugging", "reaching"):
        made = context.emulated(Trial(exercise=exercise, level="ideal", seed=seed, rate_hz=RATE_HZ))
        found = zhou_trial.estimate(made, zhou_trial.motion(made, settings))
        figures.append(shoulder_mm(made, found))
        if exercise == "reaching":
            rows = whole_repetitions(made)
            wrist = rms((found.positions["wrist"] - made.truth.trunk_positions["wrist"])[rows])
            flexion = rms(
                angle_error(found.angles["elbow_flexion"], made.truth.angles["elbow_flexion"])[rows]
            )
            figures += [
                None if wrist is None else 1e3 * wrist,
                None if flexion is None else float(np.degrees(flexion)),
            ]
    return figures


def whole_repetitions(made: Emulated) -> slice:
    """Return the rows from the first repetition's beginning to the last one's end."""
    cycles = zhou_trial.cycles(made)
    return slice(cycles[0], cycles[-1])


def shoulder_mm(made: Emulated, found: Estimate) -> float | None:
    """Return the 3-D RMS of the shoulder's translation over whole repetitions, mm."""
    rows = whole_repetitions(made)
    error = rms((found.shift - made.truth.shoulder_shift)[rows])
    return None if error is None else 1e3 * error


HEIGHTS_M = (1.60, 1.75, 1.90)
"""Of the wearers whose lambda is compared: their arms differ in length by a fifth."""
CALIBRATION_S = zhou_trial.REPETITION_S * zhou_trial.CALIBRATION_REPETITIONS


def lambda_transfer(context: Context) -> list[Table]:
    """Return lambda of three wearers, twice each, and what another's does to the shoulder."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    fits: dict[tuple[float, int], tuple[float, float, float]] = {}
    seeds = (context.seeds[0], context.seeds[0] + 1)
    for height in HEIGHTS_M:
        for seed in seeds:
            context.progress(f"lambda: {height} m, seed {seed}")
            trial = _wearer("reaching", height, seed)
            fit = zhou_trial.calibrated_lambda(
                context.emulated(replace(trial, seconds=CALIBRATION_S)), zhou_trial.CORRECTED
            )
            x, y, z = fit.weight.tolist()
            fits[height, seed] = (x, y, z)
    wearers = list(fits)
    for i, (height, seed) in enumerate(wearers):
        # The next wearer but one: another height, and the next one's day.
        own, other = fits[height, seed], fits[wearers[(i + len(seeds)) % len(wearers)]]
        cells: list[Cell] = [*own]
        for weight in (own, other, MEAN_OF_BOTH):
            for exercise in ("reaching", "shrugging"):
                made = context.emulated(_wearer(exercise, height, seed))
                settings = replace(zhou_trial.CORRECTED, weight=weight)
                cells.append(shoulder_mm(made, zhou_trial.estimate(made, zhou_trial.motion(made, settings))))
        rows.append((f"{height:.2f} m, day {seed}", tuple(cells)))
    exercises = ("reach", "shrug")
    return [
        Table(
            name="zhou-lambda",
            title="Lambda of one wearer used on another (erratum Z6), typical",
            unit="lambda without unit; shoulder mm 3-D RMS",
            columns=(
                *("l11", "l22", "l33"),
                *(f"{e}, {whose}" for whose in ("own", "another's", "-1/2") for e in exercises),
            ),
            rows=tuple(rows),
            notes=(
                "The paper says that lambda depends on the arm's length only, a healthy adult's serving "
                "a patient. Each wearer is calibrated on two days, with other errors of the same "
                "sensors' class, by 20 repetitions of reaching with a still shoulder. Were the claim true, "
                "both days would agree and heights would be in order.",
            ),
        )
    ]


def _wearer(exercise: str, height_m: float, seed: int) -> Trial:
    return Trial(
        exercise=exercise, level="typical", seed=seed, rate_hz=RATE_HZ, more=(("height_m", height_m),)
    )


ARRANGEMENTS: Mapping[Arrangement, str] = {
    "near-joints": "2 cm from elbow and wrist (2.3.1)",
    "moved-away": "10 cm from them (the re-allocation test)",
    "tracker": "5 cm from the acromion, palmar wrist (2.3.2)",
    "usual": "ours: 4 cm above the epicondyle, 3 cm above the wrist",
}
REALLOCATION_S = 100.0


def arrangements(context: Context) -> list[Table]:
    """Return the circle with the sensors worn in each of the paper's places, over 100 s."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    seconds = 20.0 if context.quick else REALLOCATION_S
    for arrangement, words in ARRANGEMENTS.items():
        context.progress(f"zhou places: {arrangement}")
        cells = _placed(context, arrangement, seconds, context.seeds[0])
        rows.append((words, tuple(cells)))
    return [
        Table(
            name="zhou-places",
            title="The circle with the sensors in other places, typical",
            unit="wrist: mm 3-D RMS; mean place: mm, and % of its distance from the shoulder",
            columns=(
                *("as the text (Z5 missing)", "corrected", "live", "best"),
                *("mean off, live", "% live", "mean off, best", "% best"),
            ),
            rows=tuple(rows),
            notes=(
                "The paper: moving both sensors away from their joints varied the mean by less than 0.5 %.",
            ),
        )
    ]


def _placed(context: Context, arrangement: Arrangement, seconds: float, seed: int) -> list[float | None]:
    trial = Trial(
        exercise="circle",
        level="typical",
        seed=seed,
        rate_hz=RATE_HZ,
        seconds=seconds,
        arrangement=arrangement,
    )
    made = context.emulated(trial)
    rows, true = whole_repetitions(made), made.truth.trunk_positions
    literal = replace(zhou_trial.CORRECTED, corrected=CORRECTED - {"Z5"})
    readings = [
        zhou_trial.estimate(made, zhou_trial.motion(made, s)) for s in (literal, zhou_trial.CORRECTED)
    ]
    found = [*readings, made.solved("auto"), made.solved("best")]
    figures: list[float | None] = []
    for one in found:
        error = rms((one.positions["wrist"] - true["wrist"])[rows])
        figures.append(None if error is None else 1e3 * error)
    reach = float(np.linalg.norm((true["wrist"] - true["shoulder"])[rows].mean(axis=0)))
    for one in found[2:]:
        off = np.linalg.norm(np.nanmean((one.positions["wrist"] - true["wrist"])[rows], axis=0))
        figures += [1e3 * float(off), 100.0 * float(off) / reach]
    return figures
