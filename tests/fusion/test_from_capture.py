"""Capture folders with known motion: what calibrates them, their rates and gaps, and the table."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from brachium_body import rotation
from brachium_body.angles import COLUMNS
from brachium_body.segments import arm_segments
from brachium_fusion.capture_batches import batches, numbers
from brachium_fusion.solve import SolveError, SolveSettings, run
from brachium_wire import table
from brachium_wire.capture import CaptureSegment, load

RATE = 100.0
UP = np.array([0.0, 0.0, 9.81])
FIELD = np.array([0.0, 23.0, -40.0])


def flexing(seconds: float) -> np.ndarray:
    """Return model angles (n, 7) rad: hanging for 4 s, then the elbow flexes 0 to 90 deg and back."""
    t = np.arange(round(seconds * RATE)) / RATE
    theta = np.zeros((len(t), 7))
    theta[:, 3] = np.where(t > 4.0, np.radians(45.0) * (1.0 - np.cos(2.0 * np.pi * 0.4 * (t - 4.0))), 0.0)
    return theta


def measured(quats) -> dict[str, np.ndarray]:
    turns = Rotation.from_quat(np.roll(quats, -1, axis=-1))
    step = (turns[:-1].inv() * turns[1:]).as_rotvec() * RATE
    inverse = turns.inv()
    blocks = {"g": np.vstack([step[:1], step]), "a": inverse.apply(UP), "m": inverse.apply(FIELD)}
    return {f"{name}{axis}": block[:, i] for name, block in blocks.items() for i, axis in enumerate("xyz")}


def capture_folder(
    path, made, *, toml="", sides=("right",), seconds=12.0, facing=0.0, mounting=None, edit=None
):
    path.mkdir()
    (path / "capture.toml").write_text(toml)
    theta = flexing(seconds)
    t = np.arange(len(theta)) / RATE + 100.0
    for side in sides:
        for segment, pose in made.arm_poses(theta, side).items():
            q = rotation.multiply(rotation.about(2, -facing), pose)
            q = rotation.multiply(q, (mounting or {}).get(segment, rotation.IDENTITY))
            columns = {"t": t} | measured(q)
            if edit is not None:
                columns = edit(segment, columns)
            table.write(path / f"{segment}.csv", columns, {}, {})
    return path


POSE = '[calibration]\npose = "n-pose"\nfrom_s = 0.5\nto_s = 3.5\n'
FLEXION = '[[calibration.functional]]\nmotion = "elbow-flexion"\nfrom_s = 4.0\nto_s = 11.0\n'


def elbow_error_deg(report) -> float:
    truth = np.degrees(flexing(12.0)[:, 3])
    errors = [
        np.degrees(s.angles["elbow_flexion"]) - truth[round((s.time_ns * 1e-9 - ZERO_S) * RATE)]
        for s in report.skeletons
        if "elbow_flexion" in s.angles
    ]
    assert len(errors) > 800
    return float(np.sqrt(np.mean(np.square(errors[50:]))))


ZERO_S = 1_000_000_000_000_000 * 1e-9 + 100.0


def test_a_pose_and_facing_solve_any_mounting(made, tmp_path) -> None:
    random = np.random.default_rng(1)
    mounting = {s: made.random_rotation(random) for s in arm_segments("right")}
    folder = capture_folder(
        tmp_path / "c", made, toml=f"facing_deg = {np.degrees(0.8)}\n{POSE}", mounting=mounting, facing=0.8
    )
    report = run(SolveSettings(input=folder))
    assert report.forward == "facing"
    assert report.drops == {}
    assert report.rows == 1200
    assert elbow_error_deg(report) < 1.0


@pytest.mark.parametrize("facing", [0.0, 1.3, -2.5])
def test_a_functional_elbow_flexion_says_where_forward_is(made, tmp_path, facing) -> None:
    random = np.random.default_rng(2)
    mounting = {s: made.random_rotation(random) for s in arm_segments("right")}
    folder = capture_folder(tmp_path / "c", made, toml=POSE + FLEXION, mounting=mounting, facing=facing)
    report = run(SolveSettings(input=folder))
    assert report.forward == "elbow"
    assert elbow_error_deg(report) < 1.5
    forward = rotation.rotate(rotation.inverse(report.skeletons[-1].trunk_from_world), [0.0, 1.0, 0.0])
    off = rotation.wrap(np.arctan2(forward[0], forward[1]) - facing)
    assert abs(np.degrees(off)) < 3.0


def test_without_calibration_it_says_so_and_solves(made, tmp_path) -> None:
    report = run(SolveSettings(input=capture_folder(tmp_path / "c", made, seconds=5.0)))
    assert any("no calibration" in w for w in report.warnings)
    assert set(report.quality["forearm_r"]) == {"uncalibrated"}


def test_starts_rates_gaps_and_rows_without_numbers(made, tmp_path) -> None:
    def edit(segment, columns):
        keep = np.ones(len(columns["t"]), dtype=bool)
        if segment == "forearm_r":
            keep[:50] = False  # begins half a second later
            keep[600:606] = False  # 60 ms are held
            keep[800:890] = False  # 900 ms: held for as long as live, then missing
        if segment == "hand_r":
            keep[1::2] = False  # 50 Hz
            columns = columns | {"ax": np.where(np.arange(len(keep)) == 500, np.nan, columns["ax"])}
            columns |= {"mx": np.where(np.arange(len(keep)) % 3 == 0, columns["mx"], np.nan)}
        return {name: values[keep] for name, values in columns.items()}

    folder = capture_folder(tmp_path / "c", made, toml=f"facing_deg = 0\n{POSE}", edit=edit)
    out = tmp_path / "out.csv"
    report = run(SolveSettings(input=folder, out=out))
    columns = table.read(out).columns
    assert columns["time"] == pytest.approx(np.arange(1200) / RATE + 100.0)
    quality = columns["quality_forearm_r"]
    assert set(quality[601:605]) == {"held"}
    assert set(quality[802:888]) == {"held", "missing"}
    assert set(quality[875:888]) == {"missing"}
    assert set(quality[70:590]) == {"good"}
    assert np.isnan(columns["forearm_r_qw"][875:888]).all()
    assert np.isnan(columns["elbow_flexion"][875:888]).all()
    assert np.isnan(columns["forearm_r_qw"][:49]).all()
    assert any("hand_r: 1 row left out" in w for w in report.warnings)
    truth = np.degrees(flexing(12.0)[:, 3])
    there = np.isfinite(columns["elbow_flexion"]) & (columns["time"] < 108.0)
    assert np.abs(columns["elbow_flexion"] - truth)[there].max() < 3.0


def expected_columns(sides) -> list[str]:
    both = len(sides) > 1
    names = ["time"]
    segments = [s for side in sides for s in arm_segments(side)]
    names += [f"{s}_q{p}" for s in segments for p in "wxyz"]
    names += [f"{s}_sensor_q{p}" for s in segments for p in "wxyz"]
    for side in sides:
        end = f"_{side[0]}" if both else ""
        names += [f"{j}_{a}{end}" for j in ("shoulder", "elbow", "wrist", "hand") for a in "xyz"]
        names += [f"shoulder_shift_{a}{end}" for a in ("x", "y", "z", "sd_x", "sd_y", "sd_z")]
        names += [
            c if c.startswith("trunk_") else c + end
            for c in COLUMNS
            if not (c.startswith("trunk_") and side != sides[0])
        ]
    told = [f"{j}_angles" for j in ("shoulder", "elbow", "wrist", "clavicle")]
    told += [f"{j}_position" for j in ("shoulder", "elbow", "wrist", "hand")]
    ends = [f"_{side[0]}" for side in sides] if both else [""]
    names += [f"quality_{name}{end}" for end in ends for name in told]
    return names + [f"quality_{s}" for s in segments]


@pytest.mark.parametrize("sides", [("right",), ("right", "left")])
def test_the_table_has_the_columns_units_and_endings_of_the_design(made, tmp_path, sides) -> None:
    folder = capture_folder(tmp_path / "c", made, toml=f"facing_deg = 0\n{POSE}", sides=sides, seconds=5.0)
    run(SolveSettings(input=folder, out=tmp_path / "out.csv", rate_hz=20.0))
    result = table.read(tmp_path / "out.csv")
    assert list(result.columns) == expected_columns(sides)
    assert np.diff(result.columns["time"]) == pytest.approx(0.05)
    for name, unit in result.units.items():
        joint = name.removesuffix("_r").removesuffix("_l")
        wanted = "s" if name == "time" else "m" if joint[-2:] in ("_x", "_y", "_z") else "deg"
        assert unit == wanted, name
    text = (tmp_path / "out.csv").read_text().lower()
    assert "nan" not in text
    assert ",," in text  # what is not known is empty


def test_columns_are_chosen_by_group(made, tmp_path) -> None:
    folder = capture_folder(tmp_path / "c", made, seconds=3.0)
    run(SolveSettings(input=folder, out=tmp_path / "out.csv", groups=("clinical", "quality")))
    names = list(table.read(tmp_path / "out.csv").columns)
    told = [f"quality_{joint}_angles" for joint in ("shoulder", "elbow", "wrist")]
    assert names == ["time", *COLUMNS[7:14], *told, *(f"quality_{s}" for s in arm_segments("right"))]


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("mode", ["live", "best"])
def test_what_one_sensor_leaves_to_an_assumption_is_marked_and_named(made, tmp_path, ending, mode) -> None:
    folder = capture_folder(tmp_path / "c", made, toml=f"facing_deg = 0\n{POSE}", seconds=5.0)
    for segment in ("upper_arm_r", "hand_r"):
        (folder / f"{segment}.csv").unlink()
    out = tmp_path / f"out.{ending}"
    report = run(SolveSettings(input=folder, out=out, rate_hz=20.0, mode=mode))
    found = table.read(out)
    there = np.isfinite(found.columns["elbow_flexion"])
    assert there.sum() > 80
    assert set(found.columns["quality_elbow_angles"][there]) == {"assumed"}
    assert set(found.columns["quality_elbow_angles"][~there]) <= {""}
    assert set(found.columns["quality_wrist_position"][there]) == {"assumed"}
    assert set(found.columns["quality_forearm_r"][there]) == {"good"}
    assert "quality_shoulder_angles" not in found.columns
    why = "the upper arm hangs still, the hand is in line with the forearm"
    assert found.metadata["assumed"]["elbow_angles"] == report.assumptions["elbow_angles"] == why


def test_two_sensors_assume_nothing_of_the_elbow(made, tmp_path) -> None:
    folder = capture_folder(tmp_path / "c", made, toml=f"facing_deg = 0\n{POSE}", seconds=5.0)
    (folder / "hand_r.csv").unlink()
    report = run(SolveSettings(input=folder, out=tmp_path / "out.csv", rate_hz=20.0))
    assert "hand_position" in report.assumptions
    assert not any(name.endswith("_angles") for name in report.assumptions)
    found = table.read(tmp_path / "out.csv")
    assert set(found.columns["quality_elbow_angles"]) - {""} == {"good"}


def test_bad_input_is_one_line(tmp_path) -> None:
    with pytest.raises(SolveError, match="no such file or folder"):
        run(SolveSettings(input=tmp_path / "nothing"))
    with pytest.raises(SolveError, match="--rate must be"):
        run(SolveSettings(input=tmp_path, rate_hz=0.0))


def test_angles_of_joints_without_a_sensor_are_as_the_capture_states(made, tmp_path) -> None:
    folder = capture_folder(
        tmp_path / "c", made, toml=f"assumed_angles_deg = {{ elbow_flexion = 30 }}\n{POSE}"
    )
    for segment in ("forearm_r", "hand_r"):
        (folder / f"{segment}.csv").unlink()
    (skeleton, *_) = run(SolveSettings(input=folder, rate_hz=10.0)).skeletons
    upper, fore = (skeleton.positions[j] for j in ("elbow", "wrist"))
    assert np.degrees(np.arctan2(fore[1] - upper[1], upper[2] - fore[2])) == pytest.approx(30.0, abs=1.0)


def test_an_assumed_angle_that_no_arm_has_is_refused(made, tmp_path) -> None:
    folder = capture_folder(tmp_path / "c", made, toml="assumed_angles_deg = { knee_flexion = 30 }")
    with pytest.raises(ValueError, match="knee_flexion"):
        run(SolveSettings(input=folder, rate_hz=10.0))


def at_times(t) -> CaptureSegment:
    t = np.asarray(t, dtype=np.float64)
    return CaptureSegment(t=t, rate_hz=RATE, acc=np.tile(UP, (len(t), 1)), gyr=np.zeros((len(t), 3)))


def test_every_lost_sample_has_a_number_and_times_that_jitter_lose_none() -> None:
    there = np.setdiff1d(np.arange(100), [7, 20, 22, 40, 41, 42, 43, 44])
    assert numbers(at_times(there / RATE)).tolist() == there.tolist()
    late = np.arange(100) / RATE
    late[30] += 0.8 / RATE
    late[50] -= 0.8 / RATE
    assert numbers(at_times(late)).tolist() == list(range(100))
    slow = np.arange(5000) * 1.01 / RATE
    assert numbers(at_times(slow)).tolist() == list(range(5000))


def test_samples_lost_one_by_one_are_bridged_and_cost_little(made, tmp_path) -> None:
    random = np.random.default_rng(3)

    def edit(_, columns):
        keep = random.random(len(columns["t"])) > 0.05
        keep[:2] = True
        return {name: values[keep] for name, values in columns.items()}

    toml = f"facing_deg = 0\n{POSE}"
    whole = run(SolveSettings(input=capture_folder(tmp_path / "whole", made, toml=toml)))
    holed = capture_folder(tmp_path / "holed", made, toml=toml, edit=edit)
    capture = load(holed)
    for segment, samples in batches(capture):
        assert np.diff(samples.time_ns).max(initial=0) < 1.5e9 / RATE, segment
    report = run(SolveSettings(input=holed))
    assert report.drops == {}
    assert report.rows == len(capture.segments["upper_arm_r"].t)
    assert elbow_error_deg(report) < elbow_error_deg(whole) + 0.1
