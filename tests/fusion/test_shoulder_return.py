"""A shoulder whose displacement comes and goes is never shown to jump, and says while it is not measured."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from brachium_fusion.rows import Row
from brachium_fusion.shoulder_return import RETURN_S, ShoulderReturn

PERIOD_NS = 20_000_000
AWAY = np.array([0.02, 0.236, -0.01])


def rows(n: int, first: int = 0, subject: str = "p01") -> list[Row]:
    return [
        Row(subject, "right", (first + i) * PERIOD_NS, 0, (), (), None, False)  # type: ignore[arg-type]
        for i in range(n)
    ]


def told(known: np.ndarray) -> np.ndarray:
    return np.where(known[:, None], AWAY, np.nan)


def test_without_any_displacement_nothing_is_shown_or_remembered() -> None:
    memory = ShoulderReturn()
    assert memory.follow(rows(5), None) == (None, None)
    shown, assumed = memory.follow(rows(5), np.full((5, 3), np.nan))
    assert shown is not None
    assert not shown.any()
    assert assumed is not None
    assert not assumed.any()
    assert memory.state("p01") == {}


def test_a_displacement_that_ends_goes_back_within_seconds_and_is_assumed_meanwhile() -> None:
    known = np.arange(400) < 100
    shown, assumed = ShoulderReturn().follow(rows(400), told(known))
    assert shown is not None
    assert assumed is not None
    np.testing.assert_array_equal(shown[:100], np.tile(AWAY, (100, 1)))
    steps = np.linalg.norm(np.diff(shown, axis=0), axis=1)
    assert steps.max() < np.linalg.norm(AWAY) * 0.02 / RETURN_S  # its way over the time constant
    assert not assumed[:100].any()
    assert assumed[100:230].all()
    assert not assumed[-50:].any()
    assert not shown[-50:].any()


def test_a_displacement_that_comes_back_is_reached_and_then_measured() -> None:
    known = (np.arange(600) < 50) | (np.arange(600) >= 300)
    shown, assumed = ShoulderReturn().follow(rows(600), told(known))
    assert shown is not None
    assert assumed is not None
    assert assumed[300:400].all()
    assert not assumed[-50:].any()
    np.testing.assert_array_equal(shown[-50:], np.tile(AWAY, (50, 1)))


@given(st.lists(st.booleans(), min_size=2, max_size=60), st.integers(0, 60))
@settings(max_examples=50, deadline=None)
def test_it_never_jumps_and_goes_on_from_its_state(changes: list[bool], cut: int) -> None:
    known = np.repeat(changes, 3)
    cut = min(cut, len(known) - 1)
    whole, assumed = ShoulderReturn().follow(rows(len(known)), told(known))
    first, second = ShoulderReturn(), ShoulderReturn()
    first.follow(rows(cut), told(known[:cut]))
    second.restore("p01", first.state("p01"))
    rest, rest_assumed = second.follow(rows(len(known) - cut, cut), told(known[cut:]))
    assert whole is not None
    assert rest is not None
    np.testing.assert_array_equal(rest, whole[cut:])
    np.testing.assert_array_equal(rest_assumed, assumed[cut:])
    begun = int(np.argmax(known)) if known.any() else len(known)
    steps = np.linalg.norm(np.diff(whole[begun:], axis=0), axis=1)
    assert (steps < np.linalg.norm(AWAY) * 0.02 / RETURN_S + 0.0011).all()


def test_arms_do_not_share_what_they_remember() -> None:
    memory = ShoulderReturn()
    memory.follow(rows(1, subject="a"), AWAY[None])
    assert memory.state("b") == {}
    shown, _ = memory.follow(rows(1, subject="b"), None)
    assert shown is not None
    assert not shown.any()
