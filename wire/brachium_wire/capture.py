"""Capture folders: one `<segment>.parquet` or `<segment>.csv` each, and an optional `capture.toml`.

Columns: `t` s, `ax ay az` m/s^2, `gx gy gz` rad/s, optional `mx my mz` uT; or `qw qx qy qz`, world from
sensor.
"""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_body.segments import SEGMENTS, Segment, side_of
from brachium_wire import table
from brachium_wire.capture_checks import check_agreement, check_range
from brachium_wire.capture_settings import CaptureError, CaptureSettings, read_settings, to_toml
from brachium_wire.capture_units import BOUNDS, check_acc, check_gyr, doubts, rows
from brachium_wire.samples import MAX_ACC, MAX_GYR, MAX_MAG

Floats = npt.NDArray[np.float64]

_BLOCKS = {
    "acc": ("ax", "ay", "az"),
    "gyr": ("gx", "gy", "gz"),
    "mag": ("mx", "my", "mz"),
    "quat": ("qw", "qx", "qy", "qz"),
}
_LIMITS = {"acc": MAX_ACC, "gyr": MAX_GYR, "mag": MAX_MAG}
_SETTINGS, _TRUTH = "capture.toml", "truth"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CaptureSegment:
    """One sensor's samples: t (n,) s, strictly growing; acc, gyr, mag (n, 3); quat (n, 4) of length 1."""

    t: Floats
    rate_hz: float
    """That of capture.toml when this sensor's median period is within 2 % of it, else the median's."""
    acc: Floats | None = None
    gyr: Floats | None = None
    mag: Floats | None = None
    """A row of NaN where the magnetometer gave none."""
    quat: Floats | None = None
    dropped: int = 0
    """Rows left out: a number in them was missing, or beyond what a sensor measures."""
    beyond: int = 0
    """Of these, the latter."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Capture:
    """A capture folder, read and checked."""

    settings: CaptureSettings
    segments: dict[Segment, CaptureSegment]
    truth: Path | None = None
    """truth.parquet or truth.csv, when there is one."""
    warnings: tuple[str, ...] = field(default=())


def load(folder: Path) -> Capture:
    """Return what a capture folder holds.

    Raises CaptureError, or table.MissingExtra for Parquet without pyarrow.
    """
    if not folder.is_dir():
        raise CaptureError(f"{folder}: no such folder; a capture is a folder with one file a segment")
    files, truth, warnings = _files(folder)
    stated = folder / _SETTINGS
    settings = read_settings(stated) if stated.is_file() else CaptureSettings(side=_side(files))
    segments: dict[Segment, CaptureSegment] = {
        name: _segment(path, settings.rate_hz) for name, path in files.items()
    }
    try:
        check_agreement(settings, {name: segment.t for name, segment in segments.items()})
    except CaptureError as error:
        raise CaptureError(f"{folder}: {error}") from None
    for name, segment in segments.items():
        warnings += doubts(name, segment.acc, segment.dropped - segment.beyond, segment.beyond)
    return Capture(settings=settings, segments=segments, truth=truth, warnings=tuple(warnings))


def write(
    folder: Path,
    settings: CaptureSettings,
    segments: Mapping[Segment, CaptureSegment],
    ending: Literal["csv", "parquet"] = "parquet",
) -> None:
    """Write a capture folder; raises CaptureError when one is there already."""
    if folder.is_dir() and any(folder.iterdir()):
        raise CaptureError(f"{folder}: is not empty; a capture is written to a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _SETTINGS).write_text(to_toml(settings), encoding="utf-8")
    for name, segment in segments.items():
        columns: dict[str, Floats] = {"t": segment.t}
        for block, names in _BLOCKS.items():
            values: Floats | None = getattr(segment, block)
            if values is not None:
                columns |= dict(zip(names, values.T, strict=True))
        table.write(folder / f"{name}.{ending}", columns, {n: _UNITS[n] for n in columns if n in _UNITS}, {})


_UNITS = (
    {"t": "s"}
    | dict.fromkeys(_BLOCKS["acc"], "m/s^2")
    | dict.fromkeys(_BLOCKS["gyr"], "rad/s")
    | dict.fromkeys(_BLOCKS["mag"], "uT")
)


# Segment files


def _files(folder: Path) -> tuple[dict[Segment, Path], Path | None, list[str]]:
    """Return the segments' files from the trunk outwards, the truth's, and what was left aside."""
    found: dict[str, Path] = {}
    aside: list[str] = []
    for path in sorted(folder.iterdir()):
        if path.suffix not in (".csv", ".parquet"):
            continue
        if path.stem not in (*SEGMENTS, _TRUTH):
            if near := difflib.get_close_matches(path.stem, SEGMENTS, n=1, cutoff=0.6):
                raise CaptureError(f"{path}: unknown segment {path.stem!r}; did you mean {near[0]!r}?")
            aside.append(f"{path.name} is no segment and was left aside")
        elif path.stem in found:
            raise CaptureError(f"{folder}: {found[path.stem].name} and {path.name}: keep one of them")
        else:
            found[path.stem] = path
    segments: dict[Segment, Path] = {name: found[name] for name in SEGMENTS if name in found}
    if not segments:
        raise CaptureError(
            f"{folder}: no segment file; write <segment>.csv or .parquet, {', '.join(SEGMENTS)}"
        )
    return segments, found.get(_TRUTH), aside


def _side(segments: Iterable[str]) -> Literal["right", "left", "both"]:
    """Return the side of the arms that the tables are of."""
    found = {side_of(name) for name in segments} - {None}
    return "both" if len(found) == 2 else "left" if found == {"left"} else "right"


def _segment(path: Path, nominal_hz: float | None) -> CaptureSegment:
    try:
        columns = table.read(path).columns
    except table.TableError as error:
        raise CaptureError(str(error)) from None
    if "t" not in columns:
        raise CaptureError(f"{path}: column t (seconds) is missing; there are {', '.join(columns)}")
    blocks = {name: _block(path, columns, names) for name, names in _BLOCKS.items()}
    if (blocks["acc"] is None or blocks["gyr"] is None) and blocks["quat"] is None:
        raise CaptureError(
            f"{path}: expected ax ay az and gx gy gz, or qw qx qy qz; there are {', '.join(columns)}"
        )
    if (blocks["acc"] is None) != (blocks["gyr"] is None):
        raise CaptureError(f"{path}: ax ay az and gx gy gz belong together; one of them is missing")
    t = _numbers(path, columns, "t")
    check_range(path, t)
    whole = np.isfinite(t)
    for name in ("acc", "gyr", "quat"):
        if (block := blocks[name]) is not None:
            whole &= np.isfinite(block).all(axis=1)
    keep = whole.copy()
    for name, limit in _LIMITS.items():
        if (block := blocks[name]) is not None:
            keep &= ~(np.abs(np.nan_to_num(block, posinf=0.0, neginf=0.0)) > limit).any(axis=1)
    beyond = int((whole & ~keep).sum())
    rates = None if blocks["gyr"] is None else blocks["gyr"][whole]
    t, blocks = t[keep], {name: None if b is None else b[keep] for name, b in blocks.items()}
    if len(t) < 2:
        out = f"; {beyond} hold what no sensor measures ({BOUNDS})" if beyond else ""
        raise CaptureError(f"{path}: {rows(len(t), 'whole ')}, at least two are needed{out}")
    _check_order(path, t, np.flatnonzero(keep))
    acc, gyr = blocks["acc"], blocks["gyr"]
    if acc is not None and gyr is not None and rates is not None:
        check_acc(str(path), acc)
        check_gyr(str(path), t, acc, gyr, rates)
    if (quat := blocks["quat"]) is not None:
        blocks["quat"] = _unit(path, quat)
    if (mag := blocks["mag"]) is not None:
        blocks["mag"] = np.where(np.isfinite(mag).all(axis=1, keepdims=True), mag, np.nan)
    own_hz = 1.0 / float(np.median(np.diff(t)))
    near = nominal_hz is not None and abs(own_hz / nominal_hz - 1.0) < 0.02
    rate_hz = nominal_hz if near and nominal_hz is not None else own_hz
    return CaptureSegment(t=t, rate_hz=rate_hz, dropped=int((~keep).sum()), beyond=beyond, **blocks)


def _block(path: Path, columns: Mapping[str, table.Column], names: tuple[str, ...]) -> Floats | None:
    missing = [name for name in names if name not in columns]
    if len(missing) == len(names):
        return None
    if missing:
        raise CaptureError(
            f"{path}: column {missing[0]} is missing beside {', '.join(set(names) - set(missing))}"
        )
    return np.stack([_numbers(path, columns, name) for name in names], axis=1)


def _numbers(path: Path, columns: Mapping[str, table.Column], name: str) -> Floats:
    if columns[name].dtype.kind not in "if":
        cell, row = _first_text(columns[name])
        raise CaptureError(
            f"{path}: data row {row}, column {name} holds text, {cell!r}; expected a number, 9.81"
        )
    return columns[name].astype(np.float64)


def _first_text(column: table.Column) -> tuple[str, int]:
    """Return the first cell that is no number, and its row counted from 1."""
    for row, cell in enumerate(map(str, column.tolist()), start=1):
        try:
            float(cell or "nan")
        except ValueError:
            return cell, row
    return str(column[0]), 1


def _check_order(path: Path, t: Floats, rows: npt.NDArray[np.int64]) -> None:
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        i = int(back[0])
        raise CaptureError(
            f"{path}: t must grow; data row {rows[i + 1] + 1} has {t[i + 1]:.6f} after {t[i]:.6f}"
        )


def _unit(path: Path, quat: Floats) -> Floats:
    length = np.linalg.norm(quat, axis=1)
    worst = int(np.argmax(np.abs(length - 1.0)))
    if abs(length[worst] - 1.0) > 0.05:
        raise CaptureError(f"{path}: qw qx qy qz of length {length[worst]:.3f}; a rotation has length 1")
    unit: Floats = quat / length[:, None]
    return unit
