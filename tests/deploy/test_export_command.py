"""The command: recordings, results and captures in, files out, and back through `solve --settings`."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from brachium.__main__ import main
from brachium.bench_exports import write_capture
from brachium.export_source import origin_of
from brachium_body.continuation import AngleTracker
from brachium_fusion import from_recording
from brachium_nodes.wearer import Wearer, WearerSettings
from brachium_viewer import marks
from brachium_wire import keys, recording, table
from brachium_wire.codec import encode
from brachium_wire.messages import Event

LEFT_SILENT = range(30, 60)
START_NS = 1_700_000_000_000_000_000
MARK_NS = 4_500_000_000
"""An exercise begins half a second after the first skeleton."""


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("capture") / "arms"
    write_capture(folder, "elbow-flexion")
    return folder


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two arms' skeletons alone; some of the left arm's did not come."""
    path = tmp_path_factory.mktemp("recording") / "arms.mcap"
    wearer = Wearer(WearerSettings(exercise="elbow-flexion", arms="both"))
    t = 4.0 + np.arange(100) / 50.0
    with recording.RecordingWriter(path) as file:
        settings = Event(time_ns=START_NS, kind="settings", data={"filter": "vqf", "magnetometer": False})
        file.write(keys.event("gym", "p07"), encode(settings), START_NS)
        begun = marks.event(marks.ExerciseBegins(exercise="elbow-flexion", side="left"), START_NS + MARK_NS)
        file.write(keys.event("gym", "p07"), encode(begun), START_NS + 1)
        for side in ("right", "left"):
            for row, skeleton in enumerate(wearer.skeletons(t, side, START_NS, AngleTracker())):
                if side == "right" or row not in LEFT_SILENT:
                    file.write(keys.skeleton("gym", "p07", side), encode(skeleton), skeleton.time_ns)
    return path


def run(*words: object) -> int:
    return main([str(word) for word in words])


def columns(path: Path) -> dict[str, Any]:
    return table.read(path).columns


def test_a_recording_gives_its_live_skeletons_and_a_gap_where_none_came(live: Path, tmp_path: Path):
    out = tmp_path / "arms.csv"
    assert run("export", live, "--out", out) == 0
    read = table.read(out)
    assert len(read) == 100
    missing = np.isnan(read.columns["elbow_flexion_l"])
    assert np.flatnonzero(missing).tolist() == list(LEFT_SILENT)
    assert not np.isnan(read.columns["elbow_flexion_r"]).any()
    assert read.units["elbow_flexion_l"] == "deg"
    assert read.metadata["origin"] == "emulated"
    assert read.metadata["subject"] == "p07"
    assert read.metadata["settings"]["filter"] == "vqf"
    assert read.metadata["settings"]["magnetometer"] is False


def test_both_arms_of_a_recording_end_in_a_c3d_file_by_the_ending_of_out(live: Path, tmp_path: Path):
    import ezc3d

    out = tmp_path / "arms.c3d"
    assert run("export", live, "--out", out, "--from", 0.2, "--until", 1.0, "--rate", 25) == 0
    read = ezc3d.c3d(str(out))
    assert read["parameters"]["POINT"]["RATE"]["value"].tolist() == [25.0]
    assert read["data"]["points"].shape == (4, 8, 20)
    silent = np.isnan(read["data"]["points"][0, 4:]).all(axis=0)
    assert np.flatnonzero(silent).tolist() == [10, 11, 12, 13, 14, 15, 16, 17, 18, 19]


def test_what_was_marked_stands_in_the_file_at_its_time(live: Path, tmp_path: Path):
    import ezc3d
    import kineticstoolkit

    out, study = tmp_path / "arms.c3d", tmp_path / "study"
    assert run("export", live, "--out", out, "--from", 0.2) == 0
    found = kineticstoolkit.read_c3d(str(out), convert_point_unit=False)["Points"].events
    assert [(event.name.split(":")[-1], round(event.time, 6)) for event in found] == [("exercise", 0.3)]
    told = ezc3d.c3d(str(out))["parameters"]["EVENT"]["DESCRIPTIONS"]["value"]
    assert told == ["elbow-flexion, left, active"]
    assert run("export", live, "--to", "motion-bids", "--out", study, "--from", 0.2) == 0
    (events,) = study.rglob("*_events.tsv")
    rows = [line.split("\t") for line in events.read_text().splitlines()]
    assert rows == [
        ["onset", "duration", "trial_type", "text"],
        ["0.300000", "0", "exercise", "elbow-flexion, left, active"],
    ]
    assert run("export", live, "--out", tmp_path / "later.csv", "--from", 1.0) == 0
    (told,) = table.read(tmp_path / "later.csv").metadata["events"]
    assert told["data"]["side"] == "left"


@pytest.mark.parametrize("to", ["parquet", "sto", "mot", "trc", "c3d", "bvh", "rrd", "motion-bids"])
def test_settings_of_an_exported_file_solve_the_same_again(
    to: str, solved: Path, capture: Path, tmp_path: Path
):
    out = tmp_path / ("study" if to == "motion-bids" else f"arms.{to}")
    assert run("export", solved, "--to", to, "--out", out, "--until", 1) == 0
    again = tmp_path / "again.csv"
    assert run("solve", capture, "--settings", out, "--out", again) == 0
    first, second = table.read(solved), table.read(again)
    assert second.metadata == first.metadata
    assert list(second.columns) == list(first.columns)
    for name, values in first.columns.items():
        assert np.array_equal(second.columns[name], values, equal_nan=values.dtype.kind == "f"), name


@pytest.fixture(scope="module")
def solved(capture: Path) -> Path:
    """A result that the default settings would not give."""
    out = capture.parent / "solved.csv"
    words = (
        "--filter",
        "complementary",
        "--no-mag",
        "--rate",
        20,
        "--columns",
        "segments,positions,theta,clinical,isb",
    )
    assert run("solve", capture, "--out", out, *words) == 0
    assert len(table.read(out)) == 260
    return out


def test_other_options_come_before_those_of_settings(solved: Path, capture: Path, tmp_path: Path):
    again = tmp_path / "again.csv"
    assert run("solve", capture, "--settings", solved, "--rate", 10, "--out", again) == 0
    read = table.read(again)
    assert len(read) == 130
    assert read.metadata["filter"] == "complementary"


def test_a_capture_is_solved_on_the_way(capture: Path, tmp_path: Path):
    out = tmp_path / "arms.csv"
    assert run("export", capture, "--out", out, "--columns", "elbow_flexion", "--rate", 10) == 0
    assert list(columns(out)) == ["time", "elbow_flexion_r", "elbow_flexion_l"]
    assert len(table.read(out)) == 130


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("nothing.csv", "--out", "arm.trc"), "No such file"),
        (("{solved}", "--out", "arm.xyz"), "no format goes by this ending; choose one with --to: csv"),
        (("{solved}", "--to", "trc", "--out", "arm.c3d"), "a file of --to trc ends in .trc"),
        (("{solved}", "--out", "nowhere/arm.trc"), "cannot be written in folder"),
        (
            ("{solved}", "--out", "arm.trc", "--columns", "clinical"),
            "a .trc holds positions, and there are none",
        ),
        (
            ("{solved}", "--out", "arm.bvh", "--columns", "clinical"),
            "a BVH file needs positions of all joints",
        ),
        (("{solved}", "--out", "arm.mot", "--columns", "positions"), "a .mot holds joint angles"),
        (("{solved}", "--out", "arm.sto", "--columns", "clinical"), "an .sto holds orientations"),
        (("{solved}", "--out", "arm.csv", "--from", "50"), "there is nothing from 50"),
        (("{live}", "--out", "arm.csv", "--subject", "p09"), "holds no subject 'p09'; there are p07"),
    ],
)
def test_what_cannot_be_exported_is_one_line(
    words: tuple[str, ...],
    complaint: str,
    solved: Path,
    live: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.chdir(tmp_path)
    assert run("export", *(word.format(solved=solved, live=live) for word in words)) == 2
    said = capsys.readouterr().err.strip()
    assert complaint in said
    assert len(said.splitlines()) == 1


def test_a_file_that_tells_no_settings_is_refused(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    other = tmp_path / "other.trc"
    other.write_text("PathFileType\n")
    assert run("solve", capture, "--settings", other) == 2
    assert "does not tell its settings (there is no other.trc.json beside it)" in capsys.readouterr().err


def test_nothing_emulated_in_part_goes_as_worn(live: Path):
    with recording.read(live) as messages:
        contents = from_recording.sort_out(messages)["p07"]
    mixed = [msgspec.structs.replace(s, origin="worn") for s in contents.live[:5]]
    assert origin_of([*mixed, *contents.live[5:]]) == "emulated"
    assert origin_of(mixed) == "worn"


def test_the_input_is_not_written_over(live: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "arms.csv"
    assert run("export", live, "--out", out) == 0
    before = out.read_bytes()
    assert run("export", out, "--out", out, "--from", 1) == 2
    assert "is the input itself; choose another name" in capsys.readouterr().err
    assert out.read_bytes() == before


def test_a_recording_that_was_cut_is_exported_up_to_the_cut_and_said_to_be(
    live: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(live.read_bytes()[:-200])
    assert run("export", cut, "--out", tmp_path / "arms.csv") == 0
    assert "cut.mcap: not closed: read up to the cut" in caplog.text
