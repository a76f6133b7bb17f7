"""What an emulated optical tracker says of an arm's joints, at the sensors' rate (Zhou 2008, 2.3.2). Pure."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium.evaluation.emulated import Emulated
from brachium_body import rotation
from brachium_body.angles import INDEX, joint_angles
from brachium_nodes.optical import optical_record

Floats = npt.NDArray[np.float64]

EPICONDYLE_M, WRIST_M = 0.035, 0.025
"""From the markers on lateral epicondyle and wrist inwards to the joints' centres, along the wands: as a
laboratory measures it on each person."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """What the tracker saw, on the sensors' grid."""

    places: dict[str, Floats]
    """shoulder, elbow, wrist in trunk axes from the chest, (n, 3) m."""
    angles: dict[str, Floats]
    """elbow_flexion and forearm_pronation, (n,) rad."""


def track(made: Emulated) -> Tracked:
    """Return what the tracker saw of one trial, the trunk being still.

    The shoulder's centre is the acromion's marker less what lies between them at rest.
    """
    trial, session = made.trial, made.session
    n = len(session.time_s)
    record = optical_record(trial.settings(), trial.side, n / trial.rate_hz).resampled(round(trial.rate_hz))
    markers = {name: places[:n] for name, places in record.markers.items()}
    upper_wand = _unit(markers["upper_arm_wand"] - markers["lateral_epicondyle"])
    fore_wand = _unit(markers["forearm_wand"] - markers["wrist"])
    elbow = markers["lateral_epicondyle"] - EPICONDYLE_M * upper_wand
    wrist = markers["wrist"] - WRIST_M * fore_wand
    still = slice(0, round(trial.rate_hz))
    acromion = markers["acromion"]
    shoulder = acromion - (acromion[still] - made.truth.world_positions["shoulder"][still]).mean(axis=0)
    outward = 1.0 if trial.side == "right" else -1.0
    upper = _frame(shoulder - elbow, outward * upper_wand)
    fore = _frame(elbow - wrist, outward * fore_wand)
    unknown = np.full((n, 4), np.nan)
    angles = joint_angles(unknown, rotation.multiply(rotation.inverse(upper), fore), unknown, trial.side)
    return Tracked(
        {"shoulder": shoulder, "elbow": elbow, "wrist": wrist},
        {name: np.unwrap(angles[:, INDEX[name]]) for name in ("elbow_flexion", "forearm_pronation")},
    )


def _frame(along: Floats, across: Floats) -> Floats:
    """Return world_from_segment (n, 4) whose Y lies along one direction and whose Z is near another."""
    y = _unit(along)
    z = _unit(across - y * (across * y).sum(axis=1, keepdims=True))
    return rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=-1))


def _unit(v: Floats) -> Floats:
    unit: Floats = v / np.sqrt((v * v).sum(axis=1, keepdims=True))
    return unit
