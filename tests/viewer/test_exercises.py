"""The table of exercises: angles that exist, goals that a joint can reach."""

import pytest

from brachium_body.angles import COLUMNS
from brachium_body.ranges import PLAUSIBLE
from brachium_viewer.exercises import EXERCISES, exercise


@pytest.mark.parametrize("one", EXERCISES.values(), ids=list(EXERCISES))
def test_angle_and_goal_are_possible(one) -> None:
    assert one.angle in COLUMNS
    assert (one.plane is None) == (one.angle != "isb_elevation" or one.name == "reaching")
    if one.goal_deg is not None:
        low, high = PLAUSIBLE[one.angle]
        assert low < one.goal_deg < high


def test_an_unknown_name_is_free_movement() -> None:
    assert exercise("juggling").name == "free"
    assert exercise("drinking").name == "drinking"
