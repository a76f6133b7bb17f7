"""The measure of what a recorder loses, on a short run: its figures are those that are promised."""

from dataclasses import asdict

import msgspec
import pytest

from brachium import bench_disk, bench_recorder
from brachium.page_promises import PAGE_PROOFS


@pytest.mark.network
def test_a_killed_recorder_and_a_full_disk_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_recorder, "LEAST_S", 0.6)
    monkeypatch.setattr(bench_recorder, "MOST_S", 0.7)
    monkeypatch.setattr(bench_recorder, "ARMS", 1)
    monkeypatch.setattr(bench_disk, "SETTLE_S", 0.5)
    monkeypatch.setattr(bench_disk, "AFTER_S", 1.0)
    found = bench_recorder.measure(1)
    disk = found.full_disk
    assert found.kills == 1
    assert found.holes == 0
    assert 0.0 <= found.kill_worst_s == found.kill_median_s <= min(found.power_worst_s.values())
    assert disk.on_monitor
    assert disk.on_page
    assert disk.page_stops
    assert disk.let_go > 0
    assert disk.exit_code == 1
    assert "takes no more" in disk.alarm
    assert disk.opens == disk.disk.startswith("a file system")  # a limit of sizes leaves no room for an index
    assert disk.messages > 0
    assert disk.skeletons_per_s > 0
    assert disk.frames_per_s > 0
    figures = msgspec.to_builtins(asdict(found))
    (proof,) = (proof for proof in PAGE_PROOFS if proof.name == "recorder")
    assert all(promise.take(figures) is not None for promise in proof.promises)
