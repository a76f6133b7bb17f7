import json

import pytest

from brachium.evaluation.tables import Limit, Table, middle, shown


def table(**other) -> Table:
    return Table(
        **{
            "name": "t",
            "title": "A table",
            "unit": "deg",
            "columns": ("paper", "live"),
            "rows": (("first", (1.0, None)), ("second", ("none", 0.123))),
            "limits": (Limit(what="live", value=0.123, at_most=0.2, unit="deg"),),
            "notes": ("A note.",),
        }
        | other
    )


@pytest.mark.parametrize(
    ("value", "at_least", "met"),
    [(1.0, False, True), (2.1, False, False), (2.1, True, True), (1.0, True, False)],
)
def test_a_limit_is_met_on_its_side(value: float, at_least: bool, met: bool):
    assert Limit(what="x", value=value, at_most=2.0, unit="mm", at_least=at_least).met is met


def test_what_is_not_measured_meets_no_limit_and_is_never_shown_as_a_figure():
    limit = Limit(what="x", value=None, at_most=2.0, unit="mm")
    assert not limit.met
    assert "not measured" in limit.words()
    assert "NOT MET" in limit.words()
    assert shown(None) == "-"


def test_text_markdown_and_json_hold_every_cell():
    made = table()
    for text in (made.text(), made.markdown()):
        for word in ("A table", "first", "second", "paper", "live", "1.00", "0.12", "none", "A note.", "met"):
            assert word in text
    lines = made.markdown().splitlines()
    assert "| first | 1.00 | - |" in lines
    plain = json.loads(json.dumps(made.plain()))
    assert plain["rows"] == [
        {"label": "first", "paper": 1.0, "live": None},
        {"label": "second", "paper": "none", "live": 0.123},
    ]
    assert plain["limits"][0]["met"] is True


def test_a_row_of_another_length_is_refused():
    with pytest.raises(ValueError, match="row 'x': 1 cells, 2 columns"):
        table(rows=(("x", (1.0,)),))


@pytest.mark.parametrize(
    ("cell", "text"), [(0.0, "0.00"), (0.0123, "0.012"), (0.5, "0.50"), (12.34, "12.3"), (531.2, "531")]
)  # fmt: skip
def test_figures_are_shown_with_what_they_can_carry(cell: float, text: str):
    assert shown(cell) == text


def test_the_middle_leaves_out_what_is_not_known():
    assert middle([3.0, None, 1.0, 2.0]) == 2.0
    assert middle([None, None]) is None
