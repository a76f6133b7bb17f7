"""The emulated way to the gateway: every fault is counted as it is injected, nothing else is changed."""

from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_nodes.link import (
    WIFI,
    Departure,
    EmulatedClock,
    FaultSettings,
    departures,
    lost_samples,
)
from brachium_wire.sequence import SequenceCounter

SAMPLES = 5
PERIOD_S = 0.05


def run(faults: FaultSettings, count: int, seed: int = 0) -> list[Departure]:
    return list(islice(departures(0.04, PERIOD_S, SAMPLES, faults, seed, "hand_r"), count))


def whole(arrived: list[Departure]) -> list[Departure]:
    """Leave out the end until nothing is held back for a swap."""
    while True:
        top = max(d.number for d in arrived)
        if arrived[-1].injected.sent + arrived[-1].injected.lost == SAMPLES * (top + 1):
            return arrived
        arrived = arrived[:-1]


probability = st.floats(0.0, 0.2)


@given(
    loss=probability,
    burst=st.floats(0.0, 0.02),
    swap=probability,
    duplicate=probability,
    seed=st.integers(0, 99),
)
@settings(max_examples=60, deadline=None)
def test_a_receiver_counts_what_was_injected(
    loss: float, burst: float, swap: float, duplicate: float, seed: int
) -> None:
    faults = FaultSettings(loss=loss, burst_loss=burst, swap=swap, duplicate=duplicate)
    arrived = whole(run(faults, 400, seed))
    counter = SequenceCounter()
    for departure in arrived:
        counter.feed(SAMPLES * departure.number, SAMPLES)
    injected = arrived[-1].injected
    assert (counter.received, counter.lost) == (injected.sent, injected.lost)
    assert (counter.out_of_order, counter.repeated) == (injected.swapped, injected.duplicated)
    numbers = [d.number for d in arrived]  # the same once more by hand
    assert injected.sent == SAMPLES * len(set(numbers))
    assert injected.lost == SAMPLES * (max(numbers) + 1 - len(set(numbers)))
    assert injected.duplicated == SAMPLES * (len(numbers) - len(set(numbers)))


@pytest.mark.parametrize(
    ("fault", "name"), [("loss", "lost"), ("swap", "swapped"), ("duplicate", "duplicated")]
)
def test_a_fault_comes_as_often_as_asked_and_brings_no_other(fault: str, name: str) -> None:
    injected = whole(run(FaultSettings(**{fault: 0.1}), 4000))[-1].injected  # type: ignore[arg-type]
    assert getattr(injected, name) / (injected.sent + injected.lost) == pytest.approx(0.1, rel=0.2)
    others = {"lost", "swapped", "duplicated"} - {name}
    assert all(getattr(injected, other) == 0 for other in others)


def test_bursts_take_whole_runs_of_packets() -> None:
    arrived = run(FaultSettings(burst_loss=0.005, burst_packets=12), 3000)
    gaps = np.diff([d.number for d in arrived]) - 1
    assert set(gaps[gaps > 0]) <= {12, 24}
    assert (gaps == 12).sum() > 5


def test_without_faults_everything_comes_once_in_order_and_at_once() -> None:
    arrived = run(FaultSettings(), 600)
    assert [d.number for d in arrived] == list(range(600))
    assert [d.time_s for d in arrived] == pytest.approx(0.04 + PERIOD_S * np.arange(600), abs=1e-12)
    assert arrived[-1].injected.sent == 600 * SAMPLES


@pytest.mark.parametrize("wifi", ["good", "busy"])
def test_wifi_delays_and_holds_back_but_keeps_the_order(wifi: str) -> None:
    arrived = run(FaultSettings(wifi=wifi), 12_000)  # type: ignore[arg-type]
    times = np.array([d.time_s for d in arrived])
    delay = times - (0.04 + PERIOD_S * np.arange(len(times)))
    model = WIFI[wifi]  # type: ignore[index]
    assert (np.diff(times) >= 0.0).all()
    assert delay.min() >= model.base_s
    # The median of a gamma distribution of shape 1.5 lies at 1.18 of its scale.
    assert np.median(delay) == pytest.approx(model.base_s + 1.18 * model.jitter_scale_s, rel=0.05)
    assert model.burst_s < delay.max() < model.burst_longest_s + 0.1
    bursts = ((delay[1:] > model.burst_s) & (delay[:-1] <= model.burst_s)).sum()
    assert bursts == pytest.approx(model.burst_rate_hz * 600.0, rel=0.35)


def test_the_first_packet_always_comes_first() -> None:
    for seed in range(50):
        assert run(FaultSettings(loss=0.45, swap=0.45), 1, seed)[0].number == 0


def test_the_same_seed_gives_the_same_way() -> None:
    faults = FaultSettings(wifi="busy", loss=0.1, swap=0.1)
    assert run(faults, 500, 3) == run(faults, 500, 3)
    assert run(faults, 500, 3) != run(faults, 500, 4)


def test_clocks_run_at_rates_of_their_own_and_tick_evenly() -> None:
    clocks = [EmulatedClock.draw(100.0, 30.0, seed, "hand_r") for seed in range(200)]
    assert np.std([c.skew for c in clocks]) == pytest.approx(30e-6, rel=0.15)
    assert len({c.start_s for c in clocks}) == 200
    index = np.arange(0, 400_000, 4000)
    for clock in clocks[:20]:
        t = clock.sample_time_s(index)
        assert 0.0 <= t[0] < 0.01
        assert np.abs(np.diff(clock.ticks_us(t)) - 40_000_000).max() <= 1
        assert t[-1] - t[0] == pytest.approx(3960.0 / (1.0 + clock.skew), abs=1e-6)


@pytest.mark.parametrize(
    "wrong",
    [
        {"loss": 1.5},
        {"swap": -0.1},
        {"loss": 0.5, "duplicate": 0.5},
        {"burst_packets": 0},
        {"wifi": "perfect"},
    ],
)
def test_impossible_faults_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"give|choose"):
        FaultSettings(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("batch", [1, 5])
def test_lost_samples_are_those_that_the_stream_loses(batch: int) -> None:
    faults = FaultSettings(loss=0.1, burst_loss=0.02, burst_packets=5, swap=0.03, duplicate=0.02)
    count = 997
    lost = lost_samples(count, batch, faults, 4, "hand_r")
    arrived = set()
    for departure in departures(0.0, 1.0, batch, faults, 4, "hand_r"):
        if departure.number > count:
            break
        arrived |= set(range(departure.number * batch, (departure.number + 1) * batch))
    assert lost.shape == (count,)
    assert set(np.flatnonzero(~lost)) == arrived & set(range(count))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
def test_bursts_lose_their_share_in_runs(share: float) -> None:
    begins = share / (5 - 4 * share)  # of the packets outside a burst, of which each takes five
    lost = lost_samples(200_000, 1, FaultSettings(burst_loss=begins, burst_packets=5), 1, "hand_r")
    assert lost.mean() == pytest.approx(share, rel=0.1)
    if share:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
        runs = edges[1::2] - edges[::2]
        assert set(runs[:-1] % 5) == {0}


def test_single_losses_have_the_share_that_is_asked_for() -> None:
    assert lost_samples(100_000, 1, FaultSettings(loss=0.2), 2, "hand_r").mean() == pytest.approx(
        0.2, rel=0.05
    )
    assert not lost_samples(1000, 3, FaultSettings(), 2, "hand_r").any()
