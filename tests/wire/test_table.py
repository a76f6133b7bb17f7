"""Tables: what is written is read back, whatever it holds; other readers see the same."""

import builtins
import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from brachium_wire import table

NUMBERS = st.floats(allow_nan=True, allow_infinity=False)
NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,12}", fullmatch=True)
TEXTS = st.text(st.characters(blacklist_categories=["Cs", "Cc"]), max_size=8)


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50, deadline=None)
def test_numbers_text_units_and_metadata_come_back(tmp_path: Path, ending: str, data: st.DataObject) -> None:
    n = data.draw(st.integers(1, 8))
    rows = lambda one: st.lists(one, min_size=n, max_size=n)  # noqa: E731 (a name for one expression)
    names = data.draw(st.lists(NAMES, min_size=4, max_size=4, unique=True))
    columns: dict[str, Any] = {
        names[0]: np.array(data.draw(rows(NUMBERS))),
        names[1]: np.array(data.draw(rows(st.integers(-(1 << 59), 1 << 59))), dtype=np.int64),
        names[2]: np.array(data.draw(rows(st.booleans()))),
        names[3]: np.array(["q" + text for text in data.draw(rows(TEXTS))]),
    }
    units = {names[0]: data.draw(st.sampled_from(["deg", "m/s^2", "m"]))}
    metadata = {"origin": "emulated", "note": data.draw(TEXTS), "scores": {"a": [1.5, None, True]}}
    path = tmp_path / f"t.{ending}"
    table.write(path, columns, units, metadata)
    read = table.read(path)
    assert list(read.columns) == names
    for name, column in columns.items():
        assert read.columns[name].dtype.kind == column.dtype.kind
        np.testing.assert_array_equal(read.columns[name], column)
    assert read.units == units
    assert read.metadata == metadata
    assert len(read) == n


def test_a_missing_number_is_an_empty_cell_and_a_null(tmp_path: Path) -> None:
    columns = {"time": [0.0, 0.5], "elbow_flexion": [np.nan, 90.25], "quality_hand_r": ["", "good"]}
    table.write(tmp_path / "a.csv", columns, {"time": "s", "elbow_flexion": "deg"}, {"origin": "worn"})
    assert (tmp_path / "a.csv").read_text() == (
        '# origin: "worn"\ntime [s],elbow_flexion [deg],quality_hand_r\n0.0,,\n0.5,90.25,good\n'
    )
    table.write(tmp_path / "a.parquet", columns, {"time": "s"}, {"origin": "worn"})
    import pyarrow.parquet as parquet

    content = parquet.read_table(tmp_path / "a.parquet")
    assert content.column("elbow_flexion").to_pylist() == [None, 90.25]
    assert content.column("quality_hand_r").to_pylist() == [None, "good"]
    assert content.schema.field("time").metadata == {b"unit": b"s"}
    with (tmp_path / "a.csv").open() as file:  # an independent reader
        assert list(csv.reader(line for line in file if line[0] != "#"))[1] == ["0.0", "", ""]


@pytest.mark.parametrize(
    ("columns", "units", "said"),
    [
        ({}, {}, "columns of one length"),
        ({"a": [1.0], "b": [1.0, 2.0]}, {}, "a 1, b 2"),
        ({"a": [np.inf]}, {}, "infinity"),
        ({"a [deg]": [1.0]}, {}, "name"),
        ({"# a": [1.0]}, {}, "name"),
        ({"a": [[1.0, 2.0]]}, {}, "shape"),
        ({"a": [1.0]}, {"b": "m"}, "not there: b"),
    ],
)
def test_what_makes_no_table_is_refused(tmp_path: Path, columns: Any, units: Any, said: str) -> None:
    with pytest.raises(table.TableError, match=said):
        table.write(tmp_path / "a.csv", columns, units, {})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a;b\n1;2\n", "semicolons"),
        ("a,a\n1,2\n", "every column once"),
        ("", "the file is empty"),
        ("\n1,2\n", "every column once"),
        ("a,b\n1\n", "data row 1 has 1 cells"),
    ],
)
def test_a_csv_file_that_is_no_table_gives_one_line(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(table.TableError, match=said) as caught:
        table.read(tmp_path / "a.csv")
    assert "\n" not in str(caught.value)


def test_a_csv_file_that_is_no_text_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"t,x\n0,\xff\n")
    with pytest.raises(table.TableError, match=r"a\.csv: not text \(UTF-8\)"):
        table.read(tmp_path / "a.csv")


def test_an_empty_parquet_file_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.parquet").touch()
    with pytest.raises(table.TableError, match="the file is empty"):
        table.read(tmp_path / "a.parquet")


def test_spreadsheet_files_with_a_byte_order_mark_and_crlf_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes("\ufefft [s],x\r\n0,1.5\r\n1,\r\n".encode())
    read = table.read(tmp_path / "a.csv")
    assert read.units == {"t": "s"}
    np.testing.assert_array_equal(read.columns["x"], [1.5, np.nan])


def test_a_foreign_parquet_file_gives_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.parquet").write_bytes(b"PAR1 and no more of it")
    with pytest.raises(table.TableError, match=r"a\.parquet: no Parquet file") as caught:
        table.read(tmp_path / "a.parquet")
    assert "\n" not in str(caught.value)


def test_parquet_without_its_package_names_the_extra_and_csv_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **named: Any) -> Any:
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return real(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(table.MissingExtra, match=r"brachium\[parquet\]"):
        table.write(tmp_path / "a.parquet", {"a": [1.0]}, {}, {})
    table.write(tmp_path / "a.csv", {"a": [1.0]}, {}, {})
    assert table.read(tmp_path / "a.csv").columns["a"].tolist() == [1.0]
