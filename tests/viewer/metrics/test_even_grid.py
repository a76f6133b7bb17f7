"""The even grid keeps what is known, and gaps stay gaps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, sosfiltfilt

from brachium_viewer.metrics.even_grid import BRIDGED_S, even, smooth, stretches
from brachium_viewer.metrics.kinematics import HOLD_S, RATE_HZ, held_mean


def test_a_short_gap_is_bridged_and_a_long_one_stays() -> None:
    time = np.arange(0.0, 10.0, 0.02)
    values = 3.0 * time
    values[(time > 2.0) & (time < 2.3)] = np.nan
    values[(time > 5.0) & (time < 6.0)] = np.nan
    grid, found = even(time, values, 50.0)
    assert np.isfinite(found[grid < 5.0]).all()
    assert np.isnan(found[(grid > 5.05) & (grid < 5.95)]).all()
    known = np.isfinite(found)
    assert np.allclose(found[known], 3.0 * grid[known])


def test_a_gap_of_a_year_takes_no_room_and_changes_nothing_beside_it() -> None:
    part = np.arange(0.0, 10.0, 0.02)
    starts = (0.0, 700.0, 3.15e7)
    time = np.concatenate([part + at for at in starts])
    grid, found = even(time, np.sin(time), 50.0)
    assert len(grid) <= len(time) + 2 * len(starts)
    assert (np.diff(grid) > 0.0).all()
    assert [end - first for first, end in stretches(np.isfinite(found))] == [500, 500, 500]
    for at in starts:
        here = (grid > at - 0.01) & (grid < at + 9.99)
        alone, values = even(part + at, np.sin(part + at), 50.0)
        np.testing.assert_allclose(grid[here], alone, atol=1e-6)
        np.testing.assert_allclose(found[here], values, atol=1e-6)


@given(seed=st.integers(0, 100), columns=st.integers(1, 3))
def test_rows_of_several_columns_are_as_each_by_itself(seed: int, columns: int) -> None:
    random = np.random.default_rng(seed)
    time = np.sort(random.uniform(0.0, 5.0, 100))
    values = random.normal(size=(100, columns))
    together = even(time, values, 25.0)[1]
    for i in range(columns):
        assert np.array_equal(even(time, values[:, i], 25.0)[1], together[:, i], equal_nan=True)


def test_smoothing_has_no_delay_and_does_not_cross_gaps() -> None:
    time = np.arange(0.0, 10.0, 0.02)
    values = np.sin(2 * np.pi * 0.5 * time)
    noisy = values + 0.2 * np.sin(2 * np.pi * 12.0 * time)
    inner = slice(50, -50)
    assert np.abs(smooth(noisy, 50.0, 4.0) - values)[inner].max() < 0.01
    cut = noisy.copy()
    cut[200:260] = np.nan
    out = smooth(cut, 50.0, 4.0)
    assert np.isnan(out[200:260]).all()
    assert np.isfinite(np.delete(out, np.s_[200:260])).all()


@given(
    seed=st.integers(0, 100),
    n=st.integers(1, 200),
    columns=st.integers(1, 3),
    rate_hz=st.sampled_from([25.0, 50.0, 100.0]),
    cutoff_hz=st.sampled_from([0.5, 1.0, 4.0, 6.0, 12.0]),
)
def test_smoothing_is_scipys(seed: int, n: int, columns: int, rate_hz: float, cutoff_hz: float) -> None:
    values = np.random.default_rng(seed).normal(40.0, 30.0, size=(n, columns))
    sections = butter(2, cutoff_hz, fs=rate_hz, output="sos")
    judge = sosfiltfilt(sections, values, axis=0, padlen=min(n - 1, round(rate_hz / cutoff_hz)))
    assert np.allclose(smooth(values, rate_hz, cutoff_hz), judge, rtol=0.0, atol=1e-9)
    assert np.array_equal(smooth(values[:, 0], rate_hz, cutoff_hz), smooth(values, rate_hz, cutoff_hz)[:, 0])


@given(seed=st.integers(0, 100), n=st.integers(0, 60))
def test_the_held_mean_is_scipys(seed: int, n: int) -> None:
    values = np.random.default_rng(seed).normal(40.0, 30.0, size=n)
    _, found = held_mean(np.arange(n) / RATE_HZ, values)
    width = round(HOLD_S * RATE_HZ)
    if n < width:
        assert np.isnan(found).all()
    else:
        assert np.allclose(found, uniform_filter1d(values, width, mode="nearest"), rtol=0.0, atol=1e-9)


def test_nothing_known_is_an_empty_grid() -> None:
    assert len(even(np.arange(3.0), np.full(3, np.nan), 10.0)[0]) == 0
    assert even(np.empty(0), np.empty((0, 3)), 10.0)[1].shape == (0, 3)


@given(st.lists(st.booleans(), max_size=40))
def test_stretches_are_the_runs(known: list[bool]) -> None:
    rebuilt = np.zeros(len(known), dtype=bool)
    for first, end in stretches(known):
        assert first < end
        rebuilt[first:end] = True
    assert rebuilt.tolist() == known
    assert BRIDGED_S > 0
