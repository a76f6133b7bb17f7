"""The figures of a recording: loss, rate, latency, and the error against truth of an emulated wearer."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_viewer import contents as c
from brachium_viewer.contents import ArmContents, Contents, SensorContents
from brachium_viewer.statistics import ErrorFigures, error_figures, interpolate, percentiles, wrap_deg

Floats = npt.NDArray[np.float64]

CLINICAL = (
    "shoulder_flexion",
    "shoulder_abduction",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_pronation",
    "wrist_flexion",
    "wrist_deviation",
)
ISB = ("isb_elevation", "isb_plane", "isb_axial")
OF_THE_PLANE = ("isb_plane", "isb_axial")
ELEVATED_DEG = 20.0
"""Below this true elevation the plane, and the axial rotation against it, say nothing: hanging, only their
sum is defined."""
TRUTH_GAP_S = 0.1
"""Truth is interpolated between two instants at most this far apart."""


@dataclass(frozen=True, kw_only=True)
class SegmentFigures:
    """One sensor's samples: the gateway's count since the node joined, or else those that are recorded."""

    node: str
    origin: str
    received: int
    lost: int
    out_of_order: int
    late: int
    loss_percent: float
    counted_by: str
    """gateway or recording."""


@dataclass(frozen=True, kw_only=True)
class ArmFigures:
    """One arm's skeletons."""

    skeletons: int
    rate_hz: float | None
    latency_p50_ms: float | None
    """From the gateway's having the last sample needed to the recorder's having the skeleton."""
    latency_p99_ms: float | None
    forward: str
    calibrated: int
    """Skeletons after calibration; only these are compared."""
    compared: int
    """Of these, the ones for whose instant truth is known."""
    quality: dict[str, dict[str, int]]
    """Skeletons a quality, by segment."""
    angles_deg: dict[str, ErrorFigures]
    """Published minus true; angles that rest on an assumption are left out, and so are ISB's plane and axial
    rotation where the true elevation is below 20 deg."""
    positions_mm: dict[str, ErrorFigures]
    """Distances from the true joint centres, in trunk axes."""
    clinical_rmse_deg: float | None
    """Root mean square over the clinical angles that are measured."""


@dataclass(frozen=True, kw_only=True)
class SummaryFigures:
    """All figures of a recording; `to_json` gives plain values."""

    recording: str
    started: str
    duration_s: float
    origins: list[str]
    segments: dict[str, SegmentFigures]
    """By `subject/segment`."""
    arms: dict[str, ArmFigures]
    """By `subject/side`."""
    unreadable: dict[str, int] = field(default_factory=dict)
    warning: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the same as maps, lists, text and numbers."""
        return asdict(self)


def figures(path: Path) -> SummaryFigures:
    """Return the figures of a recording; raises recording.RecordingError for a file that is none."""
    return of_contents(c.load(path), path.name)


def of_contents(contents: Contents, name: str) -> SummaryFigures:
    """Return the figures of what a recording holds."""
    return SummaryFigures(
        recording=name,
        started=contents.metadata.get("started", ""),
        duration_s=contents.duration_s,
        origins=contents.origins,
        segments=segments(contents),
        arms={"/".join(who): _arm(arm) for who, arm in sorted(contents.arms.items()) if len(arm.published)},
        unreadable=contents.unreadable,
        warning="; ".join(line for line in (contents.warning, *contents.clocks.values()) if line),
    )


def segments(contents: Contents) -> dict[str, SegmentFigures]:
    """Return each sensor's figures by `subject/segment`, from the trunk outwards."""
    found = sorted(contents.sensors.items(), key=c.outwards)
    return {"/".join(who): _segment(sensor) for who, sensor in found}


def _segment(sensor: SensorContents) -> SegmentFigures:
    info, status, counted = sensor.info, sensor.status, sensor.counted
    count = counted if status is None else status
    return SegmentFigures(
        node=info.node if info is not None else status.node if status is not None else "",
        origin=info.origin if info is not None else "",
        received=count.received,
        lost=count.lost,
        out_of_order=count.out_of_order,
        late=status.late if status is not None else 0,
        loss_percent=100.0 * count.lost / max(count.received + count.lost, 1),
        counted_by="gateway" if status is not None else "recording",
    )


def _arm(arm: ArmContents) -> ArmFigures:
    published = arm.published
    time_ns, settled = published.time_ns, c.calibrated(published)
    p50, p99 = percentiles(latencies_ms(arm))
    span_s = float(time_ns.max() - time_ns.min()) / 1e9
    quality: dict[str, dict[str, int]] = {}
    for skeleton, n in zip(published.examples, np.bincount(published.form).tolist(), strict=True):
        for segment, pose in skeleton.segments.items():
            counts = quality.setdefault(segment, {})
            counts[pose.quality] = counts.get(pose.quality, 0) + n
    names = _common(arm)
    errors = angle_errors_deg(arm, names)
    angles = {n: f for n, e in zip(names, errors.T, strict=True) if (f := error_figures(e)) is not None}
    clinical = [angles[name].rmse for name in CLINICAL if name in angles]
    joints = dict.fromkeys(joint for skeleton in arm.true.examples for joint in skeleton.positions)
    positions = {j: f for j in joints if (f := error_figures(position_error_mm(arm, j))) is not None}
    return ArmFigures(
        skeletons=len(published),
        rate_hz=(len(published) - 1) / span_s if span_s > 0 else None,
        latency_p50_ms=p50,
        latency_p99_ms=p99,
        forward=published.last.forward,
        calibrated=int(settled.sum()),
        compared=max([0, *(f.n for f in angles.values()), *(f.n for f in positions.values())]),
        quality=quality,
        angles_deg=angles,
        positions_mm=positions,
        clinical_rmse_deg=float(np.sqrt(np.mean(np.square(clinical)))) if clinical else None,
    )


def _common(arm: ArmContents) -> list[str]:
    """Return the angles that both the published and the true skeletons hold, in their order."""
    true = {name for skeleton in arm.true.examples for name in skeleton.angles}
    return [
        name for name in dict.fromkeys(n for s in arm.published.examples for n in s.angles) if name in true
    ]


def latencies_ms(arm: ArmContents) -> Floats:
    """Return the latencies (k,) that are known; a negative one is of another host's clock and is left out."""
    found = (arm.published.arrived_ns - arm.published.received_ns)[arm.published.received] / 1e6
    return found[found >= 0.0]


def angle_errors_deg(arm: ArmContents, names: list[str]) -> Floats:
    """Return published minus true (n, k), within half a turn; NaN before calibration, where assumed, and for
    angles of the plane of elevation where the arm is not raised."""
    true = true_at(arm, _unwrapped(_ordered(arm, arm.true.angles_rad(names))))
    error = wrap_deg(np.degrees(arm.published.angles_rad(names) - true))
    error[~c.calibrated(arm.published)] = np.nan
    low = ~_elevated(arm)
    for i, name in enumerate(names):
        error[~measured(arm, name) | (low & (name in OF_THE_PLANE)), i] = np.nan
    return error


def _elevated(arm: ArmContents) -> npt.NDArray[np.bool_]:
    """Return where the arm is truly raised far enough for its plane to be defined (n,)."""
    elevation = true_at(arm, _ordered(arm, arm.true.angles_rad(["isb_elevation"])))
    return np.asarray(np.degrees(elevation[:, 0]) >= ELEVATED_DEG)


def position_error_mm(arm: ArmContents, joint: str) -> Floats:
    """Return the distance of the published from the true joint centre (n,), NaN as for angles."""
    true = true_at(arm, _ordered(arm, arm.true.positions_m(joint)))
    error: Floats = 1e3 * np.linalg.norm(arm.published.positions_m(joint) - true, axis=1)
    error[~c.calibrated(arm.published) | ~measured(arm, joint)] = np.nan
    return error


def measured(arm: ArmContents, name: str) -> npt.NDArray[np.bool_]:
    """Return where an angle or position does not rest on an assumption (n,)."""
    return arm.published.each(lambda skeleton: skeleton.assumed.get(name) != "assumed", np.bool_)


def true_at(arm: ArmContents, values: Floats) -> Floats:
    """Return values (m, k) of the true skeletons, ordered by time, at the published instants, (n, k)."""
    at = np.unique(arm.true.time_ns)
    start = (
        at[0] if len(at) else 0
    )  # differences are small enough for float64, nanoseconds since 1970 are not
    wanted = (arm.published.time_ns - start).astype(np.float64)
    return interpolate(wanted, (at - start).astype(np.float64), values, TRUTH_GAP_S * 1e9)


def _ordered(arm: ArmContents, values: Floats) -> Floats:
    """Return the rows of the true skeletons in order of time, each instant once."""
    _, first = np.unique(arm.true.time_ns, return_index=True)
    return values[first]


def _unwrapped(angles: Floats) -> Floats:
    """Return angles (m, k) without jumps of a turn, so that what lies between two of them does."""
    for column in angles.T:
        known = np.isfinite(column)
        column[known] = np.unwrap(column[known])
    return angles
