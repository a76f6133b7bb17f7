"""What is promised of pages, sessions, reports and files: what people see and take home."""

from typing import Any

from brachium.proofs import Promise, Proof, Take, at, figure

WITH_ANGLES = ("csv", "parquet", "sto", "mot", "c3d", "rrd", "motion-bids")
WITH_PLACES = ("csv", "parquet", "trc", "c3d", "bvh", "rrd", "motion-bids")


def _total(name: str) -> Take:
    def take(figures: dict[str, Any]) -> float:
        return float(sum(found[name] for found in figures["formats"].values()))

    return take


def _exports() -> Proof:
    """Both arms in every format, read by others' readers."""
    return Proof(
        name="exports",
        commands=(("bench", "--exports", "--json"),),
        promises=(
            *(
                figure(f"{to}: angles apart", "deg", "formats", to, "angle_deg", at_most=0.1)
                for to in WITH_ANGLES
            ),
            *(
                figure(f"{to}: positions apart", "mm", "formats", to, "position_mm", at_most=1.0)
                for to in WITH_PLACES
            ),
            Promise(
                name="gaps that are none, or the other way", unit="1", take=_total("gaps_off"), at_most=0
            ),
            Promise(name="gaps", unit="1", take=_total("gaps")),
            Promise(name="numbers compared", unit="1", take=_total("numbers")),
        ),
    )


def _unless(*path: str) -> Take:
    """Take 1 where the figure says no, or nothing."""

    def take(figures: dict[str, Any]) -> float:
        return 0.0 if at(*path)(figures) else 1.0

    return take


def _recorder() -> Proof:
    """Recorders killed, power lost, a disk full."""
    full = ("full_disk",)
    return Proof(
        name="recorder",
        commands=(("bench", "--recorder", "--kills", "25", "--json"),),
        promises=(
            figure("lost to kill -9, worst", "s", "kill_worst_s", at_most=0.5),
            figure("lost to kill -9, median", "s", "kill_median_s"),
            *(
                figure(f"lost with the power, tail {tail}, worst", "s", "power_worst_s", tail, at_most=2.0)
                for tail in ("cut", "zeroed", "random")
            ),
            figure("messages missing before the last one", "1", "holes", at_most=0),
            *(
                Promise(name=f"full disk: {name}", unit="1", take=_unless("full_disk", key), at_most=0)
                for name, key in (
                    ("no alarm on the monitor", "on_monitor"),
                    ("no alarm on the page", "on_page"),
                    ("the page's own recording is shown as going on", "page_stops"),
                    ("the file does not open whole", "opens"),
                )
            ),
            figure("full disk: skeletons before", "Hz", *full, "skeletons_before_per_s"),
            figure("full disk: skeletons afterwards", "Hz", *full, "skeletons_per_s"),
            figure("full disk: frames of the page afterwards", "Hz", *full, "frames_per_s"),
        ),
    )


def _page() -> Proof:
    """The therapist's page drawn in software, beside a page that draws nothing."""
    return Proof(
        name="page",
        commands=(("bench", "--page", "--json"),),
        promises=(
            figure("skeleton to picture, median", "ms", "page_p50_ms", at_most=60.0),
            figure("skeleton to picture, 99 %", "ms", "page_p99_ms", at_most=150.0),
            figure("pictures", "Hz", "page_hz"),
            figure("an empty canvas, median", "ms", "empty_p50_ms"),
            figure("an empty canvas, 99 %", "ms", "empty_p99_ms"),
            figure("an empty canvas, pictures", "Hz", "empty_hz"),
            figure("server with one screen, of a core", "1", "server_cpu", at_most=0.08),
            figure("server with none, of a core", "1", "server_alone_cpu"),
        ),
    )


def _broken(figures: dict[str, Any]) -> float:
    return float(len(figures["broken"]))


def _report() -> Proof:
    """The report of a 20-minute session of both arms, printed."""
    return Proof(
        name="report",
        commands=(("bench", "--report", "--json"),),
        promises=(
            figure("report of 20 minutes", "s", "report_s", at_most=3.0),
            figure("report of 20 minutes, processor", "s", "report_cpu_s"),
            figure("reading the recording without a look into it", "s", "read_s"),
            figure("page", "MB", "page_mb", at_most=1.0),
            figure("A4 pages", "1", "pages", at_most=3),
            Promise(name="figures or cells that are cut or empty", unit="1", take=_broken, at_most=0),
        ),
    )


PAGE_PROOFS: tuple[Proof, ...] = (_page(), _exports(), _recorder(), _report())
