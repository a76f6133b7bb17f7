import numpy as np
import pytest

from brachium_body import lengths


def test_lengths_from_height_are_the_papers():
    arm = lengths.from_height(1.8)
    assert np.allclose(np.asarray(arm), [0.2322, 0.3348, 0.2628, 0.1944])
    assert arm.relative_sd == lengths.HEIGHT_RELATIVE_SD > 0.0


def test_uncertain_lengths_add_up_along_the_arm():
    sd = lengths.from_height(1.8).position_sd()
    assert sd[0] == pytest.approx(0.05 * 0.2322)
    assert sd[3] == pytest.approx(0.05 * np.sqrt(0.2322**2 + 0.3348**2 + 0.2628**2 + 0.1944**2))
    assert (np.diff(sd) > 0.0).all()
    assert lengths.ArmLengths(0.2, 0.3, 0.25, 0.18).position_sd().tolist() == [0.0] * 4


@pytest.mark.parametrize("height", [180.0, 0.0, -1.8, float("nan"), float("inf")])
def test_a_height_that_nobody_has_is_refused_with_what_to_do(height):
    with pytest.raises(ValueError, match=r"height must be 0.7 to 2.5 m, not .*; give it in metres"):
        lengths.from_height(height)


@pytest.mark.parametrize("bad", [33.0, 0.0, -0.3, float("nan")])
def test_a_length_that_no_arm_has_is_refused_by_name(bad):
    with pytest.raises(ValueError, match=r"length upper_arm must be 0.1 to 0.6 m, not"):
        lengths.ArmLengths(0.2, bad, 0.25, 0.18)


def test_measured_lengths_are_kept_and_the_rest_comes_from_height():
    arm = lengths.from_measured({"forearm": 0.25}, height_m=1.8)
    assert arm.forearm == 0.25
    assert arm.upper_arm == pytest.approx(0.3348)
    assert arm.relative_sd > 0.0
    full = lengths.from_measured({"chest_to_shoulder": 0.2, "upper_arm": 0.3, "forearm": 0.25, "hand": 0.18})
    assert full == lengths.ArmLengths(0.2, 0.3, 0.25, 0.18)


def test_unknown_and_missing_lengths_are_named():
    with pytest.raises(
        ValueError, match="unknown length 'lower_arm'; lengths are chest_to_shoulder, upper_arm"
    ):
        lengths.from_measured({"lower_arm": 0.25}, height_m=1.8)
    with pytest.raises(
        ValueError, match="length chest_to_shoulder is not given; give it, or the person's height"
    ):
        lengths.from_measured({"forearm": 0.25})
