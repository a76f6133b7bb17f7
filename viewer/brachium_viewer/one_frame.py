"""Two measures in one frame: the turn and shift between their worlds, found and removed. Pure."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_wire.tuples import vector

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Pairs = dict[str, tuple[Floats, Floats]]
"""By name: of a and of b at the same instants."""
FrameName = Literal["none", "rigid", "heading"]
FRAMES: tuple[FrameName, ...] = ("none", "rigid", "heading")
DISPLACEMENTS = ("shoulder_shift",)
"""Differences of positions: a turn concerns them, a shift does not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Removed:
    """What was taken out of a so that it lies in b's frame, and what was the matter without it."""

    kind: FrameName
    turn_deg: float | None
    """Of the orientations' world; None without orientations."""
    positions_turn_deg: float | None
    positions_shift_m: tuple[float, float, float] | None
    """In b's axes, after the turn; None without positions."""


def position_stems(names: list[str]) -> list[str]:
    """Return what points are named by: `wrist` for `wrist_x`, `wrist_y`, `wrist_z`."""
    stems = [n.removesuffix("_x") for n in names if n.endswith("_x")]
    return [s for s in stems if f"{s}_y" in names and f"{s}_z" in names]


def turn_between(pairs: Pairs, counts: Mask, *, heading: bool) -> Floats | None:
    """Return b_world_from_a_world (4,), the mean over all orientations of the rows that count."""
    parts = [rotation.multiply(b, rotation.inverse(a))[counts] for a, b in pairs.values()]
    errors = np.concatenate(parts) if parts else np.empty((0, 4))
    errors = errors[np.isfinite(errors).all(axis=1)]
    if not len(errors):
        return None
    turn = rotation.mean(errors)
    return rotation.about(2, rotation.heading(turn)) if heading else turn


def placement(points: Pairs, counts: Mask, *, heading: bool) -> tuple[Floats, Floats] | None:
    """Return b_from_a (4,) and the shift (3,) m that bring a's points onto b's with least squares.

    Each point is (n, 3). Kabsch 1976, or about the vertical alone; None with fewer than three places.
    """
    places = {s: ab for s, ab in points.items() if s not in DISPLACEMENTS}
    a = np.concatenate([ab[0][counts] for ab in places.values()]) if places else np.empty((0, 3))
    b = np.concatenate([ab[1][counts] for ab in places.values()]) if places else np.empty((0, 3))
    known = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    a, b = a[known], b[known]
    if len(a) < 3:
        return None
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    spread = (a - middle_a).T @ (b - middle_b)
    if heading:
        angle = np.arctan2(spread[0, 1] - spread[1, 0], spread[0, 0] + spread[1, 1])
        turn = rotation.about(2, angle)
    else:
        u, _, vt = np.linalg.svd(spread)
        sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T)) or 1.0])
        turn = rotation.from_matrix(vt.T @ sign @ u.T)
    return turn, middle_b - rotation.rotate(turn, middle_a)


def in_one_frame(
    orientations: Pairs, numbers: Pairs, counts: Mask, kind: FrameName
) -> tuple[Pairs, Pairs, Removed | None]:
    """Return orientations and numbers with a's in b's frame, and what was removed."""
    if kind == "none":
        return orientations, numbers, None
    heading = kind == "heading"
    turn = turn_between(orientations, counts, heading=heading)
    if turn is not None:
        orientations = {s: (rotation.multiply(turn, a), b) for s, (a, b) in orientations.items()}
    stems = position_stems(list(numbers))
    points = {s: _point(numbers, s) for s in stems}
    found = placement(points, counts, heading=heading)
    if found is not None:
        numbers = dict(numbers)
        for stem, (a, _) in points.items():
            moved = rotation.rotate(found[0], a) + (0.0 if stem in DISPLACEMENTS else found[1])
            for k, axis in enumerate("xyz"):
                numbers[f"{stem}_{axis}"] = (moved[:, k], numbers[f"{stem}_{axis}"][1])
    return (
        orientations,
        numbers,
        Removed(
            kind=kind,
            turn_deg=None if turn is None else _degrees(turn),
            positions_turn_deg=None if found is None else _degrees(found[0]),
            positions_shift_m=None if found is None else vector(found[1]),
        ),
    )


def _point(numbers: Pairs, stem: str) -> tuple[Floats, Floats]:
    a, b = zip(*(numbers[f"{stem}_{axis}"] for axis in "xyz"), strict=True)
    return np.column_stack(a), np.column_stack(b)


def _degrees(turn: Floats) -> float:
    return float(np.degrees(rotation.angle_between(rotation.IDENTITY, turn)))
