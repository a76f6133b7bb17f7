"""Samples out of CAN frames: whatever a bus does to them, frames of two samples never meet."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.can.grouping import TIMEOUT_NS, Grouper, Key, Sample, Unwrapper

PERIOD_NS = 10_000_000
KEY = Key(step=1.0, modulus=256.0, period_ns=PERIOD_NS)
TIME = Key(step=100.0, modulus=2.0**32, period_ns=PERIOD_NS)
MEMBERS = ("acc", "gyr", "mag")


def keyed(key: Key = KEY) -> Grouper:
    return Grouper(key, frozenset({"acc", "gyr"}), frozenset({"mag"}), keyed=True)


def headed(key: Key = TIME) -> Grouper:
    return Grouper(key, frozenset({"acc", "gyr"}), frozenset({"mag"}), keyed=False)


def mixed(samples: list[Sample]) -> int:
    """Each member's value is the number of its sample: how many samples hold more than one."""
    return sum(len({values[0] for values in sample.members.values()}) != 1 for sample in samples)


@st.composite
def disturbed(draw: st.DrawFn) -> list[tuple[int, int, str]]:
    """Frames of 24 samples as (arrival, sample, member): lost, doubled, and late by up to 300 ms."""
    frames = []
    for number in range(24):
        for place, name in enumerate(MEMBERS):
            for _ in range(draw(st.sampled_from((1, 1, 1, 1, 0, 2)))):
                late = draw(st.sampled_from((0, 0, 0, 3_000_000, 12_000_000, 70_000_000, 300_000_000)))
                frames.append((number * PERIOD_NS + place * 100_000 + late, number, name))
    return sorted(frames)


def play(
    frames: list[tuple[int, int, str]], feed: Callable[[int, int, str], list[Sample]], tick
) -> list[Sample]:
    samples: list[Sample] = []
    for arrival, number, name in frames:
        samples += tick(arrival)
        samples += feed(arrival, number, name)
    return samples + tick(frames[-1][0] + 2 * TIMEOUT_NS)


@given(disturbed(), st.integers(0, 255))
def test_frames_with_a_counter_never_mix(frames: list[tuple[int, int, str]], start: int):
    grouper = keyed()
    samples = play(
        frames,
        lambda t, n, name: grouper.member(name, (float(n),), t, float((start + n) % 256)),
        grouper.tick,
    )
    assert mixed(samples) == 0
    ticks = [sample.ticks for sample in samples]
    assert ticks == sorted(set(ticks))
    # What had both its members on time is there.
    on_time = {n for t, n, name in frames if t - n * PERIOD_NS < 1_000_000 for _ in [0]}
    whole = {
        n
        for n in on_time
        if {"acc", "gyr"} <= {m for t, k, m in frames if k == n and t - n * PERIOD_NS < 1_000_000}
    }
    assert whole <= {int(next(iter(sample.members.values()))[0]) for sample in samples}


@given(st.lists(st.sampled_from((0, 1, 1, 1, 1, 1, 2)), min_size=96, max_size=96), st.booleans())
def test_frames_behind_their_time_never_mix(times_each: list[int], wraps: bool):
    grouper, start = headed(), 2**32 - 2000 if wraps else 0
    samples: list[Sample] = []
    copies = iter(times_each)
    for number in range(24):
        now = number * PERIOD_NS
        for place, name in enumerate(("key", *MEMBERS)):
            for _ in range(next(copies)):
                at = now + place * 100_000
                samples += grouper.tick(at)
                if name == "key":
                    samples += grouper.key(float((start + 100 * number) % 2**32), at)
                else:
                    samples += grouper.member(name, (float(number),), at)
    assert mixed(samples) == 0
    given_ticks = [round((sample.ticks - start) / 100) for sample in samples]
    assert given_ticks == [int(sample.members["acc"][0]) for sample in samples]


def test_a_sample_whose_member_is_lost_is_given_up_after_a_while_and_holds_the_others_no_longer():
    grouper = keyed()
    assert grouper.member("acc", (0.0,), 0, 0.0) == []
    out: list[Sample] = []
    for number in (1, 2):
        for name in MEMBERS:
            out += grouper.member(name, (1.0,), number * PERIOD_NS, float(number))
    assert out == []
    assert [s.ticks for s in grouper.tick(TIMEOUT_NS + 1)] == [1.0, 2.0]
    assert grouper.drops == {"incomplete": 1}
    assert grouper.member("gyr", (0.0,), TIMEOUT_NS + 2, 0.0) == []
    assert grouper.drops["late_member"] == 1


def test_a_missing_optional_member_is_not_waited_for_beyond_the_next_sample():
    grouper = keyed()
    for name in ("acc", "gyr"):
        assert grouper.member(name, (0.0,), 0, 0.0) == []
    (sample,) = grouper.member("acc", (1.0,), PERIOD_NS, 1.0)
    assert sample.members == {"acc": (0.0,), "gyr": (0.0,)}


def test_the_same_frame_twice_is_one_and_two_that_differ_are_none():
    grouper = keyed()
    grouper.member("acc", (0.0,), 0, 0.0)
    grouper.member("acc", (0.0,), 1, 0.0)
    grouper.member("gyr", (0.0,), 2, 0.0)
    assert len(grouper.member("mag", (0.0,), 3, 0.0)) == 1
    grouper.member("acc", (1.0,), PERIOD_NS, 1.0)
    grouper.member("acc", (9.0,), PERIOD_NS, 1.0)
    grouper.member("gyr", (1.0,), PERIOD_NS, 1.0)
    assert grouper.member("mag", (1.0,), PERIOD_NS, 1.0) == []
    assert grouper.drops == {"repeated_member": 1, "conflicting_member": 1, "incomplete": 1}


@pytest.mark.parametrize("outage_s", [0.3, 3.0, 40.0])
def test_a_counter_is_continued_over_its_wraps_and_over_outages(outage_s: float):
    unwrapper, numbers = (
        Unwrapper(KEY),
        [*range(300), *range(300 + round(100 * outage_s), 900 + round(100 * outage_s))],
    )
    found = [unwrapper.take(float(n % 256), n * PERIOD_NS) for n in numbers]
    assert found == numbers


def test_a_sensor_that_starts_anew_is_believed_at_its_second_word():
    grouper = headed()
    for number in range(1000, 1003):
        grouper.key(100.0 * number, number * PERIOD_NS)
    base = 1010 * PERIOD_NS
    assert grouper.key(100.0, base) == []
    assert grouper.drops["strange_key"] == 1
    grouper.key(200.0, base + PERIOD_NS)
    assert grouper.restarts == 1
    for name in MEMBERS:
        grouper.member(name, (2.0,), base + PERIOD_NS)
    assert [s.ticks for s in grouper.key(300.0, base + 2 * PERIOD_NS)] == [200.0]


def test_a_member_without_its_key_is_counted():
    grouper = headed()
    assert grouper.member("acc", (0.0,), 0) == []
    assert grouper.drops == {"no_key": 1}
