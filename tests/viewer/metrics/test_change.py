"""A change is one only beyond the measurement error."""

import numpy as np
import pytest

from brachium_viewer.metrics.change import STATED_SDC_DEG, Change, smallest_change


def test_until_there_are_pairs_the_stated_one_holds() -> None:
    assert smallest_change([]).value_deg == STATED_SDC_DEG
    assert smallest_change([(90.0, 91.0)] * 4).pairs == 0


def test_it_follows_the_spread_of_repeated_donnings() -> None:
    random = np.random.default_rng(1)
    first = random.normal(90.0, 3.0 / np.sqrt(2), 5000)
    second = random.normal(90.0, 3.0 / np.sqrt(2), 5000)
    found = smallest_change(list(zip(first, second, strict=True)))
    assert found.pairs == 5000
    assert found.value_deg == pytest.approx(1.96 * 3.0, rel=0.05)


def test_few_pairs_are_trusted_less() -> None:
    pairs = [(90.0, 90.0 + d) for d in (2.0, -2.0, 2.0, -2.0, 2.0)]
    assert smallest_change(pairs).value_deg > smallest_change(pairs * 20).value_deg


def test_identical_movement_is_rarely_called_changed() -> None:
    called = []
    for seed in range(100):
        random = np.random.default_rng(seed)
        pairs = [(float(a), float(b)) for a, b in 90.0 + 2.0 * random.normal(size=(5, 2))]
        known = smallest_change(pairs)
        tried = 90.0 + 2.0 * random.normal(size=(100, 2))
        called += [Change(now=a, before=b, smallest=known).detected for a, b in tried]
    assert 0.0 < np.mean(called) <= 0.05


def test_a_change_is_detected_beyond_it() -> None:
    known = smallest_change([])
    assert not Change(now=99.0, before=90.0, smallest=known).detected
    assert Change(now=101.0, before=90.0, smallest=known).detected
    assert Change(now=79.0, before=90.0, smallest=known).difference == -11.0
