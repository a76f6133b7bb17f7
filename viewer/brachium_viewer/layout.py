"""The panels of the live view, as a Rerun blueprint, and the style of everything that is logged once."""

from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from brachium_viewer.drawings import Arm, Layout
from brachium_viewer.raw_signals import KINDS
from brachium_viewer.scene import (
    ARM_COLOUR,
    CHEST_HEIGHT,
    ORANGE,
    PLOTS,
    QUALITY_COLOUR,
    SKY,
    VERMILION,
    Plot,
    line_colours,
    place_of,
)

TIMELINE = "time"
WINDOW_S = 20.0
"""How much of the past the plots show."""
AXIS_COLOUR = {"x": VERMILION, "y": ORANGE, "z": SKY}
_MARGIN_DEG = 12.0
_REFERENCE = (120, 128, 134, 255)
_TRUTH_LINE = (205, 208, 212, 255)


def blueprint(layout: Layout) -> Any:
    """Return the panels for who is there: picture and words left, plots and quality lanes right."""
    plots = [_plot(p) for p in PLOTS if p.angle in layout.angles]
    picture = rrb.Spatial3DView(
        origin="/world",
        name=layout.title,
        background=rrb.Background(color=(24, 27, 31), kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.25, stroke_width=0.6, color=(120, 130, 140, 90)),
        eye_controls=_eye(layout),
    )
    words = rrb.TextDocumentView(origin="/words", name="What is shown")
    lanes = rrb.StateTimelineView(origin="/quality", name="Sensor quality", time_ranges=_window())
    rows = ([[plots[0]]] if len(plots) % 2 else []) + [
        plots[i : i + 2] for i in range(len(plots) % 2, len(plots), 2)
    ]
    right = [rrb.Vertical(*(rrb.Horizontal(*row) for row in rows))] if rows else []
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(picture, words, row_shares=[3, 2]),
            _side_panel(
                rrb.Vertical(*right, lanes, row_shares=[3, 1][1 - len(right) :], name="Angles"), layout
            ),
            column_shares=[10, 11],
        ),
        rrb.TimePanel(
            state="collapsed",
            timeline=TIMELINE,
            play_state="playing" if layout.recorded else "following",
        ),
        rrb.TopPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _side_panel(angles: Any, layout: Layout) -> Any:
    """Return the angles' panel, with raw signals in a tab beside it where they were asked for."""
    if not layout.raw:
        return angles
    rows = [
        rrb.Horizontal(
            *(
                rrb.TimeSeriesView(
                    origin=f"/raw/{subject}/{segment}/{kind}",
                    name=f"{subject} {segment.replace('_', ' ')}: {words}",
                    plot_legend=rrb.PlotLegend(visible=False),
                    time_ranges=_window(),
                )
                for kind, words in KINDS.items()
            )
        )
        for subject, segment in layout.raw
    ]
    return rrb.Tabs(angles, rrb.Vertical(*rows, name="Raw signals"), active_tab=1)


def log_raw_lines(recording: rr.RecordingStream, layout: Layout) -> None:
    """Log names and colours of the raw signals' axes, once a layout."""
    for subject, segment in layout.raw:
        for kind in KINDS:
            lines = rr.SeriesLines(
                colors=list(AXIS_COLOUR.values()), names=list(AXIS_COLOUR), widths=[1.4] * 3
            )
            recording.log(f"raw/{subject}/{segment}/{kind}", lines, static=True)


def log_lanes(recording: rr.RecordingStream, path: str) -> None:
    """Log a quality lane's words and colours, once."""
    names = list(QUALITY_COLOUR)
    labels = [name.replace("_", " ") for name in names]
    recording.log(
        path,
        rr.StateConfiguration(values=names, labels=labels, colors=list(QUALITY_COLOUR.values())),
        static=True,
    )


def log_lines(recording: rr.RecordingStream, layout: Layout) -> None:
    """Log names and colours of every line of every plot, once a layout."""
    colours = line_colours(layout.arms)
    for plot in (p for p in PLOTS if p.angle in layout.angles):
        path = f"angles/{plot.angle}"
        reference = [f"AAOS reference {plot.low:g}°", f"AAOS reference {plot.high:g}°"]
        recording.log(
            f"{path}/reference",
            rr.SeriesLines(colors=[_REFERENCE, _REFERENCE], names=reference, widths=[1.0, 1.0]),
            static=True,
        )
        for arm in layout.arms:
            colour = ARM_COLOUR[colours[arm.subject, arm.side]]
            line = rr.SeriesLines(
                colors=[_TRUTH_LINE if arm.truth else colour],
                names=[_name(arm)],
                widths=[4.0 if arm.truth else 1.8],
            )
            recording.log(f"{path}/{arm.path}", line, static=True)


def _name(arm: Arm) -> str:
    return f"{arm.subject} {arm.side}" + (" truth" if arm.truth else "")


def _plot(plot: Plot) -> Any:
    return rrb.TimeSeriesView(
        origin=f"/angles/{plot.angle}",
        name=f"{plot.title} [°]",
        axis_y=rrb.ScalarAxis(range=(plot.low - _MARGIN_DEG, plot.high + _MARGIN_DEG)),
        plot_legend=rrb.PlotLegend(visible=False),
        time_ranges=_window(),
    )


def _window() -> list[Any]:
    start = rrb.TimeRangeBoundary.cursor_relative(seconds=-WINDOW_S)
    return [
        rrb.VisibleTimeRange(TIMELINE, start=start, end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0))
    ]


def _eye(layout: Layout) -> Any:
    """Look at everybody from in front, from the side of the arm and a little above."""
    people = len({arm.subject for arm in layout.arms})
    sides = {arm.side for arm in layout.arms}
    middle = (place_of(0) + place_of(people - 1)) / 2
    aside = 0.0 if len(sides) > 1 else 0.8 if "right" in sides else -0.8
    away = 1.35 + 1.1 * (people - 1)
    return rrb.EyeControls3D(
        position=(middle + aside, away, CHEST_HEIGHT + 0.16),
        look_target=(middle + 0.2 * aside, 0.1, CHEST_HEIGHT - 0.2),
        eye_up=(0.0, 0.0, 1.0),
    )
