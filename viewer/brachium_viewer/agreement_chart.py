"""Bland-Altman plots: what two measures differ by, over what they measure."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from brachium_body.angles import CLINICAL
from brachium_viewer.agreement import Agreement, agreement
from brachium_viewer.charts import INK, MEASURED, QUIET
from brachium_viewer.one_frame import Mask, Pairs
from brachium_wire.table import MissingExtra, TableError

ENDINGS = (".svg", ".png", ".pdf")
POINTS = 4000
"""Dots of a panel at most, evenly chosen; its lines rest on all of them."""
ACROSS = 3
A_PAGE = 12
"""Panels that are still read at a glance, and fit on a screen."""
LABELLED = {"deg": "deg", "m": "mm"}
SCALE = {"m": 1e3}


def draw(path: Path, numbers: Pairs, counts: Mask, units: dict[str, str]) -> list[str]:
    """Draw one panel a number that both know, on rows that count; return the numbers that found no place.

    A .pdf gets as many pages as it needs; .svg and .png are one, on which clinical angles come first.
    Raises TableError for another ending or when there is nothing to draw, MissingExtra without matplotlib.
    """
    if path.suffix not in ENDINGS:
        raise TableError(f"{path}: a figure's name ends in {', '.join(ENDINGS)}")
    try:
        import matplotlib
        from matplotlib.backends.backend_pdf import PdfPages
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtra("--figure needs matplotlib: pip install 'brachium[report]'") from None
    panels = {}
    for name, (a, b) in numbers.items():
        scale = SCALE.get(units.get(name, ""), 1.0)
        pair = (scale * a[counts], scale * b[counts])
        if (figures := agreement(*pair)) is not None:
            panels[name] = (pair, figures)
    if not panels:
        raise TableError("nothing to draw: the two share no number, only orientations")
    in_order = sorted(panels, key=lambda name: name.removesuffix("_r").removesuffix("_l") not in CLINICAL)
    pages = [in_order[first : first + A_PAGE] for first in range(0, len(in_order), A_PAGE)]
    figures_of = []
    for names in pages if path.suffix == ".pdf" else pages[:1]:
        rows, across = math.ceil(len(names) / ACROSS), min(ACROSS, len(names))
        figure = Figure(figsize=(3.7 * across, 2.5 * rows + 0.3), layout="constrained", dpi=150)
        for place, name in enumerate(names):
            unit = units.get(name, "")
            _panel(figure.add_subplot(rows, across, place + 1), name, LABELLED.get(unit, unit), *panels[name])
        figures_of.append(figure)
    if path.suffix == ".pdf":
        with PdfPages(path) as book:
            for figure in figures_of:
                book.savefig(figure)
        return []
    with matplotlib.rc_context({"svg.hashsalt": "bland-altman", "svg.fonttype": "path"}):
        figures_of[0].savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    return in_order[A_PAGE:]


def _panel(axes: Any, name: str, unit: str, pair: tuple[Any, Any], figures: Agreement) -> None:
    a, b = pair
    known = np.flatnonzero(np.isfinite(a) & np.isfinite(b))
    known = known[:: max(1, math.ceil(len(known) / POINTS))]
    axes.plot((a + b)[known] / 2.0, (a - b)[known], ".", color=MEASURED, markersize=1.6, alpha=0.35)
    low, high = figures.limits
    for value, dashes in ((figures.bias, (1, 0)), (low, (4, 2)), (high, (4, 2))):
        axes.axhline(value, color=INK, linewidth=0.9, dashes=dashes)
        axes.annotate(
            f"{value:.3g}",
            (1.0, value),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=7,
            color=INK,
        )
    low, high = min(low, float(np.nanmin(a - b))), max(high, float(np.nanmax(a - b)))
    margin = 0.05 * max(high - low, 1e-9)
    axes.set_ylim(low - margin, high + margin)
    axes.set_title(name.replace("_", " "), fontsize=8.5, color=INK, loc="left")
    axes.set_xlabel(f"mean of both, {unit}".rstrip(", "), fontsize=7, color=QUIET, labelpad=1)
    axes.set_ylabel(f"a - b, {unit}".rstrip(", "), fontsize=7, color=QUIET, labelpad=1)
    axes.tick_params(labelsize=7, colors=QUIET, length=2.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
