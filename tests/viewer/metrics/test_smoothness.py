"""SPARC and LDLJ against values that are published or follow on paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from brachium_viewer.metrics.smoothness import at_ldlj_rate, ldlj, sparc


def reach(seconds: float, rate_hz: float) -> np.ndarray:
    """Return the speed of one minimum-jerk reach."""
    u = np.arange(0.0, seconds, 1.0 / rate_hz) / seconds
    return 30 * u**2 * (1 - u) ** 2 / seconds


def test_the_reference_codes_own_example() -> None:
    speed = np.exp(-5 * np.arange(-1, 1, 0.01) ** 2)
    assert sparc(speed, 100.0) == pytest.approx(-1.41403, abs=1e-4)
    assert ldlj(speed, 100.0) == pytest.approx(-5.81636, abs=1e-4)


@pytest.mark.parametrize(("seconds", "rate_hz"), [(1.0, 50.0), (1.0, 100.0), (1.0, 200.0), (2.0, 100.0)])
def test_one_reach_is_alike_at_every_rate_and_length(seconds: float, rate_hz: float) -> None:
    assert sparc(reach(seconds, rate_hz), rate_hz) == pytest.approx(-1.4058, abs=1e-3)
    assert sparc(reach(seconds, rate_hz), rate_hz, 20.0) == pytest.approx(-1.4058, abs=1e-3)


def test_two_joined_reaches() -> None:
    speed = np.concatenate([reach(1.0, 100.0)] * 2)
    assert sparc(speed, 100.0) == pytest.approx(-2.2445, abs=1e-3)


@pytest.mark.parametrize(("rate_hz", "value"), [(50.0, -5.131), (100.0, -5.224), (200.0, -5.273)])
def test_jerk_depends_on_the_rate_and_tends_to_the_value_on_paper(rate_hz: float, value: float) -> None:
    assert ldlj(reach(1.0, rate_hz), rate_hz) == pytest.approx(value, abs=1e-3)
    assert ldlj(reach(1.0, 20000.0), 20000.0) == pytest.approx(-np.log(204.8), abs=1e-3)


def test_resampled_speeds_compare() -> None:
    slow, fast = (at_ldlj_rate(reach(2.0, r), r) for r in (60.0, 240.0))
    assert ldlj(slow, 100.0) == pytest.approx(ldlj(fast, 100.0), abs=0.06)


@given(st.lists(st.floats(-100.0, 100.0), min_size=4, max_size=60), st.sampled_from([50.0, 60.0, 240.0]))
def test_resampling_is_scipys_spline(speed: list[float], rate_hz: float) -> None:
    found = at_ldlj_rate(np.array(speed), rate_hz)
    times = np.arange(len(speed)) / rate_hz
    judge = make_interp_spline(times, speed, k=3)(np.minimum(np.arange(len(found)) / 100.0, times[-1]))
    assert found == pytest.approx(judge, abs=1e-8)
    assert len(found) == int(times[-1] * 100.0 + 1e-6) + 1


@given(factor=st.floats(1e-3, 1e3), seconds=st.floats(0.5, 4.0))
def test_size_and_pace_change_nothing(factor: float, seconds: float) -> None:
    plain, other = reach(1.0, 100.0), factor * reach(seconds, 100.0 / seconds)
    assert sparc(other, 100.0 / seconds, 10.0 / seconds) == pytest.approx(sparc(plain, 100.0), abs=1e-3)
    assert ldlj(factor * plain, 100.0) == pytest.approx(ldlj(plain, 100.0), abs=1e-6)


@pytest.mark.parametrize("stops", [1, 2, 3])
def test_more_stops_are_less_smooth(stops: int) -> None:
    fewer, more = (np.concatenate([reach(1.0, 100.0)] * n) for n in (stops, stops + 1))
    assert sparc(more, 100.0) < sparc(fewer, 100.0)
    assert ldlj(more, 100.0) < ldlj(fewer, 100.0)


def test_rest_has_no_smoothness() -> None:
    assert np.isnan(sparc(np.zeros(100), 100.0))
    assert np.isnan(ldlj(np.zeros(100), 100.0))
