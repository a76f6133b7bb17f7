import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_fusion.zhou_cycles import cycle_reset, find_cycles, fit_lambda

RATE = 25.0


def there_and_back(period: int, count: int, rest: int = 30) -> np.ndarray:
    """Return rates (n, 3): half a sine out and half a sine back, then stillness, again and again."""
    moving = np.sin(2.0 * np.pi * np.arange(period - rest) / (period - rest))
    one = np.concatenate([moving, np.zeros(rest)])
    noise = np.random.default_rng(0).normal(0.0, 0.01, (count * period, 3))
    return np.tile(one, count)[:, None] * [1.0, 0.3, 0.0] + noise


@pytest.mark.parametrize("period", [60, 100, 180])
def test_repetitions_are_found_at_their_rests(period: int):
    cycles = find_cycles(there_and_back(period, 8), RATE)
    assert len(cycles) >= 7
    assert np.all(np.abs(np.diff(cycles) - period) <= 30)
    within = np.array(cycles) % period
    assert np.all((within >= period - 34) | (within <= 4))


def test_stillness_has_no_repetitions():
    assert find_cycles(np.random.default_rng(1).normal(0.0, 0.01, (500, 3)), RATE) == []
    assert find_cycles(np.zeros((500, 3)), RATE) == []
    assert find_cycles(np.zeros((20, 3)), RATE) == []


CUBIC = st.lists(st.floats(-2.0, 2.0), min_size=12, max_size=12)


@given(CUBIC)
def test_reset_takes_off_any_cubic_between_a_repetitions_ends(numbers: list[float]):
    u = np.linspace(0.0, 1.0, 2001)
    bump = (u * u * (1 - u) ** 2)[:, None] * [0.0, 1.0, 2.0]  # at rest and in place at both ends
    drift = np.vander(u, 4) @ np.array(numbers).reshape(4, 3)
    # The ends' velocities are taken from neighbouring rows: a cubic is lost up to their curvature.
    np.testing.assert_allclose(cycle_reset(bump + drift, [0, 2000]), bump, atol=5e-3)


def test_without_repetitions_only_the_start_is_taken_off():
    shift = np.random.default_rng(1).normal(size=(50, 3))
    np.testing.assert_allclose(cycle_reset(shift, []), shift - shift[0])


def test_lambda_is_what_made_the_signals():
    random = np.random.default_rng(2)
    true = np.array([-0.3, -0.8, -1.2])
    cycles = list(range(0, 2001, 100))
    u = np.linspace(-1.0, 1.0, 100)
    s_b = np.concatenate([np.vander(u, 6) @ random.normal(size=(6, 3)) for _ in range(20)])
    t = np.arange(2000)[:, None] / RATE
    fit = fit_lambda(true * s_b + 0.02 * t, s_b, cycles, RATE)
    np.testing.assert_allclose(fit.weight, true, atol=1e-9)
    np.testing.assert_allclose(fit.explained, 1.0)
    assert fit.repetitions == 20


def test_lambda_of_unrelated_signals_explains_nothing():
    random = np.random.default_rng(2)
    s_a, s_b = random.normal(size=(2, 2000, 3)).cumsum(axis=1)
    assert np.all(fit_lambda(s_a, s_b, list(range(0, 2001, 100)), RATE).explained < 0.1)


def test_one_repetition_is_too_few_for_lambda():
    with pytest.raises(ValueError, match="about 20; there are 1"):
        fit_lambda(np.zeros((100, 3)), np.zeros((100, 3)), [0, 99], RATE)


def test_the_last_repetition_may_end_with_the_recording():
    shift = np.random.default_rng(1).normal(size=(50, 3)).cumsum(axis=0)
    np.testing.assert_allclose(cycle_reset(shift, [10, 30, 50]), cycle_reset(shift, [10, 30, 49]))
