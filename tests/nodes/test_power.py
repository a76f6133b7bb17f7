"""A node's cell: how long it lasts, whether the warning comes in time, and who is told of it."""

import logging
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brachium_nodes.battery_watch import BatteryWatch
from brachium_nodes.discharge import cells, discharge
from brachium_nodes.emulated_board.cell import Cell, CellSettings
from brachium_nodes.run_time import ESP32_C3, ESP8266, run_time, run_times
from brachium_wire.battery import LOW_BATTERY_H
from brachium_wire.messages import Status


def test_the_warning_comes_twenty_minutes_before_a_cell_is_empty_and_not_much_earlier(
    firmware, tmp_path: Path
) -> None:
    chosen = [
        CellSettings(model="chen", load_ma=110.0, temperature_c=35.0),
        CellSettings(model="chen", load_ma=60.0, temperature_c=5.0, age=1.0, charge=0.5),
        CellSettings(model="tremblay", load_ma=80.0, temperature_c=15.0, age=0.5, charge=0.6),
    ]
    found = discharge(tmp_path, firmware, chosen, seed=40)
    assert [one.cell for one in found] == chosen
    for one in found:
        assert one.warned_min is not None
        assert 20.0 <= one.warned_min <= 35.0
    assert found[0].hours == pytest.approx(700.0 / 110.0, rel=0.1)
    assert len(set(cells())) == len(cells()) >= 100


@given(
    model=st.sampled_from(["chen", "tremblay"]),
    temperature_c=st.floats(0.0, 40.0),
    age=st.floats(0.0, 1.0),
    load_ma=st.floats(40.0, 150.0),
)
def test_a_cell_only_falls_and_an_older_colder_or_harder_used_one_lies_lower(
    model, temperature_c: float, age: float, load_ma: float
) -> None:
    settings = CellSettings(model=model, temperature_c=temperature_c, age=age, load_ma=load_ma)
    cell, volts = Cell(settings), []
    for _ in range(300):
        cell.drain(60.0)
        volts.append(cell.volts())
    assert all(a >= b - 1e-9 for a, b in pairwise(volts))
    best = Cell(CellSettings(model=model, load_ma=40.0, temperature_c=40.0))
    best.charge = cell.charge
    assert cell.volts() <= best.volts() + 1e-9


def test_a_cells_voltage_at_rest_is_the_published_one() -> None:
    # Chen and Rincon-Mora's open voltage, by hand, at half charge: 3.685 + 0.1078 - 0.02945 + 0.04001.
    assert Cell(CellSettings(charge=0.5, load_ma=0.0)).volts() == pytest.approx(3.80336, abs=1e-4)


def test_a_node_is_warned_of_once_and_again_only_with_another_cell(caplog) -> None:
    watch = BatteryWatch()

    def warnings(*hours: float | None) -> int:
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            for left in hours:
                watch.look(
                    Status(
                        node="n", time_ns=1, connected=True, received=1, lost=0, out_of_order=0,
                        battery_hours=left,
                    )
                )  # fmt: skip
        return len(caplog.records)

    assert warnings(None, 8.0, LOW_BATTERY_H + 0.01) == 0
    assert warnings(LOW_BATTERY_H, 0.3, 0.35, 0.1, None, 0.0) == 1
    assert "low battery, 20 min left" in caplog.text
    assert warnings(7.0, 0.2) == 1


def test_run_times_are_the_charge_over_all_that_is_drawn() -> None:
    for one in run_times():
        parts = (one.listening_ma, one.sending_ma, one.computing_ma, one.sensor_ma, one.board_ma)
        assert one.total_ma == pytest.approx(sum(parts) + one.reserve_ma, abs=0.06)
        assert one.hours == pytest.approx(0.95 * one.capacity_mah / one.total_ma, abs=0.06)
        assert one.source
    assert run_time(ESP8266, 100.0, 10).total_ma > run_time(ESP8266, 50.0, 5).total_ma
    assert run_time(ESP8266, 100.0, 5).sending_ma > run_time(ESP8266, 100.0, 10).sending_ma
    assert run_time(ESP32_C3, 50.0, 5).hours > 4.0
