"""What is called a change: counted on pairs whose differences are known, and one emulated donning."""

import pytest

from brachium.evaluation import donning_tables
from brachium_viewer.metrics.change import STATED_SDC_DEG


def _pair(apart_deg: float) -> donning_tables.Pair:
    return {"range": 80.0, "best_peak": 90.0}, {"range": 80.0 + apart_deg, "best_peak": 90.0}


def test_a_pair_is_changed_beyond_what_was_stated_or_learnt() -> None:
    learnt = [_pair(x) for x in (1.0, -1.0, 1.0, -1.0, 1.0)]
    found = donning_tables.shown([_pair(0.5), _pair(9.0), _pair(STATED_SDC_DEG + 0.1)], learnt)
    assert (found.pairs, found.stated) == (3, 1)
    assert found.learnt == 2  # sd 1 at its upper limit from five pairs: 1.96 * 2.09, below 9
    assert 1.96 < found.smallest_deg < 9.0


def test_what_is_withheld_is_no_change() -> None:
    pair: donning_tables.Pair = ({"best_peak": 90.0}, {"best_peak": 91.0})
    assert donning_tables.shown([pair], [pair] * 5).stated == 0
    assert donning_tables.apart([pair]) == [1.0]
    assert donning_tables.both([pair], "range") == []


def test_the_same_movement_by_sensors_of_another_seed() -> None:
    one, two = (donning_tables.measures_of("elbow-flexion", "ideal", 1, seed) for seed in (1, 2))
    assert one["range"] == pytest.approx(two["range"], abs=3.0)
    assert one != two
