"""The errors of a moving shoulder's estimate: an error-state Kalman filter from knot to knot. Pure."""

from math import exp, radians
from typing import Any

import numpy as np

from brachium_fusion import shoulder_increments as si
from brachium_fusion.shoulder_equations import PLACE, SIZE, SPEED, TURNS
from brachium_fusion.shoulder_model import Floats, Sizes

HELD = si.SITS.stop
"""Constants of the filter: lever arms are left to noise, skin to how a sensor sits, which it forgets."""
STATE = SIZE + HELD
"""A knot and the constants."""
CONSTANT = slice(SIZE, STATE)
SITS = slice(SIZE + si.SITS.start, STATE)
SITS_S = 30.0
"""s: how a sensor sits is a new matter so often: skin follows the posture."""
WALKS = np.concatenate(
    [np.repeat([radians(0.002), 3e-4, 2e-5, 2e-5], 3), np.repeat([radians(0.002), 3e-4, 2e-5, 2e-5], 3)]
)
"""rad/s, m/s^2, 1, 1 a sqrt(s): by how much the constants are none."""


class ErrorState:
    """Mean and covariance of the errors: truth minus what the filter holds, to be taken into it."""

    def __init__(self, size: Sizes) -> None:
        self._size = size
        knot = [1e-4] * 3 + [1e-3] * 3 + [size.tilt, size.tilt, size.heading] * 2
        one = np.repeat([size.gyro_bias, size.accel_bias, size.gyro_scale, size.accel_scale], 3)
        sd = np.concatenate([knot, one, one, np.full(6, size.mounting)])
        self.covariance: Floats = np.diag(sd**2)
        self.mean: Floats = np.zeros(STATE)

    def advance(self, inc: si.Increments, moving: float, sits: Floats, *, listen: bool) -> float:
        """Go to the next knot and hear what both sensors say of the speed gained.

        `moving` is the share of `Sizes.shoulder_accel` to expect, `sits` (6,) how the sensors are taken to
        sit. Returns the normalised square of what the sensors say differently;
        1 is as expected. Without `listen` accelerations are not believed.
        """
        h, size = float(inc.step_s[0]), self._size
        turn = inc.by_turn[0]
        constant, drift = inc.by_constant[0, :, :HELD], inc.turn_by_constant[0, :, :HELD]
        step = np.eye(STATE)
        step[PLACE, SPEED] = h * np.eye(3)
        step[TURNS, CONSTANT] = drift
        keep = exp(-h / SITS_S)
        step[SITS, SITS] *= keep
        speed = (size.shoulder_accel * moving) ** 2 * h
        turned = size.gyro_noise**2 * h
        by_speed, by_turn = np.zeros((STATE, 3)), np.zeros((STATE, 6))
        by_speed[SPEED], by_speed[PLACE] = np.eye(3), 0.5 * h * np.eye(3)
        by_turn[TURNS] = np.eye(6)
        moved = step @ self.covariance
        covariance = moved @ step.T + speed * (by_speed @ by_speed.T) + turned * (by_turn @ by_turn.T)
        diagonal = np.arange(SIZE, STATE)
        covariance[diagonal[: si.SITS.start], diagonal[: si.SITS.start]] += h * WALKS**2
        covariance[diagonal[si.SITS.start :], diagonal[si.SITS.start :]] += (1.0 - keep**2) * size.mounting**2
        before, self.covariance = self.covariance, covariance
        known, self.mean = self.mean, step @ self.mean
        self.mean[SITS] += (keep - 1.0) * sits
        if not listen:
            return 1.0
        late = turn[:, 6:]
        coefficient = np.zeros((6, STATE))
        coefficient[:, TURNS] = -(turn[:, :6] + late)
        coefficient[:, CONSTANT] = -(constant + late @ drift)
        both = np.tile(np.eye(3), (2, 1))
        noise = size.accel_noise**2 + np.cumsum((size.lever * inc.swing[0]) ** 2)
        common = moved @ coefficient.T + speed * (by_speed @ both.T) - turned * (by_turn @ late.T)
        spread = coefficient @ before @ coefficient.T + speed * (both @ both.T) + turned * (late @ late.T)
        spread[np.arange(6), np.arange(6)] += np.repeat(noise * 0.1 * h, 3)
        gained = inc.velocity[0] - coefficient @ known
        self._take(common, spread, gained)
        apart = np.concatenate([-np.eye(3), np.eye(3)], axis=1)
        difference, its_spread = apart @ gained, apart @ spread @ apart.T
        return float(difference @ np.linalg.solve(its_spread, difference)) / 3.0

    def observe(self, coefficient: Floats, value: Floats, variance: Floats) -> None:
        """Hear that coefficient (r, STATE) times the errors is value (r,), with variance (r,)."""
        common = self.covariance @ coefficient.T
        spread = coefficient @ common + np.diag(variance)
        self._take(common, spread, value - coefficient @ self.mean)

    def surprise(self, rows: slice, value: Floats, variance: float) -> float:
        """Return the normalised square, 1 expected, of hearing that these errors are value."""
        innovation = value - self.mean[rows]
        spread = self.covariance[rows, rows] + variance * np.eye(len(value))
        return float(innovation @ np.linalg.solve(spread, innovation)) / len(value)

    def forget(self, rows: slice, sd: Floats) -> None:
        """Know no more of these errors than a standard deviation."""
        self.covariance[rows, :] = 0.0
        self.covariance[:, rows] = 0.0
        self.covariance[rows, rows] = np.diag(np.square(sd))

    def widen(self, rows: slice, variance: Floats) -> None:
        """Know these errors less well by a variance each."""
        index = np.arange(STATE)[rows]
        self.covariance[index, index] += variance

    def take(self) -> Floats:
        """Return the mean (STATE,), which the caller takes into what it holds; it is 0 from then on."""
        mean, self.mean = self.mean, np.zeros(STATE)
        return mean

    def _take(self, common: Floats, spread: Floats, innovation: Floats) -> None:
        gain = np.linalg.solve(spread, common.T).T
        self.mean = self.mean + gain @ innovation
        covariance = self.covariance - gain @ common.T
        self.covariance = 0.5 * (covariance + covariance.T)

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {"covariance": self.covariance.tolist(), "mean": self.mean.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the one whose state this is."""
        self.covariance, self.mean = np.array(state["covariance"]), np.array(state["mean"])
