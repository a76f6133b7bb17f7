"""Small charts beside each other in one drawing, placed in inches.

Axes of matplotlib spend nine tenths of their time on ticks, and a report has dozens of charts: here a drawing
has one line for all frames, one for all ticks and one for all grids.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from brachium_viewer.charts import FRAME, GRID, INK, QUIET, new_figure, svg
from brachium_viewer.metrics.arm_motion import Floats

TEXT = 6.8
"""Points; the numbers at ticks are a little smaller."""
NUMBERS = TEXT - 0.6
TICK_IN = 2.5 / 72
BESIDE_IN = 4.0 / 72
"""From a frame to the numbers at its ticks."""
DIGIT_IN = 0.64 * NUMBERS / 72
MARGIN = 0.05
"""Of what is shown, around it."""
LEAST = 2.0
"""A panel spans at least two degrees or centimetres: stillness is to look still, and has whole numbers."""

Span = tuple[float, float]


class Sheet:
    """A drawing of panels, lines and words. Raises MissingExtra without matplotlib."""

    def __init__(self, width_in: float, height_in: float) -> None:
        self.size_in = width_in, height_in
        self.figure = new_figure(width_in, height_in, constrained=False)
        self.frames: list[Floats] = []
        self.ticks: list[Floats] = []
        self.grid: list[Floats] = []

    def line(self, points_in: Floats, colour: str, width: float, **more: Any) -> None:
        """Draw a line through points (n, 2); it is broken where they are NaN."""
        from matplotlib.lines import Line2D

        drawn = Line2D(*points_in.T, color=colour, linewidth=width, **more)
        drawn.set_transform(self.figure.dpi_scale_trans)
        self.figure.add_artist(drawn)

    def text(self, x_in: float, y_in: float, said: str, colour: str = INK, **more: Any) -> None:
        """Write words."""
        width_in, height_in = self.size_in
        self.figure.text(x_in / width_in, y_in / height_in, said, color=colour, **{"fontsize": TEXT, **more})

    def svg(self, name: str) -> str:
        """Return the drawing as SVG text for a page."""
        for lines, colour, width, level in (
            (self.grid, GRID, 0.6, 0.0),
            (self.frames, FRAME, 0.8, 0.5),
            (self.ticks, QUIET, 0.6, 0.5),
        ):
            if lines:
                self.line(apart(lines), colour, width, zorder=level)
        return svg(self.figure, name)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One chart of a sheet: its lower left corner and size in inches, and what it spans."""

    sheet: Sheet
    corner_in: Span
    size_in: Span
    x: Span
    y: Span

    def at(self, points: Floats) -> Floats:
        """Return the places (n, 2) in inches of points (n, 2)."""
        low = np.array([self.x[0], self.y[0]])
        reach = np.array([self.x[1] - self.x[0], self.y[1] - self.y[0]])
        return np.asarray(np.array(self.corner_in) + (points - low) / reach * np.array(self.size_in))

    def line(self, points: Floats, colour: str, width: float, **more: Any) -> None:
        """Draw a line through points (n, 2)."""
        self.sheet.line(self.at(points), colour, width, **more)

    def frame(
        self, x_ticks: Iterable[float], y_ticks: Iterable[float], *, numbers: bool = True, grid: bool = True
    ) -> None:
        """Draw the left and lower edge with ticks and their numbers; without `numbers` only y has them."""
        (left, bottom), (width, height) = self.corner_in, self.size_in
        self.sheet.frames.append(
            np.array([(left, bottom + height), (left, bottom), (left + width, bottom)], dtype=np.float64)
        )
        for value in within(x_ticks, self.x):
            across = float(self.at(np.array([value, self.y[0]]))[0])
            self.sheet.ticks.append(np.array([(across, bottom), (across, bottom - TICK_IN)]))
            if numbers:
                self._number(across, bottom - BESIDE_IN, value, ha="center", va="top")
        for value in within(y_ticks, self.y):
            up = float(self.at(np.array([self.x[0], value]))[1])
            self.sheet.ticks.append(np.array([(left, up), (left - TICK_IN, up)]))
            self._number(left - BESIDE_IN, up, value, ha="right", va="center")
            if grid:
                self.sheet.grid.append(np.array([(left, up), (left + width, up)]))

    def _number(self, x_in: float, y_in: float, value: float, **more: Any) -> None:
        self.sheet.text(x_in, y_in, written(value), QUIET, fontsize=NUMBERS, **more)

    def name_x(self, said: str) -> None:
        """Write below the numbers what the lower edge counts."""
        x_in, y_in = self.corner_in[0] + 0.5 * self.size_in[0], self.corner_in[1] - 11.2 / 72
        self.sheet.text(x_in, y_in, said, QUIET, ha="center", va="top")

    def name_y(self, said: str, ticks: Iterable[float]) -> None:
        """Write beside the numbers of these ticks what the left edge counts."""
        longest = max((len(written(value)) for value in within(ticks, self.y)), default=0)
        x_in = self.corner_in[0] - BESIDE_IN - DIGIT_IN * longest - 1.5 / 72
        y_in = self.corner_in[1] + 0.5 * self.size_in[1]
        self.sheet.text(x_in, y_in, said, QUIET, rotation=90, ha="right", va="center")

    def title(self, said: str) -> None:
        """Write above it what it shows."""
        x_in, y_in = self.corner_in[0], self.corner_in[1] + self.size_in[1] + 3.0 / 72
        self.sheet.text(x_in, y_in, said, fontsize=TEXT + 0.4, ha="left", va="baseline")


def apart(lines: Sequence[Floats]) -> Floats:
    """Return lines (each (n, 2)) as one that is broken between them."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([part for one in lines for part in (one, gap)])


def reach(values: Iterable[Floats]) -> Span:
    """Return what a panel must span to show all of these, with a margin; NaN is not shown."""
    every = np.concatenate([np.ravel(one) for one in values])
    every = every[np.isfinite(every)]
    if not every.size:
        return 0.0, LEAST
    low, high = float(every.min()), float(every.max())
    margin = max(MARGIN * (high - low), 0.5 * (LEAST - (high - low)))
    return low - margin, high + margin


def round_numbers(span: Span, most: int) -> list[float]:
    """Return whole round numbers over what is shown, at most `most` steps."""
    from matplotlib.ticker import MaxNLocator

    return [float(v) for v in MaxNLocator(most, integer=True).tick_values(*span)]


def within(ticks: Iterable[float], span: Span) -> list[float]:
    """Return the ticks that are shown."""
    slack = 1e-9 * (span[1] - span[0])
    return [tick for tick in ticks if span[0] - slack <= tick <= span[1] + slack]


def written(value: float) -> str:
    """Return the number at a tick."""
    return f"{value + 0.0:g}".replace("-", "\N{MINUS SIGN}")
