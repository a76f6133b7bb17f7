"""What became of every sample that the firmware's sensor took: pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brachium_nodes.firmware_host import ACC_STEP
from brachium_wire.messages import SampleBatch
from brachium_wire.samples import read_samples
from brachium_wire.sequence import SequenceCounter

SAMPLE = np.dtype([("inertial", ">i2", 6), ("field", "<i2", 3)])
KEPT_NS = 300_000_000
"""What was measured so long before its node joined was kept meanwhile; a batch takes less to fill."""


@dataclass(frozen=True, kw_only=True)
class SampleFigures:
    """One node's samples as a reader of the network counts them, beside what its sensor really took."""

    taken: int
    """By the sensor, from the first to the last that came."""
    received: int
    lost: int
    late: int
    unexplained: int
    """Taken, and neither received nor counted as lost; or not what the sensor took under that number."""
    unmarked: int
    """Kept over an interruption and sent again without being marked late."""
    rate_off_percent: float
    """The rate by the samples' own times, against the sensor's true one."""


def sample_figures(
    batches: Sequence[SampleBatch], joined_ns: Sequence[int], measured: bytes, true_rate_hz: float
) -> SampleFigures:
    """Return the figures of batches in the order in which they came; `joined_ns`: when the node joined.

    Each sample's content says which one of `measured` it is; numbers that disagree with it are unexplained.
    """
    counter, late, unmarked = SequenceCounter(), 0, 0
    rows, numbers, times = [], [], []
    for batch in batches:
        samples = read_samples(batch)
        n = len(samples)
        counter.feed(batch.sequence, n)
        late += n if batch.late else 0
        joined = max((t for t in joined_ns if t <= batch.received_ns), default=0)
        unmarked += n if not batch.late and samples.time_ns[-1] < joined - KEPT_NS else 0
        assert samples.acc is not None
        rows.append(np.rint(samples.acc / ACC_STEP).astype(np.int64))
        numbers.append(np.arange(batch.sequence, batch.sequence + n))
        times.append(samples.time_ns)
    got, number, time_ns = np.concatenate(rows), np.concatenate(numbers), np.concatenate(times)
    truth = np.frombuffer(measured, dtype=SAMPLE)["inertial"][:, :3].astype(np.int64)
    wrong = _wrong(got, number, truth)
    taken = int(number.max() - number.min()) + 1
    slope = float(np.polyfit((time_ns - time_ns[0]) * 1e-9, (number - number[0]).astype(float), 1)[0])
    return SampleFigures(
        taken=taken,
        received=counter.received,
        lost=counter.lost,
        late=late,
        unexplained=abs(taken - counter.received - counter.lost) + wrong,
        unmarked=unmarked,
        rate_off_percent=100.0 * abs(slope / true_rate_hz - 1.0),
    )


def _wrong(got: np.ndarray, number: np.ndarray, truth: np.ndarray) -> int:
    """Return how many samples are not what was measured under their number, one shift for all of them."""
    middle = len(got) // 2
    shifts = np.flatnonzero((truth == got[middle]).all(axis=1)) - number[middle]
    at = [np.clip(number + shift, 0, len(truth) - 1) for shift in shifts]
    return min((int((truth[i] != got).any(axis=1).sum()) for i in at), default=len(got))
