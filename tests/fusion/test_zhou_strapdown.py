import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium_body import rotation
from brachium_fusion.zhou_strapdown import (
    displacement,
    filtered,
    nearest_rotation,
    static_orientation,
    strapdown,
    world_acceleration,
)

RATE = 25.0


def gyr(n: int = 200) -> np.ndarray:
    return np.random.default_rng(3).normal(0.0, 1.5, (n, 3))


def test_orthonormal_steps_are_what_a_singular_value_decomposition_gives():
    rates = gyr()
    r = np.eye(3)
    expected = [r]
    for w in rates[1:]:
        x, y, z = w / RATE
        u, _, v = np.linalg.svd(r + r @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))
        r = u @ v
        expected.append(r)
    np.testing.assert_allclose(
        strapdown(rotation.IDENTITY, rates, RATE, orthonormal=True), expected, atol=1e-12
    )


def test_as_printed_the_columns_grow_as_the_erratum_says():
    rates = np.tile([0.0, 2.0, 0.0], (501, 1))  # 20 s at 2 rad/s
    last = strapdown(rotation.IDENTITY, rates, RATE, orthonormal=False)[-1]
    assert np.linalg.norm(last[:, 0]) == pytest.approx((1.0 + (2.0 / RATE) ** 2) ** 250)
    assert np.linalg.norm(last[:, 0]) > 4.9
    assert np.linalg.norm(last[:, 1]) == pytest.approx(1.0)


def test_a_still_sensor_has_no_acceleration_whichever_way_it_lies():
    turns = Rotation.random(20, random_state=1).as_matrix()
    up_in_sensor = np.einsum("nji,j->ni", turns, [0.0, 0.0, 9.81])
    np.testing.assert_allclose(world_acceleration(turns, up_in_sensor), 0.0, atol=1e-12)


def test_displacement_is_the_double_integral():
    t = np.arange(0, 4, 0.01)[:, None]
    np.testing.assert_allclose(displacement(-np.sin(t) * [1.0, 2.0, 3.0], 100.0)[:, 0],
                               (np.sin(t) - t)[:, 0], atol=1e-4)  # fmt: skip


@pytest.mark.parametrize("zero_phase", [False, True])
def test_filters_begin_in_equilibrium_and_keep_or_remove_what_stands(zero_phase: bool):
    still = np.tile([1.0, -2.0, 9.81], (100, 1))
    np.testing.assert_allclose(filtered(still, RATE, 10.0, "lowpass", zero_phase=zero_phase), still)
    np.testing.assert_allclose(filtered(still, RATE, 0.05, "highpass", zero_phase=zero_phase), 0.0, atol=1e-9)


def test_a_corner_above_half_the_rate_is_refused():
    with pytest.raises(ValueError, match="more than 20 samples a second, not 20"):
        filtered(gyr(), 20.0, 10.0, "lowpass", zero_phase=False)


def test_nearest_rotation_undoes_a_stretch():
    q = rotation.normalize(np.random.default_rng(1).normal(size=(50, 4)))
    turns = rotation.to_matrix(q)
    symmetric = np.array([[1.5, 0.2, 0.0], [0.2, 0.8, 0.1], [0.0, 0.1, 1.1]])
    np.testing.assert_allclose(rotation.angle_between(nearest_rotation(turns @ symmetric), q), 0, atol=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_static_orientation_is_what_turns_gravity_and_north_into_the_sensor(seed: int):
    q = rotation.normalize(np.random.default_rng(seed).normal(size=4))
    acc = np.tile(rotation.rotate(rotation.inverse(q), [0.0, 0.0, 9.81]), (5, 1))
    mag = np.tile(rotation.rotate(rotation.inverse(q), [0.0, 23.0, -40.0]), (5, 1))
    assert rotation.angle_between(static_orientation(acc, mag), q) < 1e-7
    tilt = rotation.multiply(static_orientation(acc, None), rotation.inverse(q))
    np.testing.assert_allclose(rotation.rotate(tilt, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0], atol=1e-9)
