"""Errors that were put into readings are found again; movements that cannot tell are refused by name."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_fusion import magnetometer_calibration as magnetometer
from brachium_fusion import sensor_calibration as fit
from brachium_fusion.sensor_calibration import GRAVITY, Refused

RATE = 100.0
NOISE_ACC, NOISE_GYR, NOISE_MAG = 0.028, 6e-4, 0.4
FACES = np.vstack([np.eye(3), -np.eye(3)])


def held(directions: Any, scale: Any, bias: Any, gyro_bias: Any, seed: int, seconds: float = 1.5) -> Any:
    """Return raw gyr, acc of a sensor held still in each direction of gravity, turned in between."""
    random = np.random.default_rng(seed)
    n, turn = int(seconds * RATE), int(0.5 * RATE)
    acc, gyr = [], []
    for first, second in zip(directions, np.roll(directions, -1, axis=0), strict=True):
        acc.append(np.tile(first, (n, 1)))
        gyr.append(np.zeros((n, 3)))
        part = np.linspace(0.0, 1.0, turn)[:, None]
        between = (1 - part) * first + part * second + 0.2 * np.sin(np.pi * part) * random.normal(size=3)
        acc.append(between)
        gyr.append(2.0 * np.sin(np.pi * part) * random.normal(size=3))
    true = GRAVITY * np.vstack(acc)
    raw = true / scale + bias + NOISE_ACC * random.normal(size=true.shape)
    return np.vstack(gyr) + gyro_bias + NOISE_GYR * random.normal(size=true.shape), raw


def around(n: int, seed: int) -> Any:
    """Return n directions spread over the sphere."""
    k = np.arange(n) + 0.5
    z, angle = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z * z)
    return Rotation.random(random_state=seed).apply(
        np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    )


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_a_gyro_bias_is_found_at_rest(seed: int) -> None:
    bias = np.random.default_rng(seed).normal(size=3) * 0.1
    gyr, acc = held(FACES[:2], np.ones(3), np.zeros(3), bias, seed, seconds=4.0)
    found = fit.gyro_at_rest(gyr, acc, RATE)
    assert found.calibration.gyro_bias == pytest.approx(tuple(bias), abs=2e-4)
    assert found.scores["rest_s"] == pytest.approx(3.5, abs=0.5)
    assert found.scores["bias_sd_dps"] < 0.02


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_six_faces_and_any_poses_find_scale_and_bias(seed: int) -> None:
    random = np.random.default_rng(seed)
    scale, bias = 1.0 + 0.03 * random.normal(size=3), 0.5 * random.normal(size=3)
    faces = fit.accel_six_faces(fit.still_poses(*held(FACES, scale, bias, np.zeros(3), seed), RATE))
    assert faces.calibration.accel_bias == pytest.approx(tuple(bias), abs=0.01)
    assert faces.calibration.accel_scale == pytest.approx(tuple(scale), abs=1e-3)
    poses = fit.still_poses(*held(around(14, seed), scale, bias, np.zeros(3), seed), RATE)
    assert len(poses) == 14
    free = fit.accel_still_poses(poses)
    assert free.calibration.accel_bias == pytest.approx(tuple(bias), abs=0.02)
    assert free.calibration.accel_scale == pytest.approx(tuple(scale), abs=2e-3)
    assert free.scores["residual_m_s2"] < 0.01


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_six_laid_faces_give_scale_and_bias_however_they_are_tilted(seed: int) -> None:
    random = np.random.default_rng(seed)
    scale, bias = 1.0 + 0.02 * random.normal(size=3), 0.3 * random.normal(size=3)
    axes = random.normal(size=(6, 3))
    tilts = np.radians(12.0) * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    poses = fit.still_poses(
        *held(Rotation.from_rotvec(tilts).apply(FACES), scale, bias, np.zeros(3), seed), RATE
    )
    laid = fit.accel_laid_faces(poses).calibration
    assert laid.accel_scale == pytest.approx(tuple(scale), abs=2e-3)
    assert laid.accel_bias == pytest.approx(tuple(bias), abs=0.03)


def test_faces_on_which_the_sensor_was_pushed_are_no_faces() -> None:
    poses = GRAVITY * FACES * np.array([[1.3, 1, 1]] * 6)
    with pytest.raises(Refused, match="no accelerometer errs by 23 %"):
        fit.accel_laid_faces(poses)
    assert fit.face_of(poses[0]) == "+x"
    assert fit.face_of(np.array([5.0, 5.0, 5.0])) == ""


def test_faces_laid_down_badly_spoil_faces_and_not_poses() -> None:
    """Ten degrees off a face lose 1.5 % of gravity: six faces take it for scale, the ellipsoid does not."""
    tilt = Rotation.from_rotvec(np.radians(10.0) * np.array([[0.7, 0.7, 0.1]] * 6)).apply(FACES)
    directions = np.vstack([tilt, around(8, 3)])
    poses = fit.still_poses(*held(directions, np.ones(3), np.zeros(3), np.zeros(3), 1), RATE)
    faces, free = fit.accel_six_faces(poses), fit.accel_still_poses(poses)
    assert faces.calibration.accel_scale is not None
    assert free.calibration.accel_scale is not None
    assert np.abs(np.array(faces.calibration.accel_scale) - 1.0).max() > 5e-3
    assert np.abs(np.array(free.calibration.accel_scale) - 1.0).max() < 2e-3


def turned(n: int, seed: int, offset: Any, matrix: Any) -> Any:
    """Return raw magnetometer readings all around: 46 uT seen through hard and soft iron."""
    random = np.random.default_rng(seed)
    field = 46.0 * around(n, seed)
    return (
        np.einsum("ij,nj->ni", np.linalg.inv(matrix), field) + offset + NOISE_MAG * random.normal(size=(n, 3))
    )


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_hard_and_soft_iron_are_found(seed: int) -> None:
    random = np.random.default_rng(seed)
    soft = 0.06 * random.normal(size=(3, 3))
    matrix = np.eye(3) + 0.5 * (soft + soft.T)
    matrix /= np.cbrt(np.linalg.det(matrix))
    offset = 30.0 * random.normal(size=3)
    raw = turned(1500, seed, offset, matrix)
    found = magnetometer.mag_ellipsoid(raw)
    assert found.calibration.mag_offset == pytest.approx(tuple(offset), abs=0.2)
    assert np.array(found.calibration.mag_matrix) == pytest.approx(matrix, abs=0.005)
    assert found.scores["field_ut"] == pytest.approx(46.0, rel=0.01)
    assert found.scores["residual_part"] < 0.015
    simple = magnetometer.mag_min_max(turned(1500, seed, offset, np.eye(3)))
    assert simple.calibration.mag_offset == pytest.approx(tuple(offset), abs=1.5)
    assert simple.calibration.mag_matrix is None


def test_a_passing_magnet_does_little_and_a_lasting_one_is_refused() -> None:
    raw = turned(1500, 5, np.array([20.0, -10.0, 5.0]), np.eye(3))
    passing = raw.copy()
    passing[300:340] += [30.0, 20.0, 0.0]
    assert magnetometer.mag_ellipsoid(passing).calibration.mag_offset == pytest.approx(
        (20.0, -10.0, 5.0), abs=0.6
    )
    lasting = raw.copy()
    lasting[::2] += [15.0, 10.0, 0.0]
    with pytest.raises(Refused, match=r"field varies by \d+ % after the fit"):
        magnetometer.mag_ellipsoid(lasting)


def test_movements_that_cannot_tell_are_refused() -> None:
    gyr, acc = held(FACES, np.ones(3), np.zeros(3), np.zeros(3), 1, seconds=1.0)
    with pytest.raises(Refused, match="did not lie still for 3 s"):
        fit.gyro_at_rest(gyr, acc, RATE)
    poses = fit.still_poses(gyr, acc, RATE)
    with pytest.raises(Refused, match="no still pose with y down, z down"):
        fit.accel_six_faces(poses[:4])
    with pytest.raises(Refused, match="4 still poses, 9 are needed"):
        fit.accel_still_poses(poses[:4])
    flat = around(12, 2)
    flat[:, 2] = np.abs(flat[:, 2])
    with pytest.raises(Refused, match="do not cover all sides"):
        fit.accel_still_poses(GRAVITY * flat)
    with pytest.raises(Refused, match="50 readings, 100 are needed"):
        magnetometer.mag_ellipsoid(turned(50, 1, np.zeros(3), np.eye(3)))
    ring = turned(1000, 1, np.zeros(3), np.eye(3))
    with pytest.raises(Refused, match="turn"):
        magnetometer.mag_ellipsoid(ring[np.abs(ring[:, 2]) < 6.0])
    with pytest.raises(Refused, match="all directions"):
        magnetometer.mag_min_max(ring * [1.0, 1.0, 0.3])


def test_moving_poses_are_refused_with_their_residual() -> None:
    poses = GRAVITY * around(16, 4) * (1.0 + 0.05 * np.random.default_rng(2).normal(size=(16, 1)))
    with pytest.raises(Refused, match=r"gravity is still \d\.\d+ m/s\^2 off"):
        fit.accel_still_poses(poses)
