"""`brachium solve`: a recording or a capture folder to a table. The shell: it reads and writes files.

`live` takes the way of the live service, through the same pipeline; `best` uses past and future.
"""

from collections import Counter
from functools import partial

import numpy as np
import numpy.typing as npt

from brachium_fusion import best, from_capture, from_recording
from brachium_fusion.best_arm import solve_arm
from brachium_fusion.best_material import Material
from brachium_fusion.capture_batches import nanoseconds
from brachium_fusion.orientation import FilterName
from brachium_fusion.result_quality import assumptions
from brachium_fusion.settings import Settings
from brachium_fusion.shoulder_model import NOT_OBSERVABLE_WITHOUT_STERNUM
from brachium_fusion.solve_table import tabled
from brachium_fusion.solve_terms import (
    MODES,
    NO_CALIBRATION,
    Mode,
    Outcome,
    SolveError,
    SolveReport,
    SolveSettings,
)
from brachium_fusion.subject import Subject
from brachium_fusion.zhou_recording import NEEDS, ZhouName, solve_zhou
from brachium_wire import capture as captures
from brachium_wire import recording, table

__all__ = ["MODES", "Mode", "SolveError", "SolveReport", "SolveSettings", "run"]


def run(settings: SolveSettings) -> SolveReport:
    """Solve the input and write the table.

    Raises SolveError, and the errors of brachium_wire.capture, recording and table, each one line.
    """
    return _finish(settings, outcome_of(settings))


def outcome_of(settings: SolveSettings) -> Outcome:
    """Solve the input and write nothing. Raises what `run` raises."""
    if settings.rate_hz is not None and not 1.0 <= settings.rate_hz <= 2000.0:
        raise SolveError(f"--rate must be 1 to 2000 Hz, not {settings.rate_hz:g}")
    if settings.mode not in MODES:
        raise SolveError(f"--mode {settings.mode!r} is not known; choose one of {', '.join(MODES)}")
    if settings.mode == "best" and settings.filter not in (None, "auto"):
        raise SolveError(f"--mode best has a way of its own: leave --filter {settings.filter} out")
    if settings.input.is_dir():
        return _some(settings, _capture(settings))
    if not settings.input.exists():
        raise SolveError(
            f"{settings.input}: no such file or folder; give a recording (.mcap) or a capture folder"
        )
    return _some(settings, _recording(settings))


def _some(settings: SolveSettings, outcome: Outcome) -> Outcome:
    if not outcome.skeletons:
        raise SolveError(f"{settings.input}: no instant could be solved; is any segment of an arm in it?")
    return outcome


def _split(name: FilterName | ZhouName | None) -> tuple[ZhouName | None, FilterName | None]:
    """Return the name as that of Zhou's system, which takes a whole recording, or as a filter's."""
    if name == "zhou" or name == "zhou-printed":
        return name, None
    return None, name


def _capture(settings: SolveSettings) -> Outcome:
    capture = captures.load(settings.input)
    times = from_capture.output_times(capture, settings.rate_hz)
    times_ns = nanoseconds(times).tolist()
    zhou, filter_name = _split(settings.filter)
    chosen = Settings(filter=filter_name or "auto", magnetometer=settings.magnetometer, auto_pose=False)
    if settings.mode == "best" or zhou:
        return _best(from_capture.material(capture), chosen, times, times_ns, times, {}, zhou)
    pipeline, alignment = from_capture.solve(capture, chosen, times)
    return Outcome(
        chosen=chosen,
        skeletons=[solved.skeleton for solved in pipeline.skeletons()],
        times_ns=times_ns,
        times_s=times,
        drops=pipeline.subject(from_capture.SUBJECT).drops,
        warnings=[*capture.warnings, *([NO_CALIBRATION] if alignment is None else alignment.warnings)],
        alignment=alignment,
        magnetometer=_field_used(pipeline.subject(from_capture.SUBJECT)),
    )


def _field_used(subject: Subject) -> bool:
    return any(track.magnetometer for track in subject.tracks.values())


def _best(
    material: Material,
    chosen: Settings,
    times_s: npt.NDArray[np.float64],
    times_ns: list[int],
    shown_s: npt.NDArray[np.float64],
    metadata: dict[str, object],
    zhou: ZhouName | None = None,
) -> Outcome:
    one_arm = solve_arm if zhou is None else partial(solve_zhou, zhou)
    found = best.solve(material, chosen, times_s, one_arm)
    if zhou is not None and not any(part.startswith("shoulder") for part in found.parts):
        raise SolveError(f"--filter {zhou} {NEEDS}; no arm has both: give them, or choose another --filter")
    nothing = [NO_CALIBRATION] if found.alignment is None else []
    return Outcome(
        chosen=chosen,
        skeletons=found.skeletons,
        times_ns=times_ns,
        times_s=shown_s,
        warnings=[*material.warnings, *found.warnings, *nothing],
        alignment=found.alignment,
        magnetometer=found.magnetometer,
        metadata=metadata,
        parts=found.parts,
        refused=found.refused,
    )


def _recording(settings: SolveSettings) -> Outcome:
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
    zhou, filter_name = _split(settings.filter)
    chosen = live.chosen(filter_name, settings.magnetometer, settings.rate_hz)
    warnings = [warning] if warning else []
    if settings.mode == "best" or zhou:
        return _best_recording(name, contents, chosen, warnings, zhou)
    pipeline, solved = from_recording.solve(name, contents, chosen)
    if contents.foreign_snapshot:
        warnings.append("begins with the state of another version of fusion: solved from its first sample")
    skeletons = [s.skeleton for s in solved if s.subject == name]
    compared, angle, position = (
        from_recording.largest_difference(skeletons, contents.live) if chosen == live else (0, 0.0, 0.0)
    )
    times_ns = sorted({s.time_ns for s in skeletons})
    zero = times_ns[0] if times_ns else 0
    alignment = pipeline.subject(name).calibrating.alignment
    nothing = ["no calibration pose was found: quality uncalibrated"]
    return Outcome(
        chosen=chosen,
        skeletons=skeletons,
        times_ns=times_ns,
        times_s=(np.array(times_ns) - zero) * 1e-9,
        drops=pipeline.subject(name).drops + pipeline.drops,
        warnings=[*warnings, *(nothing if alignment is None else alignment.warnings)],
        alignment=alignment,
        magnetometer=_field_used(pipeline.subject(name)),
        metadata={"subject": name, "time_zero_ns": zero},
        live=(compared, angle, position) if compared else None,
    )


def _best_recording(
    name: str,
    contents: from_recording.Contents,
    chosen: Settings,
    warnings: list[str],
    zhou: ZhouName | None,
) -> Outcome:
    material = from_recording.material(contents)
    first_s, last_s = material.span_s()
    period_ns = round(1e9 / chosen.rate_hz)
    first = -(-(material.zero_ns + round(1e9 * first_s)) // period_ns)
    count = (material.zero_ns + round(1e9 * last_s)) // period_ns - first + 1
    times_ns = ((first + np.arange(count)) * period_ns).tolist()
    times_s = np.asarray(1e-9 * (np.array(times_ns, dtype=np.int64) - material.zero_ns), dtype=np.float64)
    metadata: dict[str, object] = {"subject": name, "time_zero_ns": times_ns[0]}
    outcome = _best(material, chosen, times_s, times_ns, times_s - times_s[0], metadata, zhou)
    outcome.warnings[:0] = warnings
    return outcome


def _finish(settings: SolveSettings, outcome: Outcome) -> SolveReport:
    skeletons, chosen, alignment = outcome.skeletons, outcome.chosen, outcome.alignment
    forward, assumed = skeletons[-1].forward, assumptions(skeletons)
    if settings.out is not None:
        made = tabled(settings, outcome)
        table.write(settings.out, made.columns, made.units, made.metadata)
    quality: dict[str, Counter[str]] = {}
    first = skeletons[0].side
    for skeleton in skeletons:
        for segment, pose in skeleton.segments.items():
            if segment != "sternum" or skeleton.side == first:  # both arms name the one sternum
                quality.setdefault(segment, Counter())[pose.quality] += 1
    live, warnings = outcome.live, outcome.warnings
    if any(s.shoulder_shift is not None and "sternum" not in s.segments for s in skeletons):
        warnings = list(dict.fromkeys([*warnings, NOT_OBSERVABLE_WITHOUT_STERNUM]))
    return SolveReport(
        rows=len({s.time_ns for s in skeletons}),
        sides=sorted({s.side for s in skeletons}),
        filter=_split(settings.filter)[0] or chosen.filter,
        forward=forward,
        quality={segment: dict(counts) for segment, counts in quality.items()},
        drops=dict(outcome.drops),
        warnings=warnings,
        scores={} if alignment is None else alignment.scores,
        mode=settings.mode,
        parts=outcome.parts,
        refused=outcome.refused | ({} if alignment is None else alignment.refused),
        assumptions=assumed,
        live_compared=live[0] if live else 0,
        live_angle_rad=live[1] if live else None,
        live_position_m=live[2] if live else None,
        out=None if settings.out is None else str(settings.out),
        skeletons=skeletons,
    )
