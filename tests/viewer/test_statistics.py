"""Error figures against an independent computation."""

import statistics as judge

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import interp1d

from brachium_viewer.statistics import error_figures, interpolate, percentiles, wrap_deg

ERRORS = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40)


@given(errors=ERRORS, holes=st.integers(0, 5))
def test_figures_are_those_of_the_known_errors(errors: list[float], holes: int) -> None:
    figures = error_figures([*errors, *[np.nan] * holes])
    assert figures is not None
    assert figures.n == len(errors)
    assert figures.bias == pytest.approx(judge.fmean(errors), abs=1e-9)
    if len(errors) > 1:
        assert figures.sd == pytest.approx(judge.stdev(errors), rel=1e-6, abs=1e-6)
    assert figures.max_abs == max(map(abs, errors))
    # the mean square is the square of the mean plus the variance about it
    variance = figures.sd**2 * (figures.n - 1) / figures.n
    assert figures.rmse**2 == pytest.approx(figures.bias**2 + variance, rel=1e-6, abs=1e-6)


def test_nothing_known_gives_nothing() -> None:
    assert error_figures([np.nan, np.nan]) is None
    assert error_figures([]) is None
    assert percentiles([]) == (None, None)


def test_percentiles_of_a_hundred_and_one() -> None:
    assert percentiles(range(101)) == (50.0, 99.0)


@given(angle=st.floats(-1e4, 1e4), turns=st.integers(-5, 5))
def test_whole_turns_are_no_error(angle: float, turns: int) -> None:
    wrapped = float(wrap_deg(angle + 360.0 * turns))
    assert -180.0 <= wrapped < 180.0
    assert np.cos(np.radians(wrapped)) == pytest.approx(np.cos(np.radians(angle)), abs=1e-6)
    assert np.sin(np.radians(wrapped)) == pytest.approx(np.sin(np.radians(angle)), abs=1e-6)


@given(seed=st.integers(0, 2**32 - 1))
def test_interpolation_agrees_with_scipy_and_never_bridges_a_gap(seed: int) -> None:
    random = np.random.default_rng(seed)
    at = np.cumsum(random.uniform(0.1, 2.0, 20))
    values = random.normal(size=(20, 3))
    time = random.uniform(at[0] - 1, at[-1] + 1, 50)
    got = interpolate(time, at, values, max_gap=1.0)
    expected = interp1d(at, values, axis=0, bounds_error=False)(time)
    known = ~np.isnan(got[:, 0])
    np.testing.assert_allclose(got[known], expected[known], atol=1e-12)
    right = np.searchsorted(at, time)
    inside = (right > 0) & (right < 20)
    short = np.zeros(50, dtype=bool)
    short[inside] = np.diff(at)[right[inside] - 1] <= 1.0
    np.testing.assert_array_equal(known, short)


def test_a_value_known_at_the_very_instant_is_taken_as_it_is() -> None:
    at, values = np.array([0.0, 10.0, 20.0]), np.array([[1.0], [2.0], [np.nan]])
    got = interpolate(np.array([0.0, 10.0, 20.0, 15.0]), at, values, max_gap=1.0)
    np.testing.assert_array_equal(got[:, 0], [1.0, 2.0, np.nan, np.nan])
    assert np.isnan(interpolate(np.array([1.0]), np.empty(0), np.empty((0, 1)), 1.0)).all()
