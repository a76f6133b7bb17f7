"""The tables of real recordings: one sensor, two segments on a joint, and a person's two arms."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from brachium.evaluation import recordings
from brachium.evaluation.context import Context
from brachium.evaluation.solving import solved, word
from brachium.evaluation.tables import Cell, Limit, Table
from brachium.promises import BROAD
from brachium_wire.capture_settings import CalibrationSpans, Functional
from brachium_wire.messages import Skeleton

Floats = npt.NDArray[np.float64]

OFFLINE_VQF: Mapping[str, float] = dict(zip(BROAD, (1.01, 0.58, 1.24, 4.30), strict=True))
"""Offline VQF on the same captures."""
ORIENTATION_METHODS = ("printed", "corrected", "vqf", "auto", "best")
LIVE_MEAN_DEG, BEST_MEAN_DEG = float(np.mean(list(BROAD.values()))), 1.45
ROWS_HZ = 50.0
"""Of the table alone: filters take every sample; rows at the recording's rate change no third digit."""


def broad(context: Context) -> list[Table]:
    """Return the whole orientation error of one sensor, for each capture that has such a truth."""
    if context.data is None:
        return []
    found = recordings.folders(context.data, "total")
    if not found:
        return []
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    figures: dict[str, list[float]] = {method: [] for method in ORIENTATION_METHODS}
    for folder in found:
        cells: list[Cell] = []
        for method in ORIENTATION_METHODS:
            context.progress(f"broad: {folder.name}, {method}")
            skeletons = solved(folder, method, rate_hz=ROWS_HZ).skeletons
            figures[method].append(recordings.total_error_deg(folder, skeletons))
            cells.append(figures[method][-1])
        rows.append((folder.name, (*cells, BROAD.get(folder.name), OFFLINE_VQF.get(folder.name))))
    known = [list(d.values()) if len(found) == len(d) else [] for d in (BROAD, OFFLINE_VQF)]
    means = {method: float(np.mean(values)) for method, values in figures.items()}
    known_means = (float(np.mean(values)) if values else None for values in known)
    rows.append(("mean", (*(means[m] for m in ORIENTATION_METHODS), *known_means)))
    limits: tuple[Limit, ...] = ()
    if [folder.name for folder in found] == sorted(BROAD):
        limits = (
            Limit(what="mean, live", value=means["auto"], at_most=LIVE_MEAN_DEG, unit="deg"),
            Limit(what="mean, best", value=means["best"], at_most=BEST_MEAN_DEG, unit="deg"),
        )
    return [
        Table(
            name="broad",
            title="One 9-axis sensor against optical orientation (BROAD)",
            unit="deg, RMS of the whole error where there is movement",
            columns=(
                "printed",
                "corrected",
                "VQF",
                "live",
                "best",
                "VQF, published",
                "offline VQF, published",
            ),
            rows=tuple(rows),
            limits=limits,
        )
    ]


SETTLED_S = 15.0
LIVE_DEG, BEST_DEG = 2.1, 1.9


def two_segments(context: Context) -> list[Table]:
    """Return the error of one segment as seen from the other, heading unknown, no magnetometer."""
    if context.data is None:
        return []
    found = recordings.folders(context.data, "relative")
    if not found:
        return []
    columns = ("VQF", "live, after 15 s", "live, last minute", "best", "best, last minute")
    rows: list[tuple[str, tuple[Cell, ...]]] = []
    for folder in found:
        cells: list[Cell] = []
        for method in ("vqf", "auto", "best"):
            context.progress(f"two segments: {folder.name}, {method}")
            time_s, error = recordings.relative_errors_deg(folder, solved(folder, method).skeletons)
            begin = SETTLED_S if method == "auto" else 0.0
            cells.append(_rms(error[time_s >= begin]))
            if method != "vqf":
                cells.append(_rms(error[time_s >= max(begin, time_s[-1] - 60.0)]))
        rows.append((folder.name, tuple(cells)))
    means = [float(np.mean([c for _, cells in rows if isinstance(c := cells[i], float)])) for i in range(5)]
    rows.append(("mean", tuple(means)))
    return [
        Table(
            name="two-segments",
            title="Two segments on a joint of 1, 2 or 3 axes, no magnetometer, heading unknown",
            unit="deg, RMS of the relative orientation's error",
            columns=columns,
            rows=tuple(rows),
            limits=(
                Limit(what="mean, live, after 15 s", value=means[1], at_most=LIVE_DEG, unit="deg"),
                Limit(what="mean, best", value=means[3], at_most=BEST_DEG, unit="deg"),
            ),
            notes=(
                "Known here: dfjimu's filter 2.49 after 15 s, its smoother 2.50; with perfect heading 1.53.",
            ),
        )
    ]


SPANS_S = ((5.0, 35.0), (50.0, 80.0))
FLEXION_DEG = (-10.0, 160.0)
LEAST_SHARE, APART_DEG = 99.0, 8.0


def people(context: Context) -> list[Table]:
    """Return what can be said of people recorded without a truth: whether their arms are plausible."""
    if context.data is None:
        return []
    tables = []
    for folder in recordings.folders(context.data, ""):
        rows: list[tuple[str, tuple[Cell, ...]]] = []
        limits: list[Limit] = []
        for method in ("auto", "best"):
            context.progress(f"people: {folder.name}, {method}")
            first, second = (_free(folder, method, span) for span in SPANS_S)
            for side in sorted({s.side for s in first}):
                flexion, other = (_column(s, side, "elbow_flexion") for s in (first, second))
                low, high = FLEXION_DEG
                share = 100.0 * float(((flexion >= low) & (flexion <= high)).mean())
                carrying = float(np.nanstd(_column(first, side, "isb_carrying")))
                top = [float(np.nanpercentile(values, 99)) for values in (flexion, other)]
                apart = abs(top[0] - top[1])
                rows.append((f"{side}, {word(method)}", (share, carrying, *top, apart)))
                arm = f"{side}, {word(method)}"
                within = f"{arm}: elbow flexion within {low:g} to {high:g} deg"
                limits.append(
                    Limit(what=within, value=share, at_most=LEAST_SHARE, unit="% of rows", at_least=True)
                )
                limits.append(
                    Limit(
                        what=f"{arm}: 99 % of flexion, spans apart",
                        value=apart,
                        at_most=APART_DEG,
                        unit="deg",
                    )
                )
        tables.append(
            Table(
                name=folder.name,
                title=f"{folder.name}: people without a truth, whether their arms are plausible",
                unit="",
                columns=(
                    "rows within range, %",
                    "sd of carrying angle, deg",
                    "99 % of flexion, first span",
                    "second span",
                    "apart, deg",
                ),
                rows=tuple(rows),
                limits=tuple(limits),
                notes=(
                    "Aligned from 30 s of free movement, once from 5 to 35 s and once from 50 to 80 s of the "
                    "recording. Nothing here is an error: there is no truth.",
                ),
            )
        )
    return tables


def _free(folder: Path, method: str, span: tuple[float, float]) -> list[Skeleton]:
    stated = recordings.settings_of(folder).calibration
    spans = CalibrationSpans(
        pose=stated.pose,
        from_s=stated.from_s,
        to_s=stated.to_s,
        angles_deg=stated.angles_deg,
        functional=(Functional(motion="free", from_s=span[0], to_s=span[1]),),
    )
    return recordings.with_settings(folder, {"calibration": spans}, method)


def _column(skeletons: list[Skeleton], side: str, name: str) -> Floats:
    """Return one angle (n,) of one arm, deg."""
    return np.degrees([s.angles.get(name, np.nan) for s in skeletons if s.side == side])


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.nanmean(errors**2)))
