"""What is promised of nodes: firmware, clocks, gateways and the sensors that people already own."""

from typing import Any

from brachium.proofs import Promise, Proof, Take, figure


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


NODE_PROOFS: tuple[Proof, ...] = (
    *(_firmware(run, rate_hz) for run in ("quiet", "faults") for rate_hz in (50, 100)),
    _battery(),
)
