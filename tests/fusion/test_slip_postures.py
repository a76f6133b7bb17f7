"""Rests of several sensors: which one turned, by how much, and what says that none did."""

import numpy as np

from brachium_body import rotation
from brachium_fusion.slip_postures import evidence_of, turned_since


def _rests(turn: np.ndarray | None, sensors: int = 3) -> np.ndarray:
    """Return twelve rests in three postures in turn; from the seventh on, sensor 1 sits turned."""
    random = np.random.default_rng(5)
    postures = random.standard_normal((3, sensors, 3))
    ups = np.tile(postures / np.linalg.norm(postures, axis=2, keepdims=True), (4, 1, 1))
    ups = ups + 0.002 * random.standard_normal(ups.shape)
    if turn is not None:
        ups[6:, 1] = rotation.rotate(rotation.inverse(rotation.from_rotation_vector(turn)), ups[6:, 1])
    return np.asarray(ups / np.linalg.norm(ups, axis=2, keepdims=True))


def test_several_postures_tell_the_whole_turn() -> None:
    """Gravity seen from three sides leaves nothing of a turn unknown."""
    turn = np.radians([3.0, -5.0, 6.0])
    found = turned_since(_rests(turn))
    assert found is not None
    assert (found.sensor, found.split) == (1, 6)
    np.testing.assert_allclose(found.turn, turn, atol=np.radians(0.4))


def test_without_a_turn_there_is_no_evidence() -> None:
    """Nothing looks strange; and a posture never met before is no turn."""
    assert turned_since(_rests(None)) is None
    ups = _rests(None)
    ups[6:] = np.roll(ups[6:], 1, axis=2)
    found = turned_since(ups)
    assert found is None or found.evidence < 1.0


def test_a_turn_about_the_vertical_is_not_seen() -> None:
    """With one posture only: gravity does not change with it."""
    ups = np.tile(_rests(None)[:1], (12, 1, 1))
    turned = rotation.from_rotation_vector(np.radians(8.0) * ups[0, 1])
    ups[6:, 1] = rotation.rotate(turned, ups[6:, 1])
    assert turned_since(ups) is None


def test_postures_felt_as_before_contradict_a_turn() -> None:
    """Evidence has the sign of what the rests say, and none where nothing can be compared."""
    turn = np.radians([3.0, -5.0, 6.0])
    assert evidence_of(_rests(turn), 6, 1, turn) > 30.0
    assert evidence_of(_rests(None), 6, 1, turn) < -30.0
    assert evidence_of(_rests(None), 12, 1, turn) == 0.0
