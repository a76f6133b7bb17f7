"""Sensor-to-segment alignment from a pose and movement, against arms whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


def degrees_between(a, b) -> float:
    return float(np.degrees(np.arccos(np.clip(np.dot(a, b), -1.0, 1.0))))


def axes_of(true, side="right"):
    upper, forearm, _ = arm_segments(side)
    flexion = rotation.rotate(rotation.inverse(true[upper]), [0.0, 0.0, 1.0])
    pronation = rotation.rotate(rotation.inverse(true[forearm]), [0.0, 1.0, 0.0])
    return flexion, pronation


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 10_000),
    st.floats(-3.0, 15.0),
    st.sampled_from(["right", "left"]),
)
def test_any_mounting_any_heading_and_any_arm_are_found(seed, carrying_deg, side):
    theta = movement(MOVE_S, seed % 7)
    records, true = worn(theta, side, carrying_deg, seed, off_deg=100.0)
    found = align_segments(records, spans(theta), RATE)
    joint = found.joints[f"elbow_{side[0]}"]
    flexion, pronation = axes_of(true, side)
    assert degrees_between(joint.axis_near, flexion) < 0.5
    assert degrees_between(joint.axis_far, pronation) < 0.5
    assert np.abs(elbow_deg(records, found, side) - np.degrees(theta[:, 3])).max() < 1.0


def test_headings_of_the_sensors_worlds_do_not_matter():
    theta = movement(MOVE_S, 2)
    records, _ = worn(theta)
    turned = {
        s: replace(r, world_from_sensor=rotation.multiply(rotation.about(2, a), r.world_from_sensor))
        for (s, r), a in zip(records.items(), (1.0, -2.0), strict=True)
    }
    one, other = (align_segments(r, spans(theta), RATE) for r in (records, turned))
    for s in records:
        assert degrees_between(one.mounting[s], other.mounting[s]) < 0.2
    assert one.joints["elbow_r"].carrying_rad == pytest.approx(other.joints["elbow_r"].carrying_rad, abs=1e-3)


def test_a_left_arm_is_a_right_arm_in_the_mirror():
    theta = movement(MOVE_S, 3)
    found = {
        side: align_segments(worn(theta, side, off_deg=0.0)[0], spans(theta), RATE)
        for side in ("right", "left")
    }
    right, left = found["right"].joints["elbow_r"], found["left"].joints["elbow_l"]
    assert right.carrying_rad == pytest.approx(left.carrying_rad, abs=0.005)
    # axes are turned, not seen in the mirror: across the sagittal plane X and Y of an axis change sign
    assert degrees_between(right.axis_near, left.axis_near * np.array([-1.0, -1.0, 1.0])) < 0.5
    assert degrees_between(right.axis_far, left.axis_far * np.array([-1.0, 1.0, -1.0])) < 0.5


def test_movement_alone_will_do_where_the_elbow_uses_its_range():
    theta = movement(60.0, 4)
    theta[:, 3] = np.clip(theta[:, 3], np.radians(5.0), None)
    records, true = worn(theta, off_deg=20.0)
    found = align_segments(records, [Span(kind="free", first=0, end=len(theta))], RATE)
    flexion, pronation = axes_of(true)
    assert degrees_between(found.joints["elbow_r"].axis_near, flexion) < 1.0
    assert degrees_between(found.joints["elbow_r"].axis_far, pronation) < 1.0
    assert np.abs(elbow_deg(records, found) - np.degrees(theta[:, 3])).mean() < 3.0
    assert any("no pose" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    ("kind", "stated_deg", "angles"),
    [("given", 35.0, {"elbow_flexion": 35.0, "forearm_pronation": 10.0}), ("table", 90.0, {})],
)
def test_zeros_rest_on_what_the_pose_states(kind, stated_deg, angles):
    theta = movement(MOVE_S, 5)
    held = round(POSE_S * RATE)
    share = np.clip((np.arange(len(theta)) - held) / RATE, 0.0, 1.0)[:, None]
    pose = np.zeros(7)
    pose[3], pose[4] = np.radians([stated_deg, angles.get("forearm_pronation", 0.0)])
    theta[:, 3] = np.maximum(theta[:, 3], np.radians(35.0))
    theta = (1.0 - share) * pose + share * theta
    records, true = worn(theta, off_deg=20.0)
    records = {s: replace(r, nominal_mounting=rotation.IDENTITY) for s, r in records.items()}
    chosen = [
        Span(kind=kind, first=0, end=held, angles_deg=angles),
        Span(kind="free", first=held, end=len(theta)),
    ]
    found = align_segments(records, chosen, RATE)
    assert degrees_between(found.joints["elbow_r"].axis_near, axes_of(true)[0]) < 0.5
    assert np.abs(elbow_deg(records, found) - np.degrees(theta[:, 3])).max() < 1.5


def test_an_elbow_that_does_not_straighten_is_not_called_straight():
    theta = movement(MOVE_S, 6)
    theta[:, 3] = np.maximum(theta[:, 3], np.radians(35.0))
    records, _ = worn(theta)
    found = align_segments(records, spans(theta), RATE)
    assert found.scores["elbow_in_pose_deg_r"] > 25.0


def led(**scale):
    """Return a calibration of two led movements, as model angles (n, 7), and its spans."""
    t = np.arange(round(24.0 * RATE)) / RATE
    theta = np.zeros((len(t), 7))
    first, second = (t > 4.0) & (t < 12.0), (t > 14.0) & (t < 22.0)
    wave = 0.5 - 0.5 * np.cos(2 * np.pi * 0.5 * t)
    theta[:, 3] = np.where(first, np.radians(scale.get("flexion", 100.0)) * wave, 0.0)
    up = np.clip((t - 12.5) / 1.0, 0.0, 1.0)
    theta[:, 3] += up * np.radians(90.0) * (t > 12.0)
    theta[:, 4] = np.where(second, np.radians(scale.get("pronation", 60.0)) * np.sin(np.pi * t), 0.0)
    theta[:, 4] += np.where(first, np.radians(scale.get("turned_along", 0.0)) * wave, 0.0)
    theta[:, 0] = np.radians(scale.get("shoulder", 0.0)) * wave * (first | second)
    theta[:, 1] = np.radians(scale.get("sway", 0.0)) * np.sin(2.0 * t)
    kinds = (("n-pose", 0.5, 3.5), ("elbow-flexion", 4.0, 12.0), ("pronation", 14.0, 22.0))
    return theta, [Span(kind=k, first=round(a * RATE), end=round(b * RATE)) for k, a, b in kinds]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("what", "key", "reason"),
    [
        ({"flexion": 8.0}, "elbow-flexion_r", "too little movement"),
        ({"pronation": 8.0}, "pronation_r", "too little movement"),
        ({"flexion": 40.0, "turned_along": 120.0}, "elbow-flexion_r", "movement about another axis"),
        ({"sway": 30.0}, "pose", "not still in the pose"),
    ],
)
def test_a_bad_calibration_movement_is_refused_by_its_reason(what, key, reason):
    theta, chosen = led(**what)
    found = align_segments(worn(theta)[0], chosen, RATE)
    assert reason in found.refused[key]
    if key != "pronation_r":
        assert "elbow_r" not in found.joints


def test_a_good_led_calibration_is_not_refused():
    theta, chosen = led(shoulder=20.0)
    found = align_segments(worn(theta)[0], chosen, RATE)
    assert found.refused == {}
    assert "elbow_r" in found.joints


@pytest.mark.parametrize("flexion", [8.0, 100.0])
def test_what_else_was_recorded_stands_in_for_what_led_movements_do_not_show(flexion):
    theta, chosen = led(flexion=flexion)
    theta = np.concatenate([theta, movement(45.0, 2)])
    records, true = worn(theta)
    found = align_segments(records, chosen, RATE)
    assert ("elbow-flexion_r" in found.refused) == (flexion < 20.0)
    assert degrees_between(found.joints["elbow_r"].axis_near, axes_of(true)[0]) < 0.5


def test_hardly_any_movement_leaves_the_pose_alone():
    theta = 0.05 * movement(MOVE_S, 1)
    records = {s: replace(r, nominal_mounting=rotation.IDENTITY) for s, r in worn(theta)[0].items()}
    found = align_segments(records, spans(theta), RATE)
    assert "too little movement" in found.refused["elbow_r"]
    assert set(found.mounting) == {"upper_arm_r", "forearm_r"}


def test_gaps_in_a_record_are_passed_over():
    theta = movement(MOVE_S, 1)
    records, true = worn(theta)
    for record in records.values():
        record.world_from_sensor[400:460] = np.nan
    found = align_segments(records, spans(theta), RATE)
    assert degrees_between(found.joints["elbow_r"].axis_near, axes_of(true)[0]) < 0.5


@pytest.mark.parametrize(("first", "end"), [(0, 10**6), (50, 50), (-1, 20)])
def test_spans_outside_the_records_are_named(first, end):
    records, _ = worn(movement(2.0, 1))
    with pytest.raises(ValueError, match="the span free has rows"):
        align_segments(records, [Span(kind="free", first=first, end=end)], RATE)
