"""What a capture's settings and its segments' times must agree on."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from brachium_body.segments import Segment
from brachium_wire.capture_settings import CaptureError, CaptureSettings

Floats = npt.NDArray[np.float64]

MAX_T_S = 4e9
"""Seconds from any start, the epoch of Unix time included: it reaches this in 2096."""
_SPAN_SLACK_S = 0.1
"""People round the end of a span; the last sample lies a period before the round second."""
_OTHER_UNIT = 20.0
"""A period this many times off the stated one is another unit of time, not a slow sensor."""


def check_agreement(settings: CaptureSettings, times: Mapping[Segment, Floats]) -> None:
    """Refuse sides, periods, clocks and spans that do not fit the segments' times (n,), s.

    Raises CaptureError with a text that begins with the entry or segment.
    """
    _check_side(settings, times)
    for name, t in times.items():
        _check_period(name, t, settings.rate_hz)
    _check_one_clock(times)
    start = min(float(t[0]) for t in times.values())
    _check_spans(settings, max(float(t[-1]) for t in times.values()) - start)


def check_range(path: Path, t: Floats) -> None:
    """Raise CaptureError for the first of the times (n,) that no recording reaches; NaN is left alone."""
    wrong = np.flatnonzero(np.abs(t) > MAX_T_S)
    if wrong.size:
        row = int(wrong[0])
        raise CaptureError(
            f"{path}: data row {row + 1}: t = {t[row]:g}; "
            f"expected seconds, at most {MAX_T_S:g}, from any start"
        )


def _check_side(settings: CaptureSettings, times: Mapping[Segment, Floats]) -> None:
    sides = {"_r": "right", "_l": "left"}
    present = {side for ending, side in sides.items() if any(name.endswith(ending) for name in times)}
    if settings.side != "both" and present and settings.side not in present:
        (other,) = present
        named = ", ".join(name for name in times if sides.get(name[-2:]) == other)
        raise CaptureError(
            f'side = "{settings.side}" (right where capture.toml says none), but the tables are of the '
            f'{other} side: {named}; write side = "{other}", or rename them'
        )


def _check_period(name: str, t: Floats, rate_hz: float | None) -> None:
    """Look for milliseconds and the like; a rate that is not stated is taken to be above 1 Hz."""
    period = float(np.median(np.diff(t)))
    expected = 1.0 / rate_hz if rate_hz is not None else 0.05
    ratio = period / expected
    if ratio > _OTHER_UNIT or (rate_hz is not None and ratio < 1.0 / _OTHER_UNIT):
        unit = "microseconds" if ratio > 1e5 else "milliseconds" if ratio > _OTHER_UNIT else "another unit"
        stated = "" if rate_hz is None else f", but rate_hz = {rate_hz:g}"
        raise CaptureError(
            f"{name}: samples are {period:g} s apart{stated}; t is in seconds; this looks like {unit}"
        )


def _check_one_clock(times: Mapping[Segment, Floats]) -> None:
    in_order = sorted(times, key=lambda name: float(times[name][0]))
    last = in_order[0]
    for name in in_order[1:]:
        end, begin = float(times[last][-1]), float(times[name][0])
        if begin > end:
            raise CaptureError(
                f"{name}: begins at t = {begin:.10g} s, after {last} ended at {end:.10g} s; "
                "all files of a capture count t on one clock: shift one of them, or leave it out"
            )
        if float(times[name][-1]) > end:
            last = name


def _check_spans(settings: CaptureSettings, end_s: float) -> None:
    spans = settings.calibration
    stated = [("calibration", "to_s", spans.to_s), ("calibration", "from_s", spans.from_s)]
    stated += [(f"calibration.functional {span.motion}", "to_s", span.to_s) for span in spans.functional]
    for where, entry, second in stated:
        if second is not None and second > end_s + _SPAN_SLACK_S:
            raise CaptureError(
                f"{where}: {entry} = {second:g} lies after the recording's end at {end_s:.1f} s"
            )
