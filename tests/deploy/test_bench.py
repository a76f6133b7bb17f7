import os
import subprocess
import sys
import time

import pytest

from brachium import bench
from brachium.bench_run import cpu_seconds
from brachium.commands.bench import text
from brachium.shell import Failed
from brachium_wire.messages import SegmentPose, Skeleton

T0 = 1_700_000_000_000_000_000


def skeleton(tick: int, quality: str = "good") -> Skeleton:
    return Skeleton(
        time_ns=T0 + tick * 20_000_000,
        side="right",
        origin="emulated",
        forward="none",
        trunk_from_world=(1.0, 0.0, 0.0, 0.0),
        segments={"forearm_r": SegmentPose(quality=quality), "hand_r": SegmentPose(quality="good")},
        positions={},
        angles={},
    )


def test_gaps_and_poses_that_were_not_measured_are_counted_arm_by_arm():
    a = [(0, "a", skeleton(tick)) for tick in (0, 1, 2, 5)]
    b = [(0, "b", skeleton(tick, "held" if tick == 8 else "good")) for tick in (7, 8, 9)]
    assert bench._count([*a, *b]) == (2, 1, 7)
    assert bench._count([]) == (0, 0, 0)


def test_cpu_time_is_that_of_the_process():
    before = cpu_seconds(os.getpid())
    used = time.process_time()
    while time.process_time() - used < 0.2:
        pass
    assert cpu_seconds(os.getpid()) - before == pytest.approx(time.process_time() - used, abs=0.05)


def test_cpu_time_of_nobody_is_said():
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    with pytest.raises(Failed, match="/proc"):
        cpu_seconds(ended.pid)


@pytest.mark.network
def test_one_arm_is_measured_beside_the_relay():
    found = bench.one_arm(5, 0.4)
    assert len(found.fusion_cpu_windows) == len(found.relay_cpu_windows) == 5
    assert found.skeletons == pytest.approx(5 * 0.4 * 50, abs=15)
    assert found.latency_p50_ms <= found.latency_p99_ms
    assert 0.0 < found.latency_p50_ms < found.sensor_to_skeleton_p50_ms


@pytest.mark.network
def test_many_arms_lose_nothing():
    found = bench.many_arms(4, 0.4)
    assert found.samples_sent == 4 * 3 * 600  # 6 s at 100 Hz
    assert found.skeletons >= 4 * 5 * 50
    # Poses are held, too, where a busy machine holds a sensor up for 150 ms: `prove` asks for none.
    assert (found.skeletons_missing, found.fusion_drops) == (0, {})


def test_the_table_names_every_figure():
    one = {
        name: 1.0
        for name in bench.OneArm.__dataclass_fields__
        if name not in ("fusion_cpu_windows", "relay_cpu_windows")
    }
    said = text({"one_arm": {"5": one, "1": one}, "smoother": {"smoother_ms": 0.03, "vqf_ms": 0.002}})
    assert "% of a core" in said
    assert said.count("\n") == 12
