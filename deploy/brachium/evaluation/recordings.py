"""Real recordings solved as users solve them, and what stands in their truth.parquet."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
import numpy.typing as npt

from brachium.evaluation.errors import relative_angle
from brachium.evaluation.solving import solved
from brachium_body import rotation
from brachium_body.segments import Segment
from brachium_fusion.capture_batches import ZERO_NS
from brachium_wire import capture as captures
from brachium_wire import table
from brachium_wire.capture_settings import CaptureSettings, read_settings
from brachium_wire.messages import Skeleton

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Optical orientations of sensors."""

    time_s: Floats
    world_from_sensor: dict[str, Floats]
    """By segment, (n, 4)."""
    counts: Mask
    """(n,) which rows are to be scored."""


def folders(data: Path, metric: str) -> list[Path]:
    """Return the captures below a folder whose truth is scored by `metric`; empty: those without a truth."""
    found = []
    for path in sorted(data.iterdir()):
        if (path / "capture.toml").is_file() and settings_of(path).truth.metric == metric:
            found.append(path)
    return found


def read_truth(folder: Path) -> Truth:
    """Return a capture's truth; rows count where its mask says so and an orientation is known."""
    columns = table.read(next(folder.glob("truth.*"))).columns
    mask = settings_of(folder).truth.mask
    names = [name.removesuffix("_sensor_qw") for name in columns if name.endswith("_sensor_qw")]
    quats = {
        name: np.stack([columns[f"{name}_sensor_q{p}"].astype(np.float64) for p in "wxyz"], axis=1)
        for name in names
    }
    counts = np.ones(len(columns["t"]), dtype=np.bool_)
    if mask:
        counts &= np.nan_to_num(columns[mask].astype(np.float64)) > 0.5
    for q in quats.values():
        counts &= np.isfinite(q).all(axis=1)
    return Truth(columns["t"].astype(np.float64), quats, counts)


def sensor_orientations(skeletons: list[Skeleton], segment: Segment) -> tuple[Floats, Floats]:
    """Return the capture's times (n,) s and world_from_sensor (n, 4) of a segment, NaN where not known."""
    nothing = (np.nan,) * 4
    quats = []
    for skeleton in skeletons:
        pose = skeleton.segments.get(segment)
        quats.append(nothing if pose is None else pose.world_from_sensor or nothing)
    times = np.array([1e-9 * (skeleton.time_ns - ZERO_NS) for skeleton in skeletons])

    return times, np.array(quats, dtype=np.float64)


def between(time_s: Floats, quats: Floats, at: Floats) -> Floats:
    """Return orientations (m, 4) at the instants `at` (m,), turned evenly between neighbours."""
    after = np.clip(np.searchsorted(time_s, at), 1, len(time_s) - 1)
    part = np.clip((at - time_s[after - 1]) / (time_s[after] - time_s[after - 1]), 0.0, 1.0)
    return rotation.slerp(quats[after - 1], quats[after], part)


def total_error_deg(folder: Path, skeletons: list[Skeleton]) -> float:
    """Return the RMS of the whole orientation error of a capture's one sensor, over rows that count."""
    truth = read_truth(folder)
    (name,) = truth.world_from_sensor
    time_s, quats = sensor_orientations(skeletons, name)  # type: ignore[arg-type]
    nearest = np.clip(np.searchsorted(truth.time_s, time_s), 0, len(truth.time_s) - 1)
    there = between(truth.time_s, truth.world_from_sensor[name], time_s)
    error = rotation.angle_between(there, quats)[truth.counts[nearest]]
    error = error[np.isfinite(error)]
    return float(np.degrees(np.sqrt(np.mean(error**2))))


def relative_errors_deg(folder: Path, skeletons: list[Skeleton]) -> tuple[Floats, Floats]:
    """Return times from the first row (n,) s and the errors (n,) of the orientation of a capture's second
    sensor seen from its first, at the lag within its truth's `max_lag_samples` that fits best."""
    truth = read_truth(folder)
    first, second = sorted(truth.world_from_sensor, key=lambda name: name.startswith("forearm"))
    time_s, a = sensor_orientations(skeletons, first)  # type: ignore[arg-type]
    _, b = sensor_orientations(skeletons, second)  # type: ignore[arg-type]
    true_a, true_b = truth.world_from_sensor[first], truth.world_from_sensor[second]
    lags = settings_of(folder).truth.max_lag_samples
    period = float(np.median(np.diff(truth.time_s)))
    row = np.clip(np.round((time_s - truth.time_s[0]) / period).astype(np.int64), 0, len(true_a) - 1)
    best: Floats | None = None
    for lag in range(-lags, lags + 1):
        at = np.clip(row - lag, 0, len(true_a) - 1)
        error = np.where(truth.counts[at], relative_angle(a, b, true_a[at], true_b[at]), np.nan)
        if best is None or np.nansum(error**2) < np.nansum(best**2):
            best = error
    assert best is not None
    return time_s - time_s[0], np.degrees(best)


def settings_of(folder: Path) -> CaptureSettings:
    """Return what a capture's capture.toml says."""
    return read_settings(folder / "capture.toml")


def with_settings(folder: Path, change: Mapping[str, object], method: str) -> list[Skeleton]:
    """Return the skeletons of a capture whose capture.toml says something else."""
    loaded = captures.load(folder)
    settings = msgspec.structs.replace(loaded.settings, **change)
    with TemporaryDirectory() as other:
        captures.write(Path(other) / folder.name, settings, loaded.segments)
        return solved(Path(other) / folder.name, method).skeletons
