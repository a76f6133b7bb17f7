"""What smoothing a shoulder costs is measured beside compiled code, in the same run."""

import math
from statistics import median

from brachium import bench_smoother


def test_the_cost_is_the_median_of_the_runs_beside_vqf() -> None:
    found = bench_smoother.measure(6.0)
    assert found.samples == 600
    assert len(found.smoother_runs_ms) == len(found.vqf_runs_ms) == bench_smoother.RUNS
    assert found.smoother_ms == median(found.smoother_runs_ms)
    assert found.vqf_ms == median(found.vqf_runs_ms)
    assert all(math.isfinite(ms) and ms > 0.0 for ms in (*found.smoother_runs_ms, *found.vqf_runs_ms))
