"""The experiments of Tsilomitrou et al. 2021: one sensor each, by its eq 17 and in three dimensions."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from brachium.evaluation.context import Context
from brachium.evaluation.emulated import Emulated
from brachium.evaluation.errors import angle_error, rms
from brachium.evaluation.solving import word
from brachium.evaluation.tables import Cell, Table
from brachium.evaluation.trials import Trial, stated_angles
from brachium_nodes.sensors import Level
from brachium_nodes.session import Reading
from brachium_viewer.statistics import eq17
from brachium_viewer.two_sensors_text import PAPER

Floats = npt.NDArray[np.float64]

METHODS = ("printed", "corrected", "vqf", "auto", "best")
WORDS = tuple(word(method) for method in METHODS)
RATE_HZ, SECONDS, QUICK_SECONDS = 50.0, 30.0, 20.0


class Experiment(NamedTuple):
    """One of sections 4.2 to 4.4."""

    label: str
    exercise: str
    part: str
    """The segment that carries the sensor."""
    paper: Mapping[str, tuple[float, ...]]
    """By joint: MAE, largest, RMSE of eq 17 against the second sensor, mm; empty where it has none."""
    angles: tuple[str, ...]


EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment("4 elbow", "elbow-flexion", "forearm",
               PAPER["forearm"], ("theta4", "theta5")),
    Experiment("5 abduction", "shoulder-abduction", "upper_arm",
               PAPER["upper_arm"],
               ("theta1", "theta2", "theta3", "isb_elevation")),
    Experiment("wrist", "wrist-flexion", "hand", {"hand": ()}, ("theta6", "theta7")),
)  # fmt: skip
EQ17 = ("MAE", "largest", "RMSE")


def trial_of(context: Context, experiment: Experiment, level: Level, seed: int) -> Trial:
    """Return an experiment's trial: its one sensor, and what it states of the joints that it does not see."""
    return Trial(
        exercise=experiment.exercise,
        level=level,
        seed=seed,
        rate_hz=RATE_HZ,
        seconds=QUICK_SECONDS if context.quick else SECONDS,
        parts=(experiment.part,),
        assumed_angles_deg=stated_angles(experiment.exercise),
    )


def places(context: Context) -> list[Table]:
    """Return Tables 4 and 5, once against a second set of sensors, as the paper has them, once against the
    truth."""
    return [_places(context, level, against) for level in context.levels for against in ("second", "truth")]


def _places(context: Context, level: Level, against: str) -> Table:
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for experiment in EXPERIMENTS:
        context.progress(f"tsilomitrou, {level}: {experiment.label}, against {against}")
        for joint, paper in experiment.paper.items():
            figures = [
                context.over_seeds_each(partial(_place, context, experiment, level, against, joint, method))
                for method in METHODS
            ]
            place = "end effector" if joint == "hand" else joint
            for i, statistic in enumerate((*(f"eq 17 {s}" for s in EQ17), "3-D RMS")):
                stated = paper[i] if i < len(paper) and against == "second" else None
                rows.append((f"{experiment.label}: {place}, {statistic}", (stated, *(f[i] for f in figures))))
    reference = {"second": "a second set of sensors on the same segment", "truth": "the truth"}[against]
    return Table(
        name=f"tsilomitrou-{against}-{level}",
        title=f"Tables 4 and 5 of Tsilomitrou et al. 2021 against {reference}, {level}",
        unit="mm",
        columns=("paper", *WORDS),
        rows=tuple(rows),
        notes=(
            "Eq 17 compares distances from the chest and is blind to most of an error (erratum T17); the 3-D "
            "RMS beside it is the distance between the two places. A second sensor of the same kind shares "
            "the first one's faults of method and shows only what differs between two copies (erratum T19). "
            f"Emulated right arm, 50 Hz, median of seeds {', '.join(map(str, context.seeds))}.",
        ),
    )


def _place(
    context: Context, experiment: Experiment, level: Level, against: str, joint: str, method: str, seed: int
) -> list[float | None]:
    trial = trial_of(context, experiment, level, seed)
    made = context.emulated(trial)
    found = made.solved(method).positions[joint][made.counts]
    if against == "truth":
        reference = made.truth.trunk_positions[joint][made.counts]
    else:
        second = context.emulated(replace(trial, second_set=True))
        reference = second.solved(method).positions[joint][made.counts]
    norm, apart = eq17(found, reference), rms(found - reference)
    figures: list[float | None] = [None, None, None]
    if norm is not None:
        figures = [norm.mae, norm.largest, norm.rmse]
    return [None if f is None else 1e3 * f for f in (*figures, apart)]


def angles(context: Context) -> list[Table]:
    """Return the joint angles' errors against the truth."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for level in context.levels:
        for experiment in EXPERIMENTS:
            context.progress(f"tsilomitrou angles, {level}: {experiment.label}")
            for column in experiment.angles:
                cells = tuple(
                    context.over_seeds(partial(_angle_of, context, experiment, level, column, method))
                    for method in METHODS
                )
                rows.append((f"{experiment.label}: {column}, {level}", cells))
    return [
        Table(
            name="tsilomitrou-angles",
            title="Joint angles in the experiments of Tsilomitrou et al. 2021, against the truth",
            unit="deg RMS",
            columns=WORDS,
            rows=tuple(rows),
            notes=(
                "theta1 and theta3 come near the model's singularity at the top of the raise, where they "
                "amplify any error; isb_elevation does not.",
            ),
        )
    ]


def _angle_of(
    context: Context, experiment: Experiment, level: Level, column: str, method: str, seed: int
) -> float | None:
    return _angle(context.emulated(trial_of(context, experiment, level, seed)), column, method)


def _angle(made: Emulated, column: str, method: str) -> float | None:
    error = rms(angle_error(made.solved(method).angles[column], made.truth.angles[column])[made.counts])
    return None if error is None else float(np.degrees(error))


LOSSES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
BURSTS = (1, 5, 10)
LOSS_METHODS = ("corrected", "vqf", "auto", "best")


def packet_loss(context: Context) -> list[Table]:
    """Return the elbow test with part of the samples lost, one by one and in bursts."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for burst in BURSTS:
        for loss in LOSSES if burst == 1 else LOSSES[1:]:
            context.progress(f"packet loss: {100 * loss:g} %, {burst} in a row")
            cells = tuple(
                context.over_seeds(partial(_loss, context, method, loss, burst)) for method in LOSS_METHODS
            )
            rows.append((f"{100 * loss:g} %, {burst} in a row", cells))
    return [
        Table(
            name="packet-loss",
            title="The elbow test with samples lost, typical",
            unit="deg RMS of elbow flexion, over the rows that were solved",
            columns=tuple(word(method) for method in LOSS_METHODS),
            rows=tuple(rows),
            notes=(
                "The paper (section 1) expects little harm, and has no figure. 50 Hz, forearm sensor alone.",
            ),
        )
    ]


def _loss(context: Context, method: str, loss: float, burst: int, seed: int) -> float | None:
    trial = replace(trial_of(context, EXPERIMENTS[0], "typical", seed), loss=loss, burst=burst)
    return _angle(context.emulated(trial), "theta4", method)


LEFT_OUT: tuple[tuple[Reading, ...], ...] = ((), ("gyr",), ("acc",), ("mag",), ("gyr", "acc", "mag"))


def calibration_left_out(context: Context) -> list[Table]:
    """Return the elbow test with each calibration of the sensor left out."""
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for left_out in LEFT_OUT:
        label = "all calibrated" if not left_out else f"without {', '.join(left_out)}"
        context.progress(f"calibration left out: {label}")
        cells: list[Cell] = []
        for method in ("corrected", "vqf", "auto", "best"):
            cells += context.over_seeds_each(partial(_left_out, context, method, left_out))
        rows.append((label, tuple(cells)))
    return [
        Table(
            name="calibration-left-out",
            title="The elbow test with sensor calibrations left out",
            unit="deg",
            columns=tuple(
                f"{word} {what}"
                for word in ("corrected", "VQF", "live", "best")
                for what in ("RMS", "least", "most")
            ),
            rows=tuple(rows),
            notes=(
                "Elbow flexion is really 8 to 88 deg. The paper traces its second sensor's 13 to 85 against "
                "the node's 8 to 88 to calibration (4.2). Ideal level but for what is left out; raw errors "
                "are those that the MPU-9150's data sheet allows.",
            ),
        )
    ]


def _left_out(context: Context, method: str, left_out: tuple[Reading, ...], seed: int) -> list[float | None]:
    trial = replace(trial_of(context, EXPERIMENTS[0], "ideal", seed), uncalibrated=left_out)
    made = context.emulated(trial)
    found = np.degrees(made.solved(method).angles["theta4"][made.counts])
    low, high = np.nanpercentile(found, [1.0, 99.0])
    return [_angle(made, "theta4", method), float(low), float(high)]
