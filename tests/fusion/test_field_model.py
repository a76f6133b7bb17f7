"""The averaged field is what its linear model says it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_fusion.field_model import (
    CALIBRATION,
    HARD_IRON,
    SOFT_IRON,
    field_steps,
    heading_variance,
    looks,
)

NORTH = np.array([0.0, 19.0, -44.0])


def turned(seed: int, n: int, offset: float):
    """Return (levelled quaternions, rates, true rotation): the levelled frame lacks `offset` of heading."""
    random = np.random.default_rng(seed)
    truth = Rotation.random(n, random_state=seed)
    levelled = Rotation.from_euler("z", -offset) * truth
    return np.roll(levelled.as_quat(), 1, axis=1), random.normal(0.0, 2.0, (n, 3)), truth


@given(seed=st.integers(0, 1000), offset=st.floats(-3.0, 3.0), count=st.integers(1, 20))
@settings(max_examples=40, deadline=None)
def test_the_field_is_the_reference_and_what_calibration_left(seed: int, offset: float, count: int) -> None:
    quats, gyr, truth = turned(seed, 3 * count + count // 2, offset)
    random = np.random.default_rng(seed)
    iron, soft = random.normal(0.0, 5.0, 3), random.normal(0.0, 0.1, (3, 3))
    ideal = truth.inv().apply(NORTH)
    measured = np.linalg.solve(np.eye(3) - soft, (ideal + iron).T).T  # m = ideal + iron + soft m
    steps = field_steps(quats, gyr, measured, count)
    calibration = np.zeros(CALIBRATION)
    calibration[HARD_IRON], calibration[SOFT_IRON] = iron, soft.ravel()
    reference = np.array([NORTH[1] * np.sin(offset), NORTH[1] * np.cos(offset), NORTH[2]])
    assert np.allclose(steps.field - steps.response @ calibration, reference, atol=1e-9)
    assert np.allclose(steps.share, 1.0)


def test_a_late_magnetometer_is_the_first_column() -> None:
    """To first order in the angle turned during the lag."""
    quats, gyr, truth = turned(1, 200, 0.0)
    lag = 1e-4
    before = truth * Rotation.from_rotvec(-lag * gyr)
    steps = field_steps(quats, gyr, before.inv().apply(NORTH), 10)
    assert np.allclose(steps.field - steps.response[:, :, 0] * lag, NORTH, atol=1e-4)
    assert np.abs(steps.field - NORTH).max() > 1e-3


def test_samples_without_a_field_are_left_out_of_the_means() -> None:
    quats, gyr, truth = turned(2, 40, 0.0)
    mag = truth.inv().apply(NORTH) + 1.0
    few = mag.copy()
    few[1::2] = np.nan
    few[20:30] = np.nan
    steps = field_steps(quats, gyr, few, 10)
    assert steps.share.tolist() == [0.5, 0.5, 0.0, 0.5]
    assert np.all(steps.field[2] == 0.0)
    assert np.all(steps.response[2] == 0.0)
    alone = field_steps(quats[:10:2], gyr[:10:2], mag[:10:2], 5)
    assert np.allclose(steps.field[0], alone.field[0])
    assert np.allclose(steps.response[0], alone.response[0])


@pytest.mark.parametrize("step_s", [0.2, 0.5])
def test_movement_tells_more_of_the_field_and_less_of_the_heading(step_s: float) -> None:
    rates = np.array([0.0, 0.05, 0.5, 5.0])
    assert np.all(np.diff(heading_variance(rates, step_s)) > 0.0)
    told = looks(rates, step_s, 1.0)
    assert told[0] < 0.01 * told[-1]
    assert told[-1] == pytest.approx(step_s)
