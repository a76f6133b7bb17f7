"""The clock of a node against a simulated Wi-Fi: errors, stated uncertainty, and order."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from brachium_nodes.clock import MAX_SLOPE, NodeClock
from brachium_nodes.clock_line import Below, between
from brachium_nodes.clock_trial import Trial, delays, trial
from brachium_nodes.link import WIFI
from brachium_wire.hosttime import HostClock

HOST_S = 1_700_000_000.0


def ns(seconds: float) -> int:
    return round((HOST_S + seconds) * 1e9)


def at(made: Trial, second: float) -> float:
    """The error of the first batch after this second, ms."""
    return abs(int(made.error_ns[np.searchsorted(made.taken_s, second)])) * 1e-6


def test_a_minute_of_busy_wifi_leaves_a_tenth_of_a_millisecond() -> None:
    errors = [at(trial(seed, 61.0), 60.0) for seed in range(30)]
    print(f"busy Wi-Fi, 60 s: median {np.median(errors):.3f} ms, p95 {np.percentile(errors, 95):.3f} ms")
    assert np.median(errors) <= 0.1
    assert np.percentile(errors, 95) <= 0.5


def test_five_seconds_are_better_than_one_and_a_minute_than_five_seconds() -> None:
    made = [trial(seed, 61.0, skew_ppm=-50.0) for seed in range(20)]
    one, five, sixty = (np.median([at(m, t) for m in made]) for t in (1.0, 5.0, 60.0))
    assert sixty < five < one <= 2.0


@pytest.mark.parametrize("skew_ppm", [-150.0, -50.0, 0.0, 50.0, 150.0])
def test_the_stated_uncertainty_covers_the_error(skew_ppm: float) -> None:
    within, count = 0, 0
    for seed in range(8):
        made = trial(100 + seed, 70.0, skew_ppm=skew_ppm)
        within += int(np.sum(np.abs(made.error_ns) <= made.stated_ns + 1000))  # device clocks count whole us
        count += len(made.error_ns)
    assert within / count >= 0.995
    assert count > 8 * 1000


def test_what_is_stated_is_no_more_than_the_radio_s_own_doubt() -> None:
    made = trial(1, 61.0)
    assert np.median(made.stated_ns[made.taken_s > 10.0]) < 2_000_000


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(-190, 190), st.floats(0.1e-3, 20e-3), st.floats(0.0, 5.0))
def test_published_times_strictly_increase(seed: int, skew: float, jitter: float, bursts: float) -> None:
    delay = replace(WIFI["busy"], jitter_scale_s=jitter, burst_rate_hz=bursts)
    made = trial(seed, 15.0, skew_ppm=skew, delay=delay)
    assert len(made.published_ns) > 50
    assert (np.diff(made.published_ns) > 0).all()


def test_the_simulated_radio_is_as_slow_as_it_says() -> None:
    sent = np.arange(0.0, 600.0, 0.05)
    late = delays(np.random.default_rng(1), sent, WIFI["busy"])
    assert 0.001 <= late.min() < 0.0012
    assert 0.5 < late.max() <= 0.85
    assert np.mean(late > 0.04) > 0.01


def test_a_better_estimate_never_steps_published_time_back() -> None:
    clock = NodeClock()
    clock.arrival(1_000_000, ns(1.300))  # 300 ms on the way: one-way cannot know
    before = clock.host_ns(np.array([1_000_000, 1_010_000]))
    clock.publish(1_010_000)
    assert clock.exchange(ns(1.9), 1_901_000, 1_901_100, ns(1.903))
    after = clock.host_ns(np.array([1_020_000, 1_030_000, 1_040_000]))
    clock.publish(1_040_000)
    assert (np.diff(np.concatenate([before, after])) > 0).all()
    later = clock.host_ns(np.array([30_000_000]))
    assert abs(int(later[0]) - ns(30.0)) < 3_000_000


def test_out_of_order_samples_stay_before_the_newest() -> None:
    clock = NodeClock()
    clock.exchange(ns(1.0), 1_001_000, 1_001_100, ns(1.002))
    newest = clock.host_ns(np.array([1_100_000]))[0]
    assert clock.host_ns(np.array([1_050_000]))[0] < newest


@pytest.mark.parametrize(
    ("asked", "came_us", "left_us", "answered"),
    [(1.0, 2_000, 1_000, 1.1), (1.0, 1_000, 500_000, 1.1), (1.1, 1_000, 2_000, 1.0)],
)
def test_impossible_exchanges_are_not_taken(
    asked: float, came_us: int, left_us: int, answered: float
) -> None:
    clock = NodeClock()
    assert not clock.exchange(ns(asked), came_us, left_us, ns(answered))
    assert not clock.known


def talk(clock: NodeClock, first_s: float, last_s: float, skew: float = 0.0) -> None:
    """Four questions a second, half a millisecond each way."""
    for k in range(round((last_s - first_s) * 4)):
        t = first_s + k / 4
        came = round(1e6 * (1 + skew) * (t + 0.0005))
        clock.exchange(ns(t), came, came + 100, ns(t + 0.0011))


def test_uncertainty_grows_when_nobody_answers() -> None:
    clock = NodeClock()
    talk(clock, 0.0, 10.0)
    then = clock.uncertainty_ns(10_000_000)
    for k in range(200):
        clock.arrival(10_000_000 + 1_000_000 * k, ns(10.005 + k))
    assert clock.uncertainty_ns(200_000_000) > then + 2_000_000


def test_memory_is_bounded_by_the_window() -> None:
    clock, random = NodeClock(), np.random.default_rng(1)
    for k in range(20 * 300):
        clock.arrival(50_000 * k, ns(0.05 * k + float(random.gamma(1.5, 2e-3))))
        if k % 5 == 0:
            clock.exchange(ns(0.05 * k), 50_000 * k + 1000, 50_000 * k + 1000, ns(0.05 * k + 0.002))
    assert clock._ups.size + clock._downs.size < 1000
    assert clock._ups.span <= 71_000_000


def test_a_node_whose_samples_come_in_any_order_is_timed() -> None:
    clock, random = NodeClock(), np.random.default_rng(2)
    talk(clock, 0.0, 5.0)
    for us in random.integers(5_000_000, 20_000_000, 200).tolist():
        clock.arrival(us, ns(20.1))
    assert abs(clock.host_times([20_000_000])[0] - ns(20.0)) < 2_000_000


points = st.lists(st.tuples(st.integers(0, 60_000_000), st.integers(0, 20_000_000)), min_size=1, max_size=60)


@given(points)
def test_the_kept_points_are_the_lower_edge_of_all(made: list[tuple[int, int]]) -> None:
    made = sorted(made)
    below = Below(0.2)
    for x, y in made:
        below.add(x, y)
    x, y = np.array(made).T
    for slope in (-0.2, -0.05, 0.0, 0.013, 0.2):
        kept = np.array(below.edge())
        assert (kept[:, 1] - slope * kept[:, 0]).min() == pytest.approx((y - slope * x).min(), abs=1e-3)


def test_the_middle_line_is_the_linear_programme_s() -> None:
    rng = np.random.default_rng(5)
    for skew in (-0.15, 0.0, 0.08, 0.3):  # ns per us
        x_up, x_down = (np.sort(rng.integers(0, 60_000_000, n)) for n in (300, 200))
        up = np.rint(skew * x_up + 1e6 + rng.gamma(1.5, 2e6, 300))
        down = np.rint(skew * x_down - 1e6 - rng.gamma(1.5, 2e6, 200))
        above, minus_below = Below(MAX_SLOPE), Below(MAX_SLOPE)
        for x, y in zip(x_up.tolist(), up.tolist(), strict=True):
            above.add(x, round(y))
        for x, y in zip(x_down.tolist(), down.tolist(), strict=True):
            minus_below.add(x, round(-y))
        intercept, slope, gap = between(above, minus_below, MAX_SLOPE)
        # The same as a linear programme, in s and ns: a1 under the ups, a2 over the downs.
        one, zero = np.ones, np.zeros
        judged = linprog(
            [-1.0, 1.0, -(x_up.mean() - x_down.mean()) * 1e-6],
            A_ub=np.r_[np.c_[one(300), zero(300), x_up * 1e-6], np.c_[zero(200), -one(200), -x_down * 1e-6]],
            b_ub=np.r_[up, -down],
            bounds=[(None, None), (None, None), (-MAX_SLOPE * 1e6, MAX_SLOPE * 1e6)],
            method="highs",
        )
        a1, a2, b = judged.x
        assert slope == pytest.approx(b * 1e-6, abs=1e-5)
        assert intercept == pytest.approx((a1 + a2) / 2, abs=500)
        assert gap == pytest.approx(a1 - a2, abs=1000)


def test_a_jump_of_the_wall_clock_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = HostClock()
    before = clock.now_ns()
    monkeypatch.setattr("time.time_ns", lambda: 0)
    after = clock.now_ns()
    assert 0 <= after - before < 1_000_000_000
