"""Two arms against each other, and how the joints of one move together. Pure."""

from dataclasses import dataclass

import numpy as np

from brachium_body.angles import CLINICAL
from brachium_viewer.metrics.arm_motion import ArmMotion, Floats
from brachium_viewer.metrics.kinematics import coverage
from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, withheld


def symmetry(affected: Measure, other: Measure) -> Measure:
    """Return one arm's measure over the other's, per cent: 100 is alike."""
    if affected.value is None or other.value is None:
        return withheld(_one_unknown(affected, other), "%")
    if abs(other.value) < 1e-9:
        return withheld("the other side did not move", "%")
    return measure(100.0 * affected.value / other.value, "%", min(affected.coverage, other.coverage))


def difference(one: Measure, other: Measure) -> Measure:
    """Return how far one arm's measure is above the other's, in its unit.

    Of a logarithm as LDLJ this is what can be told: its part of a mean would say nothing of how much.
    """
    if one.value is None or other.value is None:
        return withheld(_one_unknown(one, other), one.unit)
    return measure(one.value - other.value, one.unit, min(one.coverage, other.coverage))


def _one_unknown(one: Measure, other: Measure) -> str:
    return f"one side is not known: {one.withheld or other.withheld}"


@dataclass(frozen=True, kw_only=True)
class Components:
    """Principal components of the clinical joint angles, largest first."""

    names: tuple[str, ...]
    """The angles that were measured, k."""
    explained: Floats
    """(k,) part of the variance, summing to 1."""
    directions: Floats
    """(k, k): row i is component i, unit length, over `names`; its largest entry is positive."""


def components(motion: ArmMotion) -> Components | None:
    """Return the principal components, or None when fewer than two angles were measured or nothing moved."""
    columns = {name: motion.known(name) for name in CLINICAL}
    names = tuple(n for n, v in columns.items() if coverage(motion.time_s, np.isfinite(v)) >= ENOUGH)
    if len(names) < 2:
        return None
    table = np.stack([columns[name] for name in names], axis=1)
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < 2 * len(names):
        return None
    table = table - table.mean(axis=0)
    squares, vectors = np.linalg.eigh(table.T @ table)
    spread, directions = np.maximum(squares[::-1], 0.0), vectors.T[::-1]
    if spread[0] < 1e-18:
        return None
    largest = directions[np.arange(len(names)), np.abs(directions).argmax(axis=1)]
    return Components(
        names=names,
        explained=spread / np.sum(spread),
        directions=directions * np.sign(largest)[:, None],
    )
