"""The default orientation filter: VQF's tilt and gyroscope bias, and a heading of our own. Pure.

VQF (Laidig and Seel 2023) runs without its magnetometer stage; every half second the field in its levelled
frame goes to the heading filter, and the correction is laid over the next half second so that the orientation
never jumps. VQF takes for rest what turns by less than 2 deg/s, and so the sway of somebody who stands, from
which it learns a bias that is none. Rest is here what the gyroscope's own noise cannot be told from.
"""

from math import degrees
from typing import Any

import numpy as np
import numpy.typing as npt
from vqf import VQF

from brachium_fusion.field_model import field_steps
from brachium_fusion.heading_filter import HeadingFilter

Floats = npt.NDArray[np.float64]

STEP_S = 0.5
"""The field is averaged over this: short against the drift of a heading, long against the noise."""
STILL_RAD_S = 0.1
"""Mean rate below which a sensor may be still,"""
STILL_ACC = 0.3
"""and standard deviation of its acceleration, m/s^2: then the first acceleration is gravity."""
REST_DEG_S = (0.5, 2.0)
"""Bounds of the rate below which a sensor rests; the upper one is VQF's default."""
REST_NOISES = 5.5
"""It is this many times the noise of a gyroscope axis: what the length of three reaches in a second."""
REST_ACC = 0.5
"""m/s^2, VQF's default."""


class AutoFilter:
    """See OrientationFilter."""

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
        self._rest_deg_s = REST_DEG_S[1]
        self._held = 0
        """Samples of this step so far."""
        self._rows: Floats = np.empty((self._count, 13))
        """Of this step: levelled_from_sensor (4), rate without bias (3), field (3), acceleration (3)."""
        self._part: Floats = np.arange(1, self._count + 1) / self._count

    @property
    def disturbed(self) -> bool:
        """The magnetic field is not the one that was learnt, so heading rests on the gyroscope."""
        return self._heading.disturbed

    def update(
        self, gyr: Floats, acc: Floats, mag: Floats | None, mag_index: tuple[int, ...] | None
    ) -> Floats:
        """See OrientationFilter.update."""
        n = len(gyr)
        if mag is not None and mag_index is not None:
            given, mag = mag, np.full((n, 3), np.nan)
            mag[list(mag_index)] = given
        if n <= self._count - self._held:
            return self._piece(gyr, acc, mag)
        quats = np.empty((n, 4))
        at = 0
        while at < n:
            piece = slice(at, min(n, at + self._count - self._held))
            quats[piece] = self._piece(gyr[piece], acc[piece], None if mag is None else mag[piece])
            at = piece.stop
        return quats

    def _piece(self, gyr: Floats, acc: Floats, mag: Floats | None) -> Floats:
        """Take samples of one step."""
        out = self._vqf.updateBatch(gyr, acc)
        quats: Floats = out["quat6D"]
        here = slice(self._held, self._held + len(gyr))
        self._held = here.stop
        rows = self._rows[here]
        np.subtract(gyr, out["bias"], out=rows[:, 4:7])
        if self._magnetometer:
            rows[:, :4] = quats
            rows[:, 7:10] = np.nan if mag is None else mag
            rows[:, 10:] = acc
            if not self._begun and mag is not None:
                self._begin(rows)
            quats = _turned(quats, self._from + self._part[here] * (self._heading.offset - self._from))
        if self._held == self._count:
            self._held = 0
            if self._magnetometer:
                self._step_heading(bool(out["restDetected"][-1]))
            self._tighten_rest()
        return quats

    def _begin(self, rows: Floats) -> None:
        """Take the heading of the first field there is."""
        seen = np.flatnonzero(~np.isnan(rows[:, 7]))
        if len(seen):
            self._begun = True
            first = rows[seen[:1]]
            field = field_steps(first[:, :4], first[:, 4:7], first[:, 7:10], 1).field[0]
            self._heading.offset = self._from = float(np.arctan2(field[0], field[1]))

    def _step_heading(self, rested: bool) -> None:
        rows = self._rows
        self._from = self._heading.offset
        steps = field_steps(rows[:, :4], rows[:, 4:7], rows[:, 7:10], self._count)
        strength = np.sqrt(np.einsum("ij,ij->i", rows[:, 10:], rows[:, 10:]))
        still = steps.rate[0] < STILL_RAD_S and float(strength.std()) < STILL_ACC
        self._heading.step(steps, bool(still), rested, self._step_s)

    def _tighten_rest(self) -> None:
        """Lower the threshold of rest to what the quietest step so far shows of the gyroscope's noise."""
        steps = (self._rows[1:, 4:7] - self._rows[:-1, 4:7]).ravel()
        noise = degrees(float(np.sqrt(steps @ steps / (2.0 * len(steps)))))
        threshold = max(REST_DEG_S[0], REST_NOISES * noise)
        if threshold < self._rest_deg_s:
            self._rest_deg_s = threshold
            self._vqf.setRestDetectionThresholds(threshold, REST_ACC)

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "vqf": {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in self._vqf.state.items()},
            "rest_deg_s": self._rest_deg_s,
            "heading": self._heading.state(),
            "begun": self._begun,
            "from": self._from,
            "rows": self._rows[: self._held].tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        vqf_state: Any = {k: np.array(v) if isinstance(v, list) else v for k, v in state["vqf"].items()}
        self._vqf.setRestDetectionThresholds(state["rest_deg_s"], REST_ACC)
        self._vqf.state = vqf_state
        self._rest_deg_s = state["rest_deg_s"]
        self._heading.restore(state["heading"])
        self._begun, self._from = state["begun"], state["from"]
        self._held = len(state["rows"])
        if self._held:
            self._rows[: self._held] = state["rows"]


_ABOUT_UP: Floats = np.array([[0.0, 0, 0, 1], [0, 0, 1, 0], [0, -1, 0, 0], [-1, 0, 0, 0]])
"""q _ABOUT_UP is the product of the quaternion (0, 0, 0, 1), half a turn about z, and q."""


def _turned(quats: Floats, offsets: Floats) -> Floats:
    """Return Rz(offset) q."""
    half = 0.5 * offsets[:, None]
    turned: Floats = np.cos(half) * quats
    turned += np.sin(half) * (quats @ _ABOUT_UP)
    return turned
