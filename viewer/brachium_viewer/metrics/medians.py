"""Of many repetitions: medians, the best, the last beside the first; with the share they rest on. Pure."""

from collections.abc import Mapping, Sequence

import numpy as np

from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, withheld
from brachium_viewer.metrics.repetition_measures import NAMES, RepetitionMeasures

FEW = 5
"""First against last so many repetitions."""


def values(found: Sequence[RepetitionMeasures], name: str) -> list[float]:
    """Return the values of one measure, of the repetitions that have it."""
    return [m.value for one in found if (m := one.measures[name]).value is not None]


def medians(found: Sequence[RepetitionMeasures], none: Mapping[str, str]) -> dict[str, Measure]:
    """Return the median of each measure by NAMES; its coverage is the share of repetitions that have it.

    With less than ENOUGH it is withheld: the others may have been others. `none`: by NAMES, why a set without
    repetitions has none.
    """
    return {name: _of(found, name, none, float(np.median(values(found, name) or [np.nan]))) for name in NAMES}


def best(found: Sequence[RepetitionMeasures], none: Mapping[str, str], *, rises: bool) -> Measure:
    """Return the farthest that the angle went in a repetition, with a median's coverage."""
    known = values(found, "peak") or [np.nan]
    return _of(found, "peak", none, max(known) if rises else min(known))


def first_to_last(found: Sequence[RepetitionMeasures]) -> dict[str, Measure]:
    """Return by NAMES the median of the last FEW repetitions minus that of the first FEW.

    Coverage is the share of these that have it; withheld when either has less than ENOUGH.
    """
    return {name: _change(found, name) for name in NAMES}


def _of(found: Sequence[RepetitionMeasures], name: str, none: Mapping[str, str], value: float) -> Measure:
    if not found:
        return withheld(none[name], NAMES[name])
    missing = [m.withheld for one in found if (m := one.measures[name]).value is None]
    share = 1.0 - len(missing) / len(found)
    if share >= ENOUGH:
        return measure(value, NAMES[name], share)
    why = max(missing, key=missing.count)
    if len(missing) < len(found):
        why = f"known in {len(found) - len(missing)} of {len(found)} repetitions; in others: {why}"
    return withheld(why, NAMES[name], share)


def _change(found: Sequence[RepetitionMeasures], name: str) -> Measure:
    unit = NAMES[name]
    if len(found) < 2 * FEW:
        return withheld(f"fewer than {2 * FEW} repetitions", unit)
    first, last = values(found[:FEW], name), values(found[-FEW:], name)
    share = (len(first) + len(last)) / (2 * FEW)
    if min(len(first), len(last)) < ENOUGH * FEW:
        return withheld(f"known in {len(first)} of the first {FEW} and {len(last)} of the last", unit, share)
    return measure(float(np.median(last) - np.median(first)), unit, share)
