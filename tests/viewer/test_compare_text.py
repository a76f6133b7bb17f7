"""What people read of a comparison."""

import numpy as np
import pytest

from brachium_viewer.compare import CompareSettings, Comparison, matched
from brachium_viewer.compare_text import text
from brachium_wire.table import Table, TableError

TIME = np.arange(1000) / 50.0
FLEXION = 8.0 + 40.0 * (1.0 - np.cos(2 * np.pi * TIME / 4.0))
POINT = np.column_stack([np.sin(TIME), np.cos(TIME), 0.2 * TIME])
UNITS = {"elbow_flexion": "deg", "wrist_x": "m", "wrist_y": "m", "wrist_z": "m"}


def side(offset_deg: float, shift_m: float, late_s: float = 0.0) -> Table:
    columns = {"time": TIME + late_s, "elbow_flexion": FLEXION + offset_deg}
    columns |= {f"wrist_{axis}": POINT[:, k] + shift_m for k, axis in enumerate("xyz")}
    return Table(columns, UNITS)


def compare_tables(a: Table, b: Table, chosen: CompareSettings) -> Comparison:
    return matched(a, b, chosen)[0]


def test_aligning_says_what_it_took_out() -> None:
    settings = CompareSettings(lag="estimate", frame="rigid")
    found = compare_tables(side(2.0, 0.05, 0.1), side(0.0, 0.0), settings)
    said = text(found)
    assert "lag 100.0 ms taken out" in said
    assert "shifted by -50.0, -50.0, -50.0 mm" in said
    assert found.aligned is not None
    assert found.aligned.after["columns, m"] < 1e-9 < 0.05 < found.aligned.before["columns, m"]
    assert found.aligned.after["columns, deg"] == found.columns["elbow_flexion"].rmse


def test_repetitions_are_compared_one_by_one() -> None:
    found = compare_tables(side(2.0, 0.0), side(0.0, 0.0), CompareSettings())
    assert found.repetitions_of == "elbow_flexion"
    assert len(found.repetitions) == 5
    one = found.per_repetition["elbow_flexion"]
    assert (round(one.highest.bias, 9), round(one.reach.bias, 9)) == (2.0, 0.0)
    assert "5 repetitions by elbow_flexion" in text(found)
    whole = compare_tables(side(2.0, 0.0), side(0.0, 0.0), CompareSettings(repetitions="none"))
    assert whole.repetitions == []
    assert "repetitions" not in text(whole)


def test_what_was_assumed_is_said_and_counts_for_no_range_of_motion() -> None:
    from_one_sensor = side(2.0, 0.0)
    from_one_sensor.columns["quality_elbow_angles"] = np.where(TIME < 15.0, "assumed", "good")
    from_one_sensor.columns["quality_wrist_position"] = np.full(len(TIME), "good")
    found = compare_tables(from_one_sensor, side(0.0, 0.0), CompareSettings(repetitions="elbow_flexion"))
    assert found.assumed == {"elbow_flexion": {"a": 0.75, "b": 0.0}}
    assert "assumed, not measured, in 75 % of A's rows: elbow_flexion\n" in text(found)
    assert found.columns["elbow_flexion"].n == len(TIME)
    assert "elbow_flexion" not in found.per_repetition
    assert "wrist_x" in found.per_repetition
    everywhere = side(2.0, 0.0)
    everywhere.columns["quality_elbow_angles"] = np.full(len(TIME), "assumed")
    assert compare_tables(everywhere, side(0.0, 0.0), CompareSettings()).repetitions == []


def test_columns_are_chosen_by_name_and_how_sure_a_shift_is_is_no_measure() -> None:
    a, b = side(2.0, 0.0), side(0.0, 0.0)
    for one in (a, b):
        one.columns["shoulder_shift_sd_x"] = np.full(len(TIME), 0.01)
    assert set(compare_tables(a, b, CompareSettings()).columns) == set(UNITS)
    chosen = compare_tables(a, b, CompareSettings(columns=("elbow_flexion", "*_z")))
    assert set(chosen.columns) == set(chosen.agreement) == {"elbow_flexion", "wrist_z"}
    with pytest.raises(TableError, match="'elbow_flexio' is not in both; did you mean elbow_flexion"):
        compare_tables(a, b, CompareSettings(columns=("elbow_flexio",)))


def test_a_large_p_is_not_called_agreement() -> None:
    said = text(compare_tables(side(0.0, 0.0), side(0.0, 0.0), CompareSettings()))
    assert "a large p does not show agreement" in said
    assert "95 % limits of agreement" in said
