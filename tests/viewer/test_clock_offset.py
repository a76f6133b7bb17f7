"""By how much one sensor is late against another: known shifts of known turns."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_viewer.clock_offset import Rates, Unrelated, clock_offset, wahba


def turning(t, seed=0):
    """Angular rates (n, 3) of an exercise: repetitions that differ, about axes that wander."""
    random = np.random.default_rng(seed)
    waves = 2 * np.pi * random.uniform(0.2, 1.4, 8), random.uniform(0, 6, 8), random.normal(0, 0.5, (8, 3))
    return np.sin(t[:, None] * waves[0] + waves[1]) @ waves[2]


def pair(offset_s, seed=0, seconds=30.0, noise=0.02, skew=0.0):
    random = np.random.default_rng(seed)
    a_time = np.arange(0.0, seconds, 1 / 100)
    b_time = np.arange(0.07, seconds, 1 / 51.2)
    turn = Rotation.random(random_state=seed).as_matrix()
    a = turning(a_time, seed) + random.normal(0, noise, (len(a_time), 3))
    b = turning(b_time, seed) @ turn + random.normal(0, noise, (len(b_time), 3)) + [0.01, -0.02, 0.0]
    return Rates(a_time, a), Rates(b_time * (1 + skew) + offset_s, b), turn


@settings(max_examples=30)
@given(offset_s=st.floats(-0.45, 0.45), seed=st.integers(0, 1000))
def test_a_shift_is_found_whatever_way_the_sensors_are_turned(offset_s, seed):
    a, b, _ = pair(offset_s, seed)
    found = clock_offset(a, b)
    assert abs(found.offset_s - offset_s) < 2e-3
    assert found.correlation > 0.95


def test_its_interval_holds_the_shift_as_often_as_it_says():
    inside = straight = 0
    for seed in range(40):
        a, b, _ = pair(0.04, seed)
        found = clock_offset(a, b)
        assert 0.0 < found.margin_s < 5e-3
        inside += abs(found.offset_s - 0.04) <= found.margin_s
        straight += abs(found.drift_ppm) <= found.drift_margin_ppm
    assert min(inside, straight) >= 34  # 38 of 40 are expected


def test_a_clock_that_runs_away_is_told():
    a, b, _ = pair(0.0, 3, seconds=120.0, noise=0.002, skew=60e-6)
    found = clock_offset(a, b)
    assert found.drift_ppm == pytest.approx(60.0, abs=10.0)
    assert 0.0 < found.drift_margin_ppm < 20.0


def test_samples_that_are_missing_are_not_made_up():
    a, b, _ = pair(0.12, 5)
    gone = (b.time_s > 8.0) & (b.time_s < 16.0)
    found = clock_offset(a, Rates(b.time_s[~gone], b.gyr[~gone]))
    assert abs(found.offset_s - 0.12) < 3e-3
    assert found.seconds < 22.5


def once(rates):
    """Return the same with one movement in the middle."""
    return Rates(rates.time_s, 20.0 * rates.gyr * np.exp(-(((rates.time_s - 15.0) / 0.4) ** 2))[:, None])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda a, b: (a, Rates(b.time_s + 100.0, b.gyr)), "0.0 s; 5 are needed"),
        (lambda a, b: (Rates(a.time_s[:1], a.gyr[:1]), b), "not measured anything yet"),
        (lambda a, b: (Rates(a.time_s, 0.01 * a.gyr), b), "hardly moves"),
        (lambda a, b: (a, Rates(b.time_s, turning(b.time_s, 99))), "fixed to the same segment"),
        (lambda a, b: (once(a), once(b)), "for a moment only"),
    ],
)
def test_what_cannot_be_compared_is_refused_with_what_to_do(change, said):
    a, b, _ = pair(0.0, 1)
    with pytest.raises(Unrelated, match=said):
        clock_offset(*change(a, b))


@given(st.integers(0, 10_000))
def test_the_turn_between_vectors_is_what_scipy_finds(seed):
    random = np.random.default_rng(seed)
    a, b = random.normal(size=(2, 9, 3))
    theirs, _ = Rotation.align_vectors(a, b)
    assert wahba(a, b) == pytest.approx(theirs.as_matrix(), abs=1e-6)
