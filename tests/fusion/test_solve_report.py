"""What `solve` says of a capture: which sensors and spans it rests on, nothing that was not used."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from brachium_body import rotation
from brachium_fusion.solve import SolveReport, SolveSettings, run
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire import table
from brachium_wire.capture import CaptureSegment, write
from brachium_wire.capture_settings import CalibrationSpans, CaptureSettings, Functional

RATE = 50.0
POSE = CalibrationSpans(pose="n-pose", from_s=0.5, to_s=3.5)


@pytest.fixture(scope="module")
def session() -> SessionArrays:
    wearer = WearerSettings(exercise="elbow-flexion", level="ideal", seed=3, rate_hz=RATE)
    return session_arrays(wearer, 9.0)


def capture(path: Path, session: SessionArrays, *blocks: str, spans: CalibrationSpans = POSE) -> Path:
    """Write the session's blocks (acc, gyr, mag; quat: the true orientation) as a capture."""
    segments = {
        name: CaptureSegment(
            t=session.time_s,
            rate_hz=RATE,
            **{block: sensor.world_from_sensor if block == "quat" else getattr(sensor, block)
               for block in blocks},
        )
        for name, sensor in session.sensors.items()
    }  # fmt: skip
    mounting = {s: tuple(x.nominal_mounting.tolist()) for s, x in session.sensors.items()}
    settings = CaptureSettings(rate_hz=RATE, mounting=mounting, calibration=spans)
    write(path, settings, segments, "csv")
    return path


def solved(folder: Path, out: Path, **chosen) -> tuple[SolveReport, table.Table]:
    report = run(SolveSettings(input=folder, out=out, rate_hz=25.0, **chosen))
    return report, table.read(out)


@pytest.mark.parametrize("mode", ["live", "best"])
def test_the_table_says_whether_a_magnetic_field_was_used(session, tmp_path: Path, mode) -> None:
    without = capture(tmp_path / "without", session, "acc", "gyr")
    whole = capture(tmp_path / "with", session, "acc", "gyr", "mag")
    out = tmp_path / "out.csv"
    assert solved(without, out, mode=mode)[1].metadata["magnetometer"] is False
    assert solved(whole, out, mode=mode)[1].metadata["magnetometer"] is True
    assert solved(whole, out, mode=mode, magnetometer=False)[1].metadata["magnetometer"] is False


def test_a_movement_that_was_refused_is_not_claimed(session, tmp_path: Path) -> None:
    still = Functional(motion="elbow-flexion", from_s=0.5, to_s=3.5)
    folder = capture(tmp_path / "c", session, "acc", "gyr", spans=structs.replace(POSE, functional=(still,)))
    report, _ = solved(folder, tmp_path / "out.csv", mode="best")
    assert "elbow-flexion_r" in report.refused or "elbow_r" in report.refused
    assert "elbow-flexion" not in report.parts["alignment"]
    assert "n-pose" in report.parts["alignment"]


def test_sensors_that_give_orientation_only_are_solved_at_their_best(session, tmp_path: Path) -> None:
    folder = capture(tmp_path / "c", session, "quat")
    report, found = solved(folder, tmp_path / "out.csv", mode="best")
    assert report.parts["orientation"] == "as the sensors deliver it"
    assert "orientation only" in report.refused["shoulder_r"]
    assert found.metadata["magnetometer"] is False
    assert all(s.shoulder_shift is None for s in report.skeletons)
    quats = np.stack([found.columns[f"forearm_r_sensor_q{p}"] for p in "wxyz"], axis=1)
    at = np.searchsorted(session.time_s, found.columns["time"] - 1e-9)
    truth = session.sensors["forearm_r"].world_from_sensor[at]
    relative = rotation.multiply(rotation.inverse(truth[0]), truth)
    apart = rotation.angle_between(relative, rotation.multiply(rotation.inverse(quats[0]), quats))
    assert np.degrees(apart.max()) < 0.5
    flexion = np.degrees(session.arms["right"].angles["elbow_flexion"])[at]
    assert np.abs(found.columns["elbow_flexion"] - flexion).max() < 5.0
    assert np.ptp(flexion) > 60.0
