"""The report's numbers as tables, read by another reader: pandas has them as the page does."""

from pathlib import Path
from typing import Any

import pandas
import pytest

from brachium_viewer.metrics.repetition_measures import NAMES
from brachium_viewer.report import page, tidy_sets
from brachium_viewer.report.groups import groups, lags, symmetries
from brachium_viewer.report.tidy_sets import beside, rows
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_wire import table


@pytest.fixture(scope="module")
def written(worn: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tables")
    page.write(page.ReportSettings(recording=worn, out=folder / "p01.html", csv=folder / "p01.csv"))
    return folder / "p01.csv"


@pytest.fixture(scope="module")
def sets(written: Path) -> Any:
    found = pandas.read_csv(beside(written), comment="#", dtype={"sets": str}, keep_default_na=False,
                            na_values={"value": [""], "coverage [1]": [""]})  # fmt: skip
    return found.rename(columns={"coverage [1]": "coverage"})


def number(sets: Any, **where: str) -> Any:
    for name, wanted in where.items():
        sets = sets[sets[name] == wanted]
    assert len(sets) == 1, where
    return sets.iloc[0]


def test_each_measure_of_a_repetition_has_its_own_coverage(written: Path, worn: Path) -> None:
    found = pandas.read_csv(written, comment="#")
    repetitions = [r for s in session_from_recording(worn).sets for r in s.measures.repetitions]
    for name in NAMES:
        wanted = [r.measures[name].coverage for r in repetitions]
        assert found[f"coverage_{name} [1]"].tolist() == pytest.approx(wanted)
    assert set(found["path_of"]) == {"hand"}
    assert set(found["shift_of"]) == {"shoulder or trunk movement"}


def test_all_that_is_said_of_sets_is_a_row(sets: Any, worn: Path) -> None:
    every = groups(session_from_recording(worn).sets)
    active = every[0].pooled
    right = {"exercise": "elbow-flexion", "side": "right", "mode": "active"}
    assert number(sets, **right, kind="set", quantity="repetitions").value == 10
    assert number(sets, **right, kind="set", quantity="repetitions").sets == "1 2"
    for quantity, measure in (
        ("best_peak", active.best_peak),
        ("extension_deficit", active.extension_deficit),
    ):
        row = number(sets, **right, kind="set", quantity=quantity)
        assert (row.value, row.unit) == (pytest.approx(measure.value), "deg")
        assert row.coverage == pytest.approx(measure.coverage)
    for kind, measures in (("median", active.medians), ("last_to_first", active.first_to_last)):
        for name, measure in measures.items():
            row = number(sets, **right, kind=kind, quantity=name)
            assert row.withheld == measure.withheld
            assert pandas.isna(row.value) == (measure.value is None)
            assert row.value == pytest.approx(measure.value) or measure.value is None
    (symmetry,) = symmetries(every, "right")
    row = number(sets, **right, kind="both_arms", quantity="range")
    assert (row.value, row.of, row.unit) == (pytest.approx(symmetry.range_percent.value), "left", "%")
    ((_, lag),) = lags(every)
    assert number(sets, **right, kind="active_passive", quantity="peak").value == pytest.approx(lag.value)
    explained = sets[(sets["quantity"] == "variance_explained") & (sets["mode"] == "passive")]
    assert explained["value"].sum() == pytest.approx(1.0)
    assert number(sets, **right, kind="median", quantity="shoulder_shift").of == "shoulder or trunk movement"


def test_nothing_is_empty_without_a_reason(sets: Any) -> None:
    empty = sets["value"].isna()
    assert empty.any()
    assert (sets["withheld"][empty] != "").all()
    assert (sets["withheld"][~empty] == "").all()


def test_the_second_table_goes_with_the_first_and_can_be_read_back(written: Path) -> None:
    assert beside(written).name == "p01.sets.csv"
    found = table.read(beside(written))
    assert found.metadata["title"] == "sets"
    assert len(found) == len(pandas.read_csv(beside(written), comment="#"))


def test_a_recording_without_sets_has_a_table_without_rows(tmp_path: Path, worn: Path) -> None:
    assert rows([], [], [], []) == []
    tidy_sets.write(tmp_path / "a.sets.csv", session_from_recording(worn), [])
    assert len(table.read(tmp_path / "a.sets.csv")) == 0
