"""From raw readings on a bench to the calibration that the gateway gives: fit, file, info."""

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from brachium.__main__ import main
from brachium.commands import sensor
from brachium.raw_sensors import read
from brachium_body.segments import Segment
from brachium_fusion.calibrated import Calibrated
from brachium_fusion.sensor_fits import WHATS
from brachium_nodes.calibration_bench import CalibrationBench
from brachium_nodes.known_calibrations import KnownCalibrations
from brachium_nodes.sensors import FIELD_UT, G
from brachium_nodes.wearer import WearerSettings
from brachium_wire import calibration_file as kept
from brachium_wire import capture, keys
from brachium_wire.capture_settings import CaptureSettings, read_settings
from brachium_wire.codec import encode
from brachium_wire.messages import Info, SensorCalibration
from brachium_wire.recording import Recorded, RecordingWriter
from brachium_wire.samples import write_samples

RATE_HZ = 50.0
NODE = "esp-3f21"
SEGMENT: Segment = "forearm_r"


@pytest.fixture(scope="module")
def bench() -> CalibrationBench:
    return CalibrationBench(WearerSettings(seed=7, rate_hz=RATE_HZ), SEGMENT)


@pytest.fixture(scope="module")
def readings(bench: CalibrationBench) -> dict[str, np.ndarray]:
    """Raw rows of one session on the bench: a rest, still poses, slow turns."""
    parts = [bench.at_rest(6.0), *bench.still_poses(), bench.turned_everywhere(40.0)]
    return {name: np.concatenate([getattr(p, name) for p in parts]) for name in ("gyr", "acc", "mag")}


@pytest.fixture
def recorded(tmp_path: Path, readings: dict[str, np.ndarray]) -> Path:
    """The same as a recording; its info carries a calibration that is wrong, which the fit does not use."""
    path, n = tmp_path / "bench.mcap", len(readings["gyr"])
    info = Info(
        node=NODE,
        rate_hz=RATE_HZ,
        origin="emulated",
        host="gw",
        chip="MPU-9150",
        magnetometer=True,
        calibration=SensorCalibration(gyro_bias=(1.0, 1.0, 1.0)),
    )
    with RecordingWriter(path, {}) as writer:
        writer.write(*Recorded(keys.info("gym", "p01", SEGMENT), encode(info), 0))
        for first in range(0, n, 50):
            rows = slice(first, min(first + 50, n))
            times = [round((i + 1) * 1e9 / RATE_HZ) for i in range(rows.start, rows.stop)]
            batch = write_samples(
                sequence=first,
                time_ns=times,
                device_us=[t // 1000 for t in times],
                received_ns=times[-1],
                uncertainty_ns=0,
                acc=readings["acc"][rows],
                gyr=readings["gyr"][rows],
                mag=readings["mag"][rows],
            )
            writer.write(*Recorded(keys.imu("gym", "p01", SEGMENT), encode(batch), times[-1]))
    return path


def off(found: SensorCalibration, bench: CalibrationBench) -> dict[str, float]:
    """Return how far readings calibrated so are from those of a perfect calibration, at most."""
    perfect, mine = Calibrated(bench.perfect_calibration()), Calibrated(found)
    turned = bench.turned_everywhere(20.0)
    return {
        "gyr_dps": float(np.degrees(np.abs(mine.gyr(turned.gyr) - perfect.gyr(turned.gyr)).max())),
        "acc": float(np.abs(mine.acc(turned.acc) - perfect.acc(turned.acc)).max()),
        "mag": float(np.abs(mine.mag(turned.mag) - perfect.mag(turned.mag)).max()),
    }


def test_raw_readings_come_out_calibrated_at_the_gateway(
    recorded: Path, tmp_path: Path, bench: CalibrationBench, capsys: pytest.CaptureFixture[str]
) -> None:
    """Recording -> fit -> file -> what `info` will carry: within what the chip's residuals allow."""
    assert main(["sensor", str(recorded), "--out", str(tmp_path / "kept")]) == 0
    said = capsys.readouterr().out
    assert f"{NODE} on {SEGMENT}" in said
    found = KnownCalibrations(tmp_path / "kept").of(NODE, SensorCalibration())
    errors = off(found, bench)
    assert errors["gyr_dps"] < 0.05
    assert errors["acc"] < 0.003 * G
    assert errors["mag"] < 0.02 * np.linalg.norm(FIELD_UT)
    raw = off(SensorCalibration(), bench)
    assert all(raw[name] > 10.0 * errors[name] for name in errors)
    toml = tmp_path / "capture.toml"
    toml.write_text(said.split("for capture.toml:")[1], encoding="utf-8")
    assert read_settings(toml).sensor == {SEGMENT: found}


def test_a_second_fit_adds_to_the_file(recorded: Path, tmp_path: Path) -> None:
    for what in ("gyro", "gyro", "mag-min-max"):
        assert main(["sensor", str(recorded), "--what", what, "--out", str(tmp_path)]) == 0
    file = kept.read(kept.path_of(tmp_path, NODE))
    assert file.chip == "MPU-9150"
    assert [fit.method for fit in file.fits] == ["gyro-at-rest", "gyro-at-rest", "mag-min-max"]
    assert {fit.source for fit in file.fits} == {"bench.mcap"}
    assert file.calibration.mag_matrix is None


def test_a_capture_folder_gives_the_same_fit(
    recorded: Path, tmp_path: Path, readings: dict[str, np.ndarray], capsys: pytest.CaptureFixture[str]
) -> None:
    """Its node is called as the segment; readings are those of the recording up to its float32."""
    t = np.arange(len(readings["gyr"])) / RATE_HZ
    acc, gyr, mag = (readings[name] for name in ("acc", "gyr", "mag"))
    segment = capture.CaptureSegment(t=t, rate_hz=RATE_HZ, acc=acc, gyr=gyr, mag=mag)
    folder = tmp_path / "capture"
    capture.write(folder, CaptureSettings(rate_hz=RATE_HZ), {SEGMENT: segment}, "csv")
    found = []
    for given in (recorded, folder):
        assert main(["sensor", str(given), "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out)[0])
    assert found[1]["node"] == SEGMENT
    for what in ("gyro", "accel", "mag"):
        for name, value in found[0]["fits"][what]["calibration"].items():
            np.testing.assert_allclose(found[1]["fits"][what]["calibration"][name], value, atol=1e-3)


def test_what_a_movement_does_not_tell_is_refused_by_name(
    tmp_path: Path, bench: CalibrationBench, capsys: pytest.CaptureFixture[str]
) -> None:
    """A rest alone gives the gyroscope's bias; the others say what is missing, and nothing else is lost."""
    rest = bench.at_rest(5.0)
    t = np.arange(len(rest.gyr)) / RATE_HZ
    segment = capture.CaptureSegment(t=t, rate_hz=RATE_HZ, gyr=rest.gyr, acc=rest.acc)
    capture.write(tmp_path / "rest", CaptureSettings(rate_hz=RATE_HZ), {SEGMENT: segment}, "csv")
    assert main(["sensor", str(tmp_path / "rest"), "--json"]) == 0
    fits = json.loads(capsys.readouterr().out)[0]["fits"]
    assert "gyro_bias" in fits["gyro"]["calibration"]
    assert "still poses" in fits["accel"]["refused"]
    assert "no magnetic field" in fits["mag"]["refused"]
    assert main(["sensor", str(tmp_path / "rest"), "--what", "mag", "--out", str(tmp_path / "no")]) == 1
    assert not (tmp_path / "no").exists()


def test_asking_for_a_sensor_that_is_not_there_names_those_that_are(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sensor", str(recorded), "--node", "other"]) == 2
    assert f"{NODE} on {SEGMENT}" in capsys.readouterr().err
    assert main(["sensor", "/nowhere.mcap"]) == 2


def test_the_choices_are_those_of_the_fits() -> None:
    parser = argparse.ArgumentParser()
    sensor.configure(parser)
    (what,) = [a for a in parser._actions if a.dest == "what"]
    assert what.choices == (*WHATS, "all")


def test_reading_gives_every_row(recorded: Path, readings: dict[str, np.ndarray]) -> None:
    (one,) = read(recorded)
    assert (one.node, one.segment, one.chip, one.samples.rate_hz) == (NODE, SEGMENT, "MPU-9150", RATE_HZ)
    assert one.samples.gyr is not None
    np.testing.assert_allclose(one.samples.gyr, readings["gyr"], atol=1e-5)
