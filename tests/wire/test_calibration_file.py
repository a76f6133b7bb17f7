"""A node's calibration file: what was written is read, fits replace whole parts, the past is kept."""

from pathlib import Path

import pytest

from brachium_wire import calibration_file as kept
from brachium_wire.capture_settings import read_settings
from brachium_wire.keys import BadKey
from brachium_wire.messages import SensorCalibration

GYRO = SensorCalibration(gyro_bias=(0.01, -0.02, 0.03))
IRON = SensorCalibration(
    mag_offset=(10.0, -20.0, 5.0), mag_matrix=((1.0, 0.1, 0.0), (0.1, 1.0, 0.0), (0.0, 0.0, 0.99))
)
OFFSET = SensorCalibration(mag_offset=(11.0, -21.0, 6.0))


def fit(part: kept.Part, calibration: SensorCalibration, method: str = "some") -> kept.Fit:
    return kept.Fit(
        part=part,
        method=method,
        date="2026-03-01T10:00:00+00:00",
        source="bench.mcap",
        scores={"residual": 0.01},
        calibration=calibration,
    )


def file() -> kept.CalibrationFile:
    new = kept.CalibrationFile(node="esp-3f21", chip="MPU-9150")
    return kept.with_fit(kept.with_fit(new, fit("gyro", GYRO)), fit("mag", IRON))


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = kept.path_of(tmp_path / "new", "esp-3f21")
    kept.write(path, file())
    assert kept.read(path) == file()
    assert [p.name for p in path.parent.iterdir()] == ["esp-3f21.json"]


def test_a_fit_replaces_the_whole_part_and_keeps_the_one_before() -> None:
    """An offset fitted alone does not suit the matrix of another fit."""
    after = kept.with_fit(file(), fit("mag", OFFSET))
    assert after.calibration == SensorCalibration(gyro_bias=GYRO.gyro_bias, mag_offset=OFFSET.mag_offset)
    assert [f.calibration for f in after.fits] == [GYRO, IRON, OFFSET]


def test_each_entry_of_a_calibration_belongs_to_one_part() -> None:
    entries = [name for part in kept.PARTS for name in kept.ENTRIES[part]]
    assert sorted(entries) == sorted(SensorCalibration.__struct_fields__)


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = kept.path_of(tmp_path, "n1")
    kept.write(path, file())

    def full(_: int) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="no space"):
        kept.write(path, kept.with_fit(file(), fit("mag", OFFSET)))
    assert kept.read(path) == file()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{", "fit it anew"),
        (b"[]", "version None is not known"),
        (b'{"version": 2, "node": "n1"}', "version 2 is not known"),
        (b'{"version": 1}', "node"),
        (b'{"version": 1, "node": "n1", "calibration": {"gyro_bias": [1, 2]}}', "gyro_bias"),
    ],
)
def test_what_is_no_calibration_is_refused_by_name(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "n1.json"
    path.write_bytes(content)
    with pytest.raises(kept.CalibrationFileError, match=r"n1\.json") as refused:
        kept.read(path)
    assert said in str(refused.value)


def test_a_nodes_name_cannot_lead_out_of_the_folder(tmp_path: Path) -> None:
    with pytest.raises(BadKey, match="node id"):
        kept.path_of(tmp_path, "../other")


def test_a_capture_toml_takes_the_tables(tmp_path: Path) -> None:
    path = tmp_path / "capture.toml"
    path.write_text(kept.to_toml({"forearm_r": file().calibration, "hand_r": GYRO}), encoding="utf-8")
    assert read_settings(path).sensor == {"forearm_r": file().calibration, "hand_r": GYRO}
