"""Figures of a recording whose errors are known, because they were put in."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from brachium_viewer import contents, figures
from brachium_wire import keys, recording
from brachium_wire.codec import encode
from brachium_wire.messages import Calibration, Info, Quality, SegmentPose, Session, Skeleton, Status
from brachium_wire.samples import write_samples
from brachium_wire.skeleton_columns import SkeletonCollector

ROOM, SECOND, T0 = "gym", 1_000_000_000, 1_700_000_000_000_000_000
TICK = SECOND // 50
SEGMENTS = ("upper_arm_r", "forearm_r", "hand_r")


def skeleton(
    t_ns: int, angles_deg: dict[str, float], shift_m: float, quality: Quality = "good", **more: Any
) -> Skeleton:
    named: dict[str, Any] = {
        "time_ns": t_ns,
        "side": "right",
        "origin": "emulated",
        "forward": "facing",
        "trunk_from_world": (1.0, 0.0, 0.0, 0.0),
        "segments": {s: SegmentPose(quality=quality) for s in SEGMENTS},
        "positions": {"shoulder": (0.2, 0.0, 0.0), "hand": (0.2, 0.3 + shift_m, 0.0)},
        "angles": {name: float(np.radians(value)) for name, value in angles_deg.items()},
        **more,
    }
    return Skeleton(**named)


def true_angles(t_s: float) -> dict[str, float]:
    """Return smooth angles that pass 180 deg, so that whole turns matter."""
    return {"elbow_flexion": 70.0 + 50.0 * np.sin(t_s), "shoulder_rotation": 40.0 * t_s, "isb_plane": 30.0}


def record(
    path: Path, *, seconds: float = 10.0, off_grid_ns: int = 0, truth: bool = True, **more: Any
) -> None:
    """Write a recording: elbow 2 deg too high with a swing of 1, rotation a whole turn off, hand 12 mm off.

    The first two seconds are uncalibrated and wildly wrong. Latency is 20 ms, each tenth one 60 ms.
    """
    with recording.RecordingWriter(path, {"room": ROOM, "started": "2026-01-02T03:04:05+00:00"}) as writer:
        for segment in SEGMENTS:
            info = Info(node=f"n-{segment}", rate_hz=100.0, origin="emulated", host="h")
            writer.write(keys.info(ROOM, "p01", segment), encode(info), T0)
        writer.write(keys.session(ROOM, "p01"), encode(Session(exercise="reaching")), T0)
        for i in range(round(seconds * 50)):
            t, now = T0 + i * TICK, T0 + i * TICK + 30_000_000
            early = i < 100
            true = true_angles(i / 50)
            if truth:
                writer.write(keys.truth(ROOM, "p01", "right"), encode(skeleton(t, true, 0.0)), now)
            swing = 1.0 if i % 2 else -1.0
            seen = true_angles(i / 50 + off_grid_ns / 1e9)
            seen["elbow_flexion"] += 90.0 if early else 2.0 + swing
            seen["shoulder_rotation"] += 360.0
            one = skeleton(
                t + off_grid_ns,
                seen,
                1.0 if early else 0.012,
                "uncalibrated" if early else "good",
                received_ns=now - (60_000_000 if i % 10 == 0 else 20_000_000),
                **more,
            )
            writer.write(keys.skeleton(ROOM, "p01", "right"), encode(one), now)
            if i % 50 == 49:
                status = Status(
                    node="n", time_ns=now, connected=True, received=2 * i, lost=i // 5, out_of_order=3
                )
                writer.write(keys.status(ROOM, "p01", "hand_r"), encode(status), now)
        done = Calibration(time_ns=T0, state="done", pose="n-pose", warnings=["heading assumed"])
        writer.write(keys.calibration(ROOM, "p01"), encode(done), T0 + round(seconds * SECOND))


def test_known_errors_are_found_after_calibration_alone(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap")
    found = figures.figures(tmp_path / "a.mcap")
    arm = found.arms["p01/right"]
    assert (arm.skeletons, arm.calibrated, arm.compared) == (500, 400, 400)
    elbow = arm.angles_deg["elbow_flexion"]
    assert elbow.n == 400
    assert elbow.bias == pytest.approx(2.0, abs=1e-9)
    assert elbow.rmse == pytest.approx(np.sqrt(5.0), abs=1e-9)
    assert elbow.max_abs == pytest.approx(3.0, abs=1e-9)
    assert arm.angles_deg["shoulder_rotation"].max_abs < 1e-9  # a whole turn is no error
    assert arm.positions_mm["hand"].rmse == pytest.approx(12.0, abs=1e-9)
    assert arm.positions_mm["shoulder"].max_abs == 0.0
    assert arm.clinical_rmse_deg == pytest.approx(np.sqrt(5.0 / 2), abs=1e-9)
    assert arm.rate_hz == pytest.approx(50.0)
    assert arm.latency_p50_ms == pytest.approx(20.0, abs=1e-5)
    assert arm.latency_p99_ms == pytest.approx(60.0, abs=1e-5)
    assert arm.quality["hand_r"] == {"uncalibrated": 100, "good": 400}
    assert found.origins == ["emulated"]
    assert found.duration_s == pytest.approx(10.01)  # the last skeleton came 30 ms after its instant


def test_truth_is_interpolated_when_its_instants_are_others(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", off_grid_ns=7_000_000)
    arm = figures.figures(tmp_path / "a.mcap").arms["p01/right"]
    assert arm.compared == 399  # the last is beyond the truth
    assert arm.angles_deg["elbow_flexion"].bias == pytest.approx(2.0, abs=0.02)
    assert arm.angles_deg["shoulder_rotation"].max_abs < 1e-6


def test_what_rests_on_an_assumption_is_not_compared(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", assumed={"elbow_flexion": "assumed", "shoulder_rotation": "disturbed"})
    arm = figures.figures(tmp_path / "a.mcap").arms["p01/right"]
    assert "elbow_flexion" not in arm.angles_deg
    assert arm.angles_deg["shoulder_rotation"].n == 400


@pytest.mark.parametrize("degrees", [20.5, 19.5])
def test_the_plane_is_compared_where_the_arm_is_truly_raised(tmp_path: Path, degrees: float) -> None:
    """Ten instants hang and are 170 deg off in the plane; five are raised to `degrees` and 1 deg off."""
    with recording.RecordingWriter(tmp_path / "a.mcap") as writer:
        for i in range(15):
            t, hangs = T0 + i * TICK, i < 10
            true = {"isb_elevation": 5.0 if hangs else degrees, "isb_plane": 10.0, "isb_axial": -10.0}
            off = 170.0 if hangs else 1.0
            seen = {"isb_elevation": 90.0, "isb_plane": 10.0 + off, "isb_axial": -10.0 - off}
            writer.write(keys.truth(ROOM, "p01", "right"), encode(skeleton(t, true, 0.0)), t)
            writer.write(keys.skeleton(ROOM, "p01", "right"), encode(skeleton(t, seen, 0.0)), t)
    found = figures.figures(tmp_path / "a.mcap").arms["p01/right"].angles_deg
    assert found["isb_elevation"].n == 15
    if degrees < 20.0:
        assert set(found) == {"isb_elevation"}
    else:
        assert [(found[name].n, round(found[name].rmse, 9)) for name in ("isb_plane", "isb_axial")] == [
            (5, 1.0)
        ] * 2


def test_without_truth_there_is_no_error(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", truth=False)
    arm = figures.figures(tmp_path / "a.mcap").arms["p01/right"]
    assert arm.angles_deg == arm.positions_mm == {}
    assert arm.clinical_rmse_deg is None
    assert arm.compared == 0
    assert arm.calibrated == 400


def test_samples_are_counted_by_the_gateway_else_by_the_recording(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap")
    with recording.RecordingWriter(tmp_path / "b.mcap") as writer:
        for message in recording.read(tmp_path / "a.mcap"):
            writer.write(*message)
        for sequence in (0, 5, 15):
            batch = write_samples(
                sequence=sequence, time_ns=T0 + np.arange(5) * 10_000_000, device_us=np.arange(5) * 10_000,
                received_ns=T0, uncertainty_ns=1, acc=np.zeros((5, 3)), gyr=np.zeros((5, 3)),
            )  # fmt: skip
            writer.write(keys.imu(ROOM, "p01", "forearm_r"), encode(batch), T0)
    found = figures.figures(tmp_path / "b.mcap").segments
    hand, forearm, upper = (found[f"p01/{s}"] for s in ("hand_r", "forearm_r", "upper_arm_r"))
    assert (hand.counted_by, hand.received, hand.lost, hand.out_of_order) == ("gateway", 998, 99, 3)
    assert hand.loss_percent == pytest.approx(100 * 99 / 1097)
    assert (forearm.counted_by, forearm.received, forearm.lost) == ("recording", 15, 5)
    assert forearm.loss_percent == 25.0
    assert (upper.received, upper.lost, upper.loss_percent) == (0, 0, 0.0)


def test_what_cannot_be_read_is_counted_and_harms_nothing(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", seconds=3.0)
    messages = list(recording.read(tmp_path / "a.mcap"))
    bad = recording.Recorded(keys.event(ROOM, "p01"), b"\xc1", T0)
    old = recording.Recorded(keys.event(ROOM, "p01"), encode(Session()), T0)
    found = contents.sort_out([bad, *messages, old])
    assert found.unreadable == {"malformed": 1, "wrong_version": 1}
    assert len(found.arms["p01", "right"].published) == 150


def test_a_recording_of_nothing_has_figures(tmp_path: Path) -> None:
    with recording.RecordingWriter(tmp_path / "a.mcap"):
        pass
    found = figures.figures(tmp_path / "a.mcap")
    assert (found.arms, found.segments) == ({}, {})
    assert found.duration_s == 0.0
    assert found.origins == []


def test_the_figures_are_plain_json(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", seconds=3.0)
    value = figures.figures(tmp_path / "a.mcap").to_json()
    again = msgspec.json.decode(msgspec.json.encode(value))
    assert again["arms"]["p01/right"]["positions_mm"]["hand"]["n"] == 50
    assert again == value


def test_held_and_missing_segments_say_nothing_of_calibration() -> None:
    qualities: list[tuple[dict[str, Quality], bool]] = [
        ({"hand_r": "missing"}, False),
        ({"hand_r": "held"}, False),
        ({"hand_r": "held", "forearm_r": "uncalibrated"}, False),
        ({"hand_r": "held", "forearm_r": "missing"}, False),
        ({"hand_r": "good", "forearm_r": "disturbed"}, True),
        ({"hand_r": "held", "forearm_r": "missing"}, True),
        ({"hand_r": "good", "forearm_r": "uncalibrated"}, False),
    ]
    collector = SkeletonCollector()
    for one, _ in qualities:
        segments = {name: SegmentPose(quality=q) for name, q in one.items()}
        collector.take(encode(skeleton(T0, {}, 0.0, segments=segments)), T0)
    assert contents.calibrated(collector.columns()).tolist() == [expected for _, expected in qualities]
