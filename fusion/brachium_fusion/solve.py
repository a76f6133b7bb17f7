"""`brachium solve`: a recording or a capture folder to a table, through the same pipeline as live. The
shell: it
reads and writes files."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from brachium_fusion import from_capture, from_recording
from brachium_fusion.orientation import FilterName
from brachium_fusion.result import GROUPS, Group, tabulate
from brachium_fusion.settings import Settings
from brachium_wire import capture as captures
from brachium_wire import recording, table
from brachium_wire.messages import Forward, Skeleton


class SolveError(ValueError):
    """The input cannot be solved: one line that says what was expected, what came and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveSettings:
    """What `brachium solve` takes."""

    input: Path
    out: Path | None = None
    """`.csv` or `.parquet`; None writes nothing."""
    subject: str | None = None
    """Which subject of a recording; needed only where there are several."""
    filter: FilterName | None = None
    """None: what the recording used live; `auto` for a capture folder."""
    magnetometer: bool = True
    rate_hz: float | None = None
    groups: Sequence[Group] = GROUPS


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveReport:
    """What was solved."""

    rows: int
    sides: list[str]
    filter: str
    forward: Forward
    """Which rule said where forward is."""
    quality: dict[str, dict[str, int]]
    """Per segment: instants by quality."""
    drops: dict[str, int]
    warnings: list[str]
    scores: dict[str, float] = field(default_factory=dict)
    live_compared: int = 0
    """Of a recording: instants that were live, too, and how far the two differ at most."""
    live_angle_rad: float | None = None
    live_position_m: float | None = None
    out: str | None = None
    skeletons: list[Skeleton] = field(default_factory=list, repr=False)


def run(settings: SolveSettings) -> SolveReport:
    """Solve the input and write the table.

    Raises SolveError, and the errors of brachium_wire.capture, recording and table, each one line.
    """
    if settings.rate_hz is not None and not 1.0 <= settings.rate_hz <= 2000.0:
        raise SolveError(f"--rate must be 1 to 2000 Hz, not {settings.rate_hz:g}")
    if settings.input.is_dir():
        return _capture(settings)
    if not settings.input.exists():
        raise SolveError(
            f"{settings.input}: no such file or folder; give a recording (.mcap) or a capture folder"
        )
    return _recording(settings)


def _capture(settings: SolveSettings) -> SolveReport:
    capture = captures.load(settings.input)
    chosen = Settings(filter=settings.filter or "auto", magnetometer=settings.magnetometer, auto_pose=False)
    times = from_capture.output_times(capture, settings.rate_hz)
    pipeline, alignment = from_capture.solve(capture, chosen, times)
    skeletons = [solved.skeleton for solved in pipeline.skeletons()]
    warnings = list(capture.warnings)
    if alignment is None:
        warnings.append(
            "no calibration: mounting taken as stated (identity where not), quality uncalibrated; give "
            "[calibration] in capture.toml"
        )
    else:
        warnings.extend(alignment.warnings)
    subject = pipeline.subject(from_capture.SUBJECT)
    return _finish(
        settings,
        chosen,
        skeletons,
        from_capture.nanoseconds(times).tolist(),
        times,
        drops=subject.drops,
        warnings=warnings,
        scores={} if alignment is None else alignment.scores,
    )


def _recording(settings: SolveSettings) -> SolveReport:
    with recording.read(settings.input) as messages:
        subjects = from_recording.sort_out(messages)
        warning = messages.warning
    subjects = {name: contents for name, contents in subjects.items() if contents.samples}
    if not subjects:
        raise SolveError(f"{settings.input}: holds no samples of any subject")
    name = settings.subject or next(iter(subjects))
    if settings.subject is None and len(subjects) > 1:
        raise SolveError(f"{settings.input}: holds subjects {', '.join(subjects)}; choose one with --subject")
    if name not in subjects:
        raise SolveError(f"{settings.input}: holds no subject {name!r}; there are {', '.join(subjects)}")
    contents = subjects[name]
    live = from_recording.settings_of(contents)
    chosen = Settings(
        filter=settings.filter or live.filter,
        magnetometer=live.magnetometer and settings.magnetometer,
        rate_hz=settings.rate_hz or live.rate_hz,
        auto_pose=live.auto_pose,
    )
    pipeline, solved = from_recording.solve(name, contents, chosen)
    skeletons = [s.skeleton for s in solved if s.subject == name]
    compared, angle, position = (
        from_recording.largest_difference(skeletons, contents.live) if chosen == live else (0, 0.0, 0.0)
    )
    times_ns = sorted({s.time_ns for s in skeletons})
    zero = times_ns[0] if times_ns else 0
    warnings = [warning] if warning else []
    alignment = pipeline.subject(name).alignment
    if alignment is None:
        warnings.append("no calibration pose was found: quality uncalibrated")
    else:
        warnings.extend(alignment.warnings)
    return _finish(
        settings,
        chosen,
        skeletons,
        times_ns,
        (np.array(times_ns) - zero) * 1e-9,
        drops=pipeline.subject(name).drops + pipeline.drops,
        warnings=warnings,
        scores={} if alignment is None else alignment.scores,
        metadata={"subject": name, "time_zero_ns": zero},
        live=(compared, angle, position) if compared else None,
    )


def _finish(
    settings: SolveSettings,
    chosen: Settings,
    skeletons: list[Skeleton],
    times_ns: Sequence[int],
    times_s: Any,
    *,
    drops: Counter[str],
    warnings: list[str],
    scores: dict[str, float],
    metadata: dict[str, Any] | None = None,
    live: tuple[int, float, float] | None = None,
) -> SolveReport:
    if not skeletons:
        raise SolveError(f"{settings.input}: no instant could be solved; is any segment of an arm in it?")
    forward = skeletons[-1].forward
    if settings.out is not None:
        result = tabulate(skeletons, times_ns, times_s, settings.groups)
        table.write(
            settings.out,
            result.columns,
            result.units,
            {
                "made_by": "brachium solve",
                "input": settings.input.name,
                "filter": chosen.filter,
                "magnetometer": chosen.magnetometer,
                "mode": "live",
                "forward": forward,
                "origin": skeletons[-1].origin,
                **(metadata or {}),
            },
        )
    quality: dict[str, Counter[str]] = {}
    first = skeletons[0].side
    for skeleton in skeletons:
        for segment, pose in skeleton.segments.items():
            if segment != "sternum" or skeleton.side == first:  # both arms name the one sternum
                quality.setdefault(segment, Counter())[pose.quality] += 1
    return SolveReport(
        rows=len({s.time_ns for s in skeletons}),
        sides=sorted({s.side for s in skeletons}),
        filter=chosen.filter,
        forward=forward,
        quality={segment: dict(counts) for segment, counts in quality.items()},
        drops=dict(drops),
        warnings=warnings,
        scores=scores,
        live_compared=live[0] if live else 0,
        live_angle_rad=live[1] if live else None,
        live_position_m=live[2] if live else None,
        out=None if settings.out is None else str(settings.out),
        skeletons=skeletons,
    )
