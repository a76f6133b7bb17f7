"""What becomes of a closed recording: its session in the store, and its report beside it.

It takes seconds of computing, so it is done in a process of its own: the live view goes on meanwhile.
"""

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from brachium_viewer.catalogue import ENGLISH, LANGUAGES
from brachium_viewer.sessions.from_recording import session_from_recording
from brachium_viewer.sessions.records import SessionRecord
from brachium_viewer.sessions.store import Store
from brachium_wire.table import MissingExtra

Json = dict[str, Any]
P = ParamSpec("P")
T = TypeVar("T")

SHOWN = 12
"""Earlier sessions on a page."""


def apart(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Return what a function of this module gives, worked out in a new process; raises what it raises."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=fresh) as pool:
        return pool.submit(function, *args, **kwargs).result()


def keep(recording: Path, subject: str, language: str = ENGLISH) -> Json:
    """Put the session of a recording into the store of its folder, and write its report beside it.

    Returns the report's address; without one, why there is none.
    """
    folder = recording.parent
    with Store.open(folder) as store:
        store.add(session_from_recording(recording, subject))
    from brachium_viewer.report import page as report  # heavy

    page = report_page(recording)
    try:
        report.write(
            report.ReportSettings(
                recording=recording,
                out=page,
                sessions=folder,
                subject=subject,
                language=language if language in LANGUAGES else ENGLISH,
            )
        )
    except MissingExtra as error:
        return {"report": None, "why": str(error)}
    return {"report": report_link(page), "why": ""}


def earlier(folder: Path, subject: str) -> list[Json]:
    """Return a subject's sessions as a page shows them, newest first; none where there is no store yet."""
    if not folder.is_dir():
        return []
    with Store.open(folder) as store:
        return [_shown(folder, one) for one in store.sessions(subject)[:SHOWN]]


def _shown(folder: Path, record: SessionRecord) -> Json:
    page = report_page(folder / record.recording)
    return {
        "started": record.started_ns / 1e6,
        "origin": record.origin,
        "sets": [
            {
                "exercise": one.measures.exercise,
                "side": one.measures.side,
                "mode": one.measures.mode,
                "count": len(one.measures.repetitions),
            }
            for one in record.sets
        ],
        "report": report_link(page) if record.recording and page.is_file() else None,
    }


def report_page(recording: Path) -> Path:
    """Return where the report of a recording lies: beside it, so that it goes when the recording goes."""
    return recording.with_suffix(".html")


def report_link(page: Path) -> str:
    """Return the address of a report's page."""
    return f"/report/{page.stem}"
