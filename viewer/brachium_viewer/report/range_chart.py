"""The report's chart of ranges of motion as SVG: a row a movement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from brachium_viewer.charts import INK, QUIET
from brachium_viewer.report.panels import Panel, Sheet, Span, apart, round_numbers, within
from brachium_viewer.report.report_charts import MODE_COLOURS, WIDTH_IN

BAND, NEED = "#e3e9ef", "#8a97a5"
ROW_IN, LOW_ROW_IN = 0.26, 0.2
MANY = 12
"""Rows; more of them are lower, so that all are on one sheet."""
LETTER_IN = 0.56 / 72
"""Width of a letter for each point of its size, as usual fonts are wide."""
NAME, NUMBER, LEGEND_TEXT = 7.6, 7.2, 6.8
"""Points."""
BELOW_IN, ABOVE_IN, BESIDE_IN = 0.36, 0.24, 0.72
"""For the axis, the legend, and the numbers after the longest bar."""


@dataclass(frozen=True, kw_only=True)
class RangeBar:
    """One row of the chart of ranges, deg; what is not known is None."""

    label: str
    mode: str
    now: Span
    """From the median start to the median farthest point: as the table of measures has it."""
    other: Span | None
    last: Span | None
    reference: Span | None
    """AAOS."""
    need: Span | None
    """Of daily activities."""


LEGEND: Mapping[str, str] = {
    "now": "this session",
    "other": "other side",
    "last": "last session",
    "reference": "AAOS reference",
    "need": "needed by daily activities",
}
"""By a bar's ends."""


def ranges(name: str, bars: Sequence[RangeBar], legend: Mapping[str, str] = LEGEND) -> str:
    """Return a row a movement: the reference as a wide band, this session, the other arm, the last one."""
    row_in = ROW_IN if len(bars) <= MANY else LOW_ROW_IN
    sheet = Sheet(WIDTH_IN, BELOW_IN + row_in * len(bars) + ABOVE_IN)
    left_in = 0.1 + LETTER_IN * NAME * max(len(bar.label) for bar in bars)
    panel = Panel(
        sheet=sheet,
        corner_in=(left_in, BELOW_IN),
        size_in=(WIDTH_IN - BESIDE_IN - left_in, row_in * len(bars)),
        x=_reach(bars),
        y=(-0.5, len(bars) - 0.5),
    )
    ticks = within(round_numbers(panel.x, 8), panel.x)
    for tick in ticks:
        sheet.grid.append(panel.at(np.array([[tick, panel.y[0]], [tick, panel.y[1]]])))
    panel.frame(ticks, ())
    panel.name_x("angle, deg")
    points = 72.0 * row_in
    _rows(panel, bars, "reference", 0.0, BAND, width=0.74 * points, solid_capstyle="butt")
    _rows(panel, bars, "need", -0.33, NEED, width=0.07 * points, solid_capstyle="butt")
    _rows(panel, bars, "other", 0.27, QUIET, width=1.0, marker="s", markersize=2.6)
    _rows(panel, bars, "last", -0.22, INK, width=1.0, marker="D", markersize=2.6)
    for mode in dict.fromkeys(bar.mode for bar in bars):
        colour = MODE_COLOURS.get(mode, INK)
        _rows(panel, bars, "now", 0.02, colour, mode=mode, width=0.3 * points, solid_capstyle="butt")
    for row, bar in enumerate(reversed(bars)):
        _words(panel, row, bar)
    _legend(sheet, bars, legend)
    return sheet.svg(name)


def _reach(bars: Sequence[RangeBar]) -> Span:
    """Return what the panel spans: all that it shows, and where angles are zero."""
    every = [0.0, *(value for bar in bars for name in LEGEND for value in _ends(bar, name) or ())]
    low, high = min(every), max(every)
    return low - 0.02 * (high - low), max(high, low + 1.0)


def _ends(bar: RangeBar, name: str) -> Span | None:
    found: Span | None = getattr(bar, name)
    return found


def _rows(
    panel: Panel,
    bars: Sequence[RangeBar],
    name: str,
    up: float,
    colour: str,
    *,
    width: float,
    mode: str | None = None,
    **more: object,
) -> None:
    """Draw the same ends of all rows at once, so far up from the row's middle."""
    lines = [
        np.array([[ends[0], row + up], [ends[1], row + up]])
        for row, bar in enumerate(reversed(bars))
        if (mode is None or bar.mode == mode) and (ends := _ends(bar, name)) is not None
    ]
    if lines:
        panel.line(apart(lines), colour, width, **more)


def _words(panel: Panel, row: int, bar: RangeBar) -> None:
    """Write the row's name, and its ends beyond whatever is drawn of it: no line goes through them."""
    low, high = sorted(bar.now)
    farthest = max(value for name in ("now", "other", "last") for value in _ends(bar, name) or ())
    x_in, y_in = panel.at(np.array([farthest, row])).tolist()
    panel.sheet.text(x_in + 0.06, y_in, f"{low:.0f} to {high:.0f}", fontsize=NUMBER, va="center")
    panel.sheet.text(panel.corner_in[0] - 0.08, y_in, bar.label, fontsize=NAME, va="center", ha="right")


def _legend(sheet: Sheet, bars: Sequence[RangeBar], legend: Mapping[str, str]) -> None:
    """Say above the rows what each sign that is there stands for."""
    x_in, y_in = 0.1, sheet.size_in[1] - 0.11
    colours = {"now": MODE_COLOURS["active"], "other": QUIET, "last": INK, "reference": BAND, "need": NEED}
    for name, said in legend.items():
        if not any(_ends(bar, name) for bar in bars):
            continue
        thick = {"now": 5.0, "reference": 8.0, "need": 1.6}.get(name)
        marker = {"other": "s", "last": "D"}.get(name)
        line = np.array([[x_in, y_in], [x_in + 0.17, y_in]])
        if thick is None:
            sheet.line(line, colours[name], 1.0, marker=marker, markersize=2.6)
        else:
            sheet.line(line, colours[name], thick, solid_capstyle="butt")
        sheet.text(x_in + 0.23, y_in, said, fontsize=LEGEND_TEXT, va="center")
        x_in += 0.43 + LETTER_IN * LEGEND_TEXT * len(said)
