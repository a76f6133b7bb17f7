"""The clock of a node against a simulated Wi-Fi: errors, stated uncertainty, and order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from brachium_nodes.clock import MAX_SLOPE, NodeClock, between
from brachium_wire.hosttime import HostClock

OFFSET_S = 123.456
HOST_S = 1_700_000_000.0


def wifi(rng: np.random.Generator, n: int, every_s: float, jitter_s: float, bursts: float) -> np.ndarray:
    """One-way delays, s: 1 ms, gamma jitter, and bursts of 50 to 800 ms in which frames queue."""
    delay = 1e-3 + rng.gamma(1.5, jitter_s, n)
    held = np.zeros(n)
    i = 0
    while i < n:
        if rng.random() < bursts * every_s / 0.02:
            length = min(rng.pareto(2.0) * 0.05 + 0.05, 0.8)
            k = int(length / every_s) + 1
            ahead = np.arange(i, min(i + k, n))
            held[ahead] = np.maximum(held[ahead], length - (ahead - i) * every_s)
            i += k
        i += 1
    return delay + held


def events(seed: int, seconds: float, skew_ppm: float, jitter_s: float = 2e-3, bursts: float = 0.01) -> list:
    """What a gateway sees of one node, by arrival: 20 batches and 4 exchanges a second."""
    rng = np.random.default_rng(seed)
    skew = skew_ppm * 1e-6

    def device_us(t: np.ndarray) -> np.ndarray:
        return np.floor(1e6 * (OFFSET_S + t * (1 + skew))).astype(np.int64)

    taken = np.arange(0.0, seconds, 0.05) + rng.uniform(0, 0.05)
    arrived = np.maximum.accumulate(taken + wifi(rng, len(taken), 0.05, jitter_s, bursts))
    asked = np.arange(0.0, seconds, 0.25) + rng.uniform(0, 0.25)
    down = wifi(rng, len(asked), 0.25, jitter_s, bursts)
    up = wifi(rng, len(asked), 0.25, jitter_s, bursts)
    thinking = rng.gamma(2, 0.3e-3, len(asked))
    out: list[tuple[float, tuple]] = [
        (a, ("batch", int(d), t)) for a, d, t in zip(arrived, device_us(taken), taken, strict=True)
    ]
    for t0, d, w, u in zip(asked, down, thinking, up, strict=True):
        t1, t2 = device_us(np.array([t0 + d, t0 + d + w]))
        out.append((t0 + d + w + u, ("exchange", t0, int(t1), int(t2))))
    return sorted(out)


def ns(seconds: float) -> int:
    return round((HOST_S + seconds) * 1e9)


def play(
    clock: NodeClock, happenings: list, from_s: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feed all; return published time, error and stated uncertainty, ns, of each batch from `from_s` on."""
    published, errors, stated = [], [], []
    newest_us = -1
    for arrived, what in happenings:
        if what[0] == "exchange":
            clock.exchange(ns(what[1]), what[2], what[3], ns(arrived))
            continue
        _, device_us, taken = what
        if clock.known and device_us > newest_us:
            newest_us = device_us
            host = int(clock.host_ns(np.array([device_us]))[0])
            clock.publish(device_us)
            if taken >= from_s:
                published.append(host)
                errors.append(host - ns(taken))
                stated.append(clock.uncertainty_ns(device_us))
        clock.arrival(device_us, ns(arrived))
    return np.array(published), np.array(errors), np.array(stated)


def test_a_minute_of_busy_wifi_leaves_a_tenth_of_a_millisecond() -> None:
    worst = []
    for seed in range(30):
        _, errors, _ = play(NodeClock(), events(seed, 62.0, skew_ppm=50.0), from_s=60.0)
        worst.append(float(np.abs(errors).max()) * 1e-6)
    print(f"busy Wi-Fi, 60 s: median {np.median(worst):.3f} ms, p95 {np.percentile(worst, 95):.3f} ms")
    assert np.median(worst) <= 0.1
    assert np.percentile(worst, 95) <= 0.5


def test_the_first_seconds_are_within_a_few_milliseconds() -> None:
    errors = [np.abs(play(NodeClock(), events(s, 6.0, -50.0), from_s=1.0)[1]).max() * 1e-6 for s in range(20)]
    assert np.median(errors) <= 2.0


@pytest.mark.parametrize("skew_ppm", [-150.0, -50.0, 0.0, 50.0, 150.0])
def test_the_stated_uncertainty_covers_the_error(skew_ppm: float) -> None:
    within, count = 0, 0
    for seed in range(8):
        _, errors, stated = play(NodeClock(), events(100 + seed, 70.0, skew_ppm))
        within += int(np.sum(np.abs(errors) <= stated + 1000))  # device clocks count whole us
        count += len(errors)
    assert within / count >= 0.995
    assert count > 8 * 1000


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(-190, 190), st.floats(0.1e-3, 20e-3), st.floats(0.0, 0.1))
def test_published_times_strictly_increase(seed: int, skew: float, jitter: float, bursts: float) -> None:
    published, _, _ = play(NodeClock(), events(seed, 15.0, skew, jitter, bursts))
    assert len(published) > 50
    assert (np.diff(published) > 0).all()


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


def test_uncertainty_grows_when_nobody_answers() -> None:
    clock = NodeClock()
    happenings = events(3, 10.0, 20.0)
    play(clock, happenings)
    then = clock.uncertainty_ns(round((OFFSET_S + 10.0) * 1e6))
    for k in range(200):
        t = 10.0 + k
        clock.arrival(round((OFFSET_S + t) * 1e6), ns(t + 0.005))
    assert clock.uncertainty_ns(round((OFFSET_S + 200.0) * 1e6)) > then + 2_000_000


def test_memory_is_bounded_by_the_window() -> None:
    clock = NodeClock()
    play(clock, events(1, 300.0, 10.0))
    assert len(clock._ups) < 62 * 25
    assert len(clock._downs) < 62 * 5


def test_the_middle_line_is_the_linear_programme_s() -> None:
    rng = np.random.default_rng(5)
    for skew in (-0.15, 0.0, 0.08):  # ns per us
        x_up, x_down = np.sort(rng.uniform(0, 60e6, 300)), np.sort(rng.uniform(0, 60e6, 200))
        up = skew * x_up + 1e6 + rng.gamma(1.5, 2e6, 300)
        down = skew * x_down - 1e6 - rng.gamma(1.5, 2e6, 200)
        intercept, slope, gap = between(np.column_stack([x_up, up]), np.column_stack([x_down, down]))
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
