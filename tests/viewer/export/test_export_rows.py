"""Cutting, choosing and even grids: laws, with no file."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from brachium_viewer.export import rows
from brachium_viewer.export.formats import own_rate_hz
from brachium_wire.table import Table, TableError


def moving(time_s: np.ndarray) -> Table:
    turns = Rotation.from_rotvec(np.stack([np.sin(time_s), 0.3 * time_s, np.cos(time_s)], axis=1))
    q = turns.as_quat(scalar_first=True)
    columns = {"time": time_s, "elbow_flexion": 90.0 * np.sin(time_s)}
    columns |= {f"forearm_r_q{p}": q[:, i] for i, p in enumerate("wxyz")}
    columns["quality_forearm_r"] = np.where(time_s < 1.0, "good", "held")
    return Table(columns, {"time": "s", "elbow_flexion": "deg"}, {"sides": ["right"]})


@given(rate=st.sampled_from([20.0, 25.0, 30.0, 50.0, 60.0, 100.0]), start=st.floats(-5.0, 1e5))
def test_an_even_table_at_its_own_rate_stays_as_it_is(rate: float, start: float):
    table = moving(start + np.arange(40) / rate)
    again = rows.evenly(table, own_rate_hz(table))
    assert own_rate_hz(table) == rate
    for name, values in table.columns.items():
        if name != "time":
            assert (again.columns[name] == values).all(), name
    np.testing.assert_allclose(again.columns["time"], table.columns["time"], atol=1e-6)


def test_another_rate_lies_between_the_neighbours_as_scipy_puts_it():
    table = moving(np.arange(100) / 50.0)
    again = rows.evenly(table, 30.0)
    t = again.columns["time"]
    np.testing.assert_allclose(np.diff(t), 1.0 / 30.0)
    expected = np.interp(t, table.columns["time"], table.columns["elbow_flexion"])
    np.testing.assert_allclose(again.columns["elbow_flexion"], expected, atol=1e-9)
    q = np.stack([table.columns[f"forearm_r_q{p}"] for p in "wxyz"], axis=1)
    turned = Slerp(table.columns["time"], Rotation.from_quat(q, scalar_first=True))(t)
    ours = np.stack([again.columns[f"forearm_r_q{p}"] for p in "wxyz"], axis=1)
    assert (turned.inv() * Rotation.from_quat(ours, scalar_first=True)).magnitude().max() < 1e-9


def test_nothing_is_put_into_a_gap():
    time_s = np.arange(100) / 50.0
    table = moving(time_s[(time_s < 0.8) | (time_s >= 1.2)])
    for rate in (50.0, 30.0, 100.0):
        again = rows.evenly(table, rate)
        t = again.columns["time"]
        inside = (t > 0.78 + 1e-6) & (t < 1.2 - 1e-6)
        for name in ("elbow_flexion", "forearm_r_qw", "forearm_r_qz"):
            assert np.isnan(again.columns[name][inside]).all()
            assert np.isfinite(again.columns[name][~inside]).all()
        assert (again.columns["quality_forearm_r"][inside] == "").all()


def test_what_is_nearly_all_gap_is_refused_with_where_to_cut_it():
    part = np.arange(100) / 50.0
    table = moving(np.concatenate([part, part + 86_400.0]))
    with pytest.raises(TableError, match=r"from 1\.98 s to 86400\.00 s.*--until 1\.99.*--from 86399\.99"):
        rows.evenly(table, 50.0)
    for cut in (rows.between(table, None, 1.99), rows.between(table, 86_399.99, None)):
        assert len(rows.evenly(cut, 50.0)) == 100
    assert len(rows.evenly(moving(np.concatenate([part, part + 300.0])), 50.0)) == 50 * 302


def test_times_that_do_not_grow_are_refused():
    with pytest.raises(TableError, match=r"time does not grow after 1\.00 s"):
        rows.evenly(moving(np.concatenate([np.arange(51), np.arange(40, 80)]) / 50.0), 50.0)


def test_a_number_beside_an_unknown_one_stays_and_nothing_comes_between():
    table = moving(np.arange(20) / 10.0)
    table.columns["elbow_flexion"][5] = np.nan
    again = rows.evenly(table, 20.0).columns["elbow_flexion"]
    assert np.flatnonzero(np.isnan(again)).tolist() == [9, 10, 11]


def test_columns_are_chosen_by_group_name_and_pattern():
    table = moving(np.arange(5) / 10.0)
    for words, expected in (
        (("clinical",), ["elbow_flexion"]),
        (("segments",), [f"forearm_r_q{p}" for p in "wxyz"]),
        (("elbow_*", "quality"), ["elbow_flexion", "quality_forearm_r"]),
    ):
        assert list(rows.chosen(table, words).columns) == ["time", *expected]
    with pytest.raises(TableError, match="'knee' names nothing in it; give groups"):
        rows.chosen(table, ("knee",))


def test_a_span_counts_from_the_first_instant_and_an_empty_one_is_refused():
    table = moving(7.0 + np.arange(100) / 50.0)
    assert rows.between(table, 0.5, 1.0).columns["time"].tolist() == pytest.approx(np.arange(7.5, 8.0, 0.02))
    with pytest.raises(TableError, match=r"nothing from 5 s on: the motion has 1\.98 s"):
        rows.between(table, 5.0, None)


def test_what_was_not_measured_is_left_out_when_asked():
    table = moving(np.arange(100) / 50.0)
    words = np.where(np.arange(100) % 2 == 0, "assumed", "disturbed")
    table.columns["quality_elbow_angles"] = words
    left = rows.measured(table)
    assert (np.isnan(left.columns["elbow_flexion"]) == (words == "assumed")).all()
    assert (np.isnan(left.columns["forearm_r_qw"]) == (table.columns["quality_forearm_r"] == "held")).all()
    assert np.isfinite(left.columns["time"]).all()
    with pytest.raises(TableError, match="--measured needs the columns of quality"):
        rows.measured(rows.chosen(table, ("clinical",)))


def test_every_number_of_a_result_has_its_quality(result: Table):
    """Of a result as it is: where nothing is measured of the left arm, nothing of it is left."""
    words = {n: np.full(len(result), "held") for n in result.columns if n.startswith("quality_")}
    left = rows.measured(Table(result.columns | words, result.units, result.metadata))
    stays = {n for n, v in left.columns.items() if v.dtype.kind == "f" and np.isfinite(v).any()}
    assert stays == {"time"}


def with_silence(sensor: str) -> Table:
    """Return a left arm with sensors on upper arm and forearm, `sensor`'s silent in rows 2 and 3."""
    words = np.array(["good", "good", "missing", "missing", "held"])
    calm = np.array(["good"] * 5)
    assumed = np.array(["good", "good", "assumed", "assumed", "good"])
    columns = {"time": np.arange(5) / 50.0}
    for part in ("upper_arm", "forearm"):
        columns[f"quality_{part}_l"] = words if part == sensor else calm
    columns |= {"elbow_flexion": np.array([5.0, 6.0, 104.0, 103.0, 7.0]), "quality_elbow_angles": assumed}
    for joint in ("elbow", "hand"):
        columns |= {f"{joint}_{axis}": np.arange(5.0) for axis in "xyz"}
    columns["quality_hand_position"] = np.array(["assumed"] * 5)  # there never was a sensor on the hand
    columns["quality_elbow_position"] = assumed if sensor == "upper_arm" else calm
    return Table(columns, {}, {"sides": ["left"]})


@pytest.mark.parametrize(("sensor", "elbow_known"), [("upper_arm", 3), ("forearm", 5)])
def test_what_is_assumed_only_while_a_sensor_is_silent_is_a_gap(sensor: str, elbow_known: int):
    found = rows.sensed(with_silence(sensor)).columns
    np.testing.assert_array_equal(found["elbow_flexion"], [5.0, 6.0, np.nan, np.nan, 7.0])
    assert np.isfinite(found["elbow_z"]).sum() == elbow_known
    assert np.isfinite(found["hand_x"]).tolist() == [True, True, False, False, True]


def test_what_no_sensor_ever_gave_stands_as_it_was_stated():
    table = with_silence("forearm")
    never = np.array(["missing"] * 5)
    table = Table(table.columns | {"quality_forearm_l": never}, {}, table.metadata)
    found = rows.sensed(table).columns
    assert all(np.array_equal(found[name], values) for name, values in table.columns.items())


def test_a_number_whose_quality_is_missing_is_a_gap():
    table = with_silence("forearm")
    words = np.array(["missing", "good", "good", "good", "good"])
    columns = table.columns | {"theta2": np.ones(5), "quality_shoulder_angles": words}
    found = rows.sensed(Table(columns, {}, table.metadata)).columns["theta2"]
    assert np.isnan(found).tolist() == [True, False, False, False, False]
