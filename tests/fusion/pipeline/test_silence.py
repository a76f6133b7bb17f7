"""Sensors that lag, fall silent and come back: the others go on, and nothing is made up."""

import numpy as np
import pytest

from brachium_fusion.settings import Settings
from brachium_wire import keys

MS = 1_000_000
TICK = 20 * MS
Messages = list[tuple[keys.Key, bytes]]


def silent_from(flow, messages: Messages, segment: str, made, at_ns: int) -> Messages:
    return [
        m
        for m in messages
        if m[0].topic == "info" or m[0].detail != segment or flow.time_of(m) < made.START + at_ns
    ]


@pytest.mark.parametrize("batch", [1, 5, 10])
def test_a_segment_that_lags_is_held_then_missing_and_the_others_go_on(flow, made, batch) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats, batch=batch)
    pipeline = flow.fed([], changes=flow.FACING)
    stopped = made.START + 4_000 * MS
    last = stopped - 10 * MS
    seen: dict[str, list[int]] = {"held": [], "missing": []}
    times = []
    for message in silent_from(flow, messages, "forearm_r", made, 4_000 * MS):
        pipeline.feed(*message)
        for skeleton in flow.published(pipeline):
            times.append(skeleton.time_ns)
            if skeleton.time_ns <= last:
                continue
            pose = skeleton.segments["forearm_r"]
            arrived = pipeline.subjects["p01"].received_ns
            behind = arrived - last - (batch - 1) * 10 * MS
            assert behind > 150 * MS
            assert pose.quality == ("missing" if behind > 500 * MS else "held")
            seen[pose.quality].append(skeleton.time_ns)
            assert skeleton.segments["hand_r"].quality == "good"
            assert (pose.world_from_segment is None) == (pose.quality == "missing")
            if pose.quality == "missing":
                assert "elbow_flexion" not in skeleton.angles
                assert "shoulder_flexion" in skeleton.angles
            else:
                assert skeleton.assumed["elbow_flexion"] == "held"
                assert "shoulder_flexion" not in skeleton.assumed
    assert len(seen["held"]) >= 10
    assert len(seen["missing"]) >= 50
    assert np.diff(times) == pytest.approx(TICK)


@pytest.mark.parametrize("segment", ["upper_arm_r", "forearm_r", "hand_r"])
def test_nothing_is_assumed_where_a_worn_sensor_is_silent(flow, made, segment) -> None:
    quats, _, _ = flow.worn(made, seconds=6.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    pipeline = flow.fed(silent_from(flow, messages, segment, made, 4_000 * MS), changes=flow.FACING)
    found = flow.published(pipeline)
    gaps = [s for s in found if s.segments[segment].quality == "missing"]
    assert len(gaps) >= 50
    assert all("assumed" not in s.assumed.values() for s in found)
    lost = "wrist_flexion" if segment == "hand_r" else "elbow_flexion"
    assert all(lost in s.angles for s in found if s.segments[segment].quality == "good")
    assert all(lost not in s.angles for s in gaps)


def test_a_segment_that_comes_back_is_good_again(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=8.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    rest = [
        m
        for m in messages
        if m[0].topic == "info"
        or m[0].detail != "hand_r"
        or not 4_000 * MS <= flow.time_of(m) - made.START < 5_000 * MS
    ]
    skeletons = flow.run(rest, changes=flow.FACING)
    assert skeletons[-1].segments["hand_r"].quality == "good"
    seen = {s.segments["hand_r"].quality for s in skeletons[10:]}
    assert seen == {"uncalibrated", "good", "held", "missing"}


def test_a_gap_of_50_ms_in_one_segment_is_held_where_nothing_was_measured_and_nowhere_else(
    flow, made
) -> None:
    quats, _, _ = flow.worn(made, seconds=5.0)
    messages = made.info_messages(quats) + made.orientation_messages(quats)
    lost = [m for m in messages if m[0].detail == "hand_r" and m[0].topic == "imu"][90]
    skeletons = flow.run([m for m in messages if m is not lost], changes=flow.FACING)
    start = flow.time_of(lost)
    for s in skeletons[170:]:
        inside = start - 10 * MS < s.time_ns < start + 50 * MS
        assert s.segments["hand_r"].quality == ("held" if inside else "good")
        assert s.segments["forearm_r"].quality == "good"


def test_a_subject_whose_sensors_are_all_silent_publishes_nothing_and_holds_nobody_up(flow, made) -> None:
    mine = flow.worn(made, seconds=6.0)[0]
    theirs = flow.worn(made, seconds=6.0, seed=5)[0]
    messages = made.info_messages(mine) + made.info_messages(theirs, "p02")
    quiet = [
        m
        for m in made.orientation_messages(theirs, subject="p02")
        if flow.time_of(m) < made.START + 3_000 * MS
    ]
    pipeline = flow.fed(messages + quiet)
    first = pipeline.skeletons()
    assert {s.subject for s in first} == {"p02"}
    flow.fed(made.orientation_messages(mine), pipeline=pipeline)
    assert {s.subject for s in pipeline.skeletons()} == {"p01"}


def test_after_a_long_silence_of_everything_skeletons_go_on_where_samples_do(flow, made) -> None:
    quats, _, _ = flow.worn(made, seconds=8.0)
    messages = made.info_messages(quats) + [
        m
        for m in made.orientation_messages(quats)
        if not 4_000 * MS <= flow.time_of(m) - made.START < 6_500 * MS
    ]
    times = np.array([s.time_ns for s in flow.run(messages)])
    assert np.count_nonzero(np.diff(times) != TICK) == 1
    assert np.diff(times).max() == pytest.approx(2_500 * MS, abs=2 * TICK)


def test_times_lie_on_the_grid_and_grow_for_each_arm(flow, made) -> None:
    for rate in (50.0, 40.0, 100.0, 30.0):
        quats, _, _ = flow.worn(made, ("right", "left"), seconds=4.0)
        messages = made.info_messages(quats) + made.orientation_messages(quats)
        period = round(1e9 / rate)
        for side in ("right", "left"):
            times = [s.time_ns for s in flow.run(messages, Settings(rate_hz=rate)) if s.side == side]
            assert len(times) >= 3.9 * rate
            assert set(np.diff(times).tolist()) == {period}
            assert times[0] % period == 0
