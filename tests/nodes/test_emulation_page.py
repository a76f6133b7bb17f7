"""docs/emulation.md: its figures are those of the code, and its example runs."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from brachium_nodes.exercises import EXERCISES
from brachium_nodes.routines import ROUTINES
from brachium_nodes.sensors import LEVELS, Errors, G

PAGE = Path(__file__).parents[2] / "docs" / "emulation.md"
pytestmark = pytest.mark.skipif(not PAGE.is_file(), reason="no source tree: the wheel is tested")

UNITS = {"deg": 1.0, "deg/s/sqrt(Hz)": np.pi / 180.0, "deg/s": np.pi / 180.0, "deg/s/sqrt(s)": np.pi / 180.0,
         "%": 0.01, "ug/sqrt(Hz)": 1e-6 * G, "mg": 1e-3 * G}  # fmt: skip


def rows() -> list[list[str]]:
    lines = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| `")]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("level", ["ideal", "typical", "patient"])
def test_the_table_says_what_a_level_is(level: str) -> None:
    column = {"ideal": 1, "typical": 2, "patient": 3}[level]
    for row in rows():
        unit = UNITS.get(row[4].split(",")[0].split(" ")[0], 1.0)
        assert getattr(LEVELS[level], row[0]) == pytest.approx(float(row[column]) * unit), row[0]  # type: ignore[index]


def test_every_figure_that_differs_between_levels_is_in_the_table() -> None:
    told = {row[0] for row in rows()}
    for name in (field.name for field in fields(Errors)):
        if len({getattr(LEVELS[level], name) for level in ("ideal", "typical", "patient")}) > 1:  # type: ignore[index]
            assert name in told, name


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    exec(compile(code, str(PAGE), "exec"), {})
    told = capsys.readouterr().out
    assert "(1750, 3) (1750, 3)" in told
    assert "'n-pose', 'elbow-flexion', 'pronation', 'free'" in told


def test_the_routines_and_exercises_it_names_exist() -> None:
    text = PAGE.read_text("utf-8")
    for name in filter(None, ROUTINES):
        assert name in text or name.removeprefix("calibration") in text, name
    assert "shrugging" in EXERCISES
