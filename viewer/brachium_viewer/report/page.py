"""`brachium report`: a recording to one page of HTML, and to a table. The shell: it touches files."""

from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from brachium_body.segments import Side
from brachium_viewer import contents as c
from brachium_viewer import figures as f
from brachium_viewer.catalogue import ENGLISH
from brachium_viewer.marks import ExerciseBegins
from brachium_viewer.page_sections import Chart
from brachium_viewer.page_template import origin_words, render
from brachium_viewer.report import comparison_tables as beside
from brachium_viewer.report import measure_tables, report_charts, sentences, tidy, tidy_sets, words
from brachium_viewer.report import report_tables as tables
from brachium_viewer.report.build import (
    Report,
    build,
    longest_gaps,
    movement_lines,
    of_movement,
    principal_components,
    range_bars,
)
from brachium_viewer.report.groups import lags, symmetries
from brachium_viewer.report.language import in_language, speaker
from brachium_viewer.report.range_chart import LEGEND, ranges
from brachium_viewer.report.withheld import withheld
from brachium_viewer.sessions import from_recording as sessions
from brachium_viewer.sessions.reading import open_to_read

TEMPLATE = Path(__file__).with_name("report.html.j2")


@dataclass(frozen=True, kw_only=True)
class ReportSettings:
    """What to tell of, and where."""

    recording: Path
    out: Path
    csv: Path | None = None
    sessions: Path | None = None
    """A store's folder: the last session and the subject's side come from there."""
    subject: str | None = None
    without_marks: ExerciseBegins | None = None
    """What was done, where nobody marked it."""
    language: str = ENGLISH
    """Of the page; one of LANGUAGES."""


@dataclass(frozen=True, kw_only=True)
class ReportFigures:
    """What the page says, in a few numbers."""

    subject: str
    origin: str
    sets: int
    repetitions: int
    compared: int
    """Movements that stand beside the last session's."""
    changed: int
    """Of their measures, those beyond the smallest detectable change."""
    bytes: int
    """Of the page."""
    clock: str
    """What was wrong with the times in the recording; empty when nothing was."""


def write(settings: ReportSettings) -> ReportFigures:
    """Write the page, and the tables of repetitions and of sets where they are wanted.

    Raises recording.RecordingError for a file that is none, StoreError when there is nothing of the subject,
    TableError for a table of another ending, and MissingExtra without `brachium[report]`.
    """
    contents = c.load(settings.recording)
    name = settings.recording.name
    who = sessions.the_subject(contents, name, settings.subject)
    motions = sessions.motions(contents, who)
    session = sessions.session(contents, name, who, motions, settings.without_marks)
    opened: Any = nullcontext() if settings.sessions is None else closing(open_to_read(settings.sessions))
    with opened as store:
        known = store.subject(who) if store is not None else None
        report = build(
            contents,
            session,
            motions,
            lambda exercise, side, mode: (
                store.history(who, exercise, side, mode, session.started_ns) if store is not None else ()
            ),
            known.affected_side if known is not None else "",
        )
    text = page(report, settings.language)
    settings.out.write_text(text, encoding="utf-8")
    if settings.csv is not None:
        tidy.write(settings.csv, session, report.zero_ns)
        every, parts = report.groups, principal_components(report)
        rows = tidy_sets.rows(every, symmetries(every, report.affected), lags(every), parts)
        tidy_sets.write(tidy_sets.beside(settings.csv), session, rows)
    changes = [change for past in report.pasts if past is not None for change in past.changes.values()]
    return ReportFigures(
        subject=who,
        origin=session.origin,
        sets=len(session.sets),
        repetitions=sum(len(one.measures.repetitions) for one in session.sets),
        compared=sum(bool(past.changes) for past in report.pasts if past is not None),
        changed=sum(change.detected for change in changes),
        bytes=len(text.encode()),
        clock=contents.clocks.get(who, ""),
    )


def page(report: Report, language: str = ENGLISH) -> str:
    """Return the page's HTML: no script, nothing loaded from elsewhere."""
    session, groups = report.session, report.groups
    origin_title, origin_text = origin_words([session.origin])
    arms, moved = symmetries(groups, report.affected), lags(groups)
    parts = principal_components(report)
    shown = [
        beside.between_arms(arms, report.errors),
        beside.active_passive(moved, groups, report.errors),
        tables.within_session(groups),
        tables.principal(parts),
    ]
    segments = {
        who: found
        for who, found in f.segments(report.contents).items()
        if who.split("/")[0] == session.subject
    }
    batteries = {
        "/".join(who): None if sensor.status is None else sensor.status.battery_level
        for who, sensor in report.contents.sensors.items()
    }
    english = render(
        TEMPLATE,
        session=session,
        date=tables.date(session.started_ns),
        facts=sentences.facts(report),
        worn=session.origin == "worn",
        origin_title=origin_title,
        origin_text=origin_text,
        zero=sentences.how_zero_was_set(report),
        warnings=sentences.warnings(report),
        done=tables.done(groups) if groups else None,
        ratings=[*tables.ratings(session.ratings), *sentences.stops(report)],
        ranges=_ranges(report, language),
        comparison=beside.comparison(groups, report.pasts),
        why_no_comparison=sentences.why_no_comparison(report),
        movements=movement_charts(report),
        measures=measure_tables.measures(groups) if groups else [],
        tables=[table for table in shown if table is not None],
        withheld=withheld(groups, arms, moved, parts),
        quality=tables.quality(segments, batteries, longest_gaps(report)),
        method=sentences.method(report),
        disclaimer=words.DISCLAIMER,
    )
    return in_language(english, language)


def movement_charts(report: Report) -> list[Chart]:
    """Return one row of figures for each exercise and arm that was repeated."""
    drawn = []
    moved: dict[tuple[Side, str], None] = dict.fromkeys((g.side, g.exercise.name) for g in report.groups)
    for side, name in moved:
        found, motion = of_movement(report, side, name)
        counts = {g.mode: len(g.pooled.repetitions) for g in found}
        if not any(counts.values()):
            continue
        lines = movement_lines(found, motion, report.zero_ns)
        label = ", ".join(f"{n} {mode}" for mode, n in counts.items())
        svg = report_charts.movement(f"{side}-{name}", lines)
        told = f"{label} repetition" if sum(counts.values()) == 1 else f"{label} repetitions"
        drawn.append(Chart(words.movement(name, side).capitalize(), told, svg))
    return drawn


def _ranges(report: Report, language: str) -> str:
    said = speaker(language)  # now: the drawing makes room for its labels
    bars = [replace(bar, label=said(bar.label)) for bar in range_bars(report)]
    legend = {name: said(text) for name, text in LEGEND.items()}
    return ranges("ranges", bars, legend) if bars else ""
