"""The equations of a joint of two axes: derivatives, and what fits them."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.joint_axes import fit_joint_axes
from brachium_fusion.joint_equations import AxisPriors, Guess, HeadingPrior, JointEquations
from brachium_fusion.joint_motion import JointMotion, SensorMotion, joint_motion


def unit(v):
    return np.asarray(v) / np.linalg.norm(v)


def two_axes(seconds=30.0, rate=50.0, heading=0.7, carrying=0.15, seed=0) -> JointMotion:
    """Return a joint whose first axis is Z of sensor a and whose second is Y of sensor b."""
    t = np.arange(round(seconds * rate)) / rate
    random = np.random.default_rng(seed)
    waves = [
        np.sin(2 * np.pi * random.uniform(0.1, 0.4, 3) * t[:, None] + random.uniform(0, 6, 3)).sum(axis=1)
        for _ in range(5)
    ]
    a = rotation.from_rotation_vector(0.4 * np.stack(waves[:3], axis=-1))
    joint = rotation.multiply(
        rotation.multiply(rotation.about(2, 1.0 + 0.5 * waves[3]), rotation.about(0, carrying)),
        rotation.about(1, 0.5 * waves[4]),
    )
    b = rotation.multiply(rotation.about(2, -heading), rotation.multiply(a, joint))
    return joint_motion(
        SensorMotion(world_from_sensor=a), SensorMotion(world_from_sensor=b), [(0, len(t))], rate
    )


def test_derivatives_are_those_of_the_residuals():
    priors = AxisPriors(
        axis_a=unit([0.1, 0.0, 1.0]),
        across_a=unit([0.0, 1.0, 0.2]),
        axis_b=unit([0.2, 1.0, 0.0]),
        heading=HeadingPrior(time_s=np.array([0.0, 20.0]), heading=np.array([0.5, 0.6]), sd=np.ones(2)),
    )
    equations = JointEquations(two_axes(), priors)
    random = np.random.default_rng(1)
    for _ in range(3):
        guess = Guess(
            unit(random.normal(size=3)),
            unit(random.normal(size=3)),
            0.2,
            random.normal(size=len(equations.knots_s)),
        )
        _, jacobian = equations.linear(guess)
        steps = 1e-6 * np.eye(jacobian.shape[1])
        numbers = np.stack(
            [
                (equations.linear(guess.moved(h))[0] - equations.linear(guess.moved(-h))[0]) / 2e-6
                for h in steps
            ],
            axis=-1,
        )
        assert np.abs(jacobian - numbers).max() < 1e-5 * np.abs(jacobian).max()


@pytest.mark.parametrize("heading", [0.7, -2.5])
def test_axes_heading_and_angle_are_found_from_nothing(heading):
    best = fit_joint_axes(two_axes(heading=heading), AxisPriors())[0]
    assert abs(best.axis_a[2]) > np.cos(np.radians(0.3))
    assert abs(best.axis_b[1]) > np.cos(np.radians(0.3))
    assert abs(best.carrying) == pytest.approx(0.15, abs=0.005)
    assert np.abs(rotation.wrap(best.headings - heading)).max() < 0.005
    assert best.residual < 0.01


def test_a_heading_that_drifts_is_followed():
    motion = two_axes(60.0)
    drift = np.radians(0.05) * motion.time_s
    turn = rotation.to_matrix(rotation.about(2, -drift))
    drifting = JointMotion(
        time_s=motion.time_s,
        world_from_a=motion.world_from_a,
        world_from_b=turn @ motion.world_from_b,
        rate_a=motion.rate_a,
        rate_b=np.einsum("nij,nj->ni", turn, motion.rate_b),
    )
    best = fit_joint_axes(drifting, AxisPriors())[0]
    assert np.degrees(rotation.wrap(best.headings[-1] - best.headings[0])) == pytest.approx(3.0, abs=0.4)


def test_what_is_not_seen_is_not_claimed():
    motion = two_axes()
    still = JointMotion(
        time_s=motion.time_s,
        world_from_a=np.broadcast_to(motion.world_from_a[0], motion.world_from_a.shape),
        world_from_b=np.broadcast_to(motion.world_from_b[0], motion.world_from_b.shape),
        **{name: np.zeros_like(motion.rate_a) for name in ("rate_a", "rate_b")},
    )
    best = fit_joint_axes(still, AxisPriors())[0]
    assert min(best.axis_a_sd, best.axis_b_sd, best.heading_sd) > np.radians(10.0)


def test_too_few_instants_are_refused():
    with pytest.raises(ValueError, match="at least 20 instants"):
        fit_joint_axes(two_axes().part(0.0, 1.0), AxisPriors())
