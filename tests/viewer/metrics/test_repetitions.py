"""Repetitions of known movements."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.metrics.repetitions import FLOOR_DEG, movement_set, repetitions


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


def reach(time: np.ndarray, at_s: float, seconds: float, way: float) -> np.ndarray:
    u = np.clip((time - at_s) / seconds, 0.0, 1.0)
    return way * u**3 * (10 - 15 * u + 6 * u * u)


def test_a_try_that_gives_up_is_no_repetition() -> None:
    time = np.arange(0.0, 40.0, 0.02)
    angle = np.zeros_like(time)
    for k, way in enumerate((80.0, 75.0, 28.0, 82.0, 20.0, 70.0)):
        angle += reach(time, 6 * k + 0.5, 1.2, way) - reach(time, 6 * k + 3.0, 1.2, way)
    found = movement_set(time, angle, FLOOR_DEG)
    assert [round(r.peak_s) // 6 for r in found.repetitions] == [0, 1, 3, 5]
    assert [round(r.peak_s) // 6 for r in found.tries] == [2, 4]


def test_a_stop_on_the_way_is_the_same_repetition() -> None:
    time = np.arange(0.0, 12.0, 0.02)
    angle = reach(time, 1.0, 1.0, 30.0) + reach(time, 4.0, 1.0, 30.0) - reach(time, 7.0, 1.5, 60.0)
    assert len(repetitions(time, angle, FLOOR_DEG)) == 1


def test_the_way_into_the_first_posture_adds_nothing_to_a_repetition() -> None:
    time = np.arange(0.0, 26.0, 0.02)
    angle = reach(time, 1.0, 2.0, 35.0) - reach(time, 22.0, 2.0, 35.0)
    for k in range(3):
        angle += reach(time, 5 * k + 6.0, 1.2, 10.0) - reach(time, 5 * k + 8.0, 1.2, 10.0)
    found = repetitions(time, angle, FLOOR_DEG)
    assert len(found) == 3
    bases = [np.interp(one.base_s, time, angle) for one in found]
    assert bases == pytest.approx([35.0, 35.0, 35.0], abs=0.6)
    assert found[0].from_s > 5.0
    assert found[-1].to_s < 22.5


def test_a_small_movement_under_the_floor_is_none() -> None:
    time = np.arange(0.0, 20.0, 0.02)
    sway = 1.5 * np.sin(2 * np.pi * 0.3 * time)
    assert movement_set(time, sway, FLOOR_DEG) == movement_set(time, np.zeros_like(time), FLOOR_DEG)


def test_a_repetition_counts_as_soon_as_the_arm_is_half_the_way_back() -> None:
    time = np.arange(0.0, 16.0, 0.02)
    angle = np.zeros_like(time)
    for k in range(3):
        angle += reach(time, 5 * k + 1.0, 1.5, 80.0) - reach(time, 5 * k + 3.0, 1.5, 80.0)
    counts = [len(repetitions(time[:n], angle[:n], FLOOR_DEG)) for n in range(50, len(time), 10)]
    assert counts == sorted(counts)
    at = {k: time[50 + 10 * counts.index(k)] for k in (1, 2, 3)}
    assert all(5 * (k - 1) + 3.3 < instant < 5 * (k - 1) + 4.6 for k, instant in at.items())


@given(shift=st.floats(-50, 50), factor=st.floats(0.5, 3.0), later=st.floats(0, 1e4))
def test_where_the_zero_is_and_the_unit_change_nothing(shift: float, factor: float, later: float) -> None:
    time = np.arange(0.0, 20.0, 0.02)
    angle = 30.0 * (1.0 - np.cos(2 * np.pi * time / 4.0))
    plain, other = repetitions(time, angle), repetitions(time + later, shift + factor * angle)
    assert [r.peak_s + later for r in plain] == pytest.approx([r.peak_s for r in other], abs=0.05)


def curl(time: np.ndarray, at_s: float, way: float, dip: float) -> np.ndarray:
    """Return a movement of this way and back whose top sinks once and comes back."""
    parts = ((0.0, 1.0, way), (1.5, 1.0, -dip), (2.7, 1.0, dip), (4.5, 1.2, -way))
    return sum(
        (reach(time, at_s + later, seconds, size) for later, seconds, size in parts), np.zeros_like(time)
    )


@pytest.mark.parametrize("dip_deg", [5.0, 8.0, 15.0, 30.0, 45.0])
@pytest.mark.parametrize("count", [1, 2, 8])
def test_a_top_that_sinks_and_comes_back_is_one_repetition(dip_deg: float, count: int) -> None:
    time = np.arange(0.0, 6.0 + 7.0 * count, 0.02)
    angle = np.full_like(time, 10.0)
    for k in range(count):
        angle += curl(time, 2.0 + 7.0 * k, 100.0, dip_deg)
    found = movement_set(time, angle, FLOOR_DEG)
    assert len(found.repetitions) == count
    assert found.tries == ()
    for one in found.repetitions:
        assert one.to_s - one.from_s == pytest.approx(5.1, abs=0.4)


def test_a_top_that_swings_back_is_one_repetition() -> None:
    time = np.arange(0.0, 60.0, 0.02)
    angle = np.full_like(time, 10.0)
    for k in range(8):
        since = time - 2.8 - 7.0 * k
        angle += reach(time, 2.0 + 7.0 * k, 0.8, 100.0) - reach(time, 6.5 + 7.0 * k, 1.2, 100.0)
        angle += np.where((since > 0) & (since < 3.7), 12.0 * np.exp(-since) * np.sin(5.65 * since), 0.0)
    assert len(repetitions(time, angle, FLOOR_DEG)) == 8


@pytest.mark.parametrize("rests", [0, 1, 2])
def test_small_repetitions_of_an_arm_that_is_lifted_first_are_counted_each(rests: int) -> None:
    """The arm hangs, is lifted by 45 deg, goes 15 deg further three times, hangs again."""
    time = np.arange(0.0, 30.0 * (rests + 1), 0.02)
    angle = np.zeros_like(time)
    for block in range(rests + 1):
        begin = 30.0 * block
        angle += reach(time, begin + 1.0, 2.0, 45.0) - reach(time, begin + 26.0, 2.0, 45.0)
        for k in range(3):
            angle += reach(time, begin + 5.0 + 7 * k, 1.5, 15.0) - reach(time, begin + 8.0 + 7 * k, 1.5, 15.0)
    assert len(repetitions(time, angle, FLOOR_DEG)) == 3 * (rests + 1)
