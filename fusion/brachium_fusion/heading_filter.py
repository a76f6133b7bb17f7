"""The heading that a filter without magnetometer lacks, as the samples come. Pure.

An extended Kalman filter on averages over steps of time (field_model): heading offset, its drift in movement,
the field's horizontal and vertical parts, and what the magnetometer's calibration left. A field whose
strength and inclination are off has a direction that is off as well, and stays so while the magnet is near:
such a measurement is weakened (Student's t, twice). A heading that is off by itself is only bounded (Huber),
for then the gyroscope may have drifted. What is uncertain grows meanwhile.

Two filters run side by side. One takes the magnetometer for calibrated; the other, which would follow any
disturbance, allows for a magnet on the sensor. Once the second explains the field and is sure of such a
magnet it takes over for good.
"""

from math import exp, pi, radians, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_fusion.field_model import (
    CALIBRATION,
    HARD_IRON,
    LAG_SD_S,
    MOVING_RAD_S,
    SOFT_IRON,
    FieldSteps,
    heading_variance,
    looks,
)

Floats = npt.NDArray[np.float64]

OFFSET, DRIFT, HORIZONTAL, VERTICAL = range(4)
STATES = 4 + CALIBRATION
IRON = slice(4 + HARD_IRON.start, 4 + HARD_IRON.stop)
TILT_SD = 0.5
"""rad, of the first tilt of a sensor that moves."""
TILT_SETTLES_S = 0.9
"""Its time constant: VQF averages from the first sample on."""
TILT_UNSETTLED = 0.02
"""rad: until then the field is learnt anew at every step, for a wrong tilt turns its vertical part over."""
OFFSET_SD = 0.3
"""rad, at first: by hard iron that is not known yet."""
FIELD_SD = 0.2
"""Of the field's strength, at first, beside the tilt's: the place of the start may be a desk of steel."""
HARD_IRON_SD = (0.01, 0.3)
"""Of the field's strength: what a calibration leaves, and what a magnet on the sensor does."""
SOFT_IRON_SD = 0.01
"""Scale and axes are off by about one part in a hundred after a calibration."""
DRIFT_START = radians(0.3)
"""rad/s, before the sensor rested: gyroscopes leave the factory with such biases."""
DRIFT_SD = radians(0.05)
"""rad/s, after: scale, vibration and acceleration move the bias by this against that of a rest."""
DRIFT_LASTS_S = 300.0
NOISE = 0.02
"""Of the field's strength, each component: the field of a room varies by this from place to place."""
APART_S = 1.5
"""Deviations of the field keep together for about this long in movement."""
FREEDOM = 4.0
"""Degrees of freedom of Student's t."""
BOUND = 2.0
"""Standard deviations from which on a heading pulls no harder."""
WANDER = 5e-4
"""Of the field's strength in sqrt(s) of movement: the field changes over a house."""
REJECTED = 0.3
"""A measurement of less than this weight is taken for a disturbance, or for another place."""
REJECTED_WANDER = 0.003
"""Then the field that was learnt is trusted less and less; in a minute or two the new one is taken."""
DISTURBED = 0.1
"""Of the field's strength: strength and inclination off by more are a disturbance."""
MAGNET = 0.05
"""Of the field's strength: hard iron above this is a magnet on the sensor,"""
MAGNET_SURE = 5.0
"""when it is so many times its standard deviation,"""
MAGNET_FITS = 0.8
"""and measurements, against the noise alone, had this weight on average (where all is well, above 1)"""
MAGNET_LOOKS = 10.0
"""over so many independent looks."""


class HeadingFilter:
    """Steps of averaged field in, `offset` out: world_from_sensor = Rz(offset) levelled."""

    def __init__(self) -> None:
        self.offset = 0.0
        """rad, continuous."""
        self.disturbed = False
        """Strength or inclination of the field are not the learnt ones."""
        self._tilt_sd = -1.0
        """rad; below 0 before the first step."""
        self._strength = 0.0
        self._x: Floats = np.zeros((2, STATES))
        self._p: Floats = np.zeros((2, STATES, STATES))
        self._looks = 0.0
        self._fit = 1.0
        """Running mean of the weights of the filter that allows for a magnet."""

    @property
    def sd_rad(self) -> float:
        """Return the standard deviation of the offset, infinite before there was a field."""
        return sqrt(self._p[0, 0, 0]) if self._strength > 0.0 else float("inf")

    def step(self, mean: FieldSteps, still: bool, rested: bool, step_s: float) -> None:
        """Take one step of averages over `step_s`.

        `still` tells that gravity alone was measured, `rested` that the gyroscope's bias was just learnt at
        rest.
        """
        share = float(mean.share[0])
        if self._tilt_sd < 0.0:
            self._tilt_sd = 0.0 if still else TILT_SD
        else:
            self._tilt_sd *= exp(-step_s / TILT_SETTLES_S)
        if self._strength == 0.0 or self._tilt_sd > TILT_UNSETTLED:
            if share == 0.0:
                return
            self._begin(mean.field[0])
        self._predict(mean, step_s, rested)
        if share > 0.0:
            sure = float(looks(mean.rate, step_s, APART_S)[0]) * share
            self._correct(mean.field[0], mean.response[0], sure, step_s)
            if len(self._x) > 1:
                self._look_for_magnet(sure)
        self.offset = float(self._x[0, OFFSET])

    def _begin(self, field: Floats) -> None:
        self._strength = sqrt(field @ field)
        azimuth = float(np.arctan2(field[0], field[1]))
        self._x[:] = 0.0
        self._x[:, OFFSET] = self.offset + (azimuth - self.offset + pi) % (2.0 * pi) - pi
        self._x[:, HORIZONTAL], self._x[:, VERTICAL] = np.hypot(field[0], field[1]), field[2]
        self._p[:] = 0.0
        for p, iron in zip(self._p, HARD_IRON_SD, strict=True):
            sd = np.empty(STATES)
            sd[OFFSET], sd[DRIFT] = max(OFFSET_SD, self._tilt_sd), DRIFT_START
            sd[HORIZONTAL : VERTICAL + 1] = (FIELD_SD + self._tilt_sd) * self._strength
            sd[4], sd[IRON], sd[4 + SOFT_IRON.start :] = LAG_SD_S, iron * self._strength, SOFT_IRON_SD
            p.flat[:: STATES + 1] = sd * sd

    def _predict(self, mean: FieldSteps, step_s: float, rested: bool) -> None:
        x, p = self._x, self._p
        moving = min(1.0, float(mean.rate[0]) / MOVING_RAD_S)
        reach, keep = step_s * moving, exp(-step_s / DRIFT_LASTS_S)
        x[:, OFFSET] += reach * x[:, DRIFT]
        x[:, DRIFT] *= keep
        p[:, OFFSET] += reach * p[:, DRIFT]
        p[:, :, OFFSET] += reach * p[:, :, DRIFT]
        p[:, DRIFT] *= keep
        p[:, :, DRIFT] *= keep
        p[:, OFFSET, OFFSET] += float(heading_variance(mean.rate, step_s)[0])
        p[:, DRIFT, DRIFT] += DRIFT_SD**2 * (1.0 - keep * keep)
        self._loosen_field((WANDER * self._strength) ** 2 * step_s * moving)
        if rested and p[0, DRIFT, DRIFT] > (1.5 * DRIFT_SD) ** 2:
            # The bias is another one now, and better known.
            less = DRIFT_SD / sqrt(p[0, DRIFT, DRIFT])
            p[:, DRIFT] *= less
            p[:, :, DRIFT] *= less
            x[:, DRIFT] = 0.0

    def _loosen_field(self, variance: Any) -> None:
        self._p[:, HORIZONTAL, HORIZONTAL] += variance
        self._p[:, VERTICAL, VERTICAL] += variance

    def _correct(self, field: Floats, response: Floats, sure: float, step_s: float) -> None:
        x, p = self._x, self._p
        sine, cosine = np.sin(x[:, OFFSET]), np.cos(x[:, OFFSET])
        # Along the horizontal field as it is expected, up, and across.
        level = np.zeros((len(x), 3, 3))
        level[:, 0, 0], level[:, 0, 1], level[:, 1, 2] = sine, cosine, 1.0
        level[:, 2, 0], level[:, 2, 1] = cosine, -sine
        jacobian = np.zeros((len(x), 3, STATES))
        jacobian[:, 0, HORIZONTAL] = jacobian[:, 1, VERTICAL] = 1.0
        jacobian[:, 2, OFFSET] = x[:, HORIZONTAL]
        jacobian[:, :, 4:] = level @ response
        off = level @ field - (jacobian[:, :, 4:] @ x[:, 4:, None])[:, :, 0]
        off[:, :2] -= x[:, HORIZONTAL : VERTICAL + 1]
        cross = p @ jacobian.swapaxes(1, 2)
        spread = jacobian @ cross
        noise = (NOISE * self._strength) ** 2 + (self._tilt_sd * self._strength) ** 2
        along, up, across = off.T
        a, b, d = spread[:, 0, 0] + noise, spread[:, 0, 1], spread[:, 1, 1] + noise
        squared = (d * along * along - 2.0 * b * along * up + a * up * up) / (a * d - b * b)
        gate = (FREEDOM + 2.0) / (FREEDOM + squared)
        bound = BOUND * np.sqrt(spread[:, 2, 2] + noise) / np.maximum(np.abs(across), 1e-12)
        weight = gate * np.minimum(1.0, gate) * np.minimum(1.0, bound)
        spread[:, (0, 1, 2), (0, 1, 2)] += (noise / (weight * sure))[:, None]
        gain = np.linalg.solve(spread, cross.swapaxes(1, 2))
        self._x = x + (off[:, None, :] @ gain)[:, 0]
        p = p - cross @ gain
        self._p = 0.5 * (p + p.swapaxes(1, 2))
        self._loosen_field((gate < REJECTED) * ((REJECTED_WANDER * self._strength) ** 2 * step_s))
        deviation = along * along + up * up
        self.disturbed = bool(deviation[0] > (DISTURBED * self._strength) ** 2)
        part = 1.0 - exp(-sure / MAGNET_LOOKS)
        self._fit += part * float((FREEDOM + 2.0) / (FREEDOM + deviation[-1] / noise) - self._fit)

    def _look_for_magnet(self, sure: float) -> None:
        self._looks += sure
        if self._looks < MAGNET_LOOKS or self._fit < MAGNET_FITS:
            return
        iron = self._x[1, IRON]
        size = sqrt(iron @ iron)
        if size < MAGNET * self._strength:
            return
        if size > MAGNET_SURE * sqrt(np.linalg.eigvalsh(self._p[1, IRON, IRON])[-1]):
            self._x, self._p = self._x[1:], self._p[1:]

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "offset": self.offset,
            "disturbed": self.disturbed,
            "tilt_sd": self._tilt_sd,
            "strength": self._strength,
            "x": self._x.tolist(),
            "p": self._p.ravel().tolist(),
            "looks": self._looks,
            "fit": self._fit,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        self.offset, self.disturbed = state["offset"], state["disturbed"]
        self._tilt_sd, self._strength = state["tilt_sd"], state["strength"]
        self._x = np.array(state["x"])
        self._p = np.array(state["p"]).reshape(-1, STATES, STATES)
        self._looks, self._fit = state["looks"], state["fit"]
