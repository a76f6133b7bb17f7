"""Nothing is written over what was measured."""

from pathlib import Path

import pytest

from brachium.__main__ import main
from brachium.output_file import spare
from brachium.shell import Usage


@pytest.mark.parametrize("command", ["solve", "export"])
@pytest.mark.parametrize("name", ["forearm_r.csv", "forearm_r.parquet", "upper_arm_l.csv", "truth.csv"])
def test_a_table_of_the_input_folder_is_not_written_over(
    command: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    measured = tmp_path / "forearm_r.csv"
    measured.write_text("t,ax,ay,az,gx,gy,gz\n0,0,0,9.81,0,0,0\n")
    before = measured.read_bytes()
    assert main([command, str(tmp_path), "--out", str(tmp_path / name)]) == 2
    assert "is a table of the input; choose another name" in capsys.readouterr().err
    assert measured.read_bytes() == before
    assert list(tmp_path.iterdir()) == [measured]


def test_another_name_in_the_folder_and_another_folder_are_free(tmp_path: Path):
    (tmp_path / "arm").mkdir()
    spare(tmp_path / "arm", tmp_path / "arm" / "angles.csv")
    spare(tmp_path / "arm", tmp_path / "forearm_r.csv")
    spare(tmp_path / "arm.mcap", tmp_path / "arm.csv")


def test_a_link_to_the_input_is_the_input(tmp_path: Path):
    (tmp_path / "angles.csv").write_text("time")
    (tmp_path / "same.csv").symlink_to(tmp_path / "angles.csv")
    with pytest.raises(Usage, match=r"same\.csv: is the input itself"):
        spare(tmp_path / "angles.csv", tmp_path / "same.csv")
