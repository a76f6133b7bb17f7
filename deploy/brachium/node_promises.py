"""What is promised of nodes: firmware, clocks, gateways and the sensors that people already own."""

from typing import Any

from brachium.proofs import Promise, Proof, Take, at, figure


def _worst(name: str) -> Take:
    def take(figures: dict[str, Any]) -> float:
        return max(float(found[name]) for found in figures["samples"].values())

    return take


def _firmware(run: str, rate_hz: int) -> Proof:
    words = ("--run", run, "--rate", str(rate_hz), "--seconds", "60")
    return Proof(
        name=f"firmware-{run}-{rate_hz}",
        commands=(("firmware", *words, "--json"),),
        promises=(
            Promise(name="unexplained", unit="samples", take=_worst("unexplained"), at_most=0),
            Promise(name="sent again, not marked late", unit="samples", take=_worst("unmarked"), at_most=0),
            Promise(name="lost", unit="samples", take=_worst("lost"), at_most=0 if run == "quiet" else None),
            Promise(name="late", unit="samples", take=_worst("late")),
            Promise(name="rate off", unit="%", take=_worst("rate_off_percent"), at_most=0.1),
            figure("memory of the chip's 36", "K", "heap_peak_k", at_most=30),
            figure("the chip's own modules beside it", "K", "heap_shim_k"),
            figure("skeletons", "1", "skeletons"),
        ),
    )


def _battery() -> Proof:
    ahead = ("warned_min",)
    return Proof(
        name="firmware-battery",
        commands=(("firmware", "--discharge", "--json"),),
        promises=(
            figure("cells that end with no warning", "1", "never_warned", at_most=0),
            figure("warned less than 20 min ahead", "1", "later_than_20_min", at_most=0),
            figure("warned more than 35 min ahead", "1", "earlier_than_35_min", at_most=0),
            figure("cells", "1", "cells"),
            *(
                figure(f"warned ahead, {which}", "min", *ahead, which)
                for which in ("least", "median", "most")
            ),
        ),
    )


def _clock() -> Proof:
    return Proof(
        name="clock",
        commands=(("bench", "--clock", "--runs", "200", "--json"),),
        promises=(
            figure("error after 5 s, median", "ms", "median_ms_5s"),
            figure("error after 5 s, 95 %", "ms", "p95_ms_5s", at_most=0.7),
            figure("error after 60 s, median", "ms", "median_ms_60s", at_most=0.1),
            figure("error after 60 s, 95 %", "ms", "p95_ms_60s", at_most=0.5),
            figure("the first message's offset, after 60 s, 95 %", "ms", "first_message_p95_ms_60s"),
            Promise(
                name="batches beyond the stated uncertainty",
                unit="1",
                take=lambda f: 1.0 - float(f["covered"]),
                at_most=0.05,
            ),
            figure("uncertainty stated, median", "ms", "stated_median_ms"),
            figure("times that go back", "1", "backwards", at_most=0),
        ),
    )


def _gateway() -> Proof:
    return Proof(
        name="gateway",
        commands=(("bench", "--gateway", "--nodes", "256", "--json"),),
        promises=(
            figure("256 nodes: gateway, of a core", "1", "gateway_cpu", at_most=0.20),
            figure("256 nodes: a bare echo, of a core", "1", "echo_cpu"),
            figure("256 nodes: samples lost", "samples", "samples_lost", at_most=0),
            Promise(
                name="256 nodes: samples not counted",
                unit="samples",
                take=lambda f: abs(f["samples_sent"] - f["samples_received"]),
                at_most=0,
            ),
        ),
    )


def _hostile() -> Proof:
    return Proof(
        name="gateway-hostile",
        commands=(("bench", "--hostile", "1000000", "--json"),),
        promises=(
            figure("hostile frames", "1", "frames"),
            Promise(name="gateways that ended", unit="1", take=lambda f: not f["gateway_alive"], at_most=0),
            figure("memory grown by", "MB", "rss_growth_mb", at_most=10),
            figure("good nodes: samples lost", "samples", "good_lost", at_most=0),
            Promise(
                name="good nodes: frames dropped",
                unit="1",
                take=lambda f: sum(f["good_drops"].values()),
                at_most=0,
            ),
            figure("good nodes: samples received", "samples", "good_received"),
        ),
    )


SHIMMER_DELAY_S = 0.04


def _beside_a_shimmer() -> Proof:
    """The paper's experiment, own node and Shimmer3 on one forearm; demo-typical has the wrist's target."""
    words = ("compare", "--live", "p01", "p01.ref", "--emulate", "--seconds", "30", "--level", "typical")
    worn, aligned = ("found", "as_worn", "places"), ("found", "aligned", "places")
    return Proof(
        name="beside-a-shimmer",
        commands=((*words, "--shimmer-delay", str(SHIMMER_DELAY_S), "--json"),),
        promises=(
            Promise(
                name="clocks' offset off the injected",
                unit="ms",
                take=lambda f: 1e3 * abs(f["found"]["clock"]["offset_s"] - SHIMMER_DELAY_S),
                at_most=5.0,
            ),
            _in_mm("clocks' offset, half its 95 % interval", "found", "clock", "margin_s", unit="ms"),
            *(
                _in_mm(f"{name}, {joint}, {what}", *places, joint, *path)
                for name, places in (("as worn", worn), ("aligned", aligned))
                for joint in ("wrist", "hand")
                for what, path in (("eq 17 RMSE", ("eq17", "rmse")), ("3-D RMSE", ("apart", "rmse")))
            ),
            _in_mm("own node, wrist against the truth", "found", "truth", "a", "wrist", "rmse", at_most=30.0),
            _in_mm("Shimmer3, wrist against the truth", "found", "truth", "b", "wrist", "rmse", at_most=30.0),
        ),
    )


def _in_mm(name: str, *path: str, unit: str = "mm", at_most: float | None = None) -> Promise:
    def take(figures: dict[str, Any]) -> float | None:
        found = at(*path)(figures)
        return None if found is None else 1e3 * found

    return Promise(name=name, unit=unit, take=take, at_most=at_most)


def _sensors() -> Proof:
    ways = (("guided", True), ("paper", False), ("uncalibrated", False))
    limits = {
        "gyro_bias_dps": ("gyro bias", "deg/s", 0.05),
        "accel_bias_m_s2": ("accelerometer bias", "m/s^2", 0.03),
        "accel_scale": ("accelerometer scale", "1", 0.003),
        "mag_direction_deg": ("direction of the field", "deg", 1.0),
    }
    return Proof(
        name="sensor-calibration",
        commands=(("bench", "--sensors", "--chips", "10", "--json"),),
        promises=(
            Promise(
                name="networks whose node has forgotten it",
                unit="1",
                take=lambda f: (
                    not (f["network"]["brought_again"] and f["network"]["kept_after_restart"] == "node")
                ),
                at_most=0,
            ),
            figure("from asking to kept on the node", "s", "network", "seconds"),
            figure("bad handlings taken for good", "1", "not_refused", at_most=0),
            *(
                figure(
                    f"{text} off, {way}, worst of 10", unit, "worst", way, name, at_most=most * held or None
                )
                for way, held in ways
                for name, (text, unit, most) in limits.items()
            ),
        ),
    )


def _can() -> tuple[Proof, ...]:
    """Sensors on CAN, and a machine on CAN."""
    load = (
        figure("12 sensors at 100 Hz, of a core", "1", "cpu", at_most=0.15),
        figure("a bare loop of python-can, of a core", "1", "bare_cpu"),
        figure("frames in", "1/s", "frames_per_s"),
        figure("samples off the sensors'", "1", "samples_off"),
    )
    mixing = (
        figure("samples of two", "1", "mixed", at_most=0),
        figure("out of order", "1", "out_of_order", at_most=0),
        figure("samples", "1", "samples"),
        figure("of them whole", "1", "given"),
    )
    faults = (
        figure("valid and 5 deg off, 50 ms after a fault", "joints", "wrong_after", at_most=0),
        figure("frames then", "1", "frames_after"),
        figure("worst valid angle then", "deg", "worst_after_deg"),
        figure("valid before, worst round", "1", "valid_before"),
    )
    promises = {"load": load, "mixing": mixing, "faults": faults}
    return tuple(
        Proof(name=f"can-{what}", commands=(("bench", "--can", what, "--json"),), promises=found)
        for what, found in promises.items()
    )


NODE_PROOFS: tuple[Proof, ...] = (
    _beside_a_shimmer(),
    *(_firmware(run, rate_hz) for run in ("quiet", "faults") for rate_hz in (50, 100)),
    _battery(),
    _clock(),
    _gateway(),
    _hostile(),
    _sensors(),
    *_can(),
)
