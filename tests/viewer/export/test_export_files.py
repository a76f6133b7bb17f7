"""What stands in each file, in its own format's words."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from brachium.export_readers.readers import READERS
from brachium_body import rotation
from brachium_body.kinematics import JOINTS, TRUNK_FROM_THORAX
from brachium_body.segments import SEGMENTS
from brachium_viewer.export import formats
from brachium_viewer.export.about import carried, sidecar
from brachium_viewer.export.formats import FORMATS, Wish
from brachium_viewer.export.motion_bids import write_motion_bids
from brachium_wire.table import MissingExtra, Table, TableError

GAP_ROW = 450
"""Here nothing is known of the left arm."""


def export(result: Table, folder: Path, to: str, **cut: object) -> Path:
    path = folder / ("study" if to == "motion-bids" else f"arm.{to}")
    formats.export(result, path, Wish(to=to, **cut), "brachium test")
    return path


@pytest.mark.parametrize("to", FORMATS)
def test_every_file_tells_its_origin_its_settings_and_that_it_is_no_device(
    to: str, result: Table, tmp_path: Path
):
    said = carried(export(result, tmp_path, to, until_s=0.5))
    assert said["origin"] == "playback"
    assert said["settings"] == result.metadata["settings"]
    assert "not a medical device" in said["notice"]
    assert said["export"]["until_s"] == 0.5
    assert said["sides"] == ["right", "left"]


def test_missing_markers_are_empty_cells(result: Table, tmp_path: Path):
    lines = export(result, tmp_path, "trc").read_text().splitlines()
    cells = lines[6 + GAP_ROW].split("\t")
    assert cells[0] == str(GAP_ROW + 1)
    assert cells[2:14] == [f"{float(c):.4f}" for c in cells[2:14]]
    assert cells[14:] == [""] * 13  # twelve cells, and the tab at the end
    assert lines[2].split("\t") == ["50", "50", "650", "8", "mm", "50", "1", "650"]


def test_a_missing_point_has_residual_minus_one(result: Table, tmp_path: Path):
    import ezc3d

    read = ezc3d.c3d(str(export(result, tmp_path, "c3d")))
    residuals = read["data"]["meta_points"]["residuals"][0]
    assert (residuals[:4] == 0.0).all()
    assert (residuals[4:, GAP_ROW] == -1.0).all()
    assert np.isnan(read["data"]["points"][:3, 4:, GAP_ROW]).all()
    assert read["parameters"]["POINT"]["UNITS"]["value"] == ["mm"]
    assert set(read["parameters"]["ANALOG"]["UNITS"]["value"]) == {"deg"}


def test_a_c3d_file_too_long_for_its_counter_is_refused(tmp_path: Path):
    n = 65_536
    columns = {"time": np.arange(n) / 50.0} | {f"elbow_{a}": np.zeros(n) for a in "xyz"}
    with pytest.raises(TableError, match="65535 frames, not 65536; cut with --from and --until"):
        export(Table(columns, {}, {"sides": ["left"]}), tmp_path, "c3d")


def test_bvh_holds_the_last_pose_and_the_file_beside_it_says_when(result: Table, tmp_path: Path):
    path = export(result, tmp_path, "bvh")
    rows = path.read_text().partition("Frame Time:")[2].splitlines()[1:]
    numbers = np.array([[float(x) for x in row.split()] for row in rows])
    assert np.isfinite(numbers).all()
    held = json.loads(sidecar(path).read_text())["held"]
    ((first, last),) = held["forearm_l"]
    assert first <= GAP_ROW <= last
    assert set(held) == {"shoulder_l", "upper_arm_l", "forearm_l", "hand_l"}
    left = numbers[:, -15:]
    assert (left[first : last + 1] == left[first - 1]).all()
    assert np.abs(left[last + 1] - left[last]).max() > 1.0
    known = np.isfinite(result.columns["elbow_flexion_l"])
    assert (np.flatnonzero(~known) == np.arange(first, last + 1)).all()


def bvh_places(text: str) -> dict[str, np.ndarray]:
    """Return where every joint and end site (n, 3) comes to be, by the format's own description."""
    head, _, motion = text.partition("MOTION")
    words, parents, joints = head.split(), [], []
    at = iter(words)
    for word in at:
        if word in ("ROOT", "JOINT", "End"):
            name = next(at)
            own = f"{joints[parents[-1]][0]}_end" if word == "End" else name
            joints.append((own, parents[-1] if parents else -1, [0.0] * 3, []))
        elif word == "{":
            parents.append(len(joints) - 1)
        elif word == "}":
            parents.pop()
        elif word == "OFFSET":
            joints[-1][2][:] = [float(next(at)) for _ in range(3)]
        elif word == "CHANNELS":
            joints[-1][3].extend(next(at) for _ in range(int(next(at))))
    rows = np.array([[float(x) for x in line.split()] for line in motion.splitlines()[3:]])
    turns: list[np.ndarray] = []
    places: list[np.ndarray] = []
    column = 0
    for _, parent, offset, channels in joints:
        turn = np.tile(np.eye(3), (len(rows), 1, 1))
        shift = np.zeros((len(rows), 3))
        for channel in channels:
            values, axis = rows[:, column], "XYZ".index(channel[0])
            column += 1
            if channel.endswith("position"):
                shift[:, axis] = values
            else:
                turn = turn @ plane_turn(axis, np.radians(values))
        step = np.array(offset) + shift
        if parent < 0:
            turns.append(turn)
            places.append(step)
        else:
            turns.append(turns[parent] @ turn)
            places.append(places[parent] + np.einsum("nij,nj->ni", turns[parent], step))
    return {name: place for (name, *_), place in zip(joints, places, strict=True)}


def plane_turn(axis: int, angle: np.ndarray) -> np.ndarray:
    turn = np.tile(np.eye(3), (len(angle), 1, 1))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn[:, a, a] = turn[:, b, b] = np.cos(angle)
    turn[:, b, a], turn[:, a, b] = np.sin(angle), -np.sin(angle)
    return turn


def test_forward_kinematics_of_the_bvh_gives_our_joint_centres(result: Table, tmp_path: Path):
    found = bvh_places(export(result, tmp_path, "bvh").read_text())
    bones = ("upper_arm", "forearm", "hand")
    for end in ("r", "l"):
        names = [*(f"{bone}_{end}" for bone in bones), f"hand_{end}_end"]
        for joint, name in zip(JOINTS, names, strict=True):
            ours = np.stack([result.columns[f"{joint}_{a}_{end}"] for a in "xyz"], axis=1)
            theirs = found[name] @ np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0]], dtype=float) / 100.0
            known = np.isfinite(ours).all(axis=1)
            assert known.sum() > 500
            assert np.abs(theirs - ours)[known].max() < 1e-3, (joint, end)


def test_arms_that_hang_have_no_turns_and_face_forward(result: Table, tmp_path: Path):
    text = export(result, tmp_path, "bvh", until_s=2.0).read_text()
    rows = np.array(
        [[float(x) for x in line.split()] for line in text.partition("Time:")[2].splitlines()[1:]]
    )
    assert np.abs(rows[60]).max() < 3.0
    assert "ROOT trunk" in text
    assert "JOINT shoulder_r\n\t{\n\t\tOFFSET -23.22" in text  # X is to the subject's left


def test_a_study_is_valid_bids_and_grows(result: Table, tmp_path: Path):
    study = export(result, tmp_path, "motion-bids", session="1", task="drinking", until_s=4.0)
    for subject, session in (("p01", "2"), ("p-02", "1")):
        table = Table(result.columns, result.units, result.metadata | {"subject": subject})
        formats.export(table, study, Wish(to="motion-bids", session=session, until_s=4.0), "test")
    people = (study / "participants.tsv").read_text().splitlines()
    assert [line.split("\t") for line in people] == [
        ["participant_id", "origin"],
        ["sub-p01", "playback"],
        ["sub-p02", "playback"],
    ]
    assert len(list(study.rglob("*_motion.tsv"))) == 3
    validator = shutil.which("bids-validator-deno", path=str(Path(sys.executable).parent))
    assert validator, "bids-validator-deno is of the development tools"
    done = subprocess.run(
        [validator, str(study), "--json"], capture_output=True, text=True, timeout=60, check=False
    )
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue["severity"] == "error"] == []
    with pytest.raises(TableError, match="is there already; give another --session or --task"):
        formats.export(result, study, Wish(to="motion-bids", session="1", task="drinking"), "test")


def test_a_gap_in_bids_is_not_available(result: Table, tmp_path: Path):
    path = next(export(result, tmp_path, "motion-bids").rglob("*_motion.tsv"))
    cells = path.read_text().splitlines()[GAP_ROW].split("\t")
    assert "n/a" in cells
    assert path.read_text().count("\n") == len(result)


def test_names_that_bids_cannot_hold_are_refused(result: Table, tmp_path: Path):
    motion = formats.prepared(result, Wish(to="motion-bids", session="--"), "test")
    with pytest.raises(TableError, match="session '--': a name in BIDS has letters and digits"):
        write_motion_bids(motion, tmp_path / "study")


def test_a_missing_extra_is_named(result: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(formats, "find_spec", lambda _: None)
    with pytest.raises(MissingExtra, match=r"needs the package ezc3d: pip install 'brachium\[export\]'"):
        export(result, tmp_path, "c3d")


def one_arm(result: Table, end: str) -> Table:
    """Return one arm's table as `solve` writes it: no endings but of segments."""
    other = "_l" if end == "_r" else "_r"
    columns = {}
    for name, values in result.columns.items():
        if name.endswith(other) or (f"{other}_" in name and "_q" in name):
            continue
        segment = name.split("_q")[0] in SEGMENTS or name.removeprefix("quality_") in SEGMENTS
        segment = segment or "_sensor_q" in name
        columns[name if segment else name.removesuffix(end)] = values
    side = {"_r": "right", "_l": "left"}[end]
    return Table(columns, {}, result.metadata | {"sides": [side]})


@pytest.mark.parametrize("end", ["_r", "_l"])
@pytest.mark.parametrize("to", ["sto", "mot", "trc", "c3d", "bvh"])
def test_one_arm_stands_alone_as_it_stands_beside_the_other(to: str, end: str, result: Table, tmp_path: Path):
    alone = READERS[to](export(one_arm(result, end), tmp_path, to))
    (tmp_path / "both").mkdir()
    both = READERS[to](export(result, tmp_path / "both", to))
    rows = np.isin(alone.time_s.round(6), both.time_s.round(6))  # a .mot has whole instants alone
    assert rows.sum() == len(both.time_s) >= 600
    for found, of_both in ((alone.angles_deg, both.angles_deg), (alone.places_mm, both.places_mm)):
        assert set(found) == {name for name in of_both if name.endswith(end)}
        for name, values in found.items():
            np.testing.assert_allclose(values[rows], of_both[name], atol=1e-3, err_msg=name)


def test_whose_arm_a_table_of_before_holds_is_told_by_its_segments(result: Table, tmp_path: Path):
    table = one_arm(result, "_l")
    untold = Table(table.columns, {}, {n: v for n, v in table.metadata.items() if n != "sides"})
    assert formats.prepared(untold, Wish(to="trc"), "test").about["sides"] == ["left"]
    bare = Table({"time": np.arange(3.0), "elbow_flexion": np.zeros(3)}, {}, {})
    with pytest.raises(TableError, match="no result of brachium solve: it names no time and no arm"):
        export(bare, tmp_path, "csv")


def test_a_leaning_trunk_turns_the_root_and_not_the_markers(result: Table, tmp_path: Path):
    lean = rotation.about(2, np.radians(-20.0))  # thorax axes: Z to the right, so that the chest goes forward
    n = len(result)
    thorax = np.tile(rotation.multiply(TRUNK_FROM_THORAX, lean), (n, 1))
    columns = result.columns | {f"sternum_q{p}": thorax[:, i] for i, p in enumerate("wxyz")}
    upright = np.arange(n) < 10
    for i, p in enumerate("wxyz"):
        columns[f"sternum_q{p}"] = np.where(upright, TRUNK_FROM_THORAX[i], columns[f"sternum_q{p}"])
    leaning = Table(columns, result.units, result.metadata)
    text = export(leaning, tmp_path, "bvh").read_text()
    rows = np.array(
        [[float(x) for x in line.split()] for line in text.partition("Time:")[2].splitlines()[1:]]
    )
    np.testing.assert_allclose(rows[0, 3:6], 0.0, atol=1e-6)
    np.testing.assert_allclose(rows[100, 3:6], [0.0, 20.0, 0.0], atol=1e-6)  # about X, to the left: forward
    found, plain = (READERS["bvh"](tmp_path / "arm.bvh"), READERS["trc"](export(result, tmp_path, "trc")))
    np.testing.assert_allclose(found.places_mm["wrist_r"], plain.places_mm["wrist_r"], atol=0.1)
