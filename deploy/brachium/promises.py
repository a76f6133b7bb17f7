"""What is promised, and how each promise is measured: a table of figures with their targets."""

from typing import Any

from brachium.node_promises import NODE_PROOFS
from brachium.page_promises import PAGE_PROOFS
from brachium.proofs import Promise, Proof, figure

BROAD = {
    "broad_02_undisturbed_slow_rotation_B": 1.38,
    "broad_16_undisturbed_fast_translation_B": 0.74,
    "broad_25_disturbed_tapping_B": 1.62,
    "broad_30_disturbed_stationary_magnet_C": 2.57,
}
"""What VQF reaches online on these captures: RMSE of the whole angle where there is movement, deg."""
BROAD_FACTOR = 1.1


def _loss_difference(figures: dict[str, Any]) -> float:
    pairs = (("received", "sent"), ("lost", "injected_lost"), ("out_of_order", "injected_out_of_order"))
    return float(sum(abs(c[a] - c[b]) for c in figures["segments"].values() for a, b in pairs))


def _demo(level: str, elbow_deg: float, wrist_mm: float, nodes: str = "emulated") -> Proof:
    arm = ("arms", "p01/right")
    words: tuple[str, ...] = ("--seconds", "30", "--headless", "--json", "--level", level, "--seed", "1")
    words = (*words, "--nodes", nodes)
    return Proof(
        name=f"demo-{level}" if nodes == "emulated" else f"demo-{nodes}",
        commands=(("demo", *words, "--out", "{folder}/demo"),),
        promises=(
            Promise(name="counts off the injected", unit="samples", take=_loss_difference, at_most=0),
            figure("elbow flexion RMSE", "deg", *arm, "rmse_deg", "elbow_flexion", at_most=elbow_deg),
            figure("wrist position RMSE", "mm", *arm, "rmse_mm", "wrist", at_most=wrist_mm),
            figure("skeleton rate", "Hz", *arm, "rate_hz"),
            figure("latency, 99 %", "ms", *arm, "latency_p99_ms"),
            figure(
                "start to first skeleton",
                "s",
                "first_skeleton_s",
                at_most=5.0 if nodes == "emulated" else None,
            ),
        ),
    )


def _repeat() -> Proof:
    demo = ("demo", "--seconds", "15", "--headless", "--json", "--out", "{folder}/demo")
    return Proof(
        name="solve-repeats-live",
        commands=(demo, ("solve", "{folder}/demo/recording.mcap", "--json")),
        promises=(
            figure("skeletons compared", "1", "live_compared"),
            figure("largest angle apart", "rad", "live_angle_rad", at_most=1e-9),
            figure("largest position apart", "m", "live_position_m", at_most=1e-9),
        ),
    )


def _broad(capture: str, filter_name: str, known: float | None) -> Proof:
    result, truth = "{folder}/result.parquet", f"{{data}}/{capture}/truth.parquet"
    error = ("orientations", "forearm_r_sensor", "total", "rmse")
    target = None if known is None else BROAD_FACTOR * known
    return Proof(
        name=f"{capture}-{filter_name}",
        commands=(
            ("solve", f"{{data}}/{capture}", "--filter", filter_name, "--out", result),
            ("compare", result, truth, "--json"),
        ),
        promises=(figure("orientation RMSE", "deg", *error, at_most=target),),
        needs_data=True,
    )


def _bench() -> Proof:
    one, many = ("one_arm", "5"), ("many_arms",)
    to_skeleton = tuple(
        figure(
            f"sensor to skeleton, {batch} samples a packet, {p} %",
            "ms",
            *("one_arm", batch, f"sensor_to_skeleton_p{p}_ms"),
        )
        for batch in ("1", "5", "10")
        for p in ("50", "99")
    )
    return Proof(
        name="bench",
        commands=(("bench", "--json"),),
        promises=(
            figure("one arm: fusion, of a core", "1", *one, "fusion_cpu", at_most=0.10),
            figure("one arm: a bare relay, of a core", "1", *one, "relay_cpu"),
            figure("gateway to skeleton, 99 %", "ms", *one, "latency_p99_ms", at_most=35.0),
            *to_skeleton,
            figure("start to first skeleton", "s", *one, "first_skeleton_s", at_most=5.0),
            figure("100 arms: ticks without a skeleton", "1", *many, "skeletons_missing", at_most=0),
            figure("100 arms: poses held or missing", "1", *many, "poses_not_measured", at_most=0),
            figure("100 arms: fusion, of a core", "1", *many, "fusion_cpu", at_most=0.25),
            figure("100 arms: a bare relay, of a core", "1", *many, "relay_cpu"),
            figure("shoulder smoother, a sample", "ms", "smoother", "smoother_ms", at_most=0.1),
            figure("VQF offline of both sensors, a sample", "ms", "smoother", "vqf_ms"),
        ),
    )


ACCURACY: dict[str, tuple[str, ...]] = {
    "recordings": ("broad", "two-segments", "people"),
    "arm": ("arm", "loss"),
    "patient": ("arm",),
    "long-run": ("long-run",),
    "calibration": ("alignment", "contracture", "refusals", "wear-check", "slip", "sensor-sets"),
    "tsilomitrou": ("tsilomitrou", "tsilomitrou-angles", "packet-loss", "calibration-left-out"),
    "zhou": ("zhou", "zhou-errata", "zhou-lambda", "zhou-places", "detection"),
    "sessions": ("repetitions", "donnings"),
}
"""Tables of `evaluate`, by the proof that makes them; docs/accuracy.md shows them."""
AT_LEVEL = {"patient": "patient"}
"""The level of a proof's tables, where it is not the usual ones."""


def _limits(figures: dict[str, Any]) -> list[dict[str, Any]]:
    return [limit for table in figures["tables"].values() for limit in table["limits"]]


def _accuracy(name: str, tables: tuple[str, ...]) -> Proof:
    chosen = tuple(word for table in tables for word in ("--table", table))
    if name in AT_LEVEL:
        chosen = ("--level", AT_LEVEL[name], *chosen)
    return Proof(
        name=f"accuracy-{name}",
        commands=(("evaluate", "--data", "{data}", *chosen, "--json"),),
        promises=(
            Promise(
                name="limits not met",
                unit="1",
                take=lambda f: sum(not x["met"] for x in _limits(f)),
                at_most=0,
            ),
            Promise(name="limits", unit="1", take=lambda f: len(_limits(f))),
            Promise(name="tables", unit="1", take=lambda f: len(f["tables"])),
        ),
        needs_data=name == "recordings",
    )


PROOFS: tuple[Proof, ...] = (
    _demo("typical", 3.5, 30.0),
    _demo("ideal", 1.5, 15.0),
    _demo("typical", 3.5, 30.0, "micropython"),
    _repeat(),
    *(_broad(capture, "vqf", known) for capture, known in BROAD.items()),
    *(_broad(capture, "complementary", None) for capture in BROAD),
    *(_accuracy(name, tables) for name, tables in ACCURACY.items()),
    _bench(),
    *NODE_PROOFS,
    *PAGE_PROOFS,
)
