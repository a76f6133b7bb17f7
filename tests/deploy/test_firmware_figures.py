"""A reader's counts of the firmware's samples, where the truth is known."""

import numpy as np
import pytest

from brachium.firmware_figures import SAMPLE, sample_figures
from brachium_nodes.firmware_host import ACC_STEP
from brachium_wire.messages import SampleBatch

RATE_HZ = 100.0
START_NS = 1_000_000_000_000


def measured(count: int = 400) -> np.ndarray:
    rows = np.zeros(count, dtype=SAMPLE)
    rows["inertial"] = np.random.default_rng(1).integers(-9000, 9000, (count, 6))
    return rows


def batch(rows: np.ndarray, first: int, *, sequence: int | None = None, **more: object) -> SampleBatch:
    steps = rows["inertial"][first : first + 10]
    begun = START_NS + first * 10_000_000
    fields = {
        "sequence": first if sequence is None else sequence,
        "time_ns": begun,
        "device_us": begun // 1000,
        "offsets": (np.arange(10) * 10_000_000).astype("<u4").tobytes(),
        "device_offsets": (np.arange(10) * 10_000).astype("<u4").tobytes(),
        "received_ns": begun + 110_000_000,
        "uncertainty_ns": 1000,
        "acc": (steps[:, :3] * ACC_STEP).astype("<f4").tobytes(),
        "gyr": (steps[:, 3:] * 1e-3).astype("<f4").tobytes(),
    }
    return SampleBatch(**(fields | more))


def figures(batches, rows, joined_ns=()):
    return sample_figures(batches, joined_ns, rows.tobytes(), RATE_HZ)


def test_what_came_and_what_is_missing_add_up():
    rows = measured()
    found = figures([batch(rows, first) for first in range(0, 400, 10) if first not in (100, 110)], rows)
    assert (found.taken, found.received, found.lost, found.unexplained) == (400, 380, 20, 0)
    assert found.rate_off_percent == pytest.approx(0.0, abs=1e-9)


def test_a_number_that_is_not_the_samples_own_is_unexplained():
    rows = measured(500)
    batches = [batch(rows, first) for first in range(0, 300, 10)]
    batches += [batch(rows, first, sequence=first + 3) for first in range(300, 400, 10)]
    assert figures(batches, rows).unexplained == 100


def test_one_wrong_sample_is_unexplained():
    rows = measured()
    wrong = rows.copy()
    wrong["inertial"][33, 0] += 1
    assert figures([batch(wrong, first) for first in range(0, 400, 10)], rows).unexplained == 1


@pytest.mark.parametrize(("late", "unmarked"), [(True, 0), (False, 20)])
def test_what_was_kept_over_an_interruption_must_be_marked(late: bool, unmarked: int):
    rows = measured()
    joined = START_NS + 2_000_000_000
    kept = [batch(rows, first, received_ns=joined + 1, late=late) for first in (100, 110)]
    batches = [batch(rows, first) for first in range(0, 100, 10)] + kept
    batches += [batch(rows, first) for first in range(200, 400, 10)]
    found = figures(batches, rows, (START_NS, joined))
    assert (found.unmarked, found.late) == (unmarked, 20 - unmarked)


def test_a_rate_that_is_off_is_told():
    rows = measured()
    found = sample_figures([batch(rows, first) for first in range(0, 400, 10)], (), rows.tobytes(), 100.1)
    assert found.rate_off_percent == pytest.approx(0.0999, abs=1e-4)
