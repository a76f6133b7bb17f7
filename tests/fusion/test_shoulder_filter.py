"""The causal filter of the shoulder against emulated wearers, and against a person who walks."""

import copy
import json
import os
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.orientation import VqfFilter
from brachium_fusion.shoulder_filter import ShoulderFilter
from brachium_fusion.shoulder_model import ArmModel, levelled
from brachium_fusion.shoulder_watch import RECOVER_S
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings

START = slice(10, 90)
RATE = 25.0
DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "human_arms"


@lru_cache(maxsize=16)
def session(exercise, level, seed=1, side="right", rate=RATE):
    end = side[0]
    segments = (f"upper_arm_{end}", f"forearm_{end}")
    settings = WearerSettings(
        exercise=exercise, level=level, rate_hz=rate, seed=seed, arms=side, segments=segments
    )
    made = session_arrays(settings, 24.0)
    arm, sensors = made.arms[side], [made.sensors[s] for s in segments]
    start = slice(round(0.4 * rate), round(3.6 * rate))
    world = [levelled(rotation.mean(s.world_from_sensor[start]), s.acc[start].mean(axis=0)) for s in sensors]
    mounting = [
        rotation.multiply(rotation.inverse(q), arm.world_from_segment[s][0])
        for q, s in zip(world, segments, strict=True)
    ]
    model = ArmModel(
        upper_arm_m=made.lengths.upper_arm,
        forearm_m=made.lengths.forearm,
        sensor_from_upper_arm=mounting[0],
        sensor_from_forearm=mounting[1],
        lever_upper=sensors[0].levers["shoulder"],
        lever_forearm=sensors[1].levers["elbow"],
        carrying_rad=made.carrying,
        side=side,
        soft_tissue=level not in ("exact", "ideal"),
    )
    shoulder = arm.world_positions["shoulder"]
    bias = [s.gyr[start].mean(axis=0) for s in sensors]
    rows = np.concatenate([part for s in sensors for part in (s.gyr, s.acc)], axis=1)
    return ShoulderFilter(model, rate, *world, *bias), rows, shoulder - shoulder[0]


def begun(*which, **more):
    """Return a fresh filter, the samples (n, 12) from the rest on and the true shift (n, 3)."""
    prototype, rows, truth = session(*which, **more)
    first = round(0.4 * more.get("rate", RATE))
    return copy.deepcopy(prototype), rows[first:], truth[first:]


def run(follow, rows, **more):
    return [follow.step(r[:3], r[3:6], r[6:9], r[9:12], **more) for r in rows]


def rms(error):
    return float(np.sqrt(np.square(error).sum(axis=-1).mean()))


def shifts(estimates):
    return np.array([e.shift_m for e in estimates])


@pytest.mark.parametrize("exercise", ["shrugging", "reaching", "circle"])
def test_without_errors_the_shoulder_is_followed(exercise):
    follow, rows, truth = begun(exercise, "exact")
    estimates = run(follow, rows)
    assert rms(shifts(estimates) - truth) < 0.003
    assert all(e.valid for e in estimates)


@pytest.mark.parametrize(("level", "largest"), [("ideal", 0.0045), ("typical", 0.012)])
@pytest.mark.parametrize("rate", [25.0, 50.0])
def test_a_shrug_is_followed_far_better_than_no_shift(level, largest, rate):
    errors = []
    for seed in (1, 2, 3):
        follow, rows, truth = begun("shrugging", level, seed, rate=rate)
        errors.append(rms(shifts(run(follow, rows)) - truth))
    assert rms(truth) > 0.03
    assert np.median(errors) < largest


def test_covariance_is_honest():
    ratios = []
    for seed in (1, 2, 3):
        for exercise in ("shrugging", "reaching"):
            follow, rows, truth = begun(exercise, "ideal", seed)
            estimates = run(follow, rows)
            error = shifts(estimates) - truth
            ratios += [
                e @ np.linalg.solve(one.covariance, e) / 3.0
                for one, e in zip(estimates[100:], error[100:], strict=True)
            ]
    assert 0.03 < np.mean(ratios) < 1.3


def test_no_rest_is_seen_in_the_middle_of_a_shrug():
    follow, rows, truth = begun("shrugging", "ideal")
    resting = np.array([e.at_rest for e in run(follow, rows)])
    speed = np.linalg.norm(np.gradient(truth, 1.0 / RATE, axis=0), axis=1)
    assert resting.mean() > 0.2
    assert not resting[speed > 0.08].any()


def test_a_left_arm_is_followed_like_a_right_one():
    follow, rows, truth = begun("shrugging", "ideal", 2, "left")
    assert rms(shifts(run(follow, rows)) - truth) < 0.006


def test_state_goes_through_json_and_goes_on_bit_for_bit():
    follow, rows, _ = begun("shrugging", "ideal")
    run(follow, rows[:333])
    state = json.loads(json.dumps(follow.state()))
    other, _, _ = begun("shrugging", "ideal")
    other.restore(state)
    for a, b in zip(run(follow, rows[333:]), run(other, rows[333:]), strict=True):
        np.testing.assert_array_equal(a.shift_m, b.shift_m)
        np.testing.assert_array_equal(a.world_from_upper, b.world_from_upper)
        np.testing.assert_array_equal(a.covariance, b.covariance)
        assert a.at_rest == b.at_rest


def shaken(rows, first, end, size=3.0, turns_hz=2.0):
    """Add the up and down of a walking trunk to both sensors, along what each has as up at its start."""
    rows, t = rows.copy(), np.arange(len(rows)) / RATE
    swing = np.where((t > first) & (t < end), size, 0.0) * np.sin(2.0 * np.pi * turns_hz * t)
    for c in (3, 9):
        up = rows[:80, c : c + 3].mean(axis=0)
        rows[:, c : c + 3] += swing[:, None] * up / np.linalg.norm(up)
    return rows


def test_walking_is_said_and_the_next_rest_recovers():
    follow, rows, _ = begun("elbow-flexion", "ideal")
    still = np.tile(rows[20:60].mean(axis=0), (150, 1))
    estimates = run(follow, np.concatenate([shaken(still, 1.0, 5.0), still]))
    valid = np.array([e.valid for e in estimates])
    assert valid[:25].all()
    assert not valid[round(3.0 * RATE) : round(5.0 * RATE)].any()
    assert "hold the back still" in estimates[round(4.0 * RATE)].reason
    assert valid[-1]
    assert (np.flatnonzero(~valid)[-1] / RATE - 5.0 + 2.0) > RECOVER_S
    assert all(np.isfinite(e.covariance).all() for e in estimates)


def test_the_orientation_filter_stands_in_while_the_estimate_is_not_valid():
    follow, rows, _ = begun("elbow-flexion", "ideal")
    given = {
        "world_from_upper": np.array([0.5, 0.5, 0.5, 0.5]),
        "world_from_forearm": np.array([0.5, -0.5, 0.5, 0.5]),
    }
    estimates = run(follow, shaken(rows[:100], 1.0, 9.0), **given)
    lost = [e for e in estimates if not e.valid]
    assert lost
    for e in lost:
        np.testing.assert_array_equal(e.world_from_upper, given["world_from_upper"])
        np.testing.assert_array_equal(e.shift_m, 0.0)
    assert not np.allclose(estimates[0].world_from_upper, given["world_from_upper"])


def test_a_short_gap_costs_little_and_a_long_one_is_said():
    follow, rows, truth = begun("shrugging", "ideal")
    kept = np.ones(len(rows), dtype=bool)
    kept[300:303] = False
    estimates, missing = [], 0
    for row, keep in zip(rows, kept, strict=True):
        if not keep:
            missing += 1
            continue
        estimates.append(follow.step(row[:3], row[3:6], row[6:9], row[9:12], missing_s=missing / RATE))
        missing = 0
    assert all(e.valid for e in estimates)
    assert rms(shifts(estimates) - truth[kept]) < 0.01
    row = rows[-1]
    after = follow.step(row[:3], row[3:6], row[6:9], row[9:12], missing_s=5.0)
    assert not after.valid
    assert "missing" in after.reason


def test_a_long_rest_keeps_everything_bounded():
    follow, rows, _ = begun("elbow-flexion", "ideal")
    still = np.tile(rows[20:60].mean(axis=0), (25, 1))
    for _ in range(120):
        estimates = run(follow, still)
    assert np.sqrt(np.trace(estimates[-1].covariance)) < 0.012
    assert rms(shifts(estimates)) < 0.002
    assert all(e.valid for e in estimates)


@pytest.mark.data
@pytest.mark.skipif(
    not DATA.is_dir(), reason="the recordings are kept outside the project: set BRACHIUM_DATA"
)
def test_a_person_who_walks_is_noticed():
    table = pytest.importorskip("pyarrow.parquet")

    def read(segment):
        columns = table.read_table(DATA / f"{segment}.parquet").to_pydict()
        return tuple(
            np.column_stack([columns[c] for c in names]).astype(float)
            for names in (("gx", "gy", "gz"), ("ax", "ay", "az"))
        )

    upper, forearm = read("upper_arm_r"), read("forearm_r")
    start = slice(50, 430)
    neutral = np.array([0.5, 0.5, 0.5, 0.5])
    given = [VqfFilter(0.01, False).update(gyr, acc, None, None) for gyr, acc in (upper, forearm)]
    world = [
        levelled(rotation.mean(q[start]), acc[start].mean(axis=0))
        for q, (_, acc) in zip(given, (upper, forearm), strict=True)
    ]
    mounting = [rotation.multiply(rotation.inverse(q), neutral) for q in world]
    model = ArmModel(
        upper_arm_m=0.3,
        forearm_m=0.25,
        sensor_from_upper_arm=mounting[0],
        sensor_from_forearm=mounting[1],
        lever_upper=rotation.rotate(mounting[0], [0.0, 0.2, 0.0]),
        lever_forearm=rotation.rotate(mounting[1], [0.0, 0.2, 0.0]),
        lever_sd_m=0.03,
    )
    follow = ShoulderFilter(
        model, 100.0, *world, upper[0][start].mean(axis=0), forearm[0][start].mean(axis=0)
    )
    n = min(len(upper[0]), len(forearm[0]))
    estimates = [
        follow.step(
            upper[0][i],
            upper[1][i],
            forearm[0][i],
            forearm[1][i],
            world_from_upper=given[0][i],
            world_from_forearm=given[1][i],
        )
        for i in range(50, n)
    ]
    valid = np.array([e.valid for e in estimates])
    assert valid[:350].all()
    assert not valid[5500:].any()  # the person walks to the end
    assert max(np.linalg.norm(e.shift_m) for e in estimates) < 0.4
    assert all(np.isfinite(e.world_from_upper).all() for e in estimates)
