"""The complementary filter of Tsilomitrou et al. 2021, as printed and corrected. Pure."""

from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_body import rotation

Floats = npt.NDArray[np.float64]

TIME_CONSTANT_S = 0.98
"""Tilt and heading follow accelerometer and magnetometer with this: k = 0.98 at the paper's 50 Hz. It says
only that k is close to 1 (erratum T19); a time constant keeps the behaviour at other rates."""
LEAST_COSINE = 0.02
"""Floor of cos(theta), where the angle rates are singular: sensor Y vertical, the arm hanging (erratum
T15)."""


class ComplementaryFilter:
    """The complementary filter of Tsilomitrou et al. 2021, eq 3-9, on angles phi (y), theta (x), psi (z).

    `printed` keeps the equations as they stand. Otherwise they are corrected: the signs of eq 4 (T9), rates
    taken
    at the fused angles (T10), the sign and quadrant of eq 5 (T11), eq 6 and 7 with north along +y (T12, T13),
    differences blended within +-180 deg (T14). world_from_sensor = Z(psi) X(theta) Y(phi) in both.
    """

    def __init__(self, period_s: float, magnetometer: bool, *, printed: bool) -> None:
        self._period = period_s
        self._magnetometer = magnetometer
        self._keep = TIME_CONSTANT_S / (TIME_CONSTANT_S + period_s)
        self._step = self._step_printed if printed else self._step_corrected
        self._angles: tuple[float, float, float] | None = None
        self.disturbed = False

    def update(
        self, gyr: Floats, acc: Floats, mag: Floats | None, mag_index: tuple[int, ...] | None
    ) -> Floats:
        """See OrientationFilter.update."""
        rows: dict[int, list[float]] = {}
        if mag is not None and self._magnetometer:
            rows = dict(zip(range(len(gyr)) if mag_index is None else mag_index, mag.tolist(), strict=True))
        angles = [
            self._step(g, a, rows.get(i))
            for i, (g, a) in enumerate(zip(gyr.tolist(), acc.tolist(), strict=True))
        ]
        phi, theta, psi = np.array(angles).T
        world_from_tilted = rotation.multiply(rotation.about(2, psi), rotation.about(0, theta))
        return rotation.multiply(world_from_tilted, rotation.about(1, phi))

    def state(self) -> dict[str, Any]:
        """See OrientationFilter.state."""
        return {"angles": None if self._angles is None else list(self._angles)}

    def restore(self, state: dict[str, Any]) -> None:
        """See OrientationFilter.restore."""
        angles = state["angles"]
        self._angles = None if angles is None else (angles[0], angles[1], angles[2])

    def _step_corrected(
        self, g: list[float], a: list[float], m: list[float] | None
    ) -> tuple[float, float, float]:
        phi_a, theta_a = atan2(-a[0], a[2]), atan2(a[1], hypot(a[0], a[2]))
        psi_a = None
        if m is not None:
            sp, cp, st, ct = sin(phi_a), cos(phi_a), sin(theta_a), cos(theta_a)
            north = m[1] * ct + m[0] * sp * st - m[2] * cp * st
            psi_a = atan2(m[0] * cp + m[2] * sp, north)
        if self._angles is None:
            self._angles = (phi_a, theta_a, psi_a or 0.0)
            return self._angles
        phi, theta, psi = self._angles
        sp, cp, ct = sin(phi), cos(phi), cos(theta)
        if abs(ct) < LEAST_COSINE:
            ct = LEAST_COSINE if ct >= 0.0 else -LEAST_COSINE
        psi_rate = (-sp * g[0] + cp * g[2]) / ct
        theta_rate = cp * g[0] + sp * g[2]
        phi_rate = g[1] - sin(theta) * psi_rate
        self._angles = (
            self._blend(phi + phi_rate * self._period, phi_a),
            self._blend(theta + theta_rate * self._period, theta_a),
            self._blend(psi + psi_rate * self._period, psi_a),
        )
        return self._angles

    def _blend(self, integrated: float, measured: float | None) -> float:
        if measured is None:
            return _wrap(integrated)
        return _wrap(integrated + (1.0 - self._keep) * _wrap(measured - integrated))

    def _step_printed(
        self, g: list[float], a: list[float], m: list[float] | None
    ) -> tuple[float, float, float]:
        phi_a, theta_a = atan2(a[0], a[2]), atan2(a[1], hypot(a[0], a[2]))
        sp, cp, st, ct = sin(phi_a), cos(phi_a), sin(theta_a), cos(theta_a)
        if abs(ct) < LEAST_COSINE:  # the one departure: the text divides by zero here
            ct = LEAST_COSINE
        psi_a = None
        if m is not None:
            psi_a = atan2(m[1] * ct - m[2] * sp, m[0] * cp + m[1] * sp * st + m[2] * sp * ct)
        if self._angles is None:
            self._angles = (phi_a, theta_a, psi_a or 0.0)
            return self._angles
        phi, theta, psi = self._angles
        phi += self._period * (sp * st / ct * g[0] + g[1] + cp * st / ct * g[2])
        theta += self._period * (cp * g[0] - sp * g[2])
        psi += self._period * (sp / ct * g[0] + cp / ct * g[2])
        k = self._keep
        self._angles = (
            phi * k + (1.0 - k) * phi_a,
            theta * k + (1.0 - k) * theta_a,
            psi if psi_a is None else psi * k + (1.0 - k) * psi_a,
        )
        return self._angles


def _wrap(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi
