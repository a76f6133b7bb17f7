"""How much of a movement was measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.metrics.kinematics import HOLD_S, coverage

T = np.arange(0.0, 4.0, 0.02)


@given(lost=st.lists(st.integers(1, 38), max_size=12, unique=True))
def test_packets_lost_one_by_one_leave_no_hole(lost: list[int]) -> None:
    known = np.ones(len(T), dtype=bool)
    for packet in lost[::2]:
        known[5 * packet : 5 * packet + 3] = False
    assert coverage(T, known) == 1.0


@pytest.mark.parametrize("rows", [10, 25, 100])
def test_a_gap_longer_than_what_counts_as_held_is_a_gap(rows: int) -> None:
    known = np.ones(len(T), dtype=bool)
    known[40 : 40 + rows] = False
    assert (rows + 1) * 0.02 > HOLD_S
    assert coverage(T, known) == pytest.approx(1.0 - rows / len(T))


def test_what_lies_before_the_first_and_after_the_last_is_not_measured() -> None:
    known = np.zeros(len(T), dtype=bool)
    known[2:-3] = True
    assert coverage(T, known) == pytest.approx(1.0 - 5 / len(T))
    assert coverage(T, np.zeros(len(T), dtype=bool)) == 0.0
    assert coverage(T[:0], known[:0]) == 0.0
