"""Arrays become the plain numbers that messages take."""

import numpy as np
import pytest

from brachium_wire.tuples import quaternion, vector


@pytest.mark.parametrize(("made", "size"), [(vector, 3), (quaternion, 4)])
def test_numbers_are_kept_and_are_python_s_own(made, size: int) -> None:
    given = np.linspace(-1.0, np.pi, size)
    found = made(given)
    assert found == tuple(given)
    assert {type(value) for value in found} == {float}
    assert made(list(range(size))) == tuple(map(float, range(size)))
    assert {type(value) for value in made(given.astype(np.float32))} == {float}


@pytest.mark.parametrize(("made", "size"), [(vector, 4), (quaternion, 3)])
def test_another_shape_is_refused(made, size: int) -> None:
    with pytest.raises(ValueError, match="values to unpack"):
        made(np.zeros(size))
