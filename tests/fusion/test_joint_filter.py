"""The live estimate of two sensors on one joint, against a double pendulum whose truth is exact."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.joint_filter import JointFilter
from brachium_fusion.joint_model import Joint

RATE = 50.0


def turned(motion, angle):
    """Return orientations as the sensors' own filters give them: b's heading is its own."""
    return motion.world_from_a, rotation.multiply(rotation.about(2, angle), motion.world_from_b)


def run(tracker, motion, given, rows=None, missing_s=0.0):
    """Return every estimate of some rows."""
    estimates = []
    for i in range(*(rows or (0, len(motion.gyr_a)))):
        values = (v[i] for v in (*given, motion.gyr_a, motion.gyr_b, motion.acc_a, motion.acc_b))
        estimates.append(tracker.step(*values, missing_s=missing_s))
        missing_s = 0.0
    return estimates


def relative_errors(estimates, motion, first=0):
    """Return the angle, deg, between each estimate's rotation from b to a and the true one."""
    a = np.array([e.world_from_a for e in estimates])
    b = np.array([e.world_from_b for e in estimates])
    rows = slice(first, first + len(a))
    true = rotation.multiply(rotation.inverse(motion.world_from_a[rows]), motion.world_from_b[rows])
    return np.degrees(rotation.angle_between(rotation.multiply(rotation.inverse(a), b), true))


@pytest.mark.parametrize(("axes", "angle"), [(1, -2.6), (2, 0.0), (3, np.pi)])
def test_the_heading_is_found_from_any_start(pendulum, axes, angle):
    motion = pendulum(axes, 20.0, RATE, seed=axes)
    joint = Joint(axes=axes, lever_a=motion.lever_a, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, RATE), motion, turned(motion, angle))
    assert np.max(relative_errors(estimates, motion)[-500:]) < 0.8  # of which 0.5 is 50 Hz, see the next test
    assert abs(rotation.wrap(estimates[-1].heading_rad + angle)) < np.radians(0.5)
    assert estimates[-1].heading_sd_rad < np.radians(3.0)


def test_errors_of_exact_readings_vanish_with_the_rate(pendulum):
    motion = pendulum(3, 12.0, 200.0, seed=3)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, 200.0), motion, turned(motion, np.pi))
    assert np.max(relative_errors(estimates, motion)[-1000:]) < 0.2


@pytest.mark.parametrize("axes", [1, 2])
def test_axes_alone_find_the_heading(pendulum, axes):
    motion = pendulum(axes, 20.0, RATE, seed=3)
    joint = Joint(axes=axes, axis_a=motion.axis_a, axis_b=motion.axis_b)
    estimates = run(JointFilter(joint, RATE), motion, turned(motion, 2.0))
    assert np.sqrt(np.mean(relative_errors(estimates, motion)[-250:] ** 2)) < 1.5


def test_without_levers_and_axes_orientations_pass(pendulum):
    motion = pendulum(3, 5.0, RATE, seed=1)
    given = turned(motion, 1.0)
    estimates = run(JointFilter(Joint(axes=3), RATE), motion, given)
    np.testing.assert_allclose(np.array([e.world_from_b for e in estimates]), given[1], atol=1e-12)
    assert estimates[-1].heading_sd_rad == pytest.approx(np.pi)


def test_biases_and_a_wrong_lever_arm_are_learnt(pendulum):
    motion = pendulum(3, 40.0, RATE, seed=5)
    motion.gyr_b += np.radians([0.3, -0.4, 0.2])
    motion.acc_a += np.array([0.1, -0.1, 0.05])
    wrong = motion.lever_a + np.array([0.01, 0.0, 0.0])
    joint = Joint(axes=3, lever_a=wrong, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, RATE), motion, turned(motion, -1.0))
    assert np.sqrt(np.mean(relative_errors(estimates, motion)[-500:] ** 2)) < 1.0


def test_at_rest_the_heading_is_held_and_grows_less_sure(pendulum):
    motion = pendulum(3, 50.0, RATE, seed=2, still_from_s=30.0)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, RATE), motion, turned(motion, 1.0))
    assert np.max(relative_errors(estimates, motion)[-800:]) < 0.7
    sd = np.array([e.heading_sd_rad for e in estimates])
    assert sd[-1] > sd[1650]
    assert np.all(np.diff(sd[1800:]) >= 0.0)


def test_before_anything_moved_nothing_is_claimed(pendulum):
    motion = pendulum(3, 10.0, RATE, seed=2, still_from_s=-3.0)
    rng = np.random.default_rng(1)
    motion.acc_a += 0.1 + 0.02 * rng.normal(size=motion.acc_a.shape)
    motion.acc_b += 0.02 * rng.normal(size=motion.acc_b.shape)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, RATE), motion, turned(motion, 1.0))
    assert min(e.heading_sd_rad for e in estimates) > 1.0


def test_behind_a_short_gap_the_heading_is_less_sure_and_found_again(pendulum):
    motion = pendulum(3, 40.0, RATE, seed=4)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    given, tracker = turned(motion, 0.5), JointFilter(joint, RATE)
    before = run(tracker, motion, given, (0, 1000))
    after = run(tracker, motion, given, (1015, 2000), missing_s=0.3)
    assert after[0].heading_sd_rad > before[-1].heading_sd_rad + np.radians(10.0)
    assert np.max(relative_errors(after, motion, 1015)) < 3.0
    assert np.max(relative_errors(after, motion, 1015)[-300:]) < 0.7


def test_behind_a_long_gap_the_heading_is_searched_anew(pendulum):
    motion = pendulum(3, 45.0, RATE, seed=4)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    tracker = JointFilter(joint, RATE)
    run(tracker, motion, turned(motion, 0.5), (0, 800))
    after = run(tracker, motion, turned(motion, -2.0), (900, 2250), missing_s=2.0)
    assert after[0].heading_sd_rad > 1.0
    assert np.max(relative_errors(after, motion, 900)[-300:]) < 0.7


def test_a_heading_that_jumps_is_noticed(pendulum):
    """A sensor's own filter may begin anew without a word: its heading is another one then."""
    motion = pendulum(3, 24.0, RATE, seed=4)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    tracker = JointFilter(joint, RATE)
    run(tracker, motion, turned(motion, 0.5), (0, 798))
    after = run(tracker, motion, turned(motion, -2.0), (798, 1200))
    assert np.max(relative_errors(after, motion, 798)) < 1.5


def test_a_shared_heading_starts_at_once_and_the_joint_mends_it(pendulum):
    motion = pendulum(3, 40.0, RATE, seed=6)
    joint = Joint(axes=3, lever_a=motion.lever_a, lever_b=motion.lever_b)
    estimates = run(JointFilter(joint, RATE, shared_heading=True), motion, turned(motion, np.radians(25.0)))
    assert estimates[0].heading_sd_rad < np.radians(30.0)
    assert np.max(relative_errors(estimates, motion)[-500:]) < 1.5
    own = rotation.heading(
        rotation.multiply(estimates[-1].world_from_a, rotation.inverse(motion.world_from_a[-1]))
    )
    assert abs(np.degrees(own) - 12.5) < 1.0, "both magnetometers count alike"


@pytest.mark.parametrize("at", [20, 333, 601])
def test_state_and_restore_go_on_exactly(pendulum, at):
    motion = pendulum(2, 14.0, RATE, seed=7)
    joint = Joint(
        axes=2, lever_a=motion.lever_a, lever_b=motion.lever_b, axis_a=motion.axis_a, axis_b=motion.axis_b
    )
    given, first = turned(motion, 1.0), JointFilter(joint, RATE)
    run(first, motion, given, (0, at))
    second = JointFilter(joint, RATE)
    second.restore(first.state())
    for one, other in zip(
        run(first, motion, given, (at, 700)), run(second, motion, given, (at, 700)), strict=True
    ):
        np.testing.assert_array_equal(one.world_from_b, other.world_from_b)
        assert one.heading_sd_rad == other.heading_sd_rad


def test_no_joint_has_four_axes():
    with pytest.raises(ValueError, match="1, 2 or 3 axes"):
        Joint(axes=4)
