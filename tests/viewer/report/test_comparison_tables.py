"""No difference between arms, or of moved against moving, is shown without the error, nor within it."""

from dataclasses import replace
from typing import Any

import pytest

from brachium_viewer.metrics.measure import measure
from brachium_viewer.report import comparison_tables as beside
from brachium_viewer.report.groups import errors_of, groups, lags, symmetries
from brachium_viewer.report.words import WITHIN_ERROR
from brachium_viewer.sessions.from_recording import session_from_recording

SETS = {
    "right": ("elbow-flexion", "right", "active"),
    "left": ("elbow-flexion", "left", "active"),
    "moved": ("elbow-flexion", "right", "passive"),
}


@pytest.fixture(scope="module")
def every(worn: Any) -> Any:
    """One set each of the right arm (to 100 deg), the left (to 80) and the right one moved (to 108)."""
    sets = session_from_recording(worn).sets
    return {name: next(one for one in sets if one.what == what) for name, what in SETS.items()}


def farther(one: Any, by_deg: float) -> Any:
    """Return the set with each repetition so much farther."""
    found = [
        replace(r, measures={n: replace(m, value=m.value + by_deg) if n in ("range", "peak") else m
                             for n, m in r.measures.items()})
        for r in one.measures.repetitions
    ]  # fmt: skip
    return replace(one, measures=replace(one.measures, repetitions=tuple(found)))


def smooth(one: Any, ldlj: float) -> Any:
    """Return the set with this LDLJ in each repetition."""
    found = [replace(r, measures=r.measures | {"ldlj": measure(ldlj, "1")}) for r in one.measures.repetitions]
    return replace(one, measures=replace(one.measures, repetitions=tuple(found)))


def errors(found: Any) -> Any:
    return {group.what: errors_of(group, ()) for group in found}


@pytest.mark.parametrize(
    ("by_deg", "said"),
    [(15.0, WITHIN_ERROR), (25.0, WITHIN_ERROR), (0.0, "+20 deg (129\N{NO-BREAK SPACE}%)")],
)
def test_arms_differ_beyond_the_error_alone(every: Any, by_deg: float, said: str) -> None:
    found = groups([every["right"], farther(every["left"], by_deg)])
    table = beside.between_arms(symmetries(found, "right"), errors(found))
    assert table is not None
    ((_, ours, theirs, smallest, difference, _),) = table.rows
    assert (ours, smallest, difference) == ("90", "10 (stated)", said)
    assert float(theirs) == pytest.approx(70.0 + by_deg, abs=1.0)


def test_of_ldlj_the_difference_itself_is_told(every: Any) -> None:
    found = groups([smooth(every["right"], -5.30), smooth(every["left"], -5.43)])
    table = beside.between_arms(symmetries(found, "right"), errors(found))
    assert table is not None
    assert table.rows[0][-1] == "+0.13"
    assert not any("%" in text for text in (*table.head, table.note, table.rows[0][-1]))


@pytest.mark.parametrize(
    ("by_deg", "said"),
    [(0.0, WITHIN_ERROR), (7.0, "15 deg"), (-12.0, WITHIN_ERROR), (-23.0, "no: 15 deg less far")],
)
def test_a_lag_is_shown_where_the_moved_arm_goes_farther_than_the_error(
    every: Any, by_deg: float, said: str
) -> None:
    found = groups([every["right"], farther(every["moved"], by_deg)])
    table = beside.active_passive(lags(found), found, errors(found))
    assert table is not None
    ((_, active, passive, smallest, lag),) = table.rows
    assert (active, smallest, lag) == ("100", "10 (stated)", said)
    assert float(passive) == pytest.approx(108.0 + by_deg, abs=1.0)
