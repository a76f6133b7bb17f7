"""Uneven sets do what they planned."""

import numpy as np
import pytest

from brachium_nodes.exercises import EXERCISES
from brachium_nodes.irregular import Irregular
from brachium_nodes.movement import Variation
from brachium_nodes.wearer import WearerSettings

SETS = ("elbow-irregular", "elbow-impaired", "shoulder-irregular", "shoulder-impaired")


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("seed", range(8))
def test_the_arm_comes_back_and_rests(name: str, seed: int) -> None:
    motion = EXERCISES[name].motion
    assert isinstance(motion, Irregular)
    plan = motion.plan(Variation(seed))
    changes = np.array([step.change for step in plan.steps])
    assert changes.sum() == pytest.approx(0.0, abs=1e-9)
    ends = np.array([(step.from_s, step.to_s) for step in plan.steps]).ravel()
    assert (np.diff(ends) >= 0.0).all()
    assert ends[-1] < plan.end_s
    way = np.cumsum(changes)
    assert plan.whole == int((np.diff(np.concatenate([[False], way > 0.6]).astype(int)) == 1).sum())


@pytest.mark.parametrize("seed", range(8))
def test_an_impaired_elbow_starts_bent_and_goes_little(seed: int) -> None:
    motion, variation = EXERCISES["elbow-impaired"].motion, Variation(seed)
    t = np.arange(0.0, 60.0, 0.01)
    elbow = np.degrees(motion(t, variation, None).angles["elbow_flexion"])
    calm = np.convolve(elbow, np.full(20, 0.05), mode="valid")
    assert 9.5 < calm[0] < 45.5
    assert 5.0 < np.ptp(calm) < 23.0
    fast = elbow[9:-10] - calm
    assert np.std(fast) == pytest.approx(2.0 / np.sqrt(2.0), rel=0.1)


def test_seeds_and_sides_differ() -> None:
    motion = EXERCISES["elbow-irregular"].motion
    plans = {motion.plan(Variation(seed, side)) for seed in range(10) for side in ("right", "left")}
    assert len(plans) == 20
    assert WearerSettings(exercise="elbow-irregular").exercise == "elbow-irregular"
