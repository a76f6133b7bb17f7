"""Stillness is told from spread alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_fusion.still_stretches import still_stretches

RATE = 50.0


@given(still=st.floats(1.0, 5.0), seed=st.integers(0, 1000), bias=st.floats(-0.3, 0.3))
def test_a_rest_is_found_whatever_the_bias(still: float, seed: int, bias: float) -> None:
    random = np.random.default_rng(seed)
    n, moving = int(still * RATE), 100
    gyr = np.vstack([random.normal(size=(moving, 3)), np.zeros((n, 3)), random.normal(size=(moving, 3))])
    acc = np.vstack(
        [9.81 + random.normal(size=(moving, 3)), np.full((n, 3), 5.7), random.normal(size=(moving, 3))]
    )
    found = still_stretches(gyr + bias + 5e-4 * random.normal(size=gyr.shape), acc, RATE, 0.8)
    assert len(found) == 1
    assert found[0].start == pytest.approx(moving, abs=1)
    assert found[0].stop == pytest.approx(moving + n, abs=1)


def test_too_short_or_too_little_is_none() -> None:
    assert still_stretches(np.zeros((10, 3)), np.zeros((10, 3)), RATE, 0.1) == []
    assert still_stretches(np.zeros((40, 3)), np.zeros((40, 3)), RATE, 2.0) == []
    assert still_stretches(np.zeros((120, 3)), np.zeros((120, 3)), RATE, 2.0) == [slice(0, 120)]
