"""The upper arm's own rotation from the plane of upper arm and forearm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_body import rotation
from brachium_body.kinematics import joint_orientations
from brachium_fusion.humeral_rotation import HumeralRotation, lagging_twist

DEG = np.pi / 180.0
angles = st.floats(-60.0, 60.0)


def arm(flexion_deg, side="right", carrying_deg=8.0, shoulder=(40.0, -20.0, 25.0), pronation_deg=30.0):
    """Return the upper arm and forearm (n, 4) for flexions (n,) deg."""
    flexion = np.atleast_1d(np.asarray(flexion_deg, dtype=float))
    theta = np.zeros((len(flexion), 7))
    theta[:, :3], theta[:, 3], theta[:, 4] = np.array(shoulder) * DEG, flexion * DEG, pronation_deg * DEG
    upper, forearm, _ = joint_orientations(theta, side, -carrying_deg * DEG)
    return upper, forearm


@given(
    st.floats(31.0, 150.0),
    st.floats(-50.0, 50.0),
    st.floats(-5.0, 20.0),
    st.sampled_from(["right", "left"]),
    angles,
    angles,
)
def test_a_bent_elbow_shows_any_lag(flexion, lag, carrying, side, shoulder, pronation):
    upper, forearm = arm(flexion, side, carrying, (shoulder, 10.0, -shoulder), pronation)
    behind = rotation.multiply(upper, rotation.about(1, -lag * DEG))
    corrected = HumeralRotation(-carrying * DEG, side).correct(behind, forearm)
    assert rotation.angle_between(corrected, upper)[0] < 1e-6


@given(st.floats(-10.0, 14.0), st.floats(-50.0, 50.0))
def test_a_straight_arm_shows_nothing(flexion, lag):
    upper, forearm = arm(flexion, carrying_deg=0.0)
    behind = rotation.multiply(upper, rotation.about(1, -lag * DEG))
    assert lagging_twist(behind, forearm, 0.0, "right")[1] == pytest.approx(0.0)
    assert np.allclose(HumeralRotation(0.0, "right").correct(behind, forearm), behind)


def test_what_was_seen_is_kept_while_the_arm_is_straight_and_nothing_jumps():
    flexion = np.concatenate([np.linspace(90, 0, 400), np.zeros(100), np.linspace(0, 90, 400)])
    lag = np.concatenate([np.full(400, 20.0), np.linspace(20.0, 5.0, 100), np.full(400, 5.0)])
    upper, forearm = arm(flexion)
    behind = rotation.multiply(upper, rotation.about(1, -lag * DEG))
    corrected = HumeralRotation(-8 * DEG, "right").correct(behind, forearm)
    error = np.degrees(rotation.angle_between(corrected, upper))
    assert error[:400].max() < 0.01  # the lag seen while bent still holds
    assert error[-1] < 0.01
    steps = np.degrees(rotation.angle_between(corrected[:-1], corrected[1:]))
    assert steps.max() < 0.5


@given(st.integers(1, 60))
def test_pieces_give_what_the_whole_gives(cut):
    flexion = 60 + 60 * np.sin(np.arange(120) / 9.0)
    upper, forearm = arm(flexion)
    behind = rotation.multiply(upper, rotation.about(1, -0.2 * np.cos(np.arange(120) / 20.0)))
    whole = HumeralRotation(-8 * DEG, "right").correct(behind, forearm)
    first = HumeralRotation(-8 * DEG, "right")
    head = first.correct(behind[:cut], forearm[:cut])
    second = HumeralRotation(-8 * DEG, "right")
    second.restore(first.state())
    tail = second.correct(behind[cut:], forearm[cut:])
    assert np.allclose(np.concatenate([head, tail]), whole, atol=1e-12)


def test_unknown_rows_stay_unknown_and_do_no_harm():
    upper, forearm = arm(np.full(5, 80.0))
    behind = rotation.multiply(upper, rotation.about(1, -0.3))
    forearm[2] = np.nan
    corrected = HumeralRotation(-8 * DEG, "right").correct(behind, forearm)
    assert np.degrees(rotation.angle_between(corrected, upper)).max() < 1e-4
    behind[3] = np.nan
    assert np.isnan(HumeralRotation(-8 * DEG, "right").correct(behind, forearm)[3]).all()


def test_a_twist_that_no_skin_makes_is_left_alone():
    upper, forearm = arm(90.0)
    turned = rotation.multiply(upper, rotation.about(1, np.pi / 2))
    assert np.allclose(HumeralRotation(-8 * DEG, "right").correct(turned, forearm), turned)
