"""A joint's movement: a sensor that turned is told from one that did not, by what the joint cannot do."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import joint_orientations
from brachium_fusion.joint_model import Joint
from brachium_fusion.slip_joints import JointTurned, JointTurns

RATE_HZ, SECONDS, SLIP_S = 50.0, 60.0, 30.0
ELBOW = Joint(
    axes=2,
    axis_a=np.array([0.0, 0.0, 1.0]),
    axis_b=np.array([0.0, 1.0, 0.0]),
    lever_a=None,
    lever_b=None,
    carrying_rad=0.0,
)


def moved(turns: tuple[np.ndarray, np.ndarray], seed: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Return quats (n, 2, 4) and rates (n, 2, 3) of sensors along their segments, turned from SLIP_S on."""
    random, t = np.random.default_rng(seed), np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    theta = np.zeros((len(t), 7))
    for i, size in enumerate((0.8, 0.5, 0.5, 0.9, 0.8)):
        hertz, phase = random.uniform(0.1, 0.5, 3), random.uniform(0.0, 6.3, 3)
        theta[:, i] = 0.6 * size * np.sin(2 * np.pi * hertz * t[:, None] + phase).sum(axis=1)
    theta[:, 3] += 1.2
    upper, forearm, _ = joint_orientations(theta, "right", 0.0)
    quats = np.stack([upper, forearm], axis=1)
    steps = rotation.to_rotation_vector(rotation.multiply(rotation.inverse(quats[:-1]), quats[1:]))
    gyr = RATE_HZ * np.concatenate([steps, steps[-1:]])
    gyr = gyr + 0.003 * random.standard_normal(gyr.shape)
    for sensor, turn in enumerate(turns):
        q, late = rotation.from_rotation_vector(turn), t >= SLIP_S
        quats[late, sensor] = rotation.multiply(quats[late, sensor], q)
        gyr[late, sensor] = rotation.rotate(rotation.inverse(q), gyr[late, sensor])
    return quats, gyr


NONE = np.zeros(3)


def last(quats: np.ndarray, gyr: np.ndarray) -> tuple[JointTurned, JointTurns]:
    joint, found = JointTurns(ELBOW, RATE_HZ), None
    for k in range(len(quats)):
        found = joint.step(round(k * 1e9 / RATE_HZ), quats[k], gyr[k]) or found
    assert found is not None
    return found, joint


@pytest.mark.parametrize(
    ("sensor", "turn_deg"),
    [(0, (7.0, 0.0, 0.0)), (0, (0.0, -8.0, 0.0)), (1, (8.0, 0.0, 0.0)), (1, (-5.0, 0.0, 6.0))],
)
def test_a_sensor_that_turned_is_told(sensor: int, turn_deg: tuple[float, float, float]) -> None:
    """Which one, when, and the turn across the joint's axis in it."""
    turn = np.radians(turn_deg)
    turns = (turn, NONE) if sensor == 0 else (NONE, turn)
    found, joint = last(*moved(turns))
    assert found.evidence > 14.0
    assert found.sensor == sensor
    assert joint.blocks[found.block].from_ns == SLIP_S * 1e9
    np.testing.assert_allclose(found.turn, turn, atol=np.radians(2.0))


def test_sensors_that_sit_tight_give_no_evidence() -> None:
    found, _ = last(*moved((NONE, NONE)))
    assert found.evidence < 3.0


@pytest.mark.parametrize(("sensor", "axis"), [(0, 2), (1, 1)])
def test_a_turn_about_the_joints_own_axis_cannot_be_seen(sensor: int, axis: int) -> None:
    turn = np.radians(8.0) * np.eye(3)[axis]
    found, _ = last(*moved((turn, NONE) if sensor == 0 else (NONE, turn)))
    assert found.evidence < 3.0


def test_a_heading_that_is_off_is_no_turn() -> None:
    """Two magnetometers indoors differ by some degrees, and by others later."""
    quats, gyr = moved((NONE, NONE))
    wrong = np.radians(6.0) * np.sin(np.arange(len(quats)) / RATE_HZ / 8.0)
    quats[:, 1] = rotation.multiply(rotation.about(2, wrong), quats[:, 1])
    found, _ = last(quats, gyr)
    assert found.evidence < 5.0


def test_it_goes_on_from_its_state_and_forgets() -> None:
    quats, gyr = moved((np.radians([0.0, -8.0, 0.0]), NONE))
    whole, joint = last(quats, gyr)
    first, second = JointTurns(ELBOW, RATE_HZ), JointTurns(ELBOW, RATE_HZ)
    for k in range(len(quats)):
        if k == 777:
            second.restore(first.state())
        found = (first if k < 777 else second).step(round(k * 1e9 / RATE_HZ), quats[k], gyr[k])
    assert found is not None
    assert found.evidence == whole.evidence
    joint.forget(round(SLIP_S * 1e9))
    assert joint.blocks[0].from_ns == SLIP_S * 1e9


def test_without_axes_there_is_nothing_to_watch() -> None:
    with pytest.raises(ValueError, match="axes must be known"):
        JointTurns(Joint(axes=2, axis_a=None, axis_b=None, lever_a=None, lever_b=None), RATE_HZ)
