"""Heading between two sensors and the joint's place, from accelerations alone."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion import joint_motion as joint_motions
from brachium_fusion.joint_centre import find_joint_centre
from brachium_fusion.joint_motion import SensorMotion, joint_motion

RATE = 100.0
GRAVITY = np.array([0.0, 0.0, 9.81])


def swung(heading, lever_a, lever_b, carried=0.3, seconds=20.0, skin=0.0, tremor=0.0):
    """Return the motion of two sensors on a ball joint whose centre is carried about, m; `skin` m/s^2 wobbles
    under each in its own way, and a `tremor` of 5.3 Hz swings them against each other."""
    t = np.arange(round(seconds * RATE)) / RATE
    waves = np.stack([np.sin(2 * np.pi * f * t + f) for f in (0.31, 0.47, 0.63, 0.41, 0.53, 0.71)], axis=-1)
    a, b = (rotation.from_rotation_vector(0.6 * waves[:, i : i + 3]) for i in (0, 3))
    centre = carried * waves[:, [1, 3, 5]]
    sensors = []
    for q, lever, turn in ((a, lever_a, 0.0), (b, lever_b, -heading)):
        place = centre - rotation.rotate(q, np.asarray(lever))
        acceleration = np.gradient(np.gradient(place, 1 / RATE, axis=0), 1 / RATE, axis=0)
        own_hz = [1.1, 1.5, 0.7] if turn else [0.9, 1.3, 1.7]
        wobble = skin * np.sin(2 * np.pi * np.outer(t, own_hz))
        wobble[:, 0] += (-tremor if turn else tremor) * np.sin(2 * np.pi * 5.3 * t)
        force = rotation.rotate(rotation.inverse(q), acceleration + GRAVITY + wobble)
        sensors.append(
            SensorMotion(world_from_sensor=rotation.multiply(rotation.about(2, turn), q), acc=force)
        )
    return joint_motion(sensors[0], sensors[1], [(5, len(t) - 5)], RATE)


@pytest.mark.parametrize("heading", [0.4, -2.9, 1.8])
def test_heading_and_levers_are_found(heading):
    found = find_joint_centre(swung(heading, (0.02, -0.15, 0.04), (0.0, 0.2, -0.03)))
    assert found is not None
    assert np.degrees(np.abs(rotation.wrap(found.headings - heading))).max() < 0.5
    assert found.lever_a == pytest.approx([0.02, -0.15, 0.04], abs=0.005)
    assert found.lever_b == pytest.approx([0.0, 0.2, -0.03], abs=0.005)


def test_about_a_joint_at_rest_no_heading_is_told():
    assert find_joint_centre(swung(0.4, (0.0, -0.15, 0.0), (0.0, 0.2, 0.0), carried=0.0)) is None


@pytest.mark.parametrize("heading", [0.4, -2.9, 1.8])
def test_what_skin_does_about_a_joint_at_rest_is_no_heading(heading):
    lever_a, lever_b = (0.02, -0.15, 0.04), (0.0, 0.2, -0.03)
    assert find_joint_centre(swung(heading, lever_a, lever_b, carried=0.0, skin=0.2)) is None
    found = find_joint_centre(swung(heading, lever_a, lever_b, skin=0.2))
    assert found is not None
    assert (np.abs(rotation.wrap(found.headings - heading)) < 2.0 * found.headings_sd).all()


@pytest.mark.parametrize("tremor", [1.0, 2.0, 4.0])
def test_sensors_that_tremble_on_skin_are_no_joint_the_other_way_round(tremor, monkeypatch):
    def off_deg():
        lever_a, lever_b = (0.02, -0.15, 0.04), (0.0, 0.2, -0.03)
        found = find_joint_centre(swung(0.4, lever_a, lever_b, carried=0.03, skin=0.05, tremor=tremor))
        assert found is not None
        return np.degrees(np.abs(rotation.wrap(found.headings - 0.4))).max()

    assert off_deg() < 5.0
    monkeypatch.setattr(joint_motions, "SLOW_S", joint_motions.SMOOTH_S)
    assert off_deg() > 170.0


def test_sensors_of_orientation_only_tell_nothing():
    quats = np.tile(rotation.IDENTITY, (1000, 1))
    still = SensorMotion(world_from_sensor=quats)
    assert find_joint_centre(joint_motion(still, still, [(0, 1000)], RATE)) is None


def test_gaps_and_short_runs_are_left_out():
    quats = np.tile(rotation.IDENTITY, (1000, 1))
    quats[200:260] = np.nan
    quats[300:340] = np.nan
    motion = joint_motion(
        SensorMotion(world_from_sensor=quats), SensorMotion(world_from_sensor=quats), [(0, 1000)], RATE
    )
    rows = np.round(motion.time_s * RATE).astype(int)
    assert not np.isnan(motion.world_from_a).any()
    assert not ((rows >= 200) & (rows < 340)).any()
