"""The smoother of the shoulder against emulated wearers, exact and not."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.shoulder_model import ArmModel, levelled
from brachium_fusion.shoulder_smoother import smooth_shoulder
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings

START = slice(10, 90)
RATE = 25.0
DOWN = np.array([0.0, -1.0, 0.0])


@lru_cache(maxsize=16)
def session(exercise, level, seed=1, side="right", to_s=24.0, **more):
    ends = {"right": "r", "left": "l"}[side]
    segments = (f"upper_arm_{ends}", f"forearm_{ends}")
    made = session_arrays(
        WearerSettings(
            exercise=exercise, level=level, rate_hz=RATE, seed=seed, arms=side, segments=segments, **more
        ),
        to_s,
    )
    return made, segments


def model_of(made, segments, **more):
    """Return the arm as a pose shows it: neutral while it hangs, whatever the strap does afterwards."""
    side = made.settings.arms
    arm, sensors = made.arms[side], [made.sensors[s] for s in segments]
    mountings = []
    for segment, sensor in zip(segments, sensors, strict=True):
        q = levelled(rotation.mean(sensor.world_from_sensor[START]), sensor.acc[START].mean(axis=0))
        mountings.append(rotation.multiply(rotation.inverse(q), arm.world_from_segment[segment][0]))
    return ArmModel(
        upper_arm_m=made.lengths.upper_arm,
        forearm_m=made.lengths.forearm,
        sensor_from_upper_arm=mountings[0],
        sensor_from_forearm=mountings[1],
        lever_upper=sensors[0].levers["shoulder"],
        lever_forearm=sensors[1].levers["elbow"],
        carrying_rad=made.carrying,
        side=side,
        soft_tissue=made.settings.level not in ("exact", "ideal"),
        **more,
    )


def smoothed(made, segments, model=None, **more):
    upper, forearm = (made.sensors[s] for s in segments)
    return smooth_shoulder(
        model or model_of(made, segments),
        RATE,
        (upper.gyr, upper.acc),
        (forearm.gyr, forearm.acc),
        upper.world_from_sensor,
        forearm.world_from_sensor,
        START,
        **more,
    )


def true_shift(made):
    shoulder = made.arms[made.settings.arms].world_positions["shoulder"]
    return shoulder - shoulder[0]


def rms(error):
    return float(np.sqrt(np.square(error).sum(axis=-1).mean()))


def wrist_error(made, segments, found):
    model = model_of(made, segments)
    arm = made.arms[made.settings.arms].world_positions
    upper = rotation.multiply(found.world_from_upper, model.sensor_from_upper_arm)
    forearm = rotation.multiply(found.world_from_forearm, model.sensor_from_forearm)
    wrist = arm["shoulder"][0] + found.shift_m + model.upper_arm_m * rotation.rotate(upper, DOWN)
    return rms(wrist + model.forearm_m * rotation.rotate(forearm, DOWN) - arm["wrist"])


@pytest.mark.parametrize("exercise", ["shrugging", "reaching", "circle"])
def test_without_errors_the_shoulder_is_found(exercise):
    made, segments = session(exercise, "exact")
    found = smoothed(made, segments, model_of(made, segments, lever_sd_m=0.0))
    assert rms(found.shift_m - true_shift(made)) < 0.001
    assert found.valid.all()


@pytest.mark.parametrize(("level", "largest"), [("ideal", 0.0035), ("typical", 0.008)])
def test_a_shrug_is_seen_far_better_than_no_shift(level, largest):
    made, segments = session("shrugging", level)
    found = smoothed(made, segments)
    assert rms(true_shift(made)) > 0.03
    assert rms(found.shift_m - true_shift(made)) < largest


def test_a_shoulder_held_still_stays():
    made, segments = session("circle", "typical")
    found = smoothed(made, segments)
    assert rms(found.shift_m) < 0.003


@pytest.mark.parametrize("exercise", ["circle", "reaching"])
def test_the_wrist_is_better_than_with_sensors_as_the_pose_saw_them(exercise):
    errors = []
    for seed in (1, 2, 3):
        made, segments = session(exercise, "typical", seed)
        upper, forearm = (made.sensors[s] for s in segments)
        as_posed = replace(
            smoothed(made, segments),
            shift_m=true_shift(made),
            world_from_upper=upper.world_from_sensor,
            world_from_forearm=forearm.world_from_sensor,
        )
        found = smoothed(made, segments)
        errors.append((wrist_error(made, segments, found), wrist_error(made, segments, as_posed)))
    ours, posed = np.median(errors, axis=0)
    assert ours < posed


def test_the_standard_deviation_is_honest():
    ratios = []
    for seed in (1, 2, 3):
        for exercise in ("shrugging", "free"):
            made, segments = session(exercise, "ideal", seed)
            found = smoothed(made, segments)
            error = (found.shift_m - true_shift(made))[100:] / found.sd_m[100:]
            ratios.append(float(np.square(error).mean()))
    assert 0.02 < np.mean(ratios) < 1.5


def test_rests_help_where_the_shoulder_moves():
    made, segments = session("shrugging", "ideal")
    found = smoothed(made, segments)
    assert 0.2 < found.at_rest.mean() < 0.7
    speed = np.linalg.norm(np.gradient(true_shift(made), 1.0 / RATE, axis=0), axis=1)
    assert (speed[found.at_rest] < 0.03).mean() > 0.97


def test_a_shoulder_is_lifted_after_a_minute_of_stillness():
    made, segments = session("shrugging", "ideal", to_s=72.0, routine="calibration")
    found = smoothed(made, segments)
    lifted = round(50.0 * RATE)
    true = true_shift(made)
    assert rms(true[lifted:]) > 0.03
    assert rms((found.shift_m - true)[lifted:]) < 0.005
    assert rms((found.shift_m - true)[:lifted]) < 0.004


def test_a_left_arm_is_the_mirror_of_a_right_one():
    mirror = np.array([-1.0, 1.0, 1.0])
    made, segments = session("shrugging", "exact")
    right = smoothed(made, segments).shift_m
    flip = {"gyr": -mirror, "acc": mirror}
    upper, forearm = (made.sensors[s] for s in segments)
    model = model_of(made, segments)
    left = replace(
        model,
        side="left",
        sensor_from_upper_arm=_mirrored(model.sensor_from_upper_arm),
        sensor_from_forearm=_mirrored(model.sensor_from_forearm),
        lever_upper=model.lever_upper * mirror,
        lever_forearm=model.lever_forearm * mirror,
    )
    found = smooth_shoulder(
        left,
        RATE,
        (upper.gyr * flip["gyr"], upper.acc * flip["acc"]),
        (forearm.gyr * flip["gyr"], forearm.acc * flip["acc"]),
        upper.world_from_sensor * [1.0, 1.0, -1.0, -1.0],
        forearm.world_from_sensor * [1.0, 1.0, -1.0, -1.0],
        START,
    )
    np.testing.assert_allclose(found.shift_m * mirror, right, atol=1e-6)


def _mirrored(sensor_from_segment):
    """Mirror sensor axes across their x, segment axes across their z: S_x R S_z."""
    matrix = np.diag([-1.0, 1.0, 1.0]) @ rotation.to_matrix(sensor_from_segment) @ np.diag([1.0, 1.0, -1.0])
    return rotation.from_matrix(matrix)


@pytest.mark.parametrize("side", ["right", "left"])
def test_both_arms_are_equal(side):
    made, segments = session("shrugging", "ideal", 2, side)
    assert rms(smoothed(made, segments).shift_m - true_shift(made)) < 0.004


def test_windows_go_on_from_one_another():
    made, segments = session("shrugging", "ideal", 1, "right", 150.0)
    found = smoothed(made, segments)
    error = found.shift_m - true_shift(made)
    assert rms(error[-1000:]) < 1.5 * rms(error[100:1100])
    assert np.abs(np.diff(found.shift_m, axis=0)).max() < 0.02


def test_a_gap_costs_little_and_makes_no_nan():
    made, segments = session("shrugging", "ideal")
    for name in segments:
        sensor = made.sensors[name]
        gyr, acc = sensor.gyr.copy(), sensor.acc.copy()
        gyr[300:306] = acc[300:306] = np.nan
        made = replace(made, sensors=made.sensors | {name: replace(sensor, gyr=gyr, acc=acc)})
    model = model_of(*session("shrugging", "ideal"))
    found = smoothed(made, segments, model)
    assert np.isfinite(found.shift_m).all()
    assert np.isfinite(found.world_from_upper).all()
    assert rms(found.shift_m - true_shift(made)) < 0.012


def test_a_trunk_that_walks_is_no_shoulder():
    made, segments = session("shrugging", "ideal")
    t = made.time_s
    walk = np.where((t > 12.0) & (t < 20.0), 3.0, 0.0) * np.sin(2.0 * np.pi * 2.0 * t)
    for name in segments:
        sensor = made.sensors[name]
        up = rotation.rotate(rotation.inverse(sensor.world_from_sensor), [0.0, 0.0, 1.0])
        moved = replace(sensor, acc=sensor.acc + walk[:, None] * up)
        made = replace(made, sensors=made.sensors | {name: moved})
    found = smoothed(made, segments, model_of(*session("shrugging", "ideal")))
    assert not found.valid[(t > 13.0) & (t < 19.0)].any()
    assert found.valid[t < 10.0].all()
    assert rms((found.shift_m - true_shift(made))[t < 10.0]) < 0.006


@pytest.mark.parametrize("start", [slice(10, 12), slice(0, 0)])
def test_a_start_that_is_too_short_is_refused(start):
    made, segments = session("shrugging", "exact")
    upper, forearm = (made.sensors[s] for s in segments)
    with pytest.raises(ValueError, match="the start must be at least"):
        smooth_shoulder(
            model_of(made, segments),
            RATE,
            (upper.gyr, upper.acc),
            (forearm.gyr, forearm.acc),
            upper.world_from_sensor,
            forearm.world_from_sensor,
            start,
        )


def test_accelerations_in_g_are_refused():
    made, segments = session("shrugging", "exact")
    upper, forearm = (made.sensors[s] for s in segments)
    with pytest.raises(ValueError, match="m/s"):
        smooth_shoulder(
            model_of(made, segments),
            RATE,
            (upper.gyr, upper.acc / 9.81),
            (forearm.gyr, forearm.acc / 9.81),
            upper.world_from_sensor,
            forearm.world_from_sensor,
            START,
        )
