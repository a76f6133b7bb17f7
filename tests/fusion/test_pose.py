"""Calibration by a pose: which rule gives forward, mountings found exactly, headings fixed from the left."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from brachium_body import rotation
from brachium_body.angles import INDEX, joint_angles
from brachium_body.kinematics import TRUNK_FROM_NEUTRAL, SegmentOrientations, between, joint_orientations
from brachium_body.segments import SEGMENTS, arm_segments
from brachium_fusion.alignment_warnings import warnings_for
from brachium_fusion.pose import Alignment, PoseSensor, align, pose_orientations

RIGHT_ARM = arm_segments("right")
number = st.floats(-1.0, 1.0, width=32)
headings = st.floats(-3.1, 3.1)


@st.composite
def rotations(draw):
    q = np.array(draw(st.tuples(number, number, number, number)))
    assume(np.linalg.norm(q) > 1e-2)
    return q / np.linalg.norm(q)


def sensor(q, mounting=None, magnetometer=True, sway=0.0):
    turns = rotation.from_rotation_vector(np.outer(np.linspace(-1.0, 1.0, 5), [sway, 0.0, 0.0]))
    return PoseSensor(
        world_from_sensor=rotation.multiply(q, turns), magnetometer=magnetometer, nominal_mounting=mounting
    )


def standing(pose, facing, mounting, own_heading=None):
    """Return world_from_sensor of each segment, standing in a pose and facing `facing` rad from north."""
    result = {}
    for segment, segment_from_sensor in mounting.items():
        world_from_trunk = rotation.about(2, -facing)
        q = rotation.multiply(rotation.multiply(world_from_trunk, pose[segment]), segment_from_sensor)
        turn = rotation.about(2, 0.0 if own_heading is None else own_heading[segment])
        result[segment] = rotation.multiply(turn, q)
    return result


def same(p, q) -> float:
    return float(rotation.angle_between(p, q))


# -- which rule gives forward ------------------------------------------------------------------------------

NEUTRAL = pose_orientations("n-pose", {})
FACING = {"sternum": 0.3, "elbow": 0.6, "facing": 0.9, "mounting": 1.2}
"""Each rule's own idea of where the subject faces, rad east of north: so one sees which one won."""


def case(*rules: str, magnetometer: bool = True) -> Alignment:
    sensors = {}
    for segment in ("sternum", "upper_arm_r", "forearm_r"):
        q = rotation.multiply(rotation.about(2, -1.5), TRUNK_FROM_NEUTRAL)
        mounting = None
        rule = {"sternum": "sternum", "upper_arm_r": "mounting"}.get(segment)
        if rule in rules:
            facing = rotation.multiply(rotation.about(2, -FACING[rule]), TRUNK_FROM_NEUTRAL)
            mounting = rotation.multiply(rotation.inverse(facing), q)
        if segment != "sternum" or "sternum" in rules:
            sensors[segment] = sensor(q, mounting, magnetometer)
    angle = FACING["elbow"]
    right = np.array([np.cos(angle), -np.sin(angle), 0.2])
    return align(
        sensors,
        NEUTRAL,
        facing_deg=np.degrees(FACING["facing"]) if "facing" in rules else None,
        elbow_axis={"forearm_r": right} if "elbow" in rules else None,
    )


def faces(alignment: Alignment) -> float:
    forward = rotation.rotate(alignment.world_from_trunk, np.array([0.0, 1.0, 0.0]))
    return float(np.arctan2(forward[0], forward[1]))


@pytest.mark.parametrize("first", range(4))
def test_each_rule_for_forward_wins_over_those_after_it(first: int) -> None:
    rules = list(FACING)[first:]
    for count in range(1, len(rules) + 1):
        alignment = case(*rules[:count])
        assert alignment.forward == rules[0]
        assert faces(alignment) == pytest.approx(FACING[rules[0]], abs=1e-9)
        assert not alignment.assumed


def test_without_any_rule_forward_is_assumed_and_one_warning_says_what_to_give() -> None:
    alignment = case()
    assert alignment.forward == "none"
    assert faces(alignment) == 0.0
    assert alignment.assumed == {"upper_arm_r", "forearm_r"}
    assert "facing_deg" in alignment.warnings[0]


def test_facing_means_nothing_without_magnetometers() -> None:
    assert case("facing", magnetometer=False).forward == "none"
    assert case("facing", "mounting", magnetometer=False).forward == "mounting"


@pytest.mark.parametrize("rule", ["sternum", "elbow", "mounting"])
def test_without_magnetometers_the_world_is_turned_so_that_forward_is_y(rule: str) -> None:
    alignment = case(rule, magnetometer=False)
    assert alignment.forward == rule
    assert faces(alignment) == 0.0


def test_a_sternum_without_magnetometer_among_others_with_one_gives_no_forward() -> None:
    mounting = rotation.IDENTITY
    sensors = {
        "sternum": sensor(rotation.multiply(rotation.about(2, 2.0), TRUNK_FROM_NEUTRAL), mounting, False),
        "upper_arm_r": sensor(rotation.multiply(rotation.about(2, -0.7), TRUNK_FROM_NEUTRAL), mounting),
    }
    alignment = align(sensors, NEUTRAL)
    assert alignment.forward == "mounting"
    assert faces(alignment) == pytest.approx(0.7)
    assert alignment.heading["sternum"] == pytest.approx(-2.7)


def test_a_direction_that_is_nearly_vertical_gives_no_heading() -> None:
    lying = rotation.multiply(rotation.about(0, np.radians(80.0)), TRUNK_FROM_NEUTRAL)  # X now points up
    alignment = align({"sternum": sensor(lying, rotation.IDENTITY)}, NEUTRAL, facing_deg=90.0)
    assert alignment.forward == "facing"


# -- mountings ---------------------------------------------------------------------------------------------

POSES = {
    "n-pose": {},
    "table": {},
    "given": {"elbow_flexion": 35.0, "forearm_pronation": 20.0, "wrist_flexion": -15.0},
}


@pytest.mark.parametrize("name", POSES)
@given(mountings=st.lists(rotations(), min_size=7, max_size=7), facing=headings)
@settings(max_examples=20, deadline=None)
def test_any_mounting_of_any_nine_axis_sensor_is_found_exactly(name, mountings, facing) -> None:
    pose = pose_orientations(name, POSES[name])
    mounting = dict(zip(SEGMENTS, mountings, strict=True))
    sensors = {s: sensor(q, sway=0.02) for s, q in standing(pose, facing, mounting).items()}
    alignment = align(sensors, pose, facing_deg=float(np.degrees(facing)))
    assert alignment.forward == "facing"
    for segment in SEGMENTS:
        assert same(alignment.mounting[segment], mounting[segment]) < 1e-6
        assert alignment.heading[segment] == 0.0


@pytest.mark.parametrize("name", POSES)
@given(
    mountings=st.lists(rotations(), min_size=7, max_size=7),
    own=st.lists(headings, min_size=7, max_size=7),
    sternum=st.booleans(),
)
@settings(max_examples=20, deadline=None)
def test_six_axis_sensors_with_any_heading_are_brought_into_one_world(name, mountings, own, sternum) -> None:
    pose = pose_orientations(name, POSES[name])
    chosen = SEGMENTS if sternum else SEGMENTS[1:]
    mounting = dict(zip(chosen, mountings, strict=False))
    heading = dict(zip(chosen, own, strict=False))
    sensors = {
        s: sensor(q, mounting[s], magnetometer=False)
        for s, q in standing(pose, 0.0, mounting, heading).items()
    }
    alignment = align(sensors, pose)
    assert alignment.forward == ("sternum" if sternum else "mounting")
    assert not alignment.assumed
    for segment in chosen:
        assert same(alignment.mounting[segment], mounting[segment]) < 1e-6
        turned = rotation.wrap(alignment.heading[segment] + heading[segment])
        assert abs(float(turned)) < 1e-6
        assert alignment.scores[f"from_nominal_deg_{segment}"] < 1e-4


@given(
    tilt=st.floats(-0.25, 0.25), twist=st.floats(-0.3, 0.3), own=st.lists(headings, min_size=3, max_size=3)
)
@settings(max_examples=30, deadline=None)
def test_a_strap_some_degrees_off_its_nominal_mounting_costs_heading_only(tilt, twist, own) -> None:
    """The pose gives the tilt exactly, whatever the nominal mounting says; the twist about the vertical of a
    hanging arm is not told from a heading without a magnetometer."""
    off = rotation.multiply(rotation.about(0, tilt), rotation.about(1, twist))
    mounting = dict.fromkeys(RIGHT_ARM, off)
    stood = standing(NEUTRAL, 0.0, mounting, dict(zip(RIGHT_ARM, own, strict=True)))
    sensors = {s: sensor(q, rotation.IDENTITY, magnetometer=False) for s, q in stood.items()}
    alignment = align(sensors, NEUTRAL)
    for segment in RIGHT_ARM:
        up_in_sensor = rotation.rotate(rotation.inverse(off), [0.0, 1.0, 0.0])
        up = rotation.rotate(alignment.mounting[segment], up_in_sensor)
        assert up == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
        assert same(alignment.mounting[segment], off) <= np.hypot(tilt, twist) + 0.02


# -- headings are fixed from the left ----------------------------------------------------------------------


def later_angles(alignment: Alignment, flexion: float, own_heading: dict[str, float], mounting):
    theta = np.zeros(7)
    theta[3] = flexion
    pose = dict(zip(RIGHT_ARM, joint_orientations(theta, "right"), strict=True))
    stood = standing(pose, 0.0, mounting, own_heading)
    in_trunk = []
    for segment in RIGHT_ARM:
        q = rotation.multiply(rotation.about(2, alignment.heading[segment]), stood[segment])
        q = rotation.multiply(q, rotation.inverse(alignment.mounting[segment]))
        in_trunk.append(rotation.multiply(rotation.inverse(alignment.world_from_trunk), q))
    angles = joint_angles(*between(SegmentOrientations(*in_trunk)), "right")
    return {name: float(np.degrees(angles[INDEX[name]])) for name in ("elbow_flexion", "isb_carrying")}


@pytest.mark.parametrize("nominal", [True, False])
def test_a_flexion_stays_a_flexion_only_when_the_heading_is_fixed_before_the_mounting(nominal: bool) -> None:
    own = {"upper_arm_r": 0.4, "forearm_r": -1.0, "hand_r": 2.0}
    random = np.random.default_rng(8)
    mounting = {s: rotation.normalize(random.normal(size=4)) for s in RIGHT_ARM}
    sensors = {
        s: sensor(q, mounting[s] if nominal else None, magnetometer=False)
        for s, q in standing(NEUTRAL, 0.0, mounting, own).items()
    }
    alignment = align(sensors, NEUTRAL)
    angles = later_angles(alignment, np.radians(80.0), own, mounting)
    if nominal:
        assert angles["elbow_flexion"] == pytest.approx(80.0, abs=1e-6)
        assert angles["isb_carrying"] == pytest.approx(0.0, abs=1e-6)
    else:  # the mounting took the heading: the pose looks right, every turn after it is about a wrong axis
        assert alignment.assumed == set(RIGHT_ARM)
        assert abs(angles["isb_carrying"]) > 45.0


def test_the_flexion_axis_brings_a_six_axis_forearm_home_without_a_nominal_mounting() -> None:
    own = {"upper_arm_r": 0.4, "forearm_r": -1.0, "hand_r": 2.0}
    random = np.random.default_rng(3)
    mounting = {s: rotation.normalize(random.normal(size=4)) for s in RIGHT_ARM}
    sensors = {
        s: sensor(q, None if s == "forearm_r" else mounting[s], magnetometer=False)
        for s, q in standing(NEUTRAL, 0.0, mounting, own).items()
    }
    axis = rotation.rotate(rotation.about(2, own["forearm_r"]), np.array([1.0, 0.0, 0.0]))
    alignment = align(sensors, NEUTRAL, elbow_axis={"forearm_r": axis})
    assert alignment.forward == "elbow"
    assert not alignment.assumed
    angles = later_angles(alignment, np.radians(80.0), own, mounting)
    assert angles["elbow_flexion"] == pytest.approx(80.0, abs=1e-6)
    assert angles["isb_carrying"] == pytest.approx(0.0, abs=1e-6)


# -- poses and what is said of them ------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["right", "left"])
def test_poses_are_those_of_the_arm_model(side) -> None:
    upper_arm, forearm, hand = (pose_orientations("table", {})[s] for s in arm_segments(side))
    assert same(upper_arm, TRUNK_FROM_NEUTRAL) < 1e-12
    assert rotation.rotate(forearm, [0.0, -1.0, 0.0]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert rotation.rotate(forearm, [1.0, 0.0, 0.0]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)  # thumb
    assert same(hand, forearm) < 1e-12
    for segment in SEGMENTS:
        assert same(pose_orientations("n-pose", {})[segment], TRUNK_FROM_NEUTRAL) < 1e-12


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    "name", ["shoulder_flexion", "elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation"]
)
def test_a_given_pose_has_the_clinical_angles_that_were_given(name, side) -> None:
    pose = pose_orientations("given", {name: 25.0})
    joints = between(SegmentOrientations(*(pose[s] for s in arm_segments(side))))
    angles = np.degrees(joint_angles(*joints, side))
    assert angles[INDEX[name]] == pytest.approx(25.0, abs=1e-9)


def test_an_unknown_angle_of_a_given_pose_is_named_with_those_that_are_known() -> None:
    with pytest.raises(ValueError, match=r"'knee_flexion'.*elbow_flexion"):
        pose_orientations("given", {"knee_flexion": 3.0})


def test_scores_tell_the_sway_and_a_sensor_the_wrong_way_round_is_named() -> None:
    q = rotation.multiply(rotation.about(1, np.pi), TRUNK_FROM_NEUTRAL)
    alignment = align({"forearm_l": sensor(q, rotation.IDENTITY, sway=0.1)}, NEUTRAL, facing_deg=0.0)
    assert alignment.scores["sway_deg_forearm_l"] == pytest.approx(np.degrees(0.1) * np.sqrt(0.5), abs=1e-6)
    assert alignment.scores["from_nominal_deg_forearm_l"] == pytest.approx(180.0, abs=1e-6)
    (said,) = (
        w for w in alignment.warnings if w.startswith("the sensor on the left forearm is turned by 180")
    )
    assert "or the arm was not in the pose" in said


def test_a_heading_that_nothing_ties_is_named_in_a_warning() -> None:
    sensors = {
        "upper_arm_r": sensor(TRUNK_FROM_NEUTRAL, rotation.IDENTITY, magnetometer=False),
        "forearm_r": sensor(TRUNK_FROM_NEUTRAL, None, magnetometer=False),
    }
    alignment = align(sensors, NEUTRAL)
    assert alignment.assumed == {"forearm_r"}
    (warning,) = alignment.warnings
    assert warning.startswith("heading of forearm_r is assumed against upper_arm_r: ")
    assert "so elbow angles can be far off" in warning


def test_a_heading_of_the_sternum_alone_is_said_to_touch_the_shoulders_alone() -> None:
    tied = [{"upper_arm_r", "forearm_r"}, {"upper_arm_l", "forearm_l"}]
    segments = {"sternum", *tied[0], *tied[1]}
    (warning,) = warnings_for("elbow", segments, {"sternum"}, tied, {})
    assert warning.startswith("heading of sternum is assumed against upper_arm_l and upper_arm_r: ")
    assert "so shoulder and trunk angles" in warning
    assert "elbow" not in warning


def test_one_sensor_has_no_other_to_be_tied_to() -> None:
    for segment, what in (("upper_arm_r", "planes of movement"), ("hand_r", "where it points")):
        alignment = align({segment: sensor(TRUNK_FROM_NEUTRAL, None, magnetometer=False)}, NEUTRAL)
        (warning,) = alignment.warnings
        assert f"the heading of {segment} against the trunk is assumed, and {what}" in warning


def test_magnetometers_tie_sensors_to_one_another_though_not_to_the_trunk() -> None:
    (warning,) = case().warnings
    assert "heading of forearm_r and upper_arm_r against the trunk" in warning


def test_a_wrist_whose_heading_is_known_says_nothing_of_the_elbow() -> None:
    segments = ("upper_arm_r", "forearm_r", "hand_r")
    (first, second) = warnings_for("none", segments, segments, [{"forearm_r", "hand_r"}], {})
    assert first.startswith("no rule says where forward is")
    assert "heading of forearm_r is assumed against upper_arm_r" in second


def test_an_alignment_comes_back_from_its_state() -> None:
    alignment = case("mounting")
    again = Alignment.from_state(alignment.state())
    assert again.state() == alignment.state()
    assert again.assumed == alignment.assumed
