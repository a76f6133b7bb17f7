"""What is said of many repetitions says how many of them it knows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.metrics.measure import ENOUGH, Measure, measure, withheld
from brachium_viewer.metrics.medians import FEW, best, first_to_last, medians, values
from brachium_viewer.metrics.repetition_measures import NAMES, RepetitionMeasures

NONE = dict.fromkeys(NAMES, "nobody moved")
MISSING = "the sensor was not there"


def repetition(i: int, value: float | None) -> RepetitionMeasures:
    one = withheld(MISSING, "m") if value is None else measure(value, "m")
    known: dict[str, Measure] = {name: measure(1.0, unit) for name, unit in NAMES.items()}
    return RepetitionMeasures(
        from_s=i, to_s=i + 0.9, peak_s=i + 0.5, measures=known | {"hand_path": one, "peak": one}
    )


def of(found: list[float | None]) -> tuple[RepetitionMeasures, ...]:
    return tuple(repetition(i, value) for i, value in enumerate(found))


@given(st.lists(st.one_of(st.none(), st.floats(0.1, 2.0)), min_size=1, max_size=30))
def test_a_median_has_the_share_of_repetitions_that_it_is_of(found: list[float | None]) -> None:
    known = [value for value in found if value is not None]
    share = len(known) / len(found)
    middle = medians(of(found), NONE)["hand_path"]
    assert middle.coverage == pytest.approx(share)
    if share >= ENOUGH:
        assert middle.value == pytest.approx(np.median(known))
        assert best(of(found), NONE, rises=True).value == max(known)
        assert best(of(found), NONE, rises=False).value == min(known)
    else:
        assert middle.value is None
        assert MISSING in middle.withheld
        assert (f"known in {len(known)} of {len(found)} repetitions" in middle.withheld) == bool(known)
        assert best(of(found), NONE, rises=True).value is None
    assert medians(of(found), NONE)["range"].coverage == 1.0
    assert values(of(found), "hand_path") == known


def test_without_repetitions_each_has_its_own_reason() -> None:
    found = medians((), NONE | {"trunk_lean": "no sternum"})
    assert {name: one.withheld for name, one in found.items()} == NONE | {"trunk_lean": "no sternum"}
    assert best((), NONE, rises=True).withheld == "nobody moved"


@pytest.mark.parametrize(("first", "last"), [(5, 5), (4, 5), (5, 4), (3, 5), (5, 3), (0, 0)])
def test_the_last_beside_the_first_needs_enough_of_both(first: int, last: int) -> None:
    found = [1.0] * first + [None] * (FEW - first) + [None] * (FEW - last) + [3.0] * last
    change = first_to_last(of(found))["hand_path"]
    assert change.coverage == pytest.approx((first + last) / (2 * FEW))
    if min(first, last) >= ENOUGH * FEW:
        assert change.value == pytest.approx(2.0)
    else:
        assert change.value is None
        assert change.withheld == f"known in {first} of the first {FEW} and {last} of the last"
