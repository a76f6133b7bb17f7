"""What is promised of nodes: firmware, clocks, gateways and the sensors that people already own."""

from typing import Any

from brachium.proofs import Promise, Proof, Take, figure


def _worst(name: str) -> Take:
    def take(figures: dict[str, Any]) -> float:
        return max(float(found[name]) for found in figures["samples"].values())

    return take


def _firmware(run: str) -> Proof:
    return Proof(
        name=f"firmware-{run}",
        commands=(("firmware", "--run", run, "--seconds", "60", "--json"),),
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


NODE_PROOFS: tuple[Proof, ...] = (
    _firmware("quiet"),
    _firmware("faults"),
)
