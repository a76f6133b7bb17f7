"""Real recordings: orientations against optical truth, and a person whose arms hang."""

import os
from pathlib import Path

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.capture_batches import batches
from brachium_fusion.from_capture import infos
from brachium_fusion.solve import SolveSettings, run
from brachium_fusion.track import SegmentTrack
from brachium_wire import capture, table

pytestmark = pytest.mark.data

DATA = Path(os.environ.get("BRACHIUM_DATA", Path(__file__).parents[3] / "shared" / "data"))

ONLINE_DEG = {
    "broad_02_undisturbed_slow_rotation_B": 1.38,
    "broad_16_undisturbed_fast_translation_B": 0.74,
    "broad_25_disturbed_tapping_B": 1.62,
    "broad_30_disturbed_stationary_magnet_C": 2.57,
}
"""VQF with magnetometer, online, in its authors' metric: the total error over rows with movement."""


def folder(name: str) -> Path:
    if not (DATA / name).is_dir():
        pytest.skip(f"no recording {name} in {DATA}; set BRACHIUM_DATA to the folder that holds it")
    return DATA / name


def total_error_deg(world_from_sensor, truth) -> float:
    quats = np.stack([truth[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1).astype(np.float64)
    error = rotation.angle_between(quats, world_from_sensor)
    scored = truth["movement"].astype(bool) & np.isfinite(error)
    assert scored.sum() > 10_000
    return float(np.degrees(np.sqrt(np.mean(error[scored] ** 2))))


@pytest.mark.parametrize("name", ONLINE_DEG)
def test_orientations_are_as_good_as_the_filters_authors_have_them(name: str) -> None:
    loaded = capture.load(folder(name))
    track = SegmentTrack(infos(loaded)["forearm_r"], "vqf", True)
    drops: dict = {}
    quats = []
    for _, samples in batches(loaded):
        assert track.feed(samples, drops)  # type: ignore[arg-type]
        quats += [track.timeline.at(t).after for t in samples.time_ns]  # type: ignore[union-attr]
        track.timeline.forget(samples.time_ns[-1])
    truth = table.read(DATA / name / "truth.parquet").columns
    assert total_error_deg(np.array(quats), truth) <= 1.1 * ONLINE_DEG[name]


def test_solve_writes_the_same_orientations(tmp_path: Path) -> None:
    name = "broad_16_undisturbed_fast_translation_B"
    out = tmp_path / "out.parquet"
    report = run(SolveSettings(input=folder(name), out=out, filter="vqf", rate_hz=20.0, groups=("sensors",)))
    columns = table.read(out).columns
    truth = table.read(DATA / name / "truth.parquet").columns
    quats = np.stack([columns[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1)
    after = np.clip(np.searchsorted(truth["t"], columns["time"]), 1, len(truth["t"]) - 1)
    part = (columns["time"] - truth["t"][after - 1]) / (truth["t"][after] - truth["t"][after - 1])
    there = np.stack([truth[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1).astype(np.float64)
    between = rotation.slerp(there[after - 1], there[after], part)
    scored = truth["movement"].astype(bool)[after] & np.isfinite(between[:, 0])
    error = np.degrees(rotation.angle_between(between, quats))[scored]
    assert len(error) > 1000
    assert np.sqrt(np.mean(error**2)) <= 1.1 * ONLINE_DEG[name]
    assert report.drops == {}
    assert any("no calibration" in warning for warning in report.warnings)


def test_a_persons_two_arms_hang_in_the_first_four_seconds(tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    report = run(SolveSettings(input=folder("human_arms"), out=out, rate_hz=25.0))
    assert report.sides == ["left", "right"]
    assert report.forward in ("sternum", "elbow", "facing", "mounting", "none")
    if report.forward == "none":
        assert any("no rule says where forward is" in warning for warning in report.warnings)
    columns = table.read(out).columns
    start = columns["time"] < columns["time"][0] + 4.0
    assert start.sum() == 100
    for ending in ("_r", "_l"):

        def first(name: str, ending: str = ending):
            return columns[name + ending][start].astype(np.float64)

        # Angles that rest on heading are withheld at times; these never are.
        assert np.nanmax(first("isb_elevation")) < 10.0
        assert np.nanmax(np.abs(first("elbow_flexion"))) < 10.0
        assert np.isfinite(first("hand_z")).all()
        assert (first("hand_z") < first("elbow_z") - 0.2).all()
        assert (first("elbow_z") < first("shoulder_z") - 0.2).all()
