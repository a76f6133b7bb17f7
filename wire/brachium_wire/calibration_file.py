"""A node's sensor calibration at rest: one JSON file a node, what holds now and every fit before it.

Fits come from samples as the chip gives them, which recordings and captures keep; so a fit never builds on
another, and the file can always be made again.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

import msgspec

from brachium_wire import keys
from brachium_wire.messages import SensorCalibration

VERSION = 1
Part = Literal["gyro", "accel", "mag"]
PARTS: tuple[Part, ...] = get_args(Part)
ENTRIES: dict[Part, tuple[str, ...]] = {
    "gyro": ("gyro_bias",),
    "accel": ("accel_scale", "accel_bias"),
    "mag": ("mag_offset", "mag_matrix"),
}
"""What of a SensorCalibration each part's fit replaces, all of it: half of one fit does not suit another."""


class CalibrationFileError(ValueError):
    """The file holds no calibration that can be used: what was expected, what came, what to do."""


class Fit(msgspec.Struct, frozen=True, kw_only=True):
    """One fit of one part."""

    part: Part
    method: str
    date: str
    """When it was fitted, ISO 8601."""
    source: str
    """The recording or capture, by name."""
    scores: dict[str, float]
    calibration: SensorCalibration
    """What it found; nothing but this part's entries."""


class CalibrationFile(msgspec.Struct, frozen=True, kw_only=True):
    """A node's file."""

    version: int = VERSION
    node: str
    chip: str = ""
    calibration: SensorCalibration = SensorCalibration()
    """What holds now: the newest fit of each part."""
    fits: tuple[Fit, ...] = ()
    """All fits, oldest first."""


def with_fit(file: CalibrationFile, fit: Fit) -> CalibrationFile:
    """Return the file with one more fit, which from now on holds."""
    entries = {name: getattr(fit.calibration, name) for name in ENTRIES[fit.part]}
    return msgspec.structs.replace(
        file,
        calibration=msgspec.structs.replace(file.calibration, **entries),
        fits=(*file.fits, fit),
    )


def path_of(folder: Path, node: str) -> Path:
    """Return where a node's file lies; raises BadKey for what is no node's id."""
    return folder / f"{keys.chunk(node, 'node id')}.json"


def read(path: Path) -> CalibrationFile:
    """Return what a file holds, or raise CalibrationFileError, or FileNotFoundError."""
    try:
        content = msgspec.json.decode(path.read_bytes())
        version = content.get("version") if isinstance(content, dict) else None
        if version != VERSION:
            raise CalibrationFileError(f"{path}: version {version!r} is not known; {VERSION} is")
        return msgspec.convert(content, CalibrationFile)
    except msgspec.MsgspecError as error:
        raise CalibrationFileError(f"{path}: no calibration of ours ({error}); fit it anew") from None


def write(path: Path, file: CalibrationFile) -> None:
    """Write a file whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f"{path.name}.{os.getpid()}.new")
    try:
        with fresh.open("wb") as out:
            out.write(msgspec.json.format(msgspec.json.encode(file), indent=2) + b"\n")
            out.flush()
            os.fsync(out.fileno())
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)


def to_toml(calibrations: Mapping[str, SensorCalibration]) -> str:
    """Return the `[sensor.<segment>]` tables that capture.toml takes."""
    tables = []
    for segment, calibration in calibrations.items():
        rows = (f"{name} = {value}" for name, value in msgspec.to_builtins(calibration).items())
        tables.append(
            "\n".join([f"[sensor.{segment}]", *(r.replace("(", "[").replace(")", "]") for r in rows)])
        )
    return "\n\n".join(tables) + "\n" if tables else ""
