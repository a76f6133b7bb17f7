"""Symmetry, and components of movements whose components are known."""

import numpy as np
import pytest

from brachium_viewer.metrics.both_arms import components, difference, symmetry
from brachium_viewer.metrics.measure import measure, withheld

TIME = np.arange(0.0, 40.0, 0.02)


def test_symmetry_is_one_arm_over_the_other() -> None:
    assert symmetry(measure(60.0, "deg"), measure(80.0, "deg")).value == pytest.approx(75.0)
    assert symmetry(withheld("lost", "deg"), measure(80.0, "deg")).value is None
    assert symmetry(measure(1.0, "deg"), measure(0.0, "deg")).value is None


def test_a_difference_is_told_in_its_unit_and_changes_sign_with_the_arms() -> None:
    one, other = measure(-7.0, "1"), measure(-5.0, "1", 0.9)
    there, back = difference(one, other), difference(other, one)
    assert (there.value, back.value) == (-2.0, 2.0)
    assert (there.unit, there.coverage) == ("1", 0.9)
    lost = difference(withheld("lost", "1"), other)
    assert (lost.value, lost.withheld) == (None, "one side is not known: lost")


def test_two_angles_in_one_synergy_are_one_component(motion_of) -> None:
    way = np.sin(2 * np.pi * 0.2 * TIME)
    found = components(motion_of(TIME, {"elbow_flexion": 40 * way, "shoulder_flexion": 30 * way}))
    assert found is not None
    assert found.explained[0] == pytest.approx(1.0)
    first = dict(zip(found.names, found.directions[0], strict=True))
    assert first["elbow_flexion"] == pytest.approx(0.8)
    assert first["shoulder_flexion"] == pytest.approx(0.6)


def test_variance_is_shared_as_numpys_covariance_says(motion_of) -> None:
    random = np.random.default_rng(4)
    angles = {name: 20 * random.normal(size=len(TIME)) for name in ("elbow_flexion", "wrist_flexion")}
    found = components(motion_of(TIME, angles))
    assert found is not None
    covariance = np.cov(np.stack([angles["elbow_flexion"], angles["wrist_flexion"]]))
    expected = np.sort(np.linalg.eigvalsh(covariance))[::-1]
    assert found.explained[:2] == pytest.approx(expected / expected.sum())
    assert found.explained.sum() == pytest.approx(1.0)


def test_nothing_moves_nothing_to_say(motion_of) -> None:
    assert components(motion_of(TIME, {})) is None
    motion = motion_of(TIME, {"elbow_flexion": TIME})
    for words in motion.quality.values():
        words[:] = "assumed"
    assert components(motion) is None
