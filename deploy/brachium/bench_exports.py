"""How far each exported file, in somebody else's reader, is from what was exported: both arms of a wearer."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium.export_readers import readers
from brachium.export_readers.found import Found
from brachium.version import version
from brachium_fusion import solve
from brachium_fusion.solve_table import tabled
from brachium_nodes.sensors import Level
from brachium_nodes.session import session_arrays
from brachium_nodes.wearer import WearerSettings
from brachium_viewer.export import formats
from brachium_wire import capture as captures
from brachium_wire.capture_settings import CalibrationSpans, CaptureSettings
from brachium_wire.table import Table
from brachium_wire.tuples import quaternion

Floats = npt.NDArray[np.float64]

SECONDS, RATE_HZ = 13.0, 50.0
GAP_S = (8.0, 9.5)
"""While it lasts, nothing is heard of the left arm."""
POSE_S = (0.5, 3.5)


def measure(exercise: str = "drinking") -> dict[str, Any]:
    """Export an emulated wearer's two arms in every format, read each back, and return the differences."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        write_capture(folder / "capture", exercise)
        source = solved(folder / "capture")
        return {
            "exercise": exercise,
            "instants": len(source),
            "gap_s": GAP_S[1] - GAP_S[0],
            "formats": {to: differences(source, to, folder) for to in formats.FORMATS},
        }


def write_capture(folder: Path, exercise: str, level: Level = "ideal") -> None:
    """Write a capture folder of two arms with a gap in the left one's samples."""
    made = session_arrays(
        WearerSettings(exercise=exercise, arms="both", level=level, rate_hz=RATE_HZ, seed=5), SECONDS
    )
    t, segments = made.time_s, {}
    for name, sensor in made.sensors.items():
        there = (t < GAP_S[0]) | (t >= GAP_S[1]) if name.endswith("_l") else np.ones(len(t), dtype=np.bool_)
        segments[name] = captures.CaptureSegment(
            t=t[there], rate_hz=RATE_HZ, acc=sensor.acc[there], gyr=sensor.gyr[there], mag=sensor.mag[there]
        )
    lengths = made.lengths
    settings = CaptureSettings(
        side="both",
        rate_hz=RATE_HZ,
        lengths_m={
            "chest_to_shoulder": lengths.chest_to_shoulder,
            "upper_arm": lengths.upper_arm,
            "forearm": lengths.forearm,
            "hand": lengths.hand,
        },
        facing_deg=0.0,
        mounting={name: quaternion(s.nominal_mounting) for name, s in made.sensors.items()},
        calibration=CalibrationSpans(pose="n-pose", from_s=POSE_S[0], to_s=POSE_S[1]),
    )
    captures.write(folder, settings, segments, "csv")


def solved(folder: Path) -> Table:
    """Return the table of a capture as `solve` makes it."""
    settings = solve.SolveSettings(input=folder)
    return tabled(settings, solve.outcome_of(settings))


def differences(source: Table, to: str, folder: Path) -> dict[str, Any]:
    """Export to one format, read it, and return the largest differences and the gaps that are none."""
    out = folder / ("study" if to == "motion-bids" else f"arm.{to}")
    files = formats.export(source, out, formats.Wish(to=to), version())
    found = readers.READERS[to](out)
    held, told = _held(found, len(source)), _angles(source)
    pairs = {n: (source.columns[n], v) for n, v in found.angles_deg.items() if n in told}
    if found.whole_instants:
        pairs = _whole_instants(source.columns["time"], found.time_s, pairs)
    angles = [compared(ours, theirs, 360.0) for ours, theirs in pairs.values()]
    places = [compared(_place_mm(source, n), v, None, held.get(n)) for n, v in found.places_mm.items()]
    every = (*angles, *places)
    return {
        "reader": found.reader,
        "files": len(files),
        "angles": len(angles),
        "angle_deg": max((one.apart for one in angles), default=None),
        "places": len(places),
        "position_mm": max((one.apart for one in places), default=None),
        "numbers": sum(one.numbers for one in every),
        "gaps": sum(one.gaps for one in every),
        "gaps_off": sum(one.gaps_off for one in every),
    }


def _whole_instants(
    time_s: Floats, found_s: Floats, pairs: dict[str, tuple[Floats, Floats]]
) -> dict[str, tuple[Floats, Floats]]:
    """Return pairs with nothing known wherever one of them is not, and what was found (m,) at its times."""
    whole = np.isfinite(np.stack([ours for ours, _ in pairs.values()])).all(axis=0)
    rows = np.argmin(np.abs(time_s[:, None] - found_s[None, :]), axis=0)
    out = {}
    for name, (ours, theirs) in pairs.items():
        there = np.full(len(time_s), np.nan)
        there[rows] = theirs
        out[name] = np.where(whole, ours, np.nan), there
    return out


@dataclass(frozen=True)
class Compared:
    """One quantity as exported and as read."""

    apart: float
    """The largest difference."""
    numbers: int
    """Known in both."""
    gaps: int
    """Not known where it was exported."""
    gaps_off: int
    """Known in one and not in the other."""


def compared(
    expected: Floats, came: Floats, turn: float | None, held: npt.NDArray[np.bool_] | None = None
) -> Compared:
    """Compare what was exported with what came, numbers (n,) or places (n, 3); angles but for whole turns.

    Numbers that stand for a gap, as `held` (n,) says, count as not known.
    """
    missing = int((~np.isfinite(expected)).sum())
    if expected.shape != came.shape:
        return Compared(float("inf"), 0, missing, expected.size)
    there = np.isfinite(came) if held is None else np.isfinite(came) & ~held[:, None]
    both, off = np.isfinite(expected) & there, np.isfinite(expected) != there
    apart = np.abs(came - expected)[both]
    if turn is not None:
        apart = np.minimum(apart % turn, turn - apart % turn)
    return Compared(float(apart.max(initial=0.0)), int(both.sum()), missing, int(off.sum()))


def _angles(source: Table) -> set[str]:
    return {name for name, unit in source.units.items() if unit == "deg"}


def _place_mm(source: Table, name: str) -> Floats:
    joint, end = name[:-2], name[-2:]
    return 1000.0 * np.stack([source.columns[f"{joint}_{axis}{end}"] for axis in "xyz"], axis=1)


PARENTS = ("shoulder", "upper_arm", "forearm", "hand")
"""Bones from the trunk outwards: where one stands still, so does what hangs on it."""


def _held(found: Found, n: int) -> dict[str, npt.NDArray[np.bool_]]:
    """Return by joint the frames (n,) that a format which cannot leave anything out repeats."""
    out = {}
    for name in found.places_mm:
        joint, _, end = name.rpartition("_")
        outwards = ("shoulder", "elbow", "wrist", "hand").index(joint)
        mask = np.zeros(n, dtype=np.bool_)
        for bone in ("trunk", *(f"{bone}_{end}" for bone in PARENTS[: outwards + 1])):
            for first, last in found.held.get(bone, []):
                mask[first : last + 1] = True
        out[name] = mask
    return out


def text(figures: dict[str, Any]) -> str:
    """Return the differences as a table for people."""
    lines = [
        f"two arms, {figures['instants']} instants of {figures['exercise']}, the left silent for "
        f"{figures['gap_s']:g} s",
        f"{'format':<12}{'angles':>8}{'deg apart':>12}{'places':>8}{'mm apart':>12}{'gaps':>8}{'off':>6}"
        "  reader",
    ]
    for name, found in figures["formats"].items():
        deg, mm = (_short(found[what]) for what in ("angle_deg", "position_mm"))
        lines.append(
            f"{name:<12}{found['angles']:>8}{deg:>12}{found['places']:>8}{mm:>12}"
            f"{found['gaps']:>8}{found['gaps_off']:>6}  {found['reader']}"
        )
    return "\n".join(lines)


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"
