"""What is exported: a result as it is, a recording's live skeletons, a capture folder solved on the way."""

import logging
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from brachium.shell import Usage
from brachium_fusion import from_recording, solve
from brachium_fusion.result import tabulate
from brachium_fusion.result_quality import assumptions
from brachium_fusion.solve_table import tabled
from brachium_wire import keys, recording, table
from brachium_wire.codec import WireError, decode_topic
from brachium_wire.messages import Event, Skeleton
from brachium_wire.recording import Recorded
from brachium_wire.steady_times import steady_times
from brachium_wire.table import Table

_log = logging.getLogger(__name__)

SIDES = ("right", "left")
OWN_KINDS = ("applied", "settings")
"""Events by which fusion keeps what it needs to repeat itself; all others were marked by somebody."""


def table_of(source: Path, subject: str | None) -> Table:
    """Return the input's result table.

    Raises Usage, FileNotFoundError and the errors of solve, recording and table, each one line.
    """
    if source.suffix in (".csv", ".parquet"):
        return table.read(source)
    if not source.is_dir():
        found = _live(source, subject)
        if found is not None:
            return found
    settings = solve.SolveSettings(input=source, subject=subject)
    outcome = solve.outcome_of(settings)
    for warning in outcome.warnings:
        _log.warning("%s", warning)
    return tabled(settings, outcome)


def _live(source: Path, subject: str | None) -> Table | None:
    """Return a recording's skeletons as they were live; None when it has samples alone."""
    with recording.read(source) as messages:
        arrived = list(messages)
        warning = messages.warning
    subjects = from_recording.sort_out(arrived)
    moving = {name: contents for name, contents in subjects.items() if contents.live}
    if not moving:
        return None
    if warning:
        _log.warning("%s", warning)
    if subject is not None and subject not in moving:
        if subject in subjects and subjects[subject].samples:
            return None
        raise Usage(f"{source}: holds no subject {subject!r}; there are {', '.join(moving)}")
    if subject is None and len(moving) > 1:
        raise Usage(f"{source}: holds subjects {', '.join(moving)}; choose one with --subject")
    name = subject or next(iter(moving))
    contents = moving[name]
    skeletons = _on_one_clock(contents)
    chosen = from_recording.settings_of(contents)
    times_ns = sorted({s.time_ns for s in skeletons})
    made = tabulate(skeletons, times_ns, [1e-9 * (t - times_ns[0]) for t in times_ns])
    settings = {**chosen.plain(), "mode": "live", "subject": name, "rate_hz": chosen.rate_hz}
    return Table(
        made.columns,
        made.units,
        {
            "input": source.name,
            "filter": chosen.filter,
            "mode": "live",
            "forward": skeletons[-1].forward,
            "origin": origin_of(skeletons),
            "sides": [side for side in SIDES if any(s.side == side for s in skeletons)],
            "assumed": assumptions(skeletons),
            "subject": name,
            "time_zero_ns": times_ns[0],
            "events": events_of(arrived, name, times_ns[0]),
            "settings": settings,
        },
    )


def _on_one_clock(contents: from_recording.Contents) -> list[Skeleton]:
    """Return the live skeletons at times that grow; what was put right or left out is warned of."""
    arrived = np.array(contents.live_arrived_ns, dtype=np.int64)
    times = np.array([s.time_ns for s in contents.live], dtype=np.int64)
    of_side = [rows for side in SIDES if (rows := np.array([s.side == side for s in contents.live])).any()]
    steady = steady_times([(times[rows], arrived[rows]) for rows in of_side])
    if not steady.told:
        return contents.live
    _log.warning("%s", steady.told)
    kept = np.zeros(len(times), dtype=np.bool_)
    for rows, time_ns, known in zip(of_side, steady.time_ns, steady.kept, strict=True):
        times[rows], kept[rows] = time_ns, known
    return [
        msgspec.structs.replace(contents.live[i], time_ns=int(times[i]))
        for i in np.flatnonzero(kept).tolist()
    ]


def events_of(arrived: list[Recorded], subject: str, zero_ns: int) -> list[dict[str, object]]:
    """Return what was marked: exercises, pain, notes, taps, markers; seconds from the first instant."""
    found: list[dict[str, object]] = []
    for key, payload, _ in arrived:
        with suppress(keys.BadKey, WireError):
            parsed = keys.parse(key)
            if parsed.topic != "event" or parsed.subject != subject:
                continue
            event = decode_topic(payload, "event")
            if isinstance(event, Event) and event.kind not in OWN_KINDS:
                at = {"time_s": 1e-9 * (event.time_ns - zero_ns), "kind": event.kind}
                found.append({**at, "text": event.text, "data": event.data})
    return sorted(found, key=lambda one: float(str(one["time_s"])))


def origin_of(skeletons: list[Skeleton]) -> str:
    """Return where they come from; nothing that is in part emulated or played goes as worn."""
    found = {s.origin for s in skeletons}
    return next(origin for origin in ("emulated", "playback", "worn") if origin in found)
