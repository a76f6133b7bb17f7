"""Runs the wearables' own firmware on this host: MicroPython, and an emulated board on an emulated person."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from brachium_body.segments import Segment
from brachium_nodes.emulated_board import serve
from brachium_nodes.emulated_board.board import Counts
from brachium_nodes.emulated_board.feed import FeedSettings
from brachium_nodes.emulated_board.settings import BoardSettings, ChipName, write_board
from brachium_nodes.firmware_build import BOARD, PACKAGES, Build, micropython
from brachium_nodes.wearer import Wearer
from brachium_wire.messages import SensorCalibration

ENDS_WITHIN_S = 6.0

ACC_STEP = 9.80665 / 4096
"""m/s^2: 8 g, as the firmware configures every chip."""
GYR_STEP = np.pi / 180.0 / 16.4
"""rad/s: 2000 deg/s."""
MAG_STEPS: dict[ChipName, float] = {"MPU-9150": 0.3, "MPU-9250": 0.15, "ICM-42688-P": 0.3}
"""uT."""


@dataclass(frozen=True, slots=True, eq=False)
class FirmwareNode:
    """One node in a folder of its own, which is its flash. `prepare` makes it."""

    folder: Path
    process: "subprocess.Popen[bytes]"

    @classmethod
    def start(cls, folder: Path, made: Build, *, serial: int = subprocess.DEVNULL) -> "FirmwareNode":
        """Switch on the node that was prepared in `folder`. Raises NoMicroPython.

        `serial`: a file descriptor of its serial line; without one, what it says is in `serial.txt`.
        """
        words = [sys.executable, "-m", serve.__name__, str(folder)]
        words += [*micropython(), str(BOARD / "run.py"), str(made.board), str(made.firmware)]
        environment = {**os.environ, "PYTHONPATH": str(PACKAGES.parent)}
        with (folder / "serial.txt").open("ab") as said:
            process = subprocess.Popen(
                words,
                cwd=folder,
                env=environment,
                stdin=serial,
                stdout=said if serial == subprocess.DEVNULL else serial,
                stderr=said,
                start_new_session=True,
            )
        return cls(folder, process)

    def said(self) -> str:
        """Return what it wrote on its serial line."""
        return (self.folder / "serial.txt").read_text("utf-8", "replace")

    def stop(self) -> Counts:
        """Interrupt it as over the serial line; it says bye. Raises RuntimeError when it failed."""
        self.process.terminate()
        try:
            code = self.process.wait(ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            code = self.process.wait()
        if code != 0:
            raise RuntimeError(f"the firmware ended with {code}: {self.said()[-2000:]}")
        return Counts(**json.loads((self.folder / serve.REPORT).read_text("utf-8")))


def stop_all(nodes: Iterable[FirmwareNode]) -> list[Counts]:
    """Stop every node, in order. Raises RuntimeError for the first that failed, when all have stopped."""
    reports, errors = [], []
    for node in nodes:
        try:
            reports.append(node.stop())
        except RuntimeError as error:
            errors.append(error)
    if errors:
        raise errors[0]
    return reports


def prepare(
    folder: Path, node: str, token: str, wearer: Wearer, segment: Segment, *, seconds: float,
    start_us: int, gateway: str = "", board: BoardSettings | None = None, **more: Any,
) -> None:  # fmt: skip
    """Write a node's flash and its board: it wears `segment` of `wearer` for `seconds` of true time.

    True time 0 is `start_us` of the monotonic clock. `more` goes into brachium.json. Before and after the
    span the person stands still.
    """
    board = board or BoardSettings()
    folder.mkdir(parents=True, exist_ok=True)
    clock, rate_hz = wearer.clocks[segment], wearer.settings.rate_hz
    (folder / "samples.bin").write_bytes(feed(wearer, segment, board, 0, int(seconds * rate_hz)))
    about = FeedSettings(
        path="samples.bin",
        start_us=start_us + round(1e6 * clock.phase_s),
        period_ns=round(1e9 * clock.period_s),
        rate_hz=rate_hz,
    )
    write_board(folder, board, about)
    configuration = {
        "id": node,
        "token": token,
        "gateway": gateway,
        "origin": "emulated",
        "rate_hz": rate_hz,
        "battery": {"pin": 0, "full_scale_v": board.cell.full_scale_v},
        **more,
    }
    calibration = {
        name: value
        for name, value in kept_calibration(wearer.chips[segment].calibration).items()
        if board.chip != "ICM-42688-P" or not name.startswith("mag")
    }
    for name, content in (("brachium", configuration), ("calibration", calibration)):
        (folder / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")


def kept_calibration(calibration: SensorCalibration) -> dict[str, Any]:
    """Return what is known of a calibration, as it is kept on a node."""
    names = ("gyro_bias", "accel_scale", "accel_bias", "mag_offset", "mag_matrix")
    return {name: value for name in names if (value := getattr(calibration, name)) is not None}


def feed(wearer: Wearer, segment: Segment, board: BoardSettings, first: int, count: int) -> bytes:
    """Return what the registers hold for samples (count,) from number `first` on, 18 bytes each.

    AK8975 and AK8963: x is the accelerometer's y, y its x, z its minus z.
    """
    if wearer.settings.mag_every != 1:
        raise ValueError("the board measures the field when the firmware asks; emulate it with every sample")
    readings = wearer.samples(segment, first, count)
    steps = MAG_STEPS[board.chip] * ((np.array(board.field_adjust) - 128) / 256 + 1)
    turned = readings.mag[:, [1, 0, 2]] * [1.0, 1.0, -1.0]
    rows = np.empty(count, dtype=[("inertial", ">i2", 6), ("field", "<i2", 3)])
    rows["inertial"] = _steps(np.hstack([readings.acc / ACC_STEP, readings.gyr / GYR_STEP]), 32767)
    rows["field"] = _steps(turned / steps, 4095 if board.chip == "MPU-9150" else 32760)
    return rows.tobytes()


def _steps(values: Any, most: int) -> Any:
    return np.clip(np.rint(values), -most, most)
