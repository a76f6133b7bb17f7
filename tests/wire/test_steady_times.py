"""Skeletons by a clock that was set are put on one clock, by when they were recorded."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_wire.codec import encode
from brachium_wire.messages import SegmentPose, Skeleton
from brachium_wire.skeleton_columns import SkeletonCollector
from brachium_wire.steady_times import JUMP_NS, SteadyTimes, steady_times

PERIOD_NS = 20_000_000
LATE_NS = 50_000_000
N = 1000
TRUE = 10**18 + PERIOD_NS * np.arange(N)
NOISE = np.random.default_rng(0).integers(0, 8_000_000, N)
ARRIVED = TRUE + LATE_NS + NOISE
S = 10**9


def found(time_ns: np.ndarray, arrived_ns: np.ndarray = ARRIVED) -> SteadyTimes:
    return steady_times([(time_ns, arrived_ns)])


def set_at(row: int, by_ns: int) -> np.ndarray:
    return np.where(np.arange(N) >= row, by_ns, 0)


@pytest.mark.parametrize("by_s", [-86400, -30, -5, -1, 1, 5, 86400, 86400 * 365])
def test_a_clock_that_was_set_is_put_right_and_told(by_s: int) -> None:
    steady = found(TRUE + set_at(400, by_s * S))
    assert np.abs(steady.time_ns[0] - TRUE).max() <= NOISE.max()
    assert steady.kept[0].sum() >= N - 1  # one may come before the last by the old clock
    assert [jump.by_s for jump in steady.jumps] == pytest.approx([by_s], abs=0.02)
    assert steady.jumps[0].after_s == pytest.approx(8.0, abs=0.1)
    assert f"jumped by {by_s:+.1f} s, 8.0 s into" in steady.told


@given(st.lists(st.tuples(st.integers(1, N - 1), st.integers(-100_000, 100_000)), max_size=5))
def test_however_often_it_was_set_times_grow_and_little_is_lost(
    jumps: list[tuple[int, int]],
) -> None:
    steady = found(TRUE + sum((set_at(row, by_s * S) for row, by_s in jumps), np.zeros(N, dtype=np.int64)))
    assert (np.diff(steady.time_ns[0][steady.kept[0]]) > 0).all()
    assert steady.left_out <= 2 * len(jumps)
    assert np.ptp(steady.time_ns[0] - TRUE) <= 4 * NOISE.max()


def test_both_arms_go_together_by_the_clock_that_is_the_recorders() -> None:
    time = TRUE + set_at(400, 0) - 30 * S + set_at(600, 30 * S)  # the first clock was the wrong one
    steady = steady_times([(time, ARRIVED), (time[300:], ARRIVED[300:] + 1_000)])
    assert len(steady.jumps) == 1
    assert (steady.time_ns[0][300:] == steady.time_ns[1]).all()
    assert np.abs(steady.time_ns[0] - TRUE).max() <= NOISE.max()


def test_what_is_in_order_stays_to_the_nanosecond() -> None:
    hole = np.where(np.arange(N) >= 500, 100 * S, 0)  # nothing came for 100 s
    for steady in (found(TRUE), found(TRUE + hole, ARRIVED + hole), found(TRUE, np.zeros(N, dtype=np.int64))):
        assert steady.kept[0].all()
        assert steady.told == ""
    assert (found(TRUE + hole, ARRIVED + hole).time_ns[0] == TRUE + hole).all()


def test_a_network_that_waited_and_lost_is_no_clock() -> None:
    lost = np.ones(N, dtype=np.bool_)
    lost[420:570] = False  # 3 s, of 5 s that came all at once
    arrived = ARRIVED.copy()
    arrived[400:650] = ARRIVED[650] - np.arange(250)[::-1] * 100_000
    steady = found(TRUE[lost], arrived[lost])
    assert steady.told == ""
    assert (steady.time_ns[0] == TRUE[lost]).all()


def test_a_skeleton_out_of_its_order_is_left_out_alone() -> None:
    time = TRUE.copy()
    time[[500, 501]] = time[[501, 500]]
    steady = found(time)
    assert np.flatnonzero(~steady.kept[0]).tolist() == [501]
    assert steady.told == "left out as their time had gone back: 1 skeletons"


@pytest.mark.parametrize("arrived", [np.zeros(N, dtype=np.int64), ARRIVED - set_at(400, 30 * S)])
def test_where_nothing_tells_the_longest_part_stays(arrived: np.ndarray) -> None:
    steady = found(TRUE - set_at(400, 30 * S), arrived)
    if arrived.any():  # the recorder's clock was set, too
        assert not steady.jumps
        assert np.flatnonzero(steady.kept[0]).tolist() == list(range(400, N))
        assert "400 skeletons" in steady.told
    assert (np.diff(steady.time_ns[0][steady.kept[0]]) > 0).all()


def test_columns_go_to_the_clock_with_all_they_hold() -> None:
    collector = SkeletonCollector()
    for i in range(60):
        segments = {"upper_arm_r": SegmentPose(quality="held" if i % 3 else "good")}
        angles = {"elbow_flexion": 0.01 * i} | ({"wrist_flexion": 0.02 * i} if i % 2 else {})
        one = Skeleton(
            time_ns=int(TRUE[i]) - (5 * S if i >= 30 else 0) - (JUMP_NS // 2 if i == 10 else 0),
            side="right",
            origin="worn",
            forward="elbow",
            trunk_from_world=(1.0, 0.0, 0.0, 0.0),
            segments=segments,
            positions={},
            angles=angles,
            received_ns=i,
        )
        collector.take(encode(one), int(ARRIVED[i]))
    columns = collector.columns()
    steady = steady_times([(columns.time_ns, columns.arrived_ns)])
    right = columns.on_clock(steady.time_ns[0], steady.kept[0])
    rows = np.flatnonzero(steady.kept[0])
    assert 10 not in rows
    assert len(right) == len(rows)
    assert (np.diff(right.time_ns) > 0).all()
    assert (right.received_ns == rows).all()
    assert (right.arrived_ns == ARRIVED[rows]).all()
    names = ("elbow_flexion", "wrist_flexion")
    np.testing.assert_array_equal(right.angles_rad(names), columns.angles_rad(names)[rows])
    said = [s.segments["upper_arm_r"].quality for s in (columns.examples[i] for i in columns.form[rows])]
    assert right.each(lambda s: s.segments["upper_arm_r"].quality).tolist() == said
    assert columns.on_clock(columns.time_ns, np.ones(60, dtype=np.bool_)) is columns
