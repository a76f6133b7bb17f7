"""VQF as its authors have it. Pure."""

from typing import Any

import numpy as np
import numpy.typing as npt
from vqf import VQF

Floats = npt.NDArray[np.float64]


class VqfFilter:
    """VQF (Laidig and Seel 2023) from its own wheel, default parameters: tau_acc 3 s, tau_mag 9 s."""

    def __init__(self, period_s: float, magnetometer: bool) -> None:
        self._filter = VQF(period_s)
        self._output = "quat9D" if magnetometer else "quat6D"
        self._magnetometer = magnetometer
        self.disturbed = False

    def update(
        self, gyr: Floats, acc: Floats, mag: Floats | None, mag_index: tuple[int, ...] | None
    ) -> Floats:
        """See OrientationFilter.update."""
        if not self._magnetometer:
            tilted: Floats = self._filter.updateBatch(gyr, acc)[self._output]
            return tilted
        if mag is not None and mag_index is None:
            out = self._filter.updateBatch(gyr, acc, mag)
            # Before a reference was learnt (5 s) everything counts as disturbed; that is no finding.
            self.disturbed = bool(out["magDistDetected"][-1]) and self._filter.getMagRefNorm() > 0.0
            fused: Floats = out[self._output]
            return fused
        read = self._filter.getQuat9D if self._output == "quat9D" else self._filter.getQuat6D
        rows = {} if mag is None else dict(zip(mag_index or (), mag, strict=True))
        quats = np.empty((len(gyr), 4))
        for i in range(len(gyr)):
            row = rows.get(i)
            if row is None:
                self._filter.update(gyr[i], acc[i])
            else:
                self._filter.update(gyr[i], acc[i], row)
            quats[i] = read()
        self.disturbed = bool(self._filter.getMagDistDetected()) and self._filter.getMagRefNorm() > 0.0
        return quats

    def state(self) -> dict[str, Any]:
        """See OrientationFilter.state."""
        return {"vqf": {k: _plain(v) for k, v in self._filter.state.items()}, "disturbed": self.disturbed}

    def restore(self, state: dict[str, Any]) -> None:
        """See OrientationFilter.restore."""
        plain = state["vqf"]
        vqf_state: Any = {k: np.array(v) if isinstance(v, list) else v for k, v in plain.items()}
        self._filter.state = vqf_state
        self.disturbed = state["disturbed"]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
