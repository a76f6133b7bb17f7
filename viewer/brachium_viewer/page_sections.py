"""The summary page's sections, from figures and contents: charts and tables. Pure."""

from dataclasses import dataclass

import numpy as np

from brachium_viewer import charts
from brachium_viewer import contents as c
from brachium_viewer import figures as f
from brachium_viewer.contents import Contents
from brachium_viewer.figures import ArmFigures, SummaryFigures
from brachium_viewer.metrics.arm_motion import Floats
from brachium_viewer.statistics import ErrorFigures

JOINT_NAMES = {"shoulder": "shoulder", "elbow": "elbow", "wrist": "wrist", "hand": "fingertip"}
ANGLE_NAMES = {
    "isb_elevation": "ISB elevation",
    "isb_plane": "ISB plane of elevation",
    "isb_axial": "ISB axial rotation",
}


@dataclass(frozen=True, slots=True)
class Chart:
    """A drawing, what it shows, and its one figure."""

    title: str
    figure: str
    svg: str


@dataclass(frozen=True, slots=True)
class Arm:
    """One arm's charts."""

    title: str
    has_truth: bool
    shaded: bool
    charts: list[Chart]


@dataclass(frozen=True, slots=True)
class PageTable:
    """Rows of figures under a head."""

    title: str
    head: list[str]
    rows: list[list[str]]
    note: str = ""


def arm_section(who: c.Who, contents: Contents, figures: ArmFigures) -> Arm:
    """Return one arm's charts: its angles, and how far the fingertip is from the true one."""
    arm = contents.arms[who]
    start = int(arm.published.time_ns.min())
    time: Floats = (arm.published.time_ns - start) / 1e9
    settled = c.calibrated(arm.published)
    settled_s = float(time[np.argmax(settled)]) if settled.any() else float(time[-1])
    drawn = []
    for name in f.CLINICAL:
        values = np.degrees(arm.published.angles_rad([name])[:, 0])
        if not np.isfinite(values).any():
            continue
        true = None
        if len(arm.true):
            true = (arm.true.time_ns - start) / 1e9, np.degrees(arm.true.angles_rad([name])[:, 0])
        error = figures.angles_deg.get(name)
        label = (
            f"RMSE {error.rmse:.1f}°"
            if error is not None
            else "assumed"
            if not f.measured(arm, name).any()
            else ""
        )
        svg = charts.line(f"{'-'.join(who)}-{name}", time, values, "deg", true=true, settled_s=settled_s)
        drawn.append(Chart(name.replace("_", " ").capitalize(), label, svg))
    if "hand" in figures.positions_mm:
        error_mm = f.position_error_mm(arm, "hand")
        label = f"RMSE {figures.positions_mm['hand'].rmse:.0f} mm"
        name = f"{'-'.join(who)}-hand"
        svg = charts.line(name, time, error_mm, "mm", settled_s=settled_s, from_zero=True)
        drawn.append(Chart("Fingertip, distance from true", label, svg))
    return Arm(f"{who[1].capitalize()} arm of {who[0]}", bool(len(arm.true)), settled_s > time[0], drawn)


def network_charts(contents: Contents, figures: SummaryFigures) -> list[Chart]:
    """Return latency and loss."""
    drawn = []
    for who, arm in sorted(contents.arms.items()):
        latencies = f.latencies_ms(arm)
        if latencies.size:
            found = figures.arms["/".join(who)]
            marks = {"median": found.latency_p50_ms or 0.0, "99 %": found.latency_p99_ms or 0.0}
            svg = charts.histogram(f"{'-'.join(who)}-latency", latencies, "ms", marks)
            drawn.append(Chart("Latency from gateway to skeleton", "/".join(who), svg))
    if figures.segments:
        loss = {who: s.loss_percent for who, s in figures.segments.items()}
        if len({who.split("/")[0] for who in loss}) == 1:
            loss = {who.split("/")[1]: value for who, value in loss.items()}
        drawn.append(Chart("Samples lost", "% of those sent", charts.bars("loss", loss, "%")))
    return drawn


def tables(figures: SummaryFigures) -> list[PageTable]:
    """Return the figures behind the charts."""
    found = [table for who, arm in figures.arms.items() if (table := _errors(who, arm)).rows]
    return [*found, _sensors(figures)] if figures.segments else found


def _errors(who: str, arm: ArmFigures) -> PageTable:
    angles = arm.angles_deg
    shown = [name for name in (*f.CLINICAL, *f.ISB) if name in angles]
    rows = [_row(ANGLE_NAMES.get(name, name.replace("_", " ")), "deg", 2, angles[name]) for name in shown]
    rows += [
        _row(f"{JOINT_NAMES.get(joint, joint)}, distance", "mm", 1, error)
        for joint, error in arm.positions_mm.items()
        if error.max_abs > 0.0  # the shoulder of a still trunk is where the axes begin
    ]
    note = (
        f"{arm.compared} of {arm.skeletons} skeletons compared: those after calibration for whose instant "
        "truth is known. Angles that rest on an assumption are left out. ISB's plane of elevation and axial "
        f"rotation are undefined near hanging: they are compared where the true elevation is "
        f"{f.ELEVATED_DEG:.0f}° or more, and left out where it never is."
    )
    return PageTable(
        f"Error against truth, {who}", ["", "unit", "RMSE", "bias", "SD", "largest", "n"], rows, note
    )


def _row(name: str, unit: str, digits: int, error: ErrorFigures) -> list[str]:
    numbers = [f"{value:.{digits}f}" for value in (error.rmse, error.bias, error.sd, error.max_abs)]
    return [name, unit, *numbers, str(error.n)]


def _sensors(figures: SummaryFigures) -> PageTable:
    rows = [
        [
            who,
            s.node or "-",
            *map(str, (s.received, s.lost)),
            f"{s.loss_percent:.2f}",
            *map(str, (s.out_of_order, s.late)),
        ]
        for who, s in figures.segments.items()
    ]
    by_gateway = all(s.counted_by == "gateway" for s in figures.segments.values())
    note = "Samples since the node joined, as the gateway counts them."
    if not by_gateway:
        note = "Where no gateway reported, samples are those in the recording."
    return PageTable(
        "Sensors", ["", "node", "received", "lost", "lost %", "out of order", "late"], rows, note
    )
