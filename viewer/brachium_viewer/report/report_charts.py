"""The report's figures as SVG: repetitions over each other, paths in three views, ranges of motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from brachium_viewer.charts import INK, QUIET, new_figure, plain, svg
from brachium_viewer.metrics.arm_motion import Floats
from brachium_viewer.report.repetition_lines import SHARES

MODE_COLOURS = {"active": "#0b5cad", "assisted": "#117a65", "passive": "#c2570c"}
JOINT_COLOURS = {"elbow": "#c2570c", "wrist": "#117a65", "hand": "#0b5cad"}
BAND = "#e3e9ef"
VIEWS = (("from the front", 0, 2), ("from the side", 1, 2), ("from above", 0, 1))
"""Trunk axes: x to the right, y forward, z up."""
AXIS_NAMES = ("right", "forward", "up")
WIDTH_IN, HEIGHT_IN = 7.3, 1.5
TEXT = 6.8


@dataclass(frozen=True, kw_only=True, eq=False)
class MovementLines:
    """What one arm did of one exercise, as lines to be drawn."""

    angle: str
    """As people call it."""
    overlays: Mapping[str, Floats]
    """By mode: (repetitions, len(SHARES)) deg."""
    goal_deg: float | None
    paths: Mapping[str, Floats]
    """By joint: (repetitions, points, 3) cm."""
    time_s: Floats
    places: Mapping[str, Floats]
    """By joint at time_s: (m, 3) cm."""


def movement(name: str, lines: MovementLines) -> str:
    """Return one row: the angle over each repetition, paths in three views, and x, y, z over time."""
    figure = new_figure(WIDTH_IN, HEIGHT_IN, constrained=False)
    _overlay(_place(figure, 0.42, 0.34, 1.62, 1.0), lines)
    if any(np.isfinite(p).any() for p in lines.paths.values()):
        lowest, size = _cube(lines.paths)
        for i, (_, across, upward) in enumerate(VIEWS):
            axes = _place(figure, 2.45 + 1.07 * i, 0.34, 0.82, 0.82)
            _view(axes, lines, across, upward, lowest, size, i)
        _legend(figure, lines)
        _over_time(figure, lines)
    return svg(figure, name)


def _place(figure: Any, left_in: float, bottom_in: float, width_in: float, height_in: float) -> Any:
    axes = figure.add_axes(
        (left_in / WIDTH_IN, bottom_in / HEIGHT_IN, width_in / WIDTH_IN, height_in / HEIGHT_IN)
    )
    plain(axes)
    axes.tick_params(labelsize=TEXT - 0.6, pad=1.5)
    return axes


def _overlay(axes: Any, lines: MovementLines) -> None:
    for mode, rows in lines.overlays.items():
        colour = MODE_COLOURS.get(mode, INK)
        axes.plot(
            _apart(np.tile(SHARES, (len(rows), 1))), _apart(rows), color=colour, linewidth=0.5, alpha=0.4
        )
        if np.isfinite(rows).any():
            axes.plot(SHARES, _middle(rows), color=colour, linewidth=1.5)
    if lines.goal_deg is not None:
        axes.axhline(lines.goal_deg, color=INK, linewidth=0.7, linestyle=(0, (4, 3)))
        axes.text(99, lines.goal_deg, "goal", fontsize=TEXT - 0.8, color=INK, va="bottom", ha="right")
    axes.set_xlim(0, 100)
    axes.set_xticks([0, 50, 100])
    axes.set_xlabel("% of the repetition", fontsize=TEXT, color=QUIET, labelpad=1)
    axes.set_ylabel("deg", fontsize=TEXT, color=QUIET, labelpad=1)
    axes.set_title(lines.angle, fontsize=TEXT + 0.4, color=INK, loc="left", pad=3)


def _apart(rows: Floats) -> Floats:
    """Return rows (n, m) as one line that is broken between them: one path is a tenth of the page of many."""
    return np.concatenate([rows, np.full((len(rows), 1), np.nan)], axis=1).ravel()


def _middle(rows: Floats) -> Floats:
    known = np.isfinite(rows).mean(axis=0) >= 0.5
    out = np.full(rows.shape[1], np.nan)
    out[known] = np.nanmedian(rows[:, known], axis=0)
    return out


def _cube(paths: Mapping[str, Floats]) -> tuple[Floats, float]:
    """Return the corner and edge of the cube that holds all paths, cm: every view has one scale."""
    points = np.concatenate([p.reshape(-1, 3) for p in paths.values()])
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    size = 1.12 * max(float((high - low).max()), 10.0)
    return np.asarray(0.5 * (low + high) - 0.5 * size), size


def _view(
    axes: Any, lines: MovementLines, across: int, upward: int, lowest: Floats, size: float, number: int
) -> None:
    for joint, rows in lines.paths.items():
        places = _apart(rows[:, :, across]), _apart(rows[:, :, upward])
        axes.plot(*places, color=JOINT_COLOURS[joint], linewidth=0.6, alpha=0.6)
    axes.set_xlim(lowest[across], lowest[across] + size)
    axes.set_ylim(lowest[upward], lowest[upward] + size)
    axes.grid(visible=False)
    for ticks in (axes.xaxis, axes.yaxis):
        ticks.set_major_locator(_few())
    axes.set_xlabel(f"{AXIS_NAMES[across]}, cm", fontsize=TEXT, color=QUIET, labelpad=1)
    axes.set_ylabel(AXIS_NAMES[upward], fontsize=TEXT, color=QUIET, labelpad=0)
    axes.set_title(VIEWS[number][0], fontsize=TEXT + 0.4, color=INK, loc="left", pad=3)


def _few() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(3, integer=True)


def _legend(figure: Any, lines: MovementLines) -> None:
    for i, joint in enumerate(lines.paths):
        left, level = (2.46 + 0.5 * i) / WIDTH_IN, 1.43 / HEIGHT_IN
        figure.text(left, level, joint, fontsize=TEXT, color=JOINT_COLOURS[joint], weight="bold", va="center")


def _over_time(figure: Any, lines: MovementLines) -> None:
    """Draw right, forward and up, one above the other."""
    for i, name in enumerate(AXIS_NAMES):
        axes = _place(figure, 5.72, 0.34 + 0.36 * (2 - i), 1.36, 0.29)
        for joint, place in lines.places.items():
            axes.plot(lines.time_s, place[:, i], color=JOINT_COLOURS[joint], linewidth=0.8)
        axes.yaxis.set_major_locator(_few())
        axes.set_xlim(0.0, max(float(lines.time_s[-1]), 1e-3))
        axes.text(1.01, 0.5, name, transform=axes.transAxes, rotation=270, fontsize=TEXT - 1.2, color=QUIET,
                  va="center", ha="left", clip_on=False)  # fmt: skip
        if i < 2:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("s, of one set", fontsize=TEXT, color=QUIET, labelpad=1)
    figure.text(
        5.72 / WIDTH_IN, 1.43 / HEIGHT_IN, "over time, cm", fontsize=TEXT + 0.4, color=INK, va="center"
    )


@dataclass(frozen=True, kw_only=True)
class RangeBar:
    """One row of the chart of ranges, deg; what is not known is None."""

    label: str
    mode: str
    now: tuple[float, float] | None
    """From the median start to the best peak."""
    other: tuple[float, float] | None
    last: tuple[float, float] | None
    reference: tuple[float, float] | None
    """AAOS."""
    need: tuple[float, float] | None
    """Of daily activities."""


LEGEND = ("this session", "other side", "last session", "AAOS reference", "daily activities (Namdari 2012)")


def ranges(name: str, bars: Sequence[RangeBar]) -> str:
    """Return a row a movement: the reference as a wide band, this session, the other arm, the last one."""
    height = 0.6 + 0.29 * len(bars)
    figure = new_figure(WIDTH_IN, height)
    axes = figure.add_subplot()
    plain(axes)
    axes.grid(visible=False)
    axes.grid(axis="x", color="#e6eaee", linewidth=0.6)
    for i, bar in enumerate(bars):
        y = len(bars) - 1 - i
        if bar.reference is not None:
            _bar(axes, y, bar.reference, 0.74, BAND)
        if bar.need is not None:
            _bar(axes, y - 0.33, bar.need, 0.07, "#8a97a5")
        _thin(axes, y + 0.27, bar.other, QUIET, "s")
        _thin(axes, y - 0.22, bar.last, INK, "D")
        if bar.now is not None:
            _bar(axes, y + 0.02, bar.now, 0.3, MODE_COLOURS.get(bar.mode, INK))
            low, high = sorted(bar.now)
            axes.text(high + 1.5, y + 0.02, f"{low:.0f} to {high:.0f}", fontsize=7.2, color=INK, va="center")
    axes.set_ylim(-0.55, len(bars) - 0.45)
    axes.set_yticks(range(len(bars)), [bar.label for bar in bars][::-1], fontsize=7.6, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("deg", fontsize=7.5, color=QUIET, labelpad=1)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.06 * (high - low))
    axes.legend(handles=_handles(bars), fontsize=6.8, frameon=False, ncols=5, loc="lower left",
                bbox_to_anchor=(-0.02, 1.0), labelcolor=INK, handlelength=1.4, columnspacing=1.2)  # fmt: skip
    return svg(figure, name)


def _handles(bars: Sequence[RangeBar]) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    made = [
        Patch(color=MODE_COLOURS["active"], label=LEGEND[0]),
        Line2D([], [], color=QUIET, marker="s", markersize=3, linewidth=1.0, label=LEGEND[1]),
        Line2D([], [], color=INK, marker="D", markersize=3, linewidth=1.0, label=LEGEND[2]),
        Patch(color=BAND, label=LEGEND[3]),
        Patch(color="#8a97a5", label=LEGEND[4]),
    ]
    there = (
        any(bar.now for bar in bars),
        any(bar.other for bar in bars),
        any(bar.last for bar in bars),
        any(bar.reference for bar in bars),
        any(bar.need for bar in bars),
    )
    return [handle for handle, shown in zip(made, there, strict=True) if shown]


def _bar(axes: Any, y: float, ends: tuple[float, float], height: float, colour: str) -> None:
    axes.barh(y, ends[1] - ends[0], left=ends[0], height=height, color=colour)


def _thin(axes: Any, y: float, ends: tuple[float, float] | None, colour: str, marker: str) -> None:
    if ends is not None:
        axes.plot(ends, (y, y), color=colour, linewidth=1.0, marker=marker, markersize=2.6)
