"""How far skin lets sensors swing: tremor is told from movement, skin from what is rigid."""

import numpy as np
import pytest

from brachium_fusion.joint_heading import HeadingSearch
from brachium_fusion.joint_model import NODE_S, Joint
from brachium_fusion.joint_shaking import LEAST, MOST, Shaking


def shaken(hz: float, amplitude: float, seconds: float, shaking: Shaking | None = None) -> Shaking:
    shaking = shaking or Shaking()
    for t in np.arange(0.0, seconds, NODE_S):
        acceleration = np.zeros((2, 3))
        acceleration[1, 0] = amplitude * np.sin(2.0 * np.pi * hz * t)
        shaking = shaking.then(acceleration)
    return shaking


def test_a_tremor_is_seen_within_a_second_and_a_movement_of_1_hz_is_not_taken_for_one() -> None:
    tremor = shaken(5.0, 8.0, 1.0)
    assert np.sqrt(tremor.squared) == pytest.approx(8.0 / np.sqrt(2.0), rel=0.25)
    assert shaken(1.0, 8.0, 3.0).squared < 0.05 * tremor.squared
    assert shaken(1.0, 0.0, 12.0, tremor).squared < 0.01 * tremor.squared


def test_residuals_tell_skin_from_a_rigid_sensor() -> None:
    skin = rigid = Shaking(squared=36.0, share=LEAST)
    for _ in range(round(2.0 / NODE_S)):
        skin = skin.learnt(3.0, 1e-4, NODE_S)
    assert skin.share == MOST
    assert skin.speed == pytest.approx(0.12)
    for _ in range(round(2.0 / NODE_S)):
        rigid = rigid.learnt(1.0, 1e-4, NODE_S)
    assert rigid.share == LEAST
    for _ in range(round(60.0 / NODE_S)):
        skin = skin.learnt(0.1, 1e-4, NODE_S)
    assert skin.share == pytest.approx(LEAST, rel=1.0)


def test_where_nothing_shakes_nothing_is_learnt() -> None:
    still = Shaking(squared=0.0, share=LEAST)
    assert still.learnt(3.0, 1e-4, NODE_S).share == LEAST


def test_it_goes_on_from_its_plain_values() -> None:
    one = shaken(5.0, 8.0, 0.5)
    again = Shaking.of(one.state())
    assert shaken(5.0, 3.0, 0.5, again).state() == shaken(5.0, 3.0, 0.5, one).state()


def test_what_swings_against_its_bone_at_every_tremble_overthrows_no_heading() -> None:
    """Skin answers in the opposite direction: seen for long, any weight would turn it over."""
    lever = np.zeros(3)
    search = HeadingSearch(Joint(axes=3, lever_a=lever, lever_b=lever))
    level = np.tile(np.eye(3), (2, 1, 1))
    for t in np.arange(0.0, 20.0, NODE_S):
        acceleration = np.zeros((2, 3))
        acceleration[:, 0] = np.array([6.0, -6.0]) * np.sin(2.0 * np.pi * 5.0 * t)
        search.take(level, np.zeros((2, 3)), acceleration, NODE_S)
    assert search.against(0.0) < 20.0
    assert not search.is_found()
