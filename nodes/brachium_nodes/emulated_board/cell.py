"""A lithium-ion cell while it empties: two published models, so that no estimator is tried on its own curve.

`chen`: Chen and Rincon-Mora, Accurate electrical battery model capable of predicting runtime and I-V
performance, IEEE Transactions on Energy Conversion 21 (2006), fitted to a polymer cell of 850 mAh; with two
relaxations. `tremblay`: Tremblay, Dessaint and Dekkiche, A generic battery model for the dynamic simulation
of hybrid electric vehicles, VPPC 2007, fitted to a cell of 1 Ah.

Neither knows cold or age. Here each 15 K below 25 degrees doubles the resistance and each K takes 0.6 % of
the charge; an aged cell (`age` 1) has lost 30 % of its charge and doubled its resistance: what makers' papers
show of such cells, roughly.
"""

from dataclasses import dataclass
from math import exp, log
from typing import Literal

CellModel = Literal["chen", "tremblay"]
WARM_C, DOUBLES_K, FALLS_PER_K = 25.0, 15.0, 0.006
AGED_LOSS, AGED_RESISTANCE = 0.3, 1.0


@dataclass(frozen=True, kw_only=True)
class CellSettings:
    """One cell and what it feeds."""

    model: CellModel = "chen"
    capacity_mah: float = 700.0
    """When it is new and warm."""
    charge: float = 1.0
    """Share that is left at the start."""
    load_ma: float = 80.0
    temperature_c: float = WARM_C
    age: float = 0.0
    """0 new, 1 at the end of its life."""
    noise_v: float = 0.006
    """Standard deviation of one reading of the converter: its own, and the radio's sags."""
    full_scale_v: float = 5.0


class Cell:
    """The state of one cell; `drain` lets time pass."""

    def __init__(self, settings: CellSettings) -> None:
        cold = max(0.0, WARM_C - settings.temperature_c)
        usable = (1.0 - FALLS_PER_K * cold) * (1.0 - AGED_LOSS * settings.age)
        self._resistance = exp(log(2.0) * cold / DOUBLES_K) * (1.0 + AGED_RESISTANCE * settings.age)
        self._charge_as = 3.6 * settings.capacity_mah * usable
        self._model = settings.model
        self._current_a = 1e-3 * settings.load_ma
        self.charge = settings.charge
        self._short_v = self._long_v = 0.0

    def drain(self, seconds: float) -> None:
        """Feed the load for some seconds: few enough that little changes."""
        self.charge = max(1e-3, self.charge - self._current_a * seconds / self._charge_as)
        if self._model == "chen":
            s = self.charge
            short_ohm, long_ohm = 0.3208 * exp(-29.14 * s) + 0.04669, 6.603 * exp(-155.2 * s) + 0.04984
            short_f, long_f = 703.6 - 752.9 * exp(-13.51 * s), 4475.0 - 6056.0 * exp(-27.12 * s)
            self._short_v = self._relax(self._short_v, short_ohm, short_f, seconds)
            self._long_v = self._relax(self._long_v, long_ohm, long_f, seconds)

    def volts(self) -> float:
        """Return the voltage under the load."""
        s = self.charge
        if self._model == "chen":
            open_v = 3.685 + 0.2156 * s - 0.1178 * s * s + 0.3201 * s * s * s - 1.031 * exp(-35.0 * s)
            series_ohm = 0.1562 * exp(-24.37 * s) + 0.07446
            return open_v - self._short_v - self._long_v - self._current_a * series_ohm * self._resistance
        open_v = 3.7348 - 0.00876 / s + 0.468 * exp(-3.5294 * (1.0 - s))
        return open_v - self._current_a * 0.09 * self._resistance

    def _relax(self, now_v: float, ohm: float, farad: float, seconds: float) -> float:
        """Return a relaxation's voltage after some seconds; near the end its capacitor is next to nothing."""
        end_v = self._current_a * ohm * self._resistance
        return end_v + (now_v - end_v) * exp(-seconds / max(1.0, ohm * farad * self._resistance))
