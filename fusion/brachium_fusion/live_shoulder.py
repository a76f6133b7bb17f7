"""One shoulder's displacement, from the first rest after a calibration on. Pure, causal."""

from math import radians
from typing import Any

import numpy as np
import numpy.typing as npt

from brachium_fusion.shoulder_filter import ShoulderFilter
from brachium_fusion.shoulder_model import ArmModel, ShoulderEstimate
from brachium_fusion.timeline import Motion

Floats = npt.NDArray[np.float64]

REST_S = 0.5
"""Of stillness gives the gyroscopes' biases and a place to count from."""
HEADING_SD = radians(4.0)
"""How well a magnetometer knows heading indoors."""


class RestMean:
    """The mean rate of a sensor while it is still: its gyroscope's bias."""

    def __init__(self) -> None:
        self.count = 0
        self._sum = np.zeros(3)

    def see(self, gyr: Floats, still: bool) -> None:
        """Take the rate (3,) rad/s at an instant."""
        if not still:
            self.count, self._sum = 0, np.zeros(3)
            return
        self.count += 1
        self._sum = self._sum + gyr

    @property
    def bias(self) -> Floats:
        """(3,) rad/s."""
        mean: Floats = self._sum / max(self.count, 1)
        return mean

    def state(self) -> list[Any]:
        """Return all that changes, as plain values."""
        return [self.count, self._sum.tolist()]

    def restore(self, state: list[Any]) -> None:
        """Go on as the mean whose state this is would have."""
        self.count, self._sum = state[0], np.array(state[1])


class LiveShoulder:
    """Waits for a rest, then follows the shoulder."""

    def __init__(self, model: ArmModel, rate_hz: float, magnetometers: bool) -> None:
        self._model, self._rate_hz = model, rate_hz
        self._heading_sd = HEADING_SD if magnetometers else None
        self._filter: ShoulderFilter | None = None

    def step(
        self,
        world_from: tuple[Floats, Floats],
        motion: tuple[Motion, Motion],
        rests: tuple[RestMean, RestMean],
        missing_s: float,
        trunk_velocity: Floats | None = None,
    ) -> ShoulderEstimate | None:
        """Take the sensors of upper arm and forearm at an instant, and how fast the trunk carries the
        shoulder, (3,) m/s; None before the first rest."""
        (upper, forearm), (upper_motion, forearm_motion) = world_from, motion
        if self._filter is None:
            if min(rests[0].count, rests[1].count) < REST_S * self._rate_hz:
                return None
            self._filter = self._new(upper, forearm, rests[0].bias, rests[1].bias)
        return self._filter.step(
            upper_motion.gyr,
            upper_motion.acc,
            forearm_motion.gyr,
            forearm_motion.acc,
            trunk_velocity=trunk_velocity,
            world_from_upper=upper,
            world_from_forearm=forearm,
            missing_s=missing_s,
        )

    def _new(self, upper: Floats, forearm: Floats, *biases: Floats) -> ShoulderFilter:
        return ShoulderFilter(
            self._model, self._rate_hz, upper, forearm, *biases, heading_sd_rad=self._heading_sd
        )

    def state(self) -> dict[str, Any] | None:
        """Return all that changes, as plain values."""
        return None if self._filter is None else self._filter.state()

    def restore(self, state: dict[str, Any] | None) -> None:
        """Go on as the shoulder whose state this is would have."""
        if state is not None:
            level = np.array([1.0, 0.0, 0.0, 0.0])
            self._filter = self._new(level, level, np.zeros(3), np.zeros(3))
            self._filter.restore(state)
