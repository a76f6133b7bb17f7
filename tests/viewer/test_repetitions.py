"""Repetitions of known movements."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.repetitions import repetitions


@given(count=st.integers(2, 12), period=st.floats(1.5, 6.0), seed=st.integers(0, 1000))
def test_every_repetition_is_found_once(count: int, period: float, seed: int) -> None:
    time = np.arange(0.0, count * period, 0.02)
    angle = 8.0 + 40.0 * (1.0 - np.cos(2 * np.pi * time / period))
    angle += np.random.default_rng(seed).normal(scale=0.5, size=len(time))
    found = repetitions(time, angle)
    assert len(found) == count
    middles = [0.5 * (r.from_s + r.to_s) for r in found]
    expected = (np.arange(count) + 0.5) * period
    assert np.abs(np.array(middles) - expected).max() < 0.1 * period


def test_rests_between_are_left_out() -> None:
    time = np.arange(0.0, 30.0, 0.02)
    phase = (time % 10.0) - 4.0
    angle = np.where((phase > 0) & (phase < 2), 50.0 * np.sin(np.pi * phase / 2) ** 2, 0.0)
    found = repetitions(time, angle)
    assert len(found) == 3
    for k, one in enumerate(found):
        assert one.from_s == pytest.approx(10 * k + 4.2, abs=0.2)
        assert one.to_s == pytest.approx(10 * k + 5.8, abs=0.2)


def test_tremor_is_no_repetition() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    angle = 40.0 * (1.0 - np.cos(2 * np.pi * time / 5.0)) + 1.5 * np.sin(2 * np.pi * 5.0 * time)
    assert len(repetitions(time, angle)) == 4


def test_stillness_and_nothing_have_none() -> None:
    time = np.arange(0.0, 5.0, 0.1)
    assert repetitions(time, np.full(50, 3.0)) == []
    assert repetitions(time, np.full(50, np.nan)) == []


def test_what_is_not_known_is_left_out() -> None:
    time = np.arange(0.0, 20.0, 0.02)
    angle = 40.0 * (1.0 - np.cos(2 * np.pi * time / 5.0))
    angle[100:110] = np.nan
    assert len(repetitions(time, angle)) == 4
