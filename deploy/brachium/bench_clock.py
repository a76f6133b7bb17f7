"""How well nodes' clocks are known: many simulated nodes over a bad radio, each beside its truth."""

from dataclasses import dataclass

import numpy as np

from brachium_nodes.clock_trial import trial
from brachium_nodes.link import WIFI

SECONDS = 62.0
AT_S = (5.0, 60.0)
CLOCK_US_NS = 1000
"""A node's clock counts whole us: no statement of it is finer."""


@dataclass(frozen=True, kw_only=True)
class ClockFigures:
    """Error of the first batch after so many seconds, over all runs, ms; and what was said of all batches."""

    runs: int
    skew_ppm: float
    median_ms_5s: float
    p95_ms_5s: float
    median_ms_60s: float
    p95_ms_60s: float
    first_message_p95_ms_60s: float
    """The yardstick: the offset that the first batch shows, kept for a minute."""
    covered: float
    """Share of all batches whose true error lies within the stated uncertainty."""
    covered_worst: float
    """The same, in the worst run."""
    stated_median_ms: float
    backwards: int
    """Batches whose time does not lie after the one before."""


def measure(runs: int, skew_ppm: float = 50.0) -> ClockFigures:
    """Simulate `runs` nodes, seeds 0 to `runs` - 1."""
    errors = np.zeros((runs, len(AT_S)))
    naive, covered, stated, backwards = np.zeros(runs), np.zeros(runs), np.zeros(runs), 0
    for seed in range(runs):
        made = trial(seed, SECONDS, skew_ppm=skew_ppm, delay=WIFI["busy"])
        size = np.abs(made.error_ns)
        errors[seed] = size[np.searchsorted(made.taken_s, AT_S)] * 1e-6
        naive[seed] = made.first_message_error_ns(AT_S[1]) * 1e-6
        covered[seed] = np.mean(size <= made.stated_ns + CLOCK_US_NS)
        stated[seed] = np.median(made.stated_ns) * 1e-6
        backwards += int(np.sum(np.diff(made.published_ns) <= 0))
    (median_5, median_60), (p95_5, p95_60) = np.median(errors, axis=0), np.percentile(errors, 95, axis=0)
    return ClockFigures(
        runs=runs,
        skew_ppm=skew_ppm,
        median_ms_5s=float(median_5),
        p95_ms_5s=float(p95_5),
        median_ms_60s=float(median_60),
        p95_ms_60s=float(p95_60),
        first_message_p95_ms_60s=float(np.percentile(np.abs(naive), 95)),
        covered=float(np.mean(covered)),
        covered_worst=float(np.min(covered)),
        stated_median_ms=float(np.median(stated)),
        backwards=backwards,
    )
