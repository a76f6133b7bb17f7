"""What a demo has shown: counts beside what was injected, the estimate beside the truth. Pure."""

from dataclasses import dataclass, field

from brachium_nodes.emulate import EmulateReport
from brachium_viewer.figures import ArmFigures, SummaryFigures


@dataclass(frozen=True, kw_only=True)
class SegmentCounts:
    """One sensor's samples: what the network counted, and what the emulated wearer did to them."""

    received: int
    lost: int
    out_of_order: int
    sent: int
    injected_lost: int
    injected_out_of_order: int

    @property
    def agree(self) -> bool:
        """Return whether the network saw exactly what was injected."""
        seen = self.received, self.lost, self.out_of_order
        return seen == (self.sent, self.injected_lost, self.injected_out_of_order)


@dataclass(frozen=True, kw_only=True)
class ArmReport:
    """One arm's skeletons; errors are over the instants after calibration."""

    skeletons: int
    compared: int
    rate_hz: float | None
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    rmse_deg: dict[str, float]
    rmse_mm: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class DemoReport:
    """A whole demo. `problem` says in one line what did not work; empty when all did."""

    exercise: str
    level: str
    seed: int
    seconds: float
    first_skeleton_s: float | None
    """From the demo's start to the first skeleton on the network."""
    segments: dict[str, SegmentCounts]
    arms: dict[str, ArmReport]
    recording: str
    summary: str
    problem: str = ""
    notes: list[str] = field(default_factory=list)


def segment_counts(figures: SummaryFigures, sent: EmulateReport) -> dict[str, SegmentCounts]:
    """Return each sensor's counts, by `subject/segment`."""
    counts = {}
    for subject, streams in sent.streams.items():
        for segment, stream in streams.items():
            seen = figures.segments.get(f"{subject}/{segment}")
            counts[f"{subject}/{segment}"] = SegmentCounts(
                received=seen.received if seen else 0,
                lost=seen.lost if seen else 0,
                out_of_order=seen.out_of_order if seen else 0,
                sent=stream.sent,
                injected_lost=stream.lost,
                injected_out_of_order=stream.swapped,
            )
    return counts


def arm_report(figures: ArmFigures) -> ArmReport:
    """Return one arm's report."""
    return ArmReport(
        skeletons=figures.skeletons,
        compared=figures.compared,
        rate_hz=figures.rate_hz,
        latency_p50_ms=figures.latency_p50_ms,
        latency_p99_ms=figures.latency_p99_ms,
        rmse_deg={name: error.rmse for name, error in figures.angles_deg.items()},
        rmse_mm={joint: error.rmse for joint, error in figures.positions_mm.items()},
    )


def problem(segments: dict[str, SegmentCounts], arms: dict[str, ArmReport]) -> str:
    """Return in one line what did not work, or nothing."""
    if not arms:
        return "no skeleton came"
    wrong = [name for name, counts in segments.items() if not counts.agree]
    if wrong:
        counts = segments[wrong[0]]
        return f"{wrong[0]}: the network's counts differ from what was injected: {counts}"
    return ""


def text(report: DemoReport) -> str:
    """Return the report for a person."""
    lines = [f"{report.exercise}, {report.level} sensors, seed {report.seed}, {report.seconds:.0f} s", ""]
    lines.append(f"{'sensor':<22}{'received':>10}{'lost':>8}{'out of order':>14}   injected")
    for name, c in report.segments.items():
        verdict = "the same" if c.agree else f"{c.sent} / {c.injected_lost} / {c.injected_out_of_order}"
        lines.append(f"{name:<22}{c.received:>10}{c.lost:>8}{c.out_of_order:>14}   {verdict}")
    for name, arm in report.arms.items():
        lines += ["", f"{name}: {arm.skeletons} skeletons{_known(arm.rate_hz, ' at {:.1f} Hz')}"]
        if arm.latency_p50_ms is not None:
            lines.append(f"  latency {arm.latency_p50_ms:.1f} ms median, {arm.latency_p99_ms:.1f} ms 99 %")
        lines += [f"  {angle:<20}{rmse:>8.2f} deg RMSE" for angle, rmse in _clinical(arm)]
        lines += [f"  {joint:<20}{rmse:>8.1f} mm RMSE" for joint, rmse in arm.rmse_mm.items() if rmse > 0.0]
    lines += ["", *report.notes, f"recording  {report.recording}"]
    if report.summary:
        lines.append(f"summary    {report.summary}")
    return "\n".join(lines)


def _clinical(arm: ArmReport) -> list[tuple[str, float]]:
    from brachium_viewer.figures import CLINICAL

    return [(name, arm.rmse_deg[name]) for name in CLINICAL if name in arm.rmse_deg]


def _known(value: float | None, form: str) -> str:
    return "" if value is None else form.format(value)
