"""The chart of ranges: each row's numbers stand clear of all that is drawn of it."""

from xml.etree import ElementTree

import pytest

from brachium_viewer.report.range_chart import MANY, NEED, RangeBar, ranges

SVG = "{http://www.w3.org/2000/svg}"


def bar(label, now, other=None, last=None):
    return RangeBar(
        label=label, mode="active", now=now, other=other, last=last, reference=(0.0, 150.0), need=None
    )


def texts(drawing):
    root = ElementTree.fromstring(drawing)
    found = {}
    for text in root.iter(f"{SVG}text"):
        found["".join(text.itertext()).strip()] = float(text.get("x"))
    return found


@pytest.mark.parametrize("far", ["other", "last"])
def test_no_line_goes_through_the_numbers(far):
    alone = texts(ranges("one", [bar("a", (10.0, 100.0)), bar("b", (10.0, 140.0))]))
    beside = texts(ranges("one", [bar("a", (10.0, 100.0), **{far: (10.0, 140.0)}), bar("b", (10.0, 140.0))]))
    assert alone["10 to 100"] < alone["10 to 140"] - 50.0
    assert beside["10 to 100"] == pytest.approx(beside["10 to 140"], abs=0.2)


def test_what_goes_down_is_told_from_low_to_high_on_its_right():
    found = texts(ranges("one", [bar("down", (0.0, -45.0))]))
    assert "-45 to 0" in found
    assert found["-45 to 0"] > found["0"]


def test_many_rows_are_lower_and_signs_that_are_not_there_are_not_explained():
    def height(rows):
        drawing = ranges("one", [bar(f"row {i}", (0.0, 90.0)) for i in range(rows)])
        return float(ElementTree.fromstring(drawing).get("viewBox").split()[3])

    assert height(2 * MANY) < 1.6 * height(MANY)
    drawing = ranges("one", [bar("a", (0.0, 90.0))])
    assert NEED not in drawing
    assert "other side" not in drawing
