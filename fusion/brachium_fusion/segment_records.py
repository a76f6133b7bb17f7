"""What alignment works on: sensors over the rows of a recording, and what was done in which of them. Pure."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees
from typing import Literal

import numpy as np
import numpy.typing as npt

from brachium_body import rotation
from brachium_fusion.pose import POSES

Floats = npt.NDArray[np.float64]
SpanKind = Literal["n-pose", "table", "given", "elbow-flexion", "pronation", "free"]

LED: tuple[SpanKind, ...] = ("elbow-flexion", "pronation")
SWAY_LIMIT_DEG = 5.0
"""A pose in which a sensor turned by more than this (rms) was not held."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Rows `first` to `end` (exclusive) of all records, and what the person did in them."""

    kind: SpanKind
    first: int
    end: int
    angles_deg: dict[str, float] = field(default_factory=dict)
    """Of the pose `given`, by clinical names."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorRecord:
    """One sensor over the rows; NaN where nothing was measured. Rows of all records belong together."""

    world_from_sensor: Floats
    """(n, 4)."""
    magnetometer: bool = False
    """Its world is the common one; without, its heading is its own."""
    nominal_mounting: Floats | None = None
    """segment_from_sensor (4,) as the wearer was told to put it on; None when nothing is known."""
    gyr: Floats | None = None
    """(n, 3) rad/s; not used: rates are taken from the orientations."""
    acc: Floats | None = None
    """(n, 3) m/s^2, calibrated; finds the heading between sensors of a joint that is moved about. None for
    sensors that deliver orientation only."""
    mag: Floats | None = None


def leaves_open(kinds: Collection[str]) -> bool:
    """Return whether movements of these kinds show less than both axes of an elbow, so that whatever else was
    recorded should be used with them. Free movement strains skin in more ways than led movement does."""
    return "free" not in kinds and not set(LED) <= set(kinds)


def check(records: Mapping[str, SensorRecord], spans: Sequence[Span], rate_hz: float) -> None:
    """Raise ValueError for spans outside the records, records of different lengths and rates of 0 or less."""
    lengths = {len(record.world_from_sensor) for record in records.values()}
    if len(lengths) != 1:
        raise ValueError(f"expected records of one length, got {sorted(lengths)} rows")
    if not rate_hz > 0.0:
        raise ValueError(f"expected a rate above 0, got {rate_hz} Hz")
    (rows,) = lengths
    for span in spans:
        if not 0 <= span.first < span.end <= rows:
            raise ValueError(
                f"the span {span.kind} has rows {span.first} to {span.end}; records have {rows} rows"
            )


def rows_of(record: SensorRecord, span: Span) -> Floats:
    """Return the known orientations (k, 4) of a span."""
    quats = record.world_from_sensor[span.first : span.end]
    return quats[np.isfinite(quats[:, 0])]


def held_pose(
    records: Mapping[str, SensorRecord], spans: Sequence[Span], refused: dict[str, str]
) -> Span | None:
    """Return the first pose in which all sensors were still; reasons of others go to `refused`."""
    poses = [span for span in spans if span.kind in POSES]
    if not poses:
        refused["pose"] = "no spans to calibrate from: give a pose, held still for some seconds"
    for span in poses:
        moved = []
        for name, record in records.items():
            quats = rows_of(record, span)
            if len(quats) == 0:
                continue
            sway = rotation.angle_between(rotation.mean(quats), quats)
            sway_deg = degrees(float(np.sqrt(np.mean(sway**2))))
            if sway_deg > SWAY_LIMIT_DEG:
                moved.append(f"{name} by {sway_deg:.0f} deg")
        if not moved:
            refused.pop("pose", None)
            return span
        refused["pose"] = f"not still in the pose {span.kind}: {', '.join(moved)}; hold it for some seconds"
    return None
