"""The report's figures of a movement as SVG: repetitions over each other, paths in three views, over time."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from brachium_viewer.charts import INK, QUIET
from brachium_viewer.metrics.arm_motion import Floats
from brachium_viewer.report.panels import BESIDE_IN, TEXT, Panel, Sheet, apart, reach, round_numbers
from brachium_viewer.report.repetition_lines import SHARES

MODE_COLOURS = {"active": "#0b5cad", "assisted": "#117a65", "passive": "#c2570c"}
JOINT_COLOURS = {"elbow": "#c2570c", "wrist": "#117a65", "hand": "#0b5cad"}
VIEWS = (("from the front", 0, 2), ("from the side", 1, 2), ("from above", 0, 1))
"""Trunk axes: x to the right, y forward, z up."""
AXIS_NAMES = ("right", "forward", "up")
WIDTH_IN, HEIGHT_IN = 7.3, 1.34
TITLE_IN = 1.27


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
    sheet = Sheet(WIDTH_IN, HEIGHT_IN)
    _overlay(sheet, lines)
    if any(np.isfinite(p).any() for p in lines.paths.values()):
        lowest, size = _cube(lines.paths)
        for number in range(len(VIEWS)):
            _view(sheet, lines, lowest, size, number)
        for i, joint in enumerate(lines.paths):
            sheet.text(2.46 + 0.72 * i, TITLE_IN, joint, JOINT_COLOURS[joint], weight="bold", va="center")
        _over_time(sheet, lines)
    return sheet.svg(name)


def _overlay(sheet: Sheet, lines: MovementLines) -> None:
    goal = np.array([] if lines.goal_deg is None else [lines.goal_deg])
    spans = reach([*lines.overlays.values(), goal])
    panel = Panel(sheet=sheet, corner_in=(0.42, 0.34), size_in=(1.62, 0.84), x=(0.0, 100.0), y=spans)
    for mode, rows in lines.overlays.items():
        colour = MODE_COLOURS.get(mode, INK)
        if np.isfinite(rows).any():
            panel.line(apart([_points(SHARES, row) for row in rows]), colour, 0.5, alpha=0.4)
            panel.line(_points(SHARES, _middle(rows)), colour, 1.5)
    if lines.goal_deg is not None:
        panel.line(_points(panel.x, goal.repeat(2)), INK, 0.7, linestyle=(0, (4, 3)))
        x_in, y_in = panel.at(np.array([99.0, lines.goal_deg])).tolist()
        sheet.text(x_in, y_in, "goal", fontsize=TEXT - 0.8, va="bottom", ha="right")
    ticks = round_numbers(spans, 5)
    panel.frame((0.0, 50.0, 100.0), ticks)
    panel.name_x("% of the repetition")
    panel.title(lines.angle)


def _points(x: npt.ArrayLike, y: Floats) -> Floats:
    return np.stack([np.asarray(x, dtype=np.float64), y], axis=-1)


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


def _view(sheet: Sheet, lines: MovementLines, lowest: Floats, size: float, number: int) -> None:
    title, across, upward = VIEWS[number]
    x, y = ((float(lowest[i]), float(lowest[i]) + size) for i in (across, upward))
    corner_in = 2.45 + 1.07 * number, 0.34
    panel = Panel(sheet=sheet, corner_in=corner_in, size_in=(0.76, 0.76), x=x, y=y)
    for joint, rows in lines.paths.items():
        panel.line(apart(list(rows[:, :, [across, upward]])), JOINT_COLOURS[joint], 0.6, alpha=0.6)
    ticks = round_numbers(y, 3)
    panel.frame(round_numbers(x, 3), ticks, grid=False)
    panel.name_x(f"{AXIS_NAMES[across]}, cm")
    panel.name_y(AXIS_NAMES[upward], ticks)
    panel.title(title)


def _over_time(sheet: Sheet, lines: MovementLines) -> None:
    """Draw right, forward and up, one above the other."""
    x = 0.0, max(float(lines.time_s[-1]), 1e-3)
    for i, name in enumerate(AXIS_NAMES):
        y = reach(place[:, i] for place in lines.places.values())
        corner_in, size_in = (5.72, 0.34 + 0.3 * (2 - i)), (1.12, 0.24)
        panel = Panel(sheet=sheet, corner_in=corner_in, size_in=size_in, x=x, y=y)
        for joint, place in lines.places.items():
            panel.line(_points(lines.time_s, place[:, i]), JOINT_COLOURS[joint], 0.8)
        panel.frame(round_numbers(x, 3), round_numbers(y, 3), numbers=i == 2)
        beside_in = corner_in[0] + size_in[0] + BESIDE_IN
        sheet.text(beside_in, corner_in[1] + 0.5 * size_in[1], name, QUIET, va="center", ha="left")
        if i == 2:
            panel.name_x("s, of one set")
    sheet.text(5.72, TITLE_IN, "over time, cm", fontsize=TEXT + 0.4, va="center")
