"""Panels span what they show, and their numbers are where the lines are."""

import re
from xml.etree import ElementTree

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.report.panels import LEAST, Panel, Sheet, apart, reach, round_numbers, within, written

NUMBERS = st.lists(st.floats(-400.0, 400.0) | st.just(float("nan")), max_size=30)


@given(NUMBERS, NUMBERS)
def test_all_that_is_known_is_spanned_with_round_numbers_beside_it(
    one: list[float], other: list[float]
) -> None:
    low, high = reach([np.array(one), np.array(other)])
    known = [v for v in one + other if not np.isnan(v)]
    assert all(low < v < high for v in known)
    assert high - low >= LEAST - 1e-9
    if known:
        assert high - low <= max(LEAST, 1.2 * (max(known) - min(known))) + 1e-9
    ticks = within(round_numbers((low, high), 3), (low, high))
    assert 1 <= len(ticks) <= 4
    assert all(tick == round(tick) for tick in ticks)


def test_a_number_is_written_as_people_write_it() -> None:
    assert [written(v) for v in (-20.0, -0.0, 2.5, 120.0)] == ["\N{MINUS SIGN}20", "0", "2.5", "120"]


def test_lines_are_apart_and_where_the_panel_says() -> None:
    sheet = Sheet(4.0, 2.0)
    panel = Panel(sheet=sheet, corner_in=(1.0, 0.5), size_in=(2.0, 1.0), x=(0.0, 10.0), y=(-1.0, 1.0))
    assert panel.at(np.array([[0.0, -1.0], [10.0, 1.0], [5.0, 0.0]])).tolist() == [[1, 0.5], [3, 1.5], [2, 1]]
    lines = [np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[0.0, 1.0], [10.0, 1.0]])]
    panel.line(apart(lines), "#123456", 1.0)
    panel.frame((0.0, 10.0, 11.0), (0.0,))
    root = ElementTree.fromstring(sheet.svg("one"))
    paths = [
        p.get("d", "") for p in root.iter("{http://www.w3.org/2000/svg}path") if "#123456" in str(p.attrib)
    ]
    (path,) = paths
    places = [[float(v) for v in re.findall(r"[\d.]+", part)] for part in re.findall(r"[ML][^MLz]*", path)]
    assert places == [[72.0, 72.0], [216.0, 72.0], [72.0, 36.0], [216.0, 36.0]]  # points, from above
    texts = ["".join(t.itertext()).strip() for t in root.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == ["0", "10", "0"]  # 11 is not shown
