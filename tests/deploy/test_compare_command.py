"""`brachium compare` tells its figures whatever becomes of the picture."""

import json
from pathlib import Path

import numpy as np
import pytest

from brachium.__main__ import main
from brachium_wire import table

TIME = np.arange(500) / 50.0


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    paths = (tmp_path / "a.csv", tmp_path / "b.csv")
    for offset, path in enumerate(paths):
        angles = {f"theta{i}": 30.0 * np.sin(TIME + i) + offset for i in range(1, 8)}
        more = {f"{name}_{end}": value for name, value in angles.items() for end in ("r", "l")}
        table.write(path, {"time": TIME, **more}, {"time": "s", **dict.fromkeys(more, "deg")}, {})
    return str(paths[0]), str(paths[1])


@pytest.mark.parametrize(("figure", "said"), [("no/a.png", "no/a.png"), ("a.gif", "ends in .svg, .png")])
def test_a_picture_that_cannot_be_made_costs_no_figures(
    files: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str], figure: str, said: str
) -> None:
    assert main(["compare", *files, "--json", "--figure", str(tmp_path / figure)]) == 2
    told = capsys.readouterr()
    assert len(json.loads(told.out)["columns"]) == 14
    assert said in told.err


def test_columns_that_find_no_room_in_the_picture_are_told(
    files: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", *files, "--figure", str(tmp_path / "a.png")]) == 0
    assert "no room for 2 columns" in capsys.readouterr().err
    assert main(["compare", *files, "--columns", "theta4_*", "--figure", str(tmp_path / "b.png")]) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert "theta4_r" in told.out
    assert "theta5_r" not in told.out
