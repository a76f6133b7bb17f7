"""The default orientation filter: VQF's tilt and gyroscope bias, and a heading of our own. Pure.

VQF (Laidig and Seel 2023) runs without its magnetometer stage; every half second the field in its levelled
frame goes to the heading filter, and the correction is laid over the next half second so that the orientation
never jumps.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from vqf import VQF

from brachium_fusion.field_model import field_steps
from brachium_fusion.heading_filter import STILL_ACC, HeadingFilter

Floats = npt.NDArray[np.float64]

STEP_S = 0.5
"""The field is averaged over this: short against the drift of a heading, long against the noise."""
STILL_RAD_S = 0.1
"""Mean rate below which a sensor may be still."""


class AutoFilter:
    """See OrientationFilter. Without magnetometer it is VQF."""

    def __init__(self, period_s: float, magnetometer: bool) -> None:
        self._vqf = VQF(period_s)
        self._magnetometer = magnetometer
        self._count = max(2, round(STEP_S / period_s))
        self._step_s = self._count * period_s
        self._heading = HeadingFilter()
        self._begun = False
        """A field was seen."""
        self._from = 0.0
        """Heading offset at the end of the last step, rad; it goes to that of the filter within this one."""
        self._held = 0
        """Samples of this step so far."""
        self._rows: Floats = np.empty((self._count, 13))
        """Of this step: levelled_from_sensor (4), rate without bias (3), field (3), acceleration (3)."""

    @property
    def disturbed(self) -> bool:
        """The magnetic field is not the one that was learnt, so heading rests on the gyroscope."""
        return self._heading.disturbed

    def update(
        self, gyr: Floats, acc: Floats, mag: Floats | None, mag_index: tuple[int, ...] | None
    ) -> Floats:
        """See OrientationFilter.update."""
        out = self._vqf.updateBatch(gyr, acc)
        quats: Floats = out["quat6D"]
        if not self._magnetometer:
            return quats
        n = len(gyr)
        rows = np.empty((n, 13))
        rows[:, :4] = quats
        np.subtract(gyr, out["bias"], out=rows[:, 4:7])
        if mag is None:
            rows[:, 7:10] = np.nan
        elif mag_index is None:
            rows[:, 7:10] = mag
        else:
            rows[:, 7:10] = np.nan
            rows[list(mag_index), 7:10] = mag
        rows[:, 10:] = acc
        if not self._begun:
            self._begin(rows)
        offsets = np.empty(n)
        at = 0
        while at < n:
            fits = min(n - at, self._count - self._held)
            end = at + fits
            self._rows[self._held : self._held + fits] = rows[at:end]
            part = np.arange(self._held + 1, self._held + fits + 1) / self._count
            offsets[at:end] = self._from + part * (self._heading.offset - self._from)
            self._held += fits
            at = end
            if self._held == self._count:
                self._end_step(bool(out["restDetected"][at - 1]))
        return _turned(quats, offsets)

    def _begin(self, rows: Floats) -> None:
        """Take the heading of the first field there is."""
        seen = np.flatnonzero(~np.isnan(rows[:, 7]))
        if len(seen):
            self._begun = True
            first = rows[seen[:1]]
            field = field_steps(first[:, :4], first[:, 4:7], first[:, 7:10], 1).field[0]
            self._heading.offset = self._from = float(np.arctan2(field[0], field[1]))

    def _end_step(self, rested: bool) -> None:
        self._from = self._heading.offset
        self._held = 0
        rows = self._rows
        steps = field_steps(rows[:, :4], rows[:, 4:7], rows[:, 7:10], self._count)
        strength = np.sqrt(np.einsum("ij,ij->i", rows[:, 10:], rows[:, 10:]))
        still = steps.rate[0] < STILL_RAD_S and float(strength.std()) < STILL_ACC
        self._heading.step(steps, bool(still), rested, self._step_s)

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "vqf": {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in self._vqf.state.items()},
            "heading": self._heading.state(),
            "begun": self._begun,
            "from": self._from,
            "rows": self._rows[: self._held].tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        vqf_state: Any = {k: np.array(v) if isinstance(v, list) else v for k, v in state["vqf"].items()}
        self._vqf.state = vqf_state
        self._heading.restore(state["heading"])
        self._begun, self._from = state["begun"], state["from"]
        self._held = len(state["rows"])
        if self._held:
            self._rows[: self._held] = state["rows"]


def _turned(quats: Floats, offsets: Floats) -> Floats:
    """Return Rz(offset) q: in complex numbers, w + iz and x + iy each turned by half the angle."""
    turn = np.exp(0.5j * offsets)
    first = turn * (quats[:, 0] + 1j * quats[:, 3])
    second = turn * (quats[:, 1] + 1j * quats[:, 2])
    result = np.empty_like(quats)
    result[:, 0], result[:, 3] = first.real, first.imag
    result[:, 1], result[:, 2] = second.real, second.imag
    return result
