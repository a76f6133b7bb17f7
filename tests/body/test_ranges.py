import numpy as np
import pytest

from brachium_body import angles, ranges


def test_every_range_is_of_a_column_and_the_right_way_round():
    for table in ranges.RANGES.values():
        for name, (low, high) in table.items():
            assert name in angles.COLUMNS
            assert low is None or high is None or low < high


def test_a_plausible_range_holds_all_that_healthy_people_do():
    for name in ranges.REFERENCE.keys() & ranges.PLAUSIBLE.keys():
        for table in (ranges.REFERENCE, ranges.PAPER):
            assert ranges.PLAUSIBLE[name].low <= table[name].low
            assert ranges.PLAUSIBLE[name].high >= table[name].high


@pytest.mark.parametrize(("name", "bounds"), list(ranges.PLAUSIBLE.items()))
def test_outside_is_flagged_on_both_ends_and_in_its_column_only(name, bounds):
    values = np.radians([bounds.low - 1.0, bounds.low + 1.0, bounds.high - 1.0, bounds.high + 1.0])
    rows = np.full((4, len(angles.COLUMNS)), np.nan)
    rows[:, angles.INDEX[name]] = values
    flags = ranges.outside_plausible(rows)
    assert flags[:, angles.INDEX[name]].tolist() == [True, False, False, True]
    assert flags.sum() == 2


def test_what_is_not_known_or_has_no_range_is_not_flagged():
    assert not ranges.outside_plausible(np.full(len(angles.COLUMNS), np.nan)).any()
    flags = ranges.outside_plausible(np.full(len(angles.COLUMNS), 100.0))
    assert {name for name, flag in zip(angles.COLUMNS, flags, strict=True) if flag} == set(ranges.PLAUSIBLE)


def test_what_no_joint_can_do_is_not_taken_as_stated():
    ranges.check_stated({"elbow_flexion": 160.0, "shoulder_flexion": -40.0})
    for value in (350.0, -16.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"^elbow_flexion = .*: no joint does that; .* -15 to 160$"):
            ranges.check_stated({"wrist_flexion": 10.0, "elbow_flexion": value})
    with pytest.raises(ValueError, match=r"^elbow: no angle that can be stated; expected elbow_flexion, "):
        ranges.check_stated({"elbow": 10.0})
    with pytest.raises(ValueError, match=r"expected elbow_flexion$"):
        ranges.check_stated({"wrist_flexion": 10.0}, ("elbow_flexion",))
