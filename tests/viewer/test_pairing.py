"""Rows beside rows: what two tables share, and the lag between them."""

from typing import Any

import numpy as np
import pytest

from brachium_viewer.pairing import Pair
from brachium_wire.table import Table, TableError

TIME = np.arange(600) / 50.0
SIGNAL = np.cumsum(np.random.default_rng(4).normal(size=600)) * 0.2


def table(time: Any, values: Any) -> Table:
    return Table({"time": time, "elbow_flexion": values}, {"elbow_flexion": "deg"})


@pytest.mark.parametrize("samples", [-23, -6, -1, 0, 3, 11, 24])
def test_a_lag_up_to_half_a_second_is_found(samples: int) -> None:
    pair = Pair(table(TIME + samples / 50.0, SIGNAL), table(TIME, SIGNAL), ("a", "b"))
    counts = np.ones(600, dtype=np.bool_)
    assert pair.best_lag_s(counts, None) == pytest.approx(samples / 50.0)
    assert pair.at(samples / 50.0, counts).columns()["elbow_flexion"].rmse < 1e-9


def test_a_limit_in_samples_is_kept() -> None:
    pair = Pair(table(TIME + 0.2, SIGNAL), table(TIME, SIGNAL), ("a", "b"))
    assert abs(pair.best_lag_s(np.ones(600, dtype=np.bool_), 2)) <= 0.04 + 1e-12


def test_a_whole_turn_is_no_error() -> None:
    pair = Pair(table(TIME, SIGNAL + 360.0), table(TIME, SIGNAL), ("a", "b"))
    a, b = pair.at(0.0, np.ones(600, dtype=np.bool_)).numbers["elbow_flexion"]
    np.testing.assert_allclose(a, b, atol=1e-9)


def test_nothing_in_common_is_refused() -> None:
    with pytest.raises(TableError, match="no column in common"):
        Pair(table(TIME, SIGNAL), Table({"t": TIME, "x": SIGNAL}, {}), ("a", "b"))
