"""What a sensor read while samples were missing: the curve is near a tremor and tame after a blow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BarycentricInterpolator

from brachium_fusion.bridging import bridge, curve


def line(before, after, missing):
    part = (np.arange(1, missing + 1) / (missing + 1))[:, None]
    return before[-1] + part * (after[0] - before[-1])


def tremor(missing: int, phase: float, hz: float = 5.0):
    """Return what lies before, within and after a gap of a sensor that trembles, sampled at 50 Hz."""
    values = np.sin(2.0 * np.pi * hz * np.arange(4 + missing) / 50.0 + phase)[:, None]
    return values[:2], values[2:-2], values[-2:]


def test_one_missing_sample_of_a_tremor_is_eight_times_nearer_than_on_a_straight_line() -> None:
    errors = []
    for phase in np.linspace(0.0, np.pi, 13):
        before, truth, after = tremor(1, phase)
        errors.append((bridge(before, after, 1) - truth, line(before, after, 1) - truth))
    ours, lines = np.sqrt(np.mean(np.square(errors), axis=0)).ravel()
    assert lines == pytest.approx(0.19 / np.sqrt(2.0), rel=0.1)  # of an amplitude of 1
    assert ours < lines / 7.0


@given(
    st.integers(1, 5),
    st.tuples(*[st.floats(-2.0, 2.0)] * 3),
)
def test_within_its_bounds_the_curve_is_scipys_polynomial(missing, shape) -> None:
    at = np.array([-1.0, 0.0, missing + 1.0, missing + 2.0])
    wanted = np.arange(1.0, missing + 1.0)
    a, b, c = shape
    values = a * np.sin(0.3 * at) + b * at + c
    judge = np.asarray(BarycentricInterpolator(at, values)(wanted))
    room = 0.5 * (values.max() - values.min())
    judge = np.clip(judge, values.min() - room, values.max() + room)
    assert bridge(values[:2, None], values[2:, None], missing)[:, 0] == pytest.approx(judge, abs=1e-9)
    nodes = np.tile(at, (missing, 1))
    again = curve(nodes, np.tile(values[:, None], (missing, 1, 1)), wanted)
    assert again[:, 0] == pytest.approx(judge, abs=1e-9)


def test_with_one_sample_of_a_side_a_short_gap_is_curved_and_a_longer_one_straight() -> None:
    before, truth, after = tremor(1, 0.3)
    assert np.abs(bridge(before, after[:1], 1) - truth) < np.abs(line(before, after, 1) - truth)
    before, _, after = tremor(4, 0.3)
    assert bridge(before, after[:1], 4) == pytest.approx(line(before, after, 4))
    assert bridge(before[-1:], after[:1], 4) == pytest.approx(line(before, after, 4))


def test_a_blow_just_before_a_gap_does_not_swing_on_through_it() -> None:
    found = bridge(np.array([[0.0], [40.0]]), np.zeros((2, 1)), 12)
    assert found.max() <= 60.0
    assert found.min() >= -20.0
