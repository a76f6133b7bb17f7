"""Charts of the summary page as SVG text: drawn by matplotlib, without a screen and without a date."""

import io
import itertools
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_wire.table import MissingExtra

Floats = npt.NDArray[np.float64]

INK, QUIET, MEASURED, TRUE, SHADE = "#1d2733", "#6b7785", "#0b5cad", "#f0b35f", "#eef1f4"
FRAME, GRID = "#c3cad2", "#e6eaee"
POINTS = 900
"""Points of a line at most: more than its pixels are of no use in print."""


def new_figure(width_in: float, height_in: float, *, constrained: bool = True) -> Any:
    """Return an empty figure of this size. Raises MissingExtra without matplotlib."""
    try:
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtra("a page's charts need matplotlib: pip install 'brachium[report]'") from None
    figure = Figure(figsize=(width_in, height_in), layout="constrained" if constrained else None)
    FigureCanvasSVG(figure)
    return figure


def plain(axes: Any) -> None:
    """Give axes the look of every page."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FRAME)
    axes.tick_params(colors=QUIET, labelsize=7.5, length=2.5, width=0.6)
    axes.grid(axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _figure(width_in: float, height_in: float) -> tuple[Any, Any]:
    figure = new_figure(width_in, height_in)
    axes = figure.add_subplot()
    plain(axes)
    return figure, axes


def svg(figure: Any, name: str) -> str:
    """Return a figure as SVG text for a page: no size of its own, and ids that no other chart of it has.

    Words stay words, so that they can be read out and searched.
    """
    import matplotlib

    out = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(out, format="svg", metadata={"Date": None}, transparent=True)
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # The page sets the size; and glyphs of two charts on one page must not share a name.
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    prefix = re.sub("[^a-z0-9]", "-", name.lower())
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r'href="#', f'href="#{prefix}-', text)
    text = re.sub(r"url\(#", f"url(#{prefix}-", text)
    # A tenth of a point is a thirtieth of a millimetre.
    return re.sub(r'(?<= d=")M [^"]*', lambda path: re.sub(r"(\.\d)\d+", r"\1", path.group()), text)


def thinned(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a line of at most POINTS points with the same lowest and highest values along the way."""
    if len(time) <= POINTS:
        return time, values
    edges = np.linspace(0, len(time), POINTS // 2 + 1).astype(np.int64)
    keep: set[int] = {0, len(time) - 1}
    for a, b in itertools.pairwise(edges.tolist()):
        part = values[a:b]
        if np.isnan(part).any():
            keep.add(int(a + np.argmax(np.isnan(part))))  # a gap stays a gap
        if np.isfinite(part).any():
            keep |= {int(a + np.nanargmin(part)), int(a + np.nanargmax(part))}
    index = np.array(sorted(keep))
    return time[index], values[index]


def with_gaps(time: Floats, values: Floats, longest_s: float = 0.5) -> tuple[Floats, Floats]:
    """Return the line with a hole where two instants are further apart: the unmeasured is not drawn."""
    holes = np.flatnonzero(np.diff(time) > longest_s) + 1
    return np.insert(time, holes, time[holes - 1]), np.insert(values, holes, np.nan)


def line(
    name: str,
    time: Floats,
    measured: Floats,
    unit: str,
    *,
    true: tuple[Floats, Floats] | None = None,
    settled_s: float | None = None,
    from_zero: bool = False,
    width_in: float = 3.65,
    height_in: float = 1.32,
) -> str:
    """Return a chart of one value over time, with the true one below it; before `settled_s` it is shaded."""
    figure, axes = _figure(width_in, height_in)
    if settled_s is not None and len(time) and settled_s > time[0]:
        axes.axvspan(time[0], settled_s, color=SHADE, linewidth=0)
    if true is not None:
        axes.plot(*thinned(*with_gaps(*true)), color=TRUE, linewidth=3.0, solid_capstyle="round")
    axes.plot(*thinned(*with_gaps(time, measured)), color=MEASURED, linewidth=1.1)
    axes.set_xlim(time[0], max(time[-1], time[0] + 1e-3))
    axes.set_ylabel(unit, color=QUIET, fontsize=7.5)
    axes.set_xlabel("s", color=QUIET, fontsize=7.5, labelpad=0)
    low, high = _reach(time, measured, true, settled_s)
    if from_zero:
        low, high = 0.0, max(high, 1.0)
    elif high - low < 10.0:  # stillness is to look still
        low, high = (low + high) / 2 - 5.0, (low + high) / 2 + 5.0
    axes.set_ylim(low, high)
    return svg(figure, name)


def _reach(
    time: Floats, measured: Floats, true: tuple[Floats, Floats] | None, settled_s: float | None
) -> tuple[float, float]:
    """Return the range to draw: that of the truth and of what is calibrated, when anything is."""
    settled = measured if settled_s is None else measured[time >= settled_s]
    shown = np.concatenate([settled if np.isfinite(settled).any() else measured, *(true or ())[1:]])
    shown = shown[np.isfinite(shown)]
    if not shown.size:
        return 0.0, 1.0
    low, high = float(shown.min()), float(shown.max())
    margin = 0.06 * (high - low)
    return low - margin, high + margin


def histogram(name: str, values: Floats, unit: str, marks: Mapping[str, float]) -> str:
    """Return a histogram with named marks; rare high values are gathered at its end, which is then marked."""
    figure, axes = _figure(3.65, 1.75)
    first, last = min(marks.values()), max(marks.values())
    end = max(min(2.0 * last, 6.0 * first), 1.0)
    axes.hist(np.minimum(values, end), bins=np.linspace(0.0, end, 41).tolist(), color=MEASURED, alpha=0.85)
    top = 1.3 * axes.get_ylim()[1]  # the marks' names stand above the bars
    axes.set_ylim(0.0, top)
    for place, (mark, value) in enumerate(marks.items()):
        label, height = f"{mark} {value:.1f}", top * (0.96 - 0.12 * place)
        if value < end:
            axes.axvline(value, color=INK, linewidth=0.8, linestyle=(0, (3, 2)))
            axes.text(value + end * 0.012, height, label, fontsize=7.5, color=INK, va="top")
        else:
            axes.text(
                end, height, f"{label} \N{RIGHTWARDS ARROW}", fontsize=7.5, color=INK, va="top", ha="right"
            )
    axes.set_xlim(0.0, end)
    axes.set_xlabel(unit, color=QUIET, fontsize=7.5, labelpad=1)
    axes.set_ylabel("skeletons", color=QUIET, fontsize=7.5)
    return svg(figure, name)


def bars(name: str, values: Mapping[str, float], unit: str) -> str:
    """Return one horizontal bar a name, with its value beside it."""
    figure, axes = _figure(3.65, 0.55 + 0.24 * max(len(values), 2))
    names = list(values)[::-1]
    numbers = [values[n] for n in names]
    axes.grid(visible=False)
    axes.barh(range(len(names)), numbers, height=0.6, color=MEASURED, alpha=0.85)
    axes.set_yticks(range(len(names)), [n.replace("_", " ") for n in names])
    reach = max([*numbers, 1e-9])
    for i, number in enumerate(numbers):
        axes.text(number + reach * 0.02, i, f"{number:.2f}", va="center", fontsize=7.5, color=INK)
    axes.set_xlim(0.0, max(reach * 1.2, 1.0))
    axes.set_ylim(-0.6, max(len(names), 2) - 0.4)
    axes.set_xlabel(unit, color=QUIET, fontsize=7.5, labelpad=1)
    return svg(figure, name)
