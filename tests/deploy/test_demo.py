"""The whole network, once: every service a process, real sockets, losses injected and found again."""

import json
from pathlib import Path

import pytest

from brachium.demo_report import ArmReport, SegmentCounts, problem

pytestmark = pytest.mark.network

SEGMENTS = ("p01/upper_arm_r", "p01/forearm_r", "p01/hand_r")


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory, brachium):
    """One demo of 12 s for all tests of this file: the report, the folder, and what was said."""
    folder = tmp_path_factory.mktemp("demo") / "out"
    words = ["demo", "--seconds", "12", "--headless", "--json", "--loss", "0.1", "--out", str(folder)]
    done = brachium(*words, timeout_s=120.0)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), folder, done.stderr


def test_the_network_counts_exactly_what_was_injected(demo):
    report, _, _ = demo
    assert sorted(report["segments"]) == sorted(SEGMENTS)
    for counts in report["segments"].values():
        assert counts["received"] == counts["sent"]
        assert counts["lost"] == counts["injected_lost"]
        assert counts["out_of_order"] == counts["injected_out_of_order"]
        assert counts["sent"] + counts["lost"] == 1200  # 12 s at 100 Hz
    assert sum(counts["lost"] for counts in report["segments"].values()) > 100  # 10 % of 3600


def test_skeletons_come_calibrated_and_are_compared_with_truth(demo):
    report, _, _ = demo
    assert report["seconds"] == 12.0  # as asked for
    arm = report["arms"]["p01/right"]
    assert arm["rate_hz"] == pytest.approx(50.0, abs=1.0)
    assert arm["compared"] > 200
    assert arm["rmse_deg"]["elbow_flexion"] < 5.0  # at a tenth of all packets lost
    assert arm["rmse_mm"]["wrist"] < 40.0
    assert arm["latency_p50_ms"] > 0.0


def test_it_leaves_a_recording_a_page_and_the_figures(demo):
    report, folder, _ = demo
    assert json.loads((folder / "demo.json").read_text()) == report
    assert Path(report["recording"]) == folder / "recording.mcap"
    page = (folder / "summary.html").read_text()
    assert page.count("<svg") >= 3
    assert "emulated" in page.lower()


def test_solving_the_recording_gives_the_live_skeletons(demo, brachium):
    _, folder, _ = demo
    done = brachium("solve", str(folder / "recording.mcap"), "--json")
    solved = json.loads(done.stdout)
    assert solved["live_compared"] > 400
    assert solved["live_angle_rad"] <= 1e-9
    assert solved["live_position_m"] <= 1e-9


def test_a_folder_that_is_used_is_not_written_over(demo, brachium):
    _, folder, _ = demo
    before = (folder / "demo.json").read_bytes()
    done = brachium("demo", "--seconds", "1", "--headless", "--out", str(folder))
    assert done.returncode == 2
    assert "is not empty" in done.stderr
    assert (folder / "demo.json").read_bytes() == before


def test_a_wrong_exercise_is_said_before_anything_starts(brachium, tmp_path: Path):
    done = brachium("demo", "--exercise", "flying", "--headless", "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert "choose one of" in done.stderr
    assert not (tmp_path / "out").exists()


def counts(**changed: int) -> SegmentCounts:
    same = {"received": 90, "lost": 10, "out_of_order": 5}
    sent = {"sent": 90, "injected_lost": 10, "injected_out_of_order": 5}
    return SegmentCounts(**{**same, **sent, **changed})


ARM = ArmReport(
    skeletons=1, compared=1, rate_hz=50.0, latency_p50_ms=1.0, latency_p99_ms=2.0, rmse_deg={}, rmse_mm={}
)


def test_what_did_not_work_is_named():
    assert problem({"a": counts()}, {"p01/right": ARM}) == ""
    assert problem({"a": counts()}, {}) == "no skeleton came"
    for name in ("received", "lost", "out_of_order"):
        assert problem({"a": counts(**{name: 0})}, {"p01/right": ARM}).startswith(
            "a: the network's counts differ"
        )
