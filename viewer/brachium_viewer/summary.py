"""The summary of a recording: one page of HTML that needs nothing else and prints to A4."""

from pathlib import Path

from brachium_viewer import contents as c
from brachium_viewer import figures as f
from brachium_viewer.contents import Contents
from brachium_viewer.figures import SummaryFigures
from brachium_viewer.page_sections import arm_section, network_charts, tables
from brachium_viewer.page_template import origin_words, render

TEMPLATE = Path(__file__).with_name("summary.html.j2")


def write(recording: Path, out: Path, title: str = "") -> SummaryFigures:
    """Write the page of a recording to `out` and return its figures.

    Raises recording.RecordingError for a file that is none, and MissingExtra without `brachium[report]`.
    """
    contents = c.load(recording)
    figures = f.of_contents(contents, recording.name)
    text = page(contents, figures, title)
    out.write_text(text, encoding="utf-8")
    return figures


def page(contents: Contents, figures: SummaryFigures, title: str = "") -> str:
    """Return the page's HTML: no script, nothing loaded from elsewhere."""
    subjects = sorted({who[0] for who in (*contents.sensors, *contents.arms)})
    heading = title or f"Summary of {', '.join(subjects) or figures.recording}"
    origin_title, origin_text = origin_words(figures.origins)
    return render(
        TEMPLATE,
        title=heading,
        heading=heading,
        facts=_facts(contents, figures),
        worn=figures.origins == ["worn"],
        origin_title=origin_title,
        origin_text=origin_text,
        notes=_notes(contents, figures),
        tiles=_tiles(figures),
        arms=[
            arm_section(who, contents, figures.arms["/".join(who)])
            for who in sorted(contents.arms)
            if "/".join(who) in figures.arms
        ],
        network=network_charts(contents, figures),
        tables=tables(figures),
        recording=figures.recording,
    )


def _facts(contents: Contents, figures: SummaryFigures) -> list[str]:
    facts = [figures.started.replace("T", " ").replace("+00:00", " UTC")] if figures.started else []
    facts.append(
        f"{figures.duration_s:.0f} s" if figures.duration_s < 120 else f"{figures.duration_s / 60:.1f} min"
    )
    facts += [f"exercise: {s.exercise}" for s in contents.sessions.values() if s.exercise]
    facts += [
        f"calibrated in pose: {k.pose}"
        for k in contents.calibrations.values()
        if k.state == "done" and k.pose
    ]
    facts.append(f"{len(figures.segments)} sensors")
    return facts


def _notes(contents: Contents, figures: SummaryFigures) -> list[str]:
    notes = [figures.warning] if figures.warning else []
    for subject, calibration in sorted(contents.calibrations.items()):
        notes += [f"{subject}: {text}" for text in calibration.warnings]
        if calibration.state == "refused":
            notes.append(f"{subject}: calibration refused: {calibration.reason}")
    for who, arm in figures.arms.items():
        if not arm.calibrated:
            notes.append(
                f"{who}: never calibrated; angles are those of uncalibrated sensors, compared with nothing."
            )
    if figures.unreadable:
        notes.append("Left out: " + ", ".join(f"{n} messages {why}" for why, n in figures.unreadable.items()))
    return notes


def _tiles(figures: SummaryFigures) -> list[tuple[str, str]]:
    tiles = []
    several = len(figures.arms) > 1
    for who, arm in figures.arms.items():
        of = f", {who}" if several else ""
        if arm.clinical_rmse_deg is not None:
            tiles.append((f"{arm.clinical_rmse_deg:.1f}°", f"RMS error of the clinical angles{of}"))
        if "hand" in arm.positions_mm:
            tiles.append((f"{arm.positions_mm['hand'].rmse:.0f} mm", f"RMS error of the fingertip{of}"))
        if arm.rate_hz is not None:
            tiles.append((f"{arm.rate_hz:.1f} Hz", f"skeletons{of}"))
        if arm.latency_p50_ms is not None and arm.latency_p99_ms is not None:
            tiles.append(
                (
                    f"{arm.latency_p50_ms:.0f} / {arm.latency_p99_ms:.0f} ms",
                    f"latency, median / 99\u00a0%{of}",
                )
            )
    lost = sum(s.lost for s in figures.segments.values())
    sent = lost + sum(s.received for s in figures.segments.values())
    if sent:
        tiles.append((f"{100.0 * lost / sent:.2f} %", "samples lost"))
    return tiles
