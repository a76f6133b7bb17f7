"""The system against an arm made here from nothing but its joint angles and the shoulder's way."""

from dataclasses import replace

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import TRUNK_FROM_THORAX, joint_rotations
from brachium_fusion.zhou import CORRECTED, PRINTED, ZhouSensor, ZhouSettings, track
from brachium_fusion.zhou_strapdown import static_orientation

RATE = 100.0
GRAVITY = np.array([0.0, 0.0, -9.81])
LENGTHS = (0.33, 0.26)
REST = slice(0, 150)
CYCLES = (150, 550, 950, 1350)


def there_and_back(n: int = 1400) -> np.ndarray:
    """Return 0 for 1.5 s, then three repetitions of 4 s from 0 to 1 and back, with rests, (n,)."""
    u = np.clip((np.arange(n) - 150) / 400.0, 0.0, 2.999) % 1.0
    up = np.clip(u / 0.4, 0.0, 1.0)
    down = np.clip((u - 0.45) / 0.4, 0.0, 1.0)
    step = [x**4 * (35 - 84 * x + 70 * x * x - 20 * x**3) for x in (up, down)]
    return step[0] - step[1]


class Arm:
    """An arm whose elbow bends by `bend_deg` and turns by `turn_deg`, its shoulder moving by `shift_m`."""

    def __init__(self, side: str, bend_deg=0.0, turn_deg=0.0, lift_deg=0.0, shift_m=(0.0, 0.0, 0.0)) -> None:
        s = there_and_back()
        theta = np.zeros((len(s), 7))
        theta[:, 0] = np.radians(10.0 + lift_deg * s)
        theta[:, 3] = np.radians(20.0 + bend_deg * s)
        theta[:, 4] = np.radians(turn_deg * s)
        joints = joint_rotations(theta, side)
        self.upper = rotation.multiply(TRUNK_FROM_THORAX, joints[0])
        self.fore = rotation.multiply(self.upper, joints[1])
        self.shift = s[:, None] * np.asarray(shift_m)
        self.elbow = self.shift + rotation.rotate(self.upper, [0.0, -LENGTHS[0], 0.0])
        self.wrist = self.elbow + rotation.rotate(self.fore, [0.0, -LENGTHS[1], 0.0])
        self.sensors = (
            self._sensor(self.upper, self.shift, (0.0, -0.29, 0.04), rotation.about(1, 0.3)),
            self._sensor(self.fore, self.elbow, (0.0, -0.23, 0.03), rotation.about(0, -0.4)),
        )

    def _sensor(self, q, joint, place, segment_from_sensor) -> ZhouSensor:
        world_from_sensor = rotation.multiply(q, segment_from_sensor)
        way = joint + rotation.rotate(q, np.array(place))
        acc = np.gradient(np.gradient(way, 1 / RATE, axis=0), 1 / RATE, axis=0)
        step = rotation.multiply(rotation.inverse(world_from_sensor[:-1]), world_from_sensor[1:])
        gyr = np.zeros_like(way)
        gyr[1:] = rotation.to_rotation_vector(step) * RATE
        specific = rotation.rotate(rotation.inverse(world_from_sensor), acc - GRAVITY)
        mag = rotation.rotate(rotation.inverse(world_from_sensor), np.array([0.0, 23.0, -40.0]))
        return ZhouSensor(
            gyr=gyr,
            acc=specific,
            world_from_sensor=static_orientation(specific[REST], mag[REST]),
            sensor_from_segment=rotation.inverse(segment_from_sensor),
            place_m=np.array(place),
        )

    def track(self, **settings):
        return track(*self.sensors, LENGTHS, RATE, REST, ZhouSettings(**settings), CYCLES)


def rms_mm(error: np.ndarray) -> float:
    return float(1e3 * np.sqrt((error[CYCLES[0] : CYCLES[-1]] ** 2).sum(axis=1).mean()))


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_shrug_with_perfect_sensors_is_found(side: str):
    arm = Arm(side, bend_deg=8.0, lift_deg=4.0, shift_m=(0.0, 0.01, 0.08))
    motion = arm.track(drift="cycle_reset", zero_phase=True)
    assert rms_mm(arm.shift) > 30.0
    assert rms_mm(motion.shift_m - arm.shift) < 1.0
    assert rms_mm(motion.elbow_m - arm.elbow) < 1.5
    assert rms_mm(motion.wrist_m - arm.wrist) < 1.5
    assert np.degrees(rotation.angle_between(motion.world_from_forearm, arm.fore)).max() < 0.3


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_reach_with_a_still_shoulder_moves_the_wrist_alone(side: str):
    arm = Arm(side, bend_deg=70.0, lift_deg=50.0, turn_deg=30.0)
    motion = arm.track(drift="cycle_reset", zero_phase=True)
    assert rms_mm(motion.shift_m) < 12.0  # eq 2 is of first order: 1 deg at these rates
    assert rms_mm(motion.wrist_m - arm.wrist) < 15.0
    assert rms_mm(arm.wrist - arm.wrist[0]) > 100.0


def test_both_sensors_solutions_are_the_shoulder_and_lambda_weighs_them():
    arm = Arm("right", bend_deg=10.0, shift_m=(0.0, 0.0, 0.08))
    none = arm.track(weight=(0.0, 0.0, 0.0), zero_phase=True)
    np.testing.assert_allclose(none.shift_m, none.s_a)
    assert rms_mm(none.s_a - arm.shift) < 15.0
    full = arm.track(weight=(-1.0, -1.0, -1.0), zero_phase=True)
    np.testing.assert_allclose(full.shift_m, none.s_a + none.s_b)
    mean = arm.track(zero_phase=True)
    np.testing.assert_allclose(mean.shift_m, 0.5 * (none.shift_m + full.shift_m))


def test_printed_lengths_are_the_wrong_way_round():
    arm = Arm("right", bend_deg=60.0)
    printed = arm.track(corrected=CORRECTED - {"Z2"}, drift="cycle_reset")
    assert np.linalg.norm(printed.elbow_m[0]) == pytest.approx(LENGTHS[1])
    assert np.linalg.norm(printed.wrist_m[0] - printed.elbow_m[0]) == pytest.approx(LENGTHS[0])
    assert rms_mm(printed.wrist_m - arm.wrist) > 30.0


def test_the_high_pass_removes_the_mean_angle_too():
    arm = Arm("right", bend_deg=70.0)
    printed = arm.track(corrected=CORRECTED - {"Z4"})
    off = np.degrees(rotation.angle_between(printed.world_from_forearm, arm.fore))[CYCLES[1] :]
    assert np.sqrt(np.mean(off**2)) > 10.0


def test_as_printed_the_shoulder_goes_off_while_it_is_still():
    arm = Arm("right", bend_deg=70.0)
    assert rms_mm(arm.track(corrected=PRINTED).shift_m) > 1000.0


def test_eq_6_mixes_position_with_displacement():
    arm = Arm("right", shift_m=(0.0, 0.0, 0.05))
    printed = arm.track(corrected=CORRECTED - {"Z5"}, weight=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(printed.s_a[0], -arm.elbow[0], atol=1e-3)


def test_unequal_arrays_and_no_rest_are_refused():
    upper, fore = Arm("right").sensors
    with pytest.raises(ValueError, match="1400 and 1399 rows"):
        track(upper, replace(fore, gyr=fore.gyr[1:], acc=fore.acc[1:]), LENGTHS, RATE, REST)
    with pytest.raises(ValueError, match="0 at rest"):
        track(upper, fore, LENGTHS, RATE, slice(0, 0))
