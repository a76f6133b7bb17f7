"""Since when a sensor is still, however seldom one asks."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brachium_fusion.stillness import STILL_RAD_S, Stillness

PERIOD_NS = 10_000_000


@given(st.lists(st.lists(st.booleans(), min_size=1, max_size=6), min_size=1, max_size=80), st.integers(1, 50))
def test_it_is_still_since_the_instant_after_the_last_movement(
    batches: list[list[bool]], asked_every: int
) -> None:
    stillness, now_ns, wanted = Stillness(), 1_000_000_000, 1_000_000_000
    assert stillness.since_ns == 0
    for number, moving in enumerate(batches):
        times_ns = [now_ns + i * PERIOD_NS for i in range(len(moving))]
        gyr = np.array([[0.0, 2.0 * STILL_RAD_S * m, 0.5 * STILL_RAD_S] for m in moving])
        stillness.see(gyr, times_ns)
        wanted = max([wanted, *(t + 1 for t, m in zip(times_ns, moving, strict=True) if m)])
        now_ns = times_ns[-1] + PERIOD_NS
        if number % asked_every == 0:
            assert stillness.since_ns == wanted
    assert stillness.since_ns == wanted
