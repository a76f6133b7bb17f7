"""A file is written whole or not at all, and none says more than was known."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brachium_viewer.export import formats
from brachium_viewer.export.formats import FORMATS, Wish
from brachium_wire.table import Table, TableError

FILES = [name for name in FORMATS if name != "motion-bids"]


def export(result: Table, path: Path, **cut: Any) -> list[Path]:
    return formats.export(result, path, Wish(to=path.suffix[1:], **cut), "test")


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is Linux's")
@pytest.mark.parametrize("to", ["csv", "sto", "mot", "trc", "c3d", "bvh"])
def test_what_does_not_fit_leaves_what_was_there(
    to: str, result: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / f"arm.{to}"
    path.write_text("of before")

    class Full:
        """Gives a scratch folder in which every file is a full disk."""

        def __init__(self, prefix: str, dir: Path):
            self.folder = dir / prefix
            self.folder.mkdir()
            (self.folder / path.name).symlink_to("/dev/full")

        def __enter__(self) -> str:
            return str(self.folder)

        def __exit__(self, *_: object) -> None:
            (self.folder / path.name).unlink()
            self.folder.rmdir()

    monkeypatch.setattr(formats, "TemporaryDirectory", Full)
    with pytest.raises(OSError, match=rf"arm\.{to}") as told:
        export(result, path, until_s=0.5)
    assert ".brachium-" not in str(told.value)
    assert path.read_text() == "of before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_c3d_file_that_was_cut_is_told(result: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import ezc3d

    write = ezc3d.c3d.write

    def cut(self: Any, path: str) -> None:
        write(self, path)
        whole = Path(path).read_bytes()
        Path(path).write_bytes(whole[:-600])  # it ends in a block of 512

    monkeypatch.setattr(ezc3d.c3d, "write", cut)
    with pytest.raises(OSError, match="not written whole; is the disk full"):
        export(result, tmp_path / "arm.c3d", until_s=0.5)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_named(result: Table, tmp_path: Path):
    with pytest.raises(FileNotFoundError) as told:
        export(result, tmp_path / "nowhere" / "arm.c3d", until_s=0.5)
    assert told.value.filename == str(tmp_path / "nowhere" / "arm.c3d")


@pytest.mark.parametrize("to", FILES)
def test_nothing_stays_beside_the_files_that_are_named(to: str, result: Table, tmp_path: Path):
    named = export(result, tmp_path / f"arm.{to}", until_s=0.5)
    assert sorted(named) == sorted(tmp_path.iterdir())


def test_opensim_s_older_reader_finds_every_row_of_a_mot_with_gaps(
    result: Table, tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    opensim: Any = pytest.importorskip("opensim", reason="OpenSim has no wheel for this machine")
    opensim.Logger.setLevelString("error")
    path = tmp_path / "arm.mot"
    export(result, path)
    stored = opensim.Storage(str(path))
    known = np.isfinite(result.columns["theta1_l"])
    assert 0 < (~known).sum() < len(result)
    assert stored.getSize() == known.sum()
    assert f"left out {(~known).sum()} of {len(result)} instants" in caplog.text
    export(result, path, columns=("theta?_r", "elbow_flexion_r"))
    assert opensim.Storage(str(path)).getSize() == len(result)


def test_a_mot_without_a_whole_instant_says_which_coordinate_to_leave_out(result: Table, tmp_path: Path):
    columns = dict(result.columns)
    flexion = np.full(len(result), np.nan)
    gap = int(np.flatnonzero(np.isnan(columns["theta1_l"]))[0])
    flexion[gap] = 0.0
    columns["elbow_flexion_r"] = flexion
    with pytest.raises(TableError, match="most for elbow_flex_r; name those that are wanted with --columns"):
        export(Table(columns, result.units, result.metadata), tmp_path / "arm.mot")
    assert not list(tmp_path.iterdir())


def test_a_study_on_a_full_disk_keeps_what_it_had_and_takes_the_recording_later(
    result: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    study, write = tmp_path / "study", Path.write_text
    formats.export(result, study, Wish(to="motion-bids", until_s=0.5), "test")
    people = (study / "participants.tsv").read_text()
    other = Table(result.columns, result.units, result.metadata | {"subject": "p02"})
    for full in ("participants.tsv", "_motion.tsv"):

        def fails(path: Path, text: str, *rest: Any, full: str = full, **named: Any) -> int:
            written = write(path, text[:5], *rest, **named)
            if full in path.name:
                raise OSError(28, "No space left on device", str(path))
            return written and write(path, text, *rest, **named)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "write_text", fails)
            with pytest.raises(OSError, match="No space left"):
                formats.export(other, study, Wish(to="motion-bids", until_s=0.5), "test")
        assert (study / "participants.tsv").read_text().startswith(people)
        assert not list(study.rglob(".*"))
        assert not list(study.rglob("sub-p02*_motion.tsv"))
    formats.export(other, study, Wish(to="motion-bids", until_s=0.5), "test")
    assert (study / "participants.tsv").read_text() == people + "sub-p02\tplayback\n"
    assert len(list(study.rglob("*_motion.tsv"))) == 2
