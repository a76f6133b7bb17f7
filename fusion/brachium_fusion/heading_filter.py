"""The heading that a filter without magnetometer lacks, as the samples come. Pure.

An extended Kalman filter on averages over steps of time (field_model): heading offset, its drift in movement,
the field's horizontal and vertical parts, and what the magnetometer's calibration left. Strength and
inclination of the field tell a disturbance whatever the heading is: by how far they are off, the measurement
is weakened (Student's t), while a heading that is off by itself is only bounded (Huber), for then the gyroscope
may have drifted. What is uncertain grows meanwhile.
"""

from math import cos, exp, pi, radians, sin, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_fusion.field_model import (
    CALIBRATION,
    HARD_IRON,
    LAG_SD_S,
    MOVING_RAD_S,
    SOFT_IRON,
    SOFT_IRON_SD,
    FieldSteps,
    heading_variance,
    looks,
)

Floats = npt.NDArray[np.float64]

OFFSET, DRIFT, HORIZONTAL, VERTICAL = range(4)
STATES = 4 + CALIBRATION
STILL_ACC = 0.3
"""m/s^2, standard deviation: below it the first acceleration is gravity, and the first tilt is right."""
TILT_SD = 0.5
"""rad, of the first tilt of a sensor that moves."""
TILT_SETTLES_S = 0.9
"""Its time constant: VQF averages from the first sample on."""
TILT_UNSETTLED = 0.02
"""rad: until then the field is learnt anew at every step, for a wrong tilt turns its vertical part over."""
OFFSET_SD = 0.3
"""rad, at first: by hard iron that is not known yet."""
FIELD_SD = 0.05
"""Of the field's strength, at first, beside the tilt's."""
HARD_IRON_SD = 0.01
"""Of the field's strength: what a calibration leaves."""
DRIFT_START = radians(0.3)
"""rad/s, before the sensor rested: gyroscopes leave the factory with such biases."""
DRIFT_SD = radians(0.05)
"""rad/s, after: scale, vibration and acceleration move the bias by this against that of a rest."""
DRIFT_LASTS_S = 300.0
NOISE = 0.02
"""Of the field's strength, each component: the field of a room varies by this from place to place."""
APART_S = 1.0
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
        self._x: Floats = np.zeros(STATES)
        self._p: Floats = np.zeros((STATES, STATES))

    @property
    def sd_rad(self) -> float:
        """Return the standard deviation of the offset, infinite before there was a field."""
        return sqrt(self._p[0, 0]) if self._strength > 0.0 else float("inf")

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
        unsettled = self._tilt_sd > TILT_UNSETTLED
        if self._strength == 0.0 or unsettled:
            if share == 0.0:
                return
            self._begin(mean.field[0])
        self._predict(mean, step_s, rested)
        if share > 0.0:
            sure = float(looks(mean.rate, step_s, APART_S)[0]) * share
            self._correct(mean.field[0], mean.response[0], sure, step_s)
        self.offset = float(self._x[OFFSET])

    def _begin(self, field: Floats) -> None:
        self._strength = sqrt(field @ field)
        self._x = np.zeros(STATES)
        azimuth = float(np.arctan2(field[0], field[1]))
        self._x[OFFSET] = self.offset + (azimuth - self.offset + pi) % (2.0 * pi) - pi
        self._x[HORIZONTAL], self._x[VERTICAL] = np.hypot(field[0], field[1]), field[2]
        sd = np.empty(STATES)
        sd[OFFSET], sd[DRIFT] = max(OFFSET_SD, self._tilt_sd), DRIFT_START
        sd[HORIZONTAL : VERTICAL + 1] = (FIELD_SD + self._tilt_sd) * self._strength
        calibration = sd[4:]
        calibration[0] = LAG_SD_S
        calibration[HARD_IRON], calibration[SOFT_IRON] = HARD_IRON_SD * self._strength, SOFT_IRON_SD
        self._p = np.diag(sd**2)

    def _predict(self, mean: FieldSteps, step_s: float, rested: bool) -> None:
        x, p = self._x, self._p
        moving = min(1.0, float(mean.rate[0]) / MOVING_RAD_S)
        reach, keep = step_s * moving, exp(-step_s / DRIFT_LASTS_S)
        x[OFFSET] += reach * x[DRIFT]
        x[DRIFT] *= keep
        p[OFFSET] += reach * p[DRIFT]
        p[:, OFFSET] += reach * p[:, DRIFT]
        p[DRIFT] *= keep
        p[:, DRIFT] *= keep
        p[OFFSET, OFFSET] += float(heading_variance(mean.rate, step_s)[0])
        p[DRIFT, DRIFT] += DRIFT_SD**2 * (1.0 - keep * keep)
        wander = (WANDER * self._strength) ** 2 * step_s * moving
        p[HORIZONTAL, HORIZONTAL] += wander
        p[VERTICAL, VERTICAL] += wander
        if (
            rested and p[DRIFT, DRIFT] > (1.5 * DRIFT_SD) ** 2
        ):  # the bias is another one now, and better known
            less = DRIFT_SD / sqrt(p[DRIFT, DRIFT])
            p[DRIFT] *= less
            p[:, DRIFT] *= less
            x[DRIFT] = 0.0

    def _correct(self, field: Floats, response: Floats, sure: float, step_s: float) -> None:
        x, p = self._x, self._p
        sine, cosine = sin(x[OFFSET]), cos(x[OFFSET])
        # Along and across the horizontal field as it is expected, and upwards.
        level = np.array([[sine, cosine, 0.0], [0.0, 0.0, 1.0], [cosine, -sine, 0.0]])
        jacobian = np.empty((3, STATES))
        jacobian[:, :4] = 0.0
        jacobian[0, HORIZONTAL] = jacobian[1, VERTICAL] = 1.0
        jacobian[2, OFFSET] = x[HORIZONTAL]
        jacobian[:, 4:] = level @ response
        off = level @ field - jacobian[:, 4:] @ x[4:]
        off[0] -= x[HORIZONTAL]
        off[1] -= x[VERTICAL]
        cross = p @ jacobian.T
        spread = jacobian @ cross
        noise = (NOISE * self._strength) ** 2 + (self._tilt_sd * self._strength) ** 2
        along, up, across = off.tolist()
        (a, b, _), (_, d, _), (_, _, e) = spread.tolist()
        a, d, e = a + noise, d + noise, e + noise
        squared = (d * along * along - 2.0 * b * along * up + a * up * up) / (a * d - b * b)
        gate = (FREEDOM + 2.0) / (FREEDOM + squared)
        weight = gate * min(1.0, BOUND * sqrt(e) / max(abs(across), 1e-12))
        spread.flat[::4] += noise / (weight * sure)
        gain = np.linalg.solve(spread, cross.T)
        self._x = x + off @ gain
        p = p - cross @ gain
        self._p = 0.5 * (p + p.T)
        if gate < REJECTED:
            wander = (REJECTED_WANDER * self._strength) ** 2 * step_s
            self._p[HORIZONTAL, HORIZONTAL] += wander
            self._p[VERTICAL, VERTICAL] += wander
        self.disturbed = along * along + up * up > (DISTURBED * self._strength) ** 2

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "offset": self.offset,
            "disturbed": self.disturbed,
            "tilt_sd": self._tilt_sd,
            "strength": self._strength,
            "x": self._x.tolist(),
            "p": self._p.ravel().tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter whose state this is would have."""
        self.offset, self.disturbed = state["offset"], state["disturbed"]
        self._tilt_sd, self._strength = state["tilt_sd"], state["strength"]
        self._x = np.array(state["x"])
        self._p = np.array(state["p"]).reshape(STATES, STATES)
