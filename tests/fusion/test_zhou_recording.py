"""`solve --filter zhou`: the arm and its table are the others', the shoulder and the orientations Zhou's."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from brachium_fusion.capture_batches import ZERO_NS
from brachium_fusion.solve import SolveError, SolveSettings, run
from brachium_nodes.session import SessionArrays, session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_wire import capture
from brachium_wire.capture_settings import CalibrationSpans, CaptureSettings

RATE = 25.0
SEGMENTS = ("upper_arm_l", "forearm_l")


@pytest.fixture(scope="module")
def session() -> SessionArrays:
    settings = WearerSettings(
        exercise="shrugging", arms="left", level="ideal", seed=2, rate_hz=RATE, segments=SEGMENTS
    )
    return session_arrays(settings, 26.0)


@pytest.fixture(scope="module")
def folder(session: SessionArrays, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("zhou") / "capture"
    settings = CaptureSettings(
        side="left",
        rate_hz=RATE,
        lengths_m={"chest_to_shoulder": session.lengths.chest_to_shoulder,
                   "upper_arm": session.lengths.upper_arm, "forearm": session.lengths.forearm,
                   "hand": session.lengths.hand},
        facing_deg=0.0,
        mounting={s: tuple(x.nominal_mounting.tolist()) for s, x in session.sensors.items()},
        calibration=CalibrationSpans(pose="n-pose", from_s=0.5, to_s=3.5),
    )  # fmt: skip
    sensors = {
        s: capture.CaptureSegment(t=session.time_s, rate_hz=RATE, acc=x.acc, gyr=x.gyr, mag=x.mag)
        for s, x in session.sensors.items()
    }
    capture.write(path, settings, sensors, "csv")
    return path


def shift_error_mm(session: SessionArrays, folder: Path, name: str) -> float:
    report = run(SolveSettings(input=folder, filter=name))  # type: ignore[arg-type]
    assert report.filter == name
    true, errors = session.arms["left"].shoulder_shift, []
    for skeleton in report.skeletons:
        row = round((skeleton.time_ns - ZERO_NS) * 1e-9 * RATE)
        if row > 6.0 * RATE and skeleton.shoulder_shift is not None:
            errors.append(np.subtract(skeleton.shoulder_shift, true[row]))
            assert all(sd >= 0.0 for sd in skeleton.shoulder_shift_sd or ())
    assert len(errors) > 400
    return float(1e3 * np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def test_corrected_sees_a_shrug_and_printed_does_not(session: SessionArrays, folder: Path):
    assert shift_error_mm(session, folder, "zhou") < 15.0
    assert shift_error_mm(session, folder, "zhou-printed") > 40.0


def test_what_cannot_be_solved_is_refused_and_writes_nothing(folder: Path, tmp_path: Path):
    whole = capture.load(folder)
    unposed = structs.replace(whole.settings, calibration=CalibrationSpans())
    for name, settings, segments in (
        ("one", whole.settings, SEGMENTS[1:]),
        ("no_pose", unposed, SEGMENTS),
    ):
        other = tmp_path / name
        capture.write(other, settings, {s: whole.segments[s] for s in segments}, "csv")
        out = tmp_path / f"{name}.csv"
        with pytest.raises(SolveError, match="--filter zhou needs raw samples of upper arm and forearm"):
            run(SolveSettings(input=other, filter="zhou", out=out))
        assert not out.exists()
