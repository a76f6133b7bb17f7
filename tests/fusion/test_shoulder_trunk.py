"""The trunk's part of a shoulder's movement, and the girdle's found with it."""

from functools import lru_cache

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX
from brachium_fusion.orientation import VqfFilter
from brachium_fusion.shoulder_model import ArmModel, levelled
from brachium_fusion.shoulder_smoother import smooth_shoulder
from brachium_fusion.shoulder_trunk import shoulder_from_pelvis, trunk_velocity
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings

START = slice(20, 180)
RATE = 50.0
SEGMENTS = ("upper_arm_r", "forearm_r", "sternum")


@lru_cache(maxsize=8)
def session(exercise, level="ideal", seed=1):
    settings = WearerSettings(
        exercise=exercise, level=level, rate_hz=RATE, seed=seed, segments=SEGMENTS, sway_deg=2.0
    )
    return session_arrays(settings, 24.0)


def mounting(made, segment):
    """Return segment_from_sensor as a pose of 3 s shows it."""
    sensor = made.sensors[segment]
    q = levelled(rotation.mean(sensor.world_from_sensor[START]), sensor.acc[START].mean(axis=0))
    return rotation.multiply(rotation.inverse(made.arms["right"].world_from_segment[segment][0]), q)


def sternum_motion(made):
    """Return where the trunk carries the right shoulder, from where it was, and how fast."""
    sensor = made.sensors["sternum"]
    world = VqfFilter(1.0 / RATE, True).update(sensor.gyr, sensor.acc, sensor.mag, None)
    turn = rotation.multiply(
        rotation.mean(sensor.world_from_sensor[START]), rotation.inverse(rotation.mean(world[START]))
    )
    world = rotation.multiply(rotation.about(2, rotation.heading(turn)), world)
    trunk_from_sensor = rotation.multiply(TRUNK_FROM_THORAX, mounting(made, "sternum"))
    arm = rotation.rotate(rotation.inverse(trunk_from_sensor), shoulder_from_pelvis(made.lengths, "right"))
    place = rotation.rotate(world, arm)
    rate = sensor.gyr - sensor.gyr[START].mean(axis=0)
    return place - place[START].mean(axis=0), trunk_velocity(world, rate, arm)


def girdle(made, trunk_velocity):
    upper, forearm = (made.sensors[s] for s in SEGMENTS[:2])
    on_upper, on_forearm = (rotation.inverse(mounting(made, s)) for s in SEGMENTS[:2])
    model = ArmModel(
        upper_arm_m=made.lengths.upper_arm,
        forearm_m=made.lengths.forearm,
        sensor_from_upper_arm=on_upper,
        sensor_from_forearm=on_forearm,
        lever_upper=upper.levers["shoulder"],
        lever_forearm=forearm.levers["elbow"],
    )
    return smooth_shoulder(
        model,
        RATE,
        (upper.gyr, upper.acc),
        (forearm.gyr, forearm.acc),
        upper.world_from_sensor,
        forearm.world_from_sensor,
        START,
        trunk_velocity=trunk_velocity,
    )


def true_shift(made):
    shoulder = made.arms["right"].world_positions["shoulder"]
    return shoulder - shoulder[0]


def rms(error):
    return float(np.sqrt(np.square(error).sum(axis=-1).mean()))


def test_the_trunk_alone_carries_a_still_shoulder():
    made = session("reaching")
    place, _ = sternum_motion(made)
    assert rms(true_shift(made)) > 0.02
    assert rms(place - true_shift(made)) < 0.3 * rms(true_shift(made))


def test_velocity_is_the_derivative_of_place():
    place, velocity = sternum_motion(session("reaching", "exact"))
    np.testing.assert_allclose(np.gradient(place, 1.0 / RATE, axis=0)[5:-5], velocity[5:-5], atol=0.012)


@pytest.mark.parametrize("exercise", ["shrugging", "reaching"])
def test_a_sternum_sensor_takes_the_trunk_out(exercise):
    made = session(exercise)
    place, velocity = sternum_motion(made)
    without, found = girdle(made, None), girdle(made, velocity)
    errors = [
        rms((shift - true_shift(made))[without.valid & found.valid])
        for shift in (without.shift_m, place + found.shift_m)
    ]
    assert errors[1] < 0.8 * errors[0]


def test_a_left_shoulder_is_on_the_other_side():
    right, left = (shoulder_from_pelvis(session("reaching").lengths, s) for s in ("right", "left"))
    np.testing.assert_array_equal(left, right * [-1.0, 1.0, 1.0])
