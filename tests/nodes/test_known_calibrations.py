"""The gateway gives a node that brings no calibration the one that was fitted before."""

import hashlib
from pathlib import Path

import pytest

from brachium_nodes import node_frames as f
from brachium_nodes.conversation import Conversation, Publish
from brachium_nodes.known_calibrations import KnownCalibrations
from brachium_nodes.roster import NodeEntry, Roster
from brachium_wire import calibration_file as kept
from brachium_wire.codec import encode
from brachium_wire.messages import Info, SensorCalibration

TOKEN = hashlib.sha256(b"one").hexdigest()
FITTED, NEWER = SensorCalibration(gyro_bias=(0.01, 0.02, 0.03)), SensorCalibration(gyro_bias=(0.0, 0.0, 0.1))
OWN = SensorCalibration(mag_offset=(1.0, 2.0, 3.0))


def roster(folder: Path | None) -> Roster:
    entry = NodeEntry(id="n1", token_sha256=TOKEN, subject="p01", segment="forearm_r")
    return Roster((entry,), None, KnownCalibrations(folder).of)


def told(roster: Roster, calibration: SensorCalibration) -> SensorCalibration:
    """Return what `info` tells of a node that says hello with this calibration of its own."""
    talk = Conversation(lambda hello: roster.admit(hello, TOKEN, None), "gw", 0)
    hello = f.Hello(node="n1", boot=1, chip="MPU-9150", rate_hz=100.0, calibration=calibration)
    (info,) = [
        a.message
        for a in talk.receive(encode(hello), 0)
        if isinstance(a, Publish) and isinstance(a.message, Info)
    ]
    return info.calibration


def keep(folder: Path, calibration: SensorCalibration) -> None:
    file = kept.CalibrationFile(node="n1", calibration=calibration)
    kept.write(kept.path_of(folder, "n1"), file)


def test_a_node_without_one_gets_what_was_fitted_and_a_new_fit_at_its_next_hello(tmp_path: Path) -> None:
    gateway = roster(tmp_path)
    assert told(gateway, SensorCalibration()) == SensorCalibration()
    keep(tmp_path, FITTED)
    assert told(gateway, SensorCalibration()) == FITTED
    keep(tmp_path, NEWER)
    assert told(gateway, SensorCalibration()) == NEWER


def test_a_nodes_own_calibration_stands(tmp_path: Path) -> None:
    keep(tmp_path, FITTED)
    assert told(roster(tmp_path), OWN) == OWN


def test_without_a_folder_nothing_is_looked_up() -> None:
    assert told(roster(None), SensorCalibration()) == SensorCalibration()


def test_a_spoilt_file_is_named_in_the_log_and_the_node_joins(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "n1.json").write_text("{}", encoding="utf-8")
    assert told(roster(tmp_path), SensorCalibration()) == SensorCalibration()
    assert "n1.json" in caplog.text
    assert "uncalibrated" in caplog.text
