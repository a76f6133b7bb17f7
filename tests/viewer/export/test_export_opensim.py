"""OpenSim's own tools on our files: inverse kinematics of orientations, forward kinematics of angles."""

import importlib
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brachium import bench_exports
from brachium.export_readers.opensim import read_mot
from brachium_body.angles import COLUMNS, joint_angles
from brachium_body.kinematics import JOINTS, TRUNK_FROM_THORAX, between, joint_orientations, positions
from brachium_body.lengths import from_height
from brachium_body.segments import SIDES, arm_segments, suffix
from brachium_viewer.export import formats, opensim
from brachium_viewer.export.about import about
from brachium_wire.table import Table

if sys.platform != "linux" or platform.machine() != "x86_64" or sys.version_info >= (3, 14):
    pytest.skip("OpenSim has no wheel for this machine", allow_module_level=True)
osim: Any = importlib.import_module("opensim")
osim.Logger.setLevelString("error")

HEIGHT_M = 1.80
LENGTHS = from_height(HEIGHT_M)
THUMB_FORWARD_DEG = 90.0
"""The model's pro_sup with the palm facing the thigh."""


def arm_model() -> Any:
    """Torso and, on both sides, humerus, radius and hand, named, zeroed and signed as in Rajagopal 2016."""
    model = osim.Model()
    model.setName("arms")
    torso = body(model, "torso")
    model.addJoint(osim.WeldJoint("ground_torso", model.getGround(), torso))
    for end, mirror in (("r", 1.0), ("l", -1.0)):
        quarter = mirror * np.pi / 2.0
        x, y, z = (0.0, quarter, 0.0), (-quarter, 0.0, 0.0), (0.0, 0.0, 0.0)
        outwards = (0.0, 0.0, mirror * LENGTHS.chest_to_shoulder)
        below = ((0.0, -length, 0.0) for length in (LENGTHS.upper_arm, LENGTHS.forearm))
        flexed = pin(model, torso, "flexed", f"arm_flex_{end}", z, outwards)
        added = pin(model, flexed, "added", f"arm_add_{end}", x)
        humerus = pin(model, added, "humerus", f"arm_rot_{end}", y)
        ulna = pin(model, humerus, "ulna", f"elbow_flex_{end}", z, next(below))
        radius = pin(model, ulna, "radius", f"pro_sup_{end}", y, default_deg=THUMB_FORWARD_DEG)
        bent = pin(model, radius, "bent", f"wrist_flex_{end}", z, next(below))
        pin(model, bent, "hand", f"wrist_dev_{end}", x)
    model.finalizeConnections()
    return model


def pin(
    model: Any,
    parent: Any,
    name: str,
    coordinate: str,
    axis: tuple[float, float, float],
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    default_deg: float = 0.0,
) -> Any:
    """Hang a body on another; `axis` (about X, then Y, rad) lays Z, about which pins turn, along the axis."""
    child = body(model, f"{name}_{coordinate[-1]}")
    orientation = osim.Vec3(*axis)
    joint = osim.PinJoint(
        f"at_{coordinate}", parent, osim.Vec3(*at), orientation, child, osim.Vec3(0), orientation
    )
    joint.updCoordinate().setName(coordinate)
    joint.updCoordinate().setDefaultValue(float(np.radians(default_deg)))
    model.addJoint(joint)
    return child


def body(model: Any, name: str) -> Any:
    made = osim.Body(name, 1.0, osim.Vec3(0), osim.Inertia(1, 1, 1))
    model.addBody(made)
    return made


@pytest.fixture(scope="module")
def model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "arms.osim"
    arm_model().printToXML(str(path))
    return path


def test_opensense_finds_our_angles_in_our_orientations(model_file: Path, tmp_path: Path):
    """Of error-free sensors: the model has no carrying angle and no twist of the wrist to put errors into."""
    bench_exports.write_capture(tmp_path / "capture", "drinking", "exact")
    result = bench_exports.solved(tmp_path / "capture")
    sto = tmp_path / "arm.sto"
    formats.export(result, sto, formats.Wish(to="sto", from_s=3.0, until_s=7.5), "test")
    placer = osim.IMUPlacer()
    placer.set_model_file(str(model_file))
    placer.set_orientation_file_for_calibration(str(sto))
    placer.set_sensor_to_opensim_rotations(osim.Vec3(0))
    placer.set_base_imu_label("torso_imu")
    placer.set_base_heading_axis("x")
    assert placer.run(False)
    placed = tmp_path / "placed.osim"
    placer.getCalibratedModel().printToXML(str(placed))
    solver = osim.IMUInverseKinematicsTool()
    solver.set_model_file(str(placed))
    solver.set_orientations_file(str(sto))
    solver.set_sensor_to_opensim_rotations(osim.Vec3(0))
    solver.set_results_directory(str(tmp_path))
    solver.set_time_range(0, 3.0)
    solver.set_time_range(1, 7.48)
    assert solver.run(False)
    (solved,) = tmp_path.glob("ik_*.mot")
    found = read_mot(solved)
    rows = slice(150, 150 + len(found.time_s))
    np.testing.assert_allclose(found.time_s, result.columns["time"][rows], atol=1e-6)
    apart = {n: np.abs(v - result.columns[n][rows]).max() for n, v in found.angles_deg.items()}
    assert len(apart) == 14
    assert all(np.ptp(v) > 5.0 for n, v in found.angles_deg.items() if "deviation" not in n)
    assert max(apart.values()) < 1.0, apart


def posed(theta: np.ndarray) -> tuple[Table, dict[str, np.ndarray]]:
    """Return the table of arms at model angles theta (n, 7) rad, and joint centres (n, 4, 3) m by side."""
    n = len(theta)
    columns: dict[str, np.ndarray] = {"time": np.arange(n) / 50.0}
    places = {}
    for side in SIDES:
        segments = joint_orientations(theta, side)
        angles = np.degrees(joint_angles(*between(segments), side))
        columns |= {f"{name}{suffix(side)}": angles[:, i] for i, name in enumerate(COLUMNS)}
        for segment, q in zip(arm_segments(side), segments, strict=True):
            columns |= {f"{segment}_q{part}": q[:, i] for i, part in enumerate("wxyz")}
        places[side] = positions(*segments, LENGTHS, side)
    return Table(columns, {}, {"origin": "emulated"}), places


def test_each_coordinate_goes_the_right_way(model_file: Path, tmp_path: Path):
    steps = np.radians(10.0) * np.eye(7)
    rng = np.random.default_rng(3)
    anywhere = np.radians(
        rng.uniform([-40, -70, -60, 0, -80, -20, -60], [80, 20, 60, 140, 80, 25, 60], (25, 7))
    )
    bent = np.radians([0, 0, 0, 90, 0, 0, 0])
    theta = np.concatenate([np.zeros((1, 7)), steps, bent + steps, anywhere])
    table, places = posed(theta)
    mot = tmp_path / "arm.mot"
    formats.export(table, mot, formats.Wish(to="mot"), "test")
    model = osim.Model(str(model_file))
    state = model.initSystem()
    read = osim.TimeSeriesTable(str(mot))
    labels = list(read.getColumnLabels())
    assert len(labels) == 14
    for row in range(len(theta)):
        values = read.getRowAtIndex(row)
        for i, label in enumerate(labels):
            model.updCoordinateSet().get(label).setValue(state, float(np.radians(values.getElt(0, i))), False)
        model.realizePosition(state)
        for side in SIDES:
            end = side[0]
            stations = [("humerus", 0.0), ("radius", 0.0), ("hand", 0.0), ("hand", -LENGTHS.hand)]
            for joint, (name, y), ours in zip(JOINTS, stations, places[side][row], strict=True):
                found = (
                    model.getBodySet()
                    .get(f"{name}_{end}")
                    .findStationLocationInGround(state, osim.Vec3(0, y, 0))
                )
                theirs = np.array([found.get(2), found.get(0), found.get(1)])
                assert np.abs(theirs - ours).max() < 1e-3, (row, side, joint, theirs, ours)


def test_ten_degrees_of_each_clinical_angle_move_the_arm_as_its_name_says():
    bent = np.radians([0, 0, 0, 90, 0, 0, 0])
    theta = np.concatenate([bent[None], bent + np.radians(10.0) * np.eye(7)])
    _, places = posed(theta)
    for side, outwards in (("right", 1.0), ("left", -1.0)):
        elbow, wrist = (places[side][:, i] - places[side][0, i] for i in (1, 2))
        assert elbow[1, 1] > 0.03  # flexion: the elbow forward
        assert outwards * elbow[2, 0] < -0.03  # adduction: towards the trunk
        assert outwards * wrist[3, 0] < -0.03  # internal rotation: the hand before the belly
        assert wrist[4, 2] > 0.03  # elbow flexion: the hand up


def test_orientations_are_those_of_the_bodies_in_a_level_ground():
    table, _ = posed(np.zeros((3, 7)))
    motion = formats.prepared(table, formats.Wish(to="sto"), "test")
    turns = opensim.orientations(motion)
    assert list(turns) == [
        *("torso_imu", "humerus_r_imu", "radius_r_imu", "hand_r_imu"),
        *("humerus_l_imu", "radius_l_imu", "hand_l_imu"),
    ]
    palm_in = {"r": [np.sqrt(0.5), 0, np.sqrt(0.5), 0], "l": [np.sqrt(0.5), 0, -np.sqrt(0.5), 0]}
    for name, q in turns.items():
        turned = name.startswith(("radius", "hand"))
        expected = palm_in[name.split("_")[1]] if turned else [1.0, 0, 0, 0]
        assert np.abs(np.abs(q @ np.array(expected)) - 1.0).max() < 1e-12, name


def test_headers_tell_origin_units_and_that_it_is_no_device(result: Table, tmp_path: Path):
    for to in ("sto", "mot"):
        path = tmp_path / f"arm.{to}"
        formats.export(result, path, formats.Wish(to=to), "test")
        head = path.read_text().partition("endheader")[0]
        assert "not a medical device" in head
        assert '"origin": "playback"' in head
        assert ("inDegrees=yes" in head) == (to == "mot")
    assert about(result, "test")["origin"] == "playback"
    assert TRUNK_FROM_THORAX.tolist() == [0.5] * 4
