import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from brachium_body import angles, kinematics, rotation

REST = rotation.IDENTITY
NOT_KNOWN = np.full(4, np.nan)
SIDES = ("right", "left")


def column(found, name):
    return found[..., angles.INDEX[name]]


def shoulder(q, side="right"):
    return angles.joint_angles(q, NOT_KNOWN, NOT_KNOWN, side)


def raised(plane, elevation, axial_of_isb):
    """A right upper arm by ISB's definition, Y-X-Y with negative elevation."""
    turns = np.stack(np.broadcast_arrays(plane, -np.asarray(elevation), axial_of_isb), axis=-1)
    return np.roll(Rotation.from_euler("YXY", turns).as_quat(), 1, axis=-1)


def posed(side, **degrees):
    theta = np.zeros(7)
    for name, value in degrees.items():
        theta[int(name[-1]) - 1] = np.radians(value)
    return angles.joint_angles(*kinematics.joint_rotations(theta, side), side)


def test_columns_are_the_stated_ones_in_their_order():
    assert " ".join(angles.COLUMNS) == (
        "theta1 theta2 theta3 theta4 theta5 theta6 theta7 shoulder_flexion shoulder_abduction "
        "shoulder_rotation elbow_flexion forearm_pronation wrist_flexion wrist_deviation isb_plane "
        "isb_elevation isb_axial isb_elbow_flexion isb_carrying isb_pronation trunk_flexion trunk_lateral "
        "trunk_rotation clavicle_protraction clavicle_elevation"
    )
    groups = (angles.SHOULDER, angles.ELBOW, angles.WRIST, angles.TRUNK, angles.CLAVICLE)
    assert sorted(name for group in groups for name in group) == sorted(angles.COLUMNS)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("name", "pose"),
    [
        ("shoulder_flexion", {"theta1": 20}),
        ("shoulder_abduction", {"theta2": -20}),
        ("shoulder_rotation", {"theta3": 20}),
        ("elbow_flexion", {"theta4": 20}),
        ("forearm_pronation", {"theta5": 20}),
        ("wrist_flexion", {"theta7": 20}),
        ("wrist_deviation", {"theta6": -20}),
    ],
)
def test_one_joint_turned_is_one_clinical_angle_on_both_sides(side, name, pose):
    found = posed(side, **pose)
    for other in angles.CLINICAL:
        assert column(found, other) == pytest.approx(np.radians(20) if other == name else 0.0, abs=1e-12)


def test_neutral_is_zero_but_for_isbs_own_zero_of_pronation():
    found = posed("left")
    assert column(found, "isb_pronation") == pytest.approx(np.pi / 2)
    rest = [name for name in angles.COLUMNS[:20] if name != "isb_pronation"]
    assert all(column(found, name) == 0.0 for name in rest)


@given(st.floats(-3.1, 3.1), st.floats(0.01, 3.1), st.floats(-3.1, 3.1))
def test_shoulder_columns_follow_from_isbs_plane_elevation_and_axial(plane, elevation, axial):
    found = shoulder(raised(plane, elevation, axial))
    assert column(found, "isb_elevation") == pytest.approx(elevation, abs=1e-9)
    assert abs(rotation.wrap(column(found, "isb_plane") - plane)) < 1e-9
    assert abs(rotation.wrap(column(found, "isb_axial") - axial)) < 1e-9
    assert column(found, "shoulder_flexion") == pytest.approx(elevation * np.sin(plane), abs=1e-9)
    assert column(found, "shoulder_abduction") == pytest.approx(elevation * np.cos(plane), abs=1e-9)
    assert abs(rotation.wrap(column(found, "shoulder_rotation") - plane - axial)) < 1e-9


def test_planes_of_elevation_are_isbs():
    flexed, abducted = posed("right", theta1=60), posed("left", theta2=-60)
    assert np.degrees(column(flexed, "isb_plane")) == pytest.approx(90)
    assert np.degrees(column(flexed, "isb_axial")) == pytest.approx(-90)  # ISB's quirk: not turned at all
    assert np.degrees(column(abducted, "isb_plane")) == pytest.approx(0, abs=1e-9)
    assert np.degrees(column(posed("right", theta1=-30), "shoulder_flexion")) == pytest.approx(
        -30
    )  # extension
    assert np.degrees(column(posed("right", theta2=20), "shoulder_abduction")) == pytest.approx(
        -20
    )  # adduction


@given(st.floats(-1e-6, 1e-6), st.floats(-1e-6, 1e-6), st.floats(-1.5, 1.5))
def test_rotation_is_well_defined_while_hanging(swing_x, swing_z, twist):
    swing = rotation.from_rotation_vector([swing_x, 0.0, swing_z])
    found = shoulder(rotation.multiply(swing, rotation.about(1, twist)))
    assert column(found, "shoulder_rotation") == pytest.approx(twist, abs=1e-9)
    assert column(found, "shoulder_flexion") == pytest.approx(swing_z, abs=1e-12)
    assert column(found, "shoulder_abduction") == pytest.approx(-swing_x, abs=1e-12)
    assert column(found, "isb_elevation") == pytest.approx(np.hypot(swing_x, swing_z), abs=1e-12)


def test_straight_up_is_finite_and_180():
    found = shoulder(rotation.from_rotation_vector([-np.pi, 0.0, 0.0]))
    assert np.degrees(column(found, "isb_elevation")) == pytest.approx(180)
    assert np.isfinite(found[:3]).all()


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("plane", [0, 5, 10, 35, 60, 90])
@pytest.mark.parametrize("noise_deg", [0.0, 0.3])
def test_an_arm_raised_in_one_plane(side, plane, noise_deg):
    time = np.arange(0.0, 3.0, 1.0 / 50.0)
    elevation = np.radians(75.0 - 75.0 * np.cos(2.0 * np.pi * time / 3.0))
    direction = np.array([-np.cos(np.radians(plane)), 0.0, np.sin(np.radians(plane))])
    q = rotation.from_rotation_vector(elevation[:, None] * direction)
    jitter = np.random.default_rng(plane).normal(0.0, np.radians(noise_deg) / np.sqrt(3.0), (len(time), 3))
    q = rotation.multiply(q, rotation.from_rotation_vector(jitter))
    q = rotation.mirror(q) if side == "left" else q
    found = angles.joint_angles(q, REST, REST, side)
    clinical = found[:, [angles.INDEX[name] for name in angles.CLINICAL]]
    assert np.degrees(np.abs(np.diff(clinical, axis=0))).max() < 5.0
    if noise_deg == 0.0:
        assert np.abs(column(found, "isb_elevation") - elevation).max() < 1e-9
        assert np.abs(column(found, "shoulder_rotation")).max() < 1e-6
        assert np.abs(column(found, "shoulder_flexion") - elevation * np.sin(np.radians(plane))).max() < 1e-9


def test_a_scapular_raise_is_named_by_its_elevation_not_by_theta2():
    elevation = np.radians(np.arange(0.0, 151.0))
    found = shoulder(raised(np.radians(35), elevation, np.radians(-35)))
    assert np.degrees(-column(found, "theta2")).max() == pytest.approx(55.0)
    size = np.hypot(column(found, "shoulder_flexion"), column(found, "shoulder_abduction"))
    assert np.abs(size - elevation).max() < 1e-9


def test_thetas_and_the_elbow_are_scipys_cardan_angles():
    q = rotation.normalize(np.random.default_rng(20).normal(size=(500, 4)))
    expected = Rotation.from_quat(np.roll(q, -1, axis=-1)).as_euler("ZXY")
    found = angles.joint_angles(q, q, q, "right")
    assert np.abs(rotation.wrap(found[:, :3] - expected)).max() < 1e-9
    elbow = [angles.INDEX[name] for name in ("elbow_flexion", "isb_carrying", "forearm_pronation")]
    assert np.abs(rotation.wrap(found[:, elbow] - expected)).max() < 1e-9
    assert np.abs(rotation.wrap(column(found, "isb_pronation") - expected[:, 2] - np.pi / 2)).max() < 1e-9
    assert np.abs(column(found, "wrist_flexion") - column(found, "theta7")).max() == 0.0
    assert np.abs(column(found, "wrist_deviation") + column(found, "theta6")).max() == 0.0


@pytest.mark.parametrize("side", SIDES)
def test_valgus_is_negative_on_both_sides(side):
    segments = kinematics.joint_orientations(np.zeros(7), side, carrying=np.radians(-12))
    distal = rotation.rotate(segments.trunk_from_forearm, [0.0, -1.0, 0.0])
    assert distal[0] * (1 if side == "right" else -1) > 0.2  # the forearm points away from the body
    found = angles.joint_angles(*kinematics.between(segments), side)
    assert np.degrees(column(found, "isb_carrying")) == pytest.approx(-12)


def test_mirror_law():
    q = rotation.normalize(np.random.default_rng(21).normal(size=(3, 300, 4)))
    right = angles.joint_angles(*q, "right")
    assert np.allclose(angles.joint_angles(*rotation.mirror(q), "left"), right, atol=1e-14, equal_nan=True)
    left = np.arange(300) % 2 == 0
    mixed = np.where(left[:, None], rotation.mirror(q), q)
    assert np.allclose(angles.joint_angles(*mixed, left), right, atol=1e-14, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "direction"),
    [("trunk_flexion", (0, 1)), ("trunk_lateral", (0, 0)), ("trunk_rotation", (1, 0))],
)
@pytest.mark.parametrize("side", SIDES)
def test_trunk_angles_lean_forward_right_and_turn_left(name, direction, side):
    turn = {"trunk_flexion": (2, -15), "trunk_lateral": (0, 15), "trunk_rotation": (1, 15)}[name]
    thorax = rotation.about(turn[0], np.radians(turn[1]))
    in_trunk = rotation.multiply(
        rotation.multiply(kinematics.TRUNK_FROM_THORAX, thorax),
        rotation.inverse(kinematics.TRUNK_FROM_THORAX),
    )
    probe = [0.0, 0.0, 1.0] if direction[0] == 0 else [0.0, 1.0, 0.0]  # the neck, or where the chest faces
    moved = rotation.rotate(in_trunk, probe)
    sign = -1.0 if name == "trunk_rotation" else 1.0  # left is negative x
    assert moved[direction[1]] * sign == pytest.approx(np.sin(np.radians(15)))
    found = angles.joint_angles(REST, REST, REST, side, calibration_from_thorax=thorax)
    for other in angles.TRUNK:
        assert column(found, other) == pytest.approx(np.radians(15) if other == name else 0.0, abs=1e-12)


@pytest.mark.parametrize(("side", "outward"), [("right", 1.0), ("left", -1.0)])
def test_clavicle_angles_turn_the_line_from_chest_to_shoulder(side, outward):
    def found(shift):
        return np.degrees(angles.clavicle_angles(shift, 0.2, side))

    assert np.allclose(found([0.0, 0.2, 0.0]), [45.0, 0.0])
    assert np.allclose(found([0.0, 0.0, 0.2]), [0.0, 45.0])
    assert np.allclose(found([0.2 * outward, 0.4, 0.0]), [45.0, 0.0])
    assert np.allclose(found([0.1 * outward, 0.4, 0.5]), [np.degrees(np.arctan2(4, 3)), 45.0])
    full = angles.joint_angles(REST, REST, REST, side, shoulder_shift=[0, 0.2, 0], chest_to_shoulder=0.2)
    assert np.degrees(column(full, "clavicle_protraction")) == pytest.approx(45)


def test_what_is_not_known_is_empty_and_nothing_else():
    found = angles.joint_angles(REST, NOT_KNOWN, REST, "right")
    empty = {name for name in angles.COLUMNS if np.isnan(column(found, name))}
    assert empty == {*angles.ELBOW, *angles.TRUNK, *angles.CLAVICLE}
    rows = angles.joint_angles(np.stack([REST, NOT_KNOWN]), REST, REST, "left")
    assert not np.isnan(rows[0, :20]).any()
    assert {name for name in angles.COLUMNS[:20] if np.isnan(column(rows[1], name))} == set(angles.SHOULDER)


def test_one_arm_equals_many():
    q = rotation.normalize(np.random.default_rng(22).normal(size=(4, 60, 4)))
    left = np.arange(60) % 3 == 0
    many = angles.joint_angles(*q[:3], left, calibration_from_thorax=q[3])
    for i in range(60):
        side = "left" if left[i] else "right"
        one = angles.joint_angles(*q[:3, i], side, calibration_from_thorax=q[3, i])
        assert np.allclose(one, many[i], atol=1e-13, equal_nan=True)
    shaped = angles.joint_angles(*q[:3].reshape(3, 5, 12, 4), left.reshape(5, 12))
    assert np.allclose(shaped.reshape(60, -1)[:, :20], many[:, :20], atol=1e-14)
