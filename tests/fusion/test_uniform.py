"""Several sensors on one grid: what lies between samples, what is bridged, and what stays a gap."""

import numpy as np
import pytest

from brachium_fusion.uniform import Series, grid, on_grid

LINE = np.array([1.0, -2.0, 0.5])


def series(t, rate=100.0, **more) -> Series:
    t = np.asarray(t, dtype=np.float64)
    return Series(time_s=t, rate_hz=rate, gyr=t[:, None] * LINE, acc=t[:, None] * LINE + 1.0, **more)


def test_sensors_of_other_rates_and_starts_share_the_fastest_ones_grid() -> None:
    fast, slow = series(5.0 + np.arange(300) / 100.0), series(4.0 + np.arange(60) / 20.0, rate=20.0)
    times, rate = grid({"forearm_r": fast, "hand_r": slow})
    assert rate == 100.0
    assert times == pytest.approx(4.0 + np.arange(400) / 100.0)
    first, second = on_grid(fast, times), on_grid(slow, times)
    assert np.array_equal(first.missing, times < 5.0 - 1e-6)
    assert np.array_equal(second.missing, times > slow.time_s[-1] + 1e-6)
    for one in (first, second):
        there = ~one.missing
        assert one.gyr[there] == pytest.approx(times[there, None] * LINE)
        assert one.acc[there] == pytest.approx(times[there, None] * LINE + 1.0)
        assert np.isnan(one.gyr[one.missing]).all()
        assert not one.held.any()
    assert first.sample[99:103].tolist() == [-1, 0, 1, 2]


def test_a_gap_of_90_ms_is_held_and_one_of_200_ms_stays_a_gap() -> None:
    t = np.arange(300) / 100.0
    keep = np.ones(300, dtype=bool)
    keep[50:58] = keep[100:119] = False
    mag = np.where((np.arange(300) % 4 == 0)[:, None], t[:, None] * LINE, np.nan)
    one = on_grid(series(t[keep], mag=mag[keep]), t)
    assert np.flatnonzero(one.held).tolist() == list(range(50, 58))
    assert np.flatnonzero(one.missing).tolist() == list(range(100, 119))
    assert one.gyr[~one.missing] == pytest.approx(t[~one.missing, None] * LINE)
    assert one.mag is not None
    measured = np.isfinite(one.mag[:, 0])
    assert one.mag[measured] == pytest.approx(np.minimum(t, 2.96)[measured, None] * LINE)
    assert not measured[100:119].any()
    assert measured.sum() > 200


def test_orientations_turn_evenly_between_samples() -> None:
    t = np.arange(40) / 20.0
    quat = np.stack([np.cos(t / 2), np.zeros(40), np.zeros(40), np.sin(t / 2)], axis=1)
    instants = np.arange(190) / 100.0
    one = on_grid(Series(time_s=t, rate_hz=20.0, quat=quat), instants)
    assert one.quat is not None
    assert 2.0 * np.arctan2(one.quat[:, 3], one.quat[:, 0]) == pytest.approx(instants)
    assert np.isnan(one.gyr).all()


def test_a_lost_sample_of_a_tremor_lies_near_the_curve_of_its_neighbours() -> None:
    t = np.arange(100) / 50.0
    keep = np.ones(100, dtype=bool)
    keep[10:90:7] = False
    values = np.sin(2.0 * np.pi * 5.0 * t)[:, None] * LINE
    one = on_grid(Series(time_s=t[keep], rate_hz=50.0, gyr=values[keep], acc=values[keep]), t)
    assert one.held.sum() == (~keep).sum()
    for found in (one.gyr, one.acc):
        assert np.abs(found - values)[keep].max() < 1e-12
        assert np.abs(found - values)[~keep].max() < 0.03 * np.abs(LINE).max()
