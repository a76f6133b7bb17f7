"""The path that a hand leaves: bounded, faint with age, and broken where nothing was measured."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brachium_viewer.scene import SKY
from brachium_viewer.trails import BREAK_S, STEP_S, TRAIL_S, HandTrail


def at(time_s: float) -> np.ndarray:
    return np.array([time_s, 0.0, 1.0])


def test_a_path_runs_through_where_the_hand_was_and_fades() -> None:
    trail, drawn = HandTrail(SKY), None
    for step in range(500):
        drawn = trail.take(step * STEP_S, at(step * STEP_S)) or drawn
    assert drawn is not None
    times = [strip[:, 0] for strip in drawn.strips]
    assert times[0][0] >= 499 * STEP_S - TRAIL_S - 1e-9
    assert times[-1][-1] == 499 * STEP_S
    assert all(a[-1] == b[0] for a, b in pairwise(times))  # one line, in parts
    opacities = [colour[3] for colour in drawn.colours]
    assert opacities == sorted(set(opacities))
    assert {colour[:3] for colour in drawn.colours} == {SKY[:3]}


def test_where_nothing_was_measured_there_is_no_line() -> None:
    trail = HandTrail(SKY)
    for step in range(10):
        trail.take(step * STEP_S, at(step * STEP_S))
    assert trail.take(0.5, None) is None
    later = 10 * STEP_S + BREAK_S
    drawn = None
    for step in range(10):
        drawn = trail.take(later + step * STEP_S, at(later + step * STEP_S))
    assert drawn is not None
    gaps = [b - a for strip in drawn.strips for a, b in pairwise(strip[:, 0])]
    assert max(gaps) < BREAK_S
    assert len(drawn.strips) == 2


@given(st.lists(st.tuples(st.floats(0.0, 100.0), st.booleans()), max_size=300))
def test_any_times_leave_a_short_path(moments: list[tuple[float, bool]]) -> None:
    trail = HandTrail(SKY)
    for time_s, measured in moments:
        drawn = trail.take(time_s, at(time_s) if measured else None)
        if drawn is not None:
            assert len(drawn.strips) == len(drawn.colours)
            for strip in drawn.strips:
                assert len(strip) > 1
                assert (np.diff(strip[:, 0]) > 0.0).all()
                assert time_s - TRAIL_S <= strip[0, 0] <= strip[-1, 0] <= time_s


def test_an_end_forgets_the_path() -> None:
    trail = HandTrail(SKY)
    trail.take(0.0, at(0.0))
    trail.take(STEP_S, at(STEP_S))
    assert trail.end().strips == ()
    drawn = trail.take(2 * STEP_S, at(2 * STEP_S))
    assert drawn is not None
    assert drawn.strips == ()
