"""Which rows calibrate a recording: as stated, else the first stillness and all that follows. Pure."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from brachium_fusion.best_arm import Tracked
from brachium_fusion.best_material import Material
from brachium_fusion.pose_watch import POSE_USED_NS, STILL_S
from brachium_fusion.segment_records import leaves_open
from brachium_fusion.sensor_to_segment import Span
from brachium_fusion.track import STILL_RAD_S

Floats = npt.NDArray[np.float64]


def rows_of_spans(
    material: Material, tracked: Mapping[str, Tracked], time_s: Floats, rate_hz: float
) -> list[Span]:
    """Return the spans as rows; where the stated movements do not show an elbow's axes, all that follows the
    pose is free movement."""
    spans = []
    for span in material.spans:
        first, end = np.searchsorted(time_s, [span.from_s - 1e-9, span.to_s + 1e-9]).tolist()
        if first < end:
            spans.append(Span(kind=span.kind, first=first, end=end, angles_deg=dict(span.angles_deg)))  # type: ignore[arg-type]
    if not spans and material.find_pose:
        spans = _stillness(tracked, rate_hz)
    open_yet = bool(spans) and leaves_open([span.kind for span in spans])
    if open_yet and spans[0].end + rate_hz < len(time_s):
        spans.append(Span(kind="free", first=spans[0].end, end=len(time_s)))
    return spans


def _stillness(tracked: Mapping[str, Tracked], rate_hz: float) -> list[Span]:
    """Return the end of the first 3 s in which all raw sensors were still, as the n-pose."""
    raw = [one for one in tracked.values() if one.raw]
    if not raw:
        return []
    still = np.ones(len(raw[0].samples.missing), dtype=np.bool_)
    for one in raw:
        speed = np.linalg.norm(one.samples.gyr, axis=1)
        still &= ~(speed > STILL_RAD_S) & np.isfinite(speed)
    wanted = round(STILL_S * rate_hz)
    moving = np.concatenate([[-1], np.flatnonzero(~still), [len(still)]])
    long = np.flatnonzero(np.diff(moving) - 1 >= wanted)
    if len(long) == 0:
        return []
    end = int(moving[long[0]]) + 1 + wanted
    return [Span(kind="n-pose", first=end - round(1e-9 * POSE_USED_NS * rate_hz), end=end)]
