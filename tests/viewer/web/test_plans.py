"""What is to be done is kept for every screen: what was chosen, and which set is next."""

from typing import Any

from brachium_body.segments import Side
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.web.page_state import PageState
from brachium_viewer.web.plans import MOST, Plans


def meant(exercise: str = "elbow-flexion", side: Side = "right", **words: Any) -> ExerciseBegins:
    return ExerciseBegins(exercise=exercise, side=side, **{"sets": 3, **words})


def test_what_was_meant_last_is_at_the_end_and_each_exercise_keeps_its_limit():
    plans = Plans()
    plans.mean("p01", meant(limit_deg=92.0))
    plans.mean("p01", meant("shoulder-flexion"))
    plans.mean("p01", meant(side="left"))
    assert [(one.exercise, one.side, one.limit_deg) for one in plans.of("p01")] == [
        ("elbow-flexion", "right", 92.0),
        ("shoulder-flexion", "right", None),
        ("elbow-flexion", "left", None),
    ]
    plans.mean("p01", meant(limit_deg=80.0))
    assert [one.limit_deg for one in plans.of("p01")] == [None, None, 80.0]
    assert plans.of("p02") == plans.of(None) == []


def test_sets_are_counted_by_whoever_ends_them_and_begin_again_after_the_last():
    plans = Plans()
    numbers = []
    plans.mean("p01", meant(limit_deg=92.0))
    for _ in range(4):
        (plan,) = plans.of("p01")
        plans.begun("p01", plan)
        plans.mean("p01", meant(limit_deg=92.0))  # chosen anew on a screen that knows no number
        plans.ended("p01", plan)
        numbers += [(one.set, one.limit_deg) for one in plans.of("p01")]
    assert numbers == [(2, 92.0), (3, 92.0), (1, 92.0), (2, 92.0)]
    plans.over("p01")
    assert [(one.set, one.limit_deg) for one in plans.of("p01")] == [(1, 92.0)]


def test_fewer_sets_than_were_done_begin_again():
    plans = Plans()
    plans.mean("p01", meant())
    plans.ended("p01", meant(set=2))
    assert [(one.set, one.sets) for one in plans.of("p01")] == [(3, 3)]
    plans.mean("p01", meant(sets=2))
    assert [(one.set, one.sets) for one in plans.of("p01")] == [(1, 2)]


def test_a_set_that_nobody_planned_makes_no_plan():
    plans = Plans()
    plans.begun("p01", meant(sets=1))
    plans.ended("p01", meant(sets=1))
    assert plans.of("p01") == []


def test_no_more_is_kept_than_there_can_be():
    plans = Plans()
    for number in range(2 * MOST):
        plans.mean("p01", meant(f"e{number}"))
    assert len(plans.of("p01")) == MOST
    assert plans.of("p01")[-1].exercise == f"e{2 * MOST - 1}"


def test_every_screen_is_told_the_plan_of_who_is_shown():
    state = PageState("lab", "p01")
    assert state.state(0)["plans"] == []
    state.plans.mean("p01", meant(goal_deg=80.0))
    state.begin(meant(goal_deg=85.0, limit_deg=90.0, repetitions=10), 0)
    assert state.state(0)["plans"] == [
        {
            "exercise": "elbow-flexion",
            "side": "right",
            "mode": "active",
            "goal_deg": 85.0,
            "limit_deg": 90.0,
            "set": 1,
            "sets": 3,
            "repetitions": 10,
        }
    ]
    state.end()
    assert [one["set"] for one in state.state(0)["plans"]] == [2]
    state.choose("p02")
    assert state.state(0)["plans"] == []
