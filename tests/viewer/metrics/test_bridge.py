"""Short gaps are bridged by cubics; long ones stay."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.metrics.bridge import rounded
from brachium_viewer.metrics.even_grid import BRIDGED_S

RATE_HZ = 50.0


@given(
    st.lists(st.floats(-50.0, 50.0), min_size=4, max_size=4),
    st.sets(st.integers(5, 45), max_size=20),
)
def test_what_is_a_cubic_stays_one(factors: list[float], lost: set[int]) -> None:
    t = np.arange(50) / RATE_HZ
    values = np.polynomial.polynomial.polyval(t, factors)
    kept = np.array([i not in lost for i in range(50)])
    times, found = rounded(t, np.where(kept, values, np.nan), RATE_HZ)
    assert times == pytest.approx(t)
    assert found == pytest.approx(values, abs=1e-6)


def test_a_long_gap_stays_and_so_does_one_at_an_end() -> None:
    t = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
    long = (t > 2.0) & (t < 2.0 + BRIDGED_S + 0.05)
    at_begin = (t > 0.01) & (t < 0.09)
    times, found = rounded(t, np.where(long | at_begin, np.nan, t), RATE_HZ)
    assert times == pytest.approx(t[~(long | at_begin)])
    assert found == pytest.approx(times)
