import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium.evaluation.errors import angle_error, covered, per_cycle, relative_angle, rms
from brachium.evaluation.loss import kept
from brachium_viewer.statistics import eq17


def test_rms_of_numbers_and_of_vectors_leaves_out_what_is_not_known():
    assert rms(np.array([3.0, -4.0, np.nan])) == pytest.approx(np.sqrt(12.5))
    assert rms(np.array([[3.0, 4.0, 0.0], [np.nan, 0.0, 0.0]])) == pytest.approx(5.0)
    assert rms(np.array([np.nan])) is None
    assert covered(np.array([[1.0, 2.0], [np.nan, 2.0]])) == 0.5


def test_angles_err_by_less_than_half_a_turn():
    assert np.degrees(angle_error(np.radians([179.0]), np.radians([-179.0]))) == pytest.approx([-2.0])


def test_a_relative_angle_is_what_scipy_says():
    a, b, c, d = (Rotation.random(30, random_state=k) for k in range(4))
    found = relative_angle(*(r.as_quat(scalar_first=True) for r in (a, b, c, d)))
    expected = ((a.inv() * b).inv() * (c.inv() * d)).magnitude()
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_eq_17_does_not_see_a_turn_about_the_chest():
    places = np.random.default_rng(1).normal(size=(100, 3))
    turned = Rotation.from_euler("z", 30, degrees=True).apply(places)
    figures = eq17(turned, places)
    assert figures is not None
    assert figures.largest < 1e-12
    assert rms(turned - places) > 0.3  # type: ignore[operator]


def test_eq_17_of_a_known_difference():
    places = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
    figures = eq17(places * [[1.2], [1.0]], places)
    assert figures is not None
    assert (figures.mae, figures.largest, figures.rmse) == pytest.approx((0.5, 1.0, np.sqrt(0.5)))
    assert eq17(np.full((2, 3), np.nan), places) is None


def test_cycles_give_the_means_over_cycles_and_axes():
    t = np.arange(400)
    truth = np.stack([np.sin(2 * np.pi * t / 100), np.cos(2 * np.pi * t / 100), 0 * t], axis=1)
    offsets = np.repeat([0.1, -0.1, 0.1, -0.1], 100)[:, None]
    figures = per_cycle(truth + offsets, truth, [0, 100, 200, 300, 400])
    assert figures is not None
    assert figures.mean == pytest.approx(0.0, abs=1e-12)
    assert figures.sd == pytest.approx(0.0, abs=1e-12)
    assert figures.rms == pytest.approx(0.1)
    assert figures.correlation == pytest.approx(1.0)  # of the axes that move
    assert figures.p is not None
    assert figures.p > 0.5


def test_a_steady_difference_has_a_small_p():
    t = np.arange(1000)
    truth = np.sin(2 * np.pi * t / 100)[:, None]
    figures = per_cycle(truth + 0.1 + 0.01 * np.sin(t / 77.0)[:, None], truth, list(range(0, 1001, 100)))
    assert figures is not None
    assert figures.p is not None
    assert figures.p < 0.01


@pytest.mark.parametrize(("loss", "burst"), [(0.0, 1), (0.05, 1), (0.05, 5), (0.2, 10)])
def test_as_many_samples_are_lost_as_was_said(loss: float, burst: int):
    there = kept(2000, loss, burst, "a")
    assert (~there).mean() == pytest.approx(loss, abs=burst / 2000)
    assert there[0]
    np.testing.assert_array_equal(there, kept(2000, loss, burst, "a"))
    if loss:
        assert (there != kept(2000, loss, burst, "b")).any()
        edges = np.flatnonzero(np.diff(np.concatenate([[1], there, [1]]).astype(int)))
        lengths = edges[1::2] - edges[::2]
        assert (lengths % burst == 0).all()
