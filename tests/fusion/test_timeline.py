"""One rotation between two samples, in plain numbers: as arrays have it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brachium_body import rotation
from brachium_fusion.timeline import Reading, at_instant

unit = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: float(np.linalg.norm(q)) > 0.1)
turns = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(unit, turns, st.floats(0.0, 1.0), st.sampled_from([1.0, -1.0]))
def test_a_single_reading_turns_as_arrays_do(q, turn, fraction, sign) -> None:
    before = rotation.normalize(q)
    after = sign * rotation.multiply(before, rotation.from_rotation_vector(turn))
    found = at_instant(Reading(before, after, fraction, "good", 0, 0))
    wanted = rotation.slerp(before, after, fraction)
    assert rotation.angle_between(found, wanted) < 1e-7
    assert abs(float(np.linalg.norm(found)) - 1.0) < 1e-12
