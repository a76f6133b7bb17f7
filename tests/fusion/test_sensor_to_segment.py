"""Sensor-to-segment alignment from a pose and movement, against arms whose truth is known."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_body.kinematics import joint_orientations
from brachium_body.segments import arm_segments
from brachium_fusion.pose import Alignment
from brachium_fusion.sensor_to_segment import SensorRecord, Span, align_segments

RATE = 50.0
POSE_S, MOVE_S = 3.0, 30.0


def movement(seconds: float, seed: int, scale=(0.9, 0.5, 0.6, 0.9, 0.8)) -> np.ndarray:
    """Return model angles (n, 7) rad: hanging for POSE_S, then shoulder, elbow and forearm at random."""
    t = np.arange(round((POSE_S + seconds) * RATE)) / RATE
    random = np.random.default_rng(seed)
    theta = np.zeros((len(t), 7))
    begun = np.clip((t - POSE_S) / 1.5, 0.0, 1.0) ** 2
    for i, size in enumerate(scale):
        hertz, phase = random.uniform(0.1, 0.5, 4), random.uniform(0.0, 6.3, 4)
        theta[:, i] = 0.5 * size * begun * np.sin(2 * np.pi * hertz * t[:, None] + phase).sum(axis=1)
    theta[:, 3] = begun * 1.0 + theta[:, 3] * 0.6
    return theta


def worn(theta, side="right", carrying_deg=8.0, seed=0, off_deg=40.0):
    """Return records of sensors put on anyhow, each with its own heading, and their true mountings."""
    random = np.random.default_rng(seed)
    records, mountings = {}, {}
    arm = joint_orientations(theta, side, np.radians(-carrying_deg))
    for segment, trunk_from_segment in zip(arm_segments(side)[:2], arm[:2], strict=True):
        mounting = rotation.from_rotation_vector(np.radians(off_deg) * random.uniform(-1, 1, 3))
        turn = rotation.about(2, random.uniform(-np.pi, np.pi))
        quats = rotation.multiply(turn, rotation.multiply(trunk_from_segment, mounting))
        records[segment], mountings[segment] = SensorRecord(world_from_sensor=quats), mounting
    return records, mountings


def spans(theta, kind="free"):
    held = round(POSE_S * RATE)
    return [Span(kind="n-pose", first=0, end=held), Span(kind=kind, first=held, end=len(theta))]


def elbow_deg(records, found: Alignment, side="right") -> np.ndarray:
    upper, forearm, _ = arm_segments(side)
    world = {
        s: rotation.multiply(
            rotation.multiply(rotation.about(2, found.heading[s]), records[s].world_from_sensor),
            rotation.inverse(found.mounting[s]),
        )
        for s in (upper, forearm)
    }
    m = rotation.to_matrix(rotation.multiply(rotation.inverse(world[upper]), world[forearm]))
    return np.degrees(np.arctan2(-m[:, 0, 1], m[:, 1, 1]))


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("carrying_deg", [15.0, 8.0, -3.0])
def test_sensors_put_on_anyhow_are_found_from_free_movement(side, carrying_deg):
    theta = movement(MOVE_S, 1)
    records, true = worn(theta, side, carrying_deg)
    found = align_segments(records, spans(theta), RATE)
    upper, forearm, _ = arm_segments(side)
    joint = found.joints[f"elbow_{side[0]}"]
    flexion = rotation.rotate(rotation.inverse(true[upper]), [0.0, 0.0, 1.0])
    pronation = rotation.rotate(rotation.inverse(true[forearm]), [0.0, 1.0, 0.0])
    assert np.degrees(np.arccos(np.clip(joint.axis_near @ flexion, -1, 1))) < 0.3
    assert np.degrees(np.arccos(np.clip(joint.axis_far @ pronation, -1, 1))) < 0.3
    assert np.degrees(joint.carrying_rad) == pytest.approx(-carrying_deg, abs=0.4)
    assert np.abs(elbow_deg(records, found, side) - np.degrees(theta[:, 3])).max() < 1.0


def test_an_alignment_goes_through_its_state():
    theta = movement(MOVE_S, 1)
    found = align_segments(worn(theta)[0], spans(theta), RATE)
    again = Alignment.from_state(found.state())
    assert again.joints == found.joints
    assert again.refused == found.refused
