"""The shoulder as it moves: its displacement and both sensors' orientations from the samples so far. Pure.

The same model as the smoother's, as an error-state Kalman filter: samples are integrated one by one, errors
and covariances go from knot to knot.
"""

from dataclasses import replace
from math import hypot
from typing import Any

import numpy as np

from brachium_body import rotation
from brachium_fusion import shoulder_hearing as hearing
from brachium_fusion import shoulder_increments as si
from brachium_fusion.shoulder_equations import NEAR_REST_S, PLACE, SIZE, SPEED, TURNS
from brachium_fusion.shoulder_errors import HELD, ErrorState
from brachium_fusion.shoulder_model import ArmModel, Floats, ShoulderEstimate, Sizes, sizes
from brachium_fusion.shoulder_strapdown import Ahead
from brachium_fusion.shoulder_watch import Watch
from brachium_fusion.shoulder_window import fitted_model

LONGEST_GAP_S = 0.3
"""After a longer one nothing is known of the shoulder until the next rest."""
UNKNOWN_M = 0.1
LOST_HEADING = 0.1
"""rad: of each sensor after a time that made no sense."""


class ShoulderFilter:
    """Follows one arm from a rest on; `step` takes both sensors' samples of one instant.

    It begins, and begins again after a movement that is no shoulder's, by taking 0.16 s of samples at rest
    for gravity.
    """

    def __init__(
        self,
        model: ArmModel,
        rate_hz: float,
        world_from_upper: Floats,
        world_from_forearm: Floats,
        gyro_bias_upper: Floats,
        gyro_bias_forearm: Floats,
        *,
        heading_sd_rad: float | None = None,
    ) -> None:
        self._model, self._period, self._every = model, 1.0 / rate_hz, si.stride(rate_hz)
        size = sizes(model)
        self._size: Sizes = replace(size, lever=hypot(size.lever, model.lever_sd_m))
        self._heading_sd = heading_sd_rad
        self._world: Floats = np.stack([world_from_upper, world_from_forearm]).astype(np.float64)
        self._constants = np.zeros(HELD)
        self._constants[0:3], self._constants[12:15] = gyro_bias_upper, gyro_bias_forearm
        self._errors = ErrorState(self._size)
        self._watch = Watch(self._size, self._world.copy())
        self._place, self._speed = np.zeros(3), np.zeros(3)
        self._ahead = Ahead(self._period)
        self._at_rest, self._settled = True, False
        self._stand()

    def step(
        self,
        gyr_u: Floats,
        acc_u: Floats,
        gyr_f: Floats,
        acc_f: Floats,
        *,
        trunk_velocity: Floats | None = None,
        world_from_upper: Floats | None = None,
        world_from_forearm: Floats | None = None,
        missing_s: float = 0.0,
    ) -> ShoulderEstimate:
        """Return the shoulder after one sample of each sensor: rad/s and m/s^2 in its axes, calibrated.

        `trunk_velocity` (3,) m/s, world, is the trunk's part of the shoulder's velocity: always or never.
        `world_from_upper` and `world_from_forearm` (4,) are an orientation filter's: they stand in while the
        estimate is not valid, and give heading if the filter was told how well they know it. `missing_s` is
        the time without samples before this one, beyond the period.
        """
        given = None
        if world_from_upper is not None and world_from_forearm is not None:
            given = np.stack([world_from_upper, world_from_forearm]).astype(np.float64)
        trunk = np.zeros(3) if trunk_velocity is None else trunk_velocity
        row = np.concatenate([gyr_u, acc_u, gyr_f, acc_f, trunk])
        if missing_s > 0.0:
            self._gap(missing_s, row, given)
        self._feed(row, given)
        return self._estimate(given)

    def _feed(self, row: Floats, given: Floats | None) -> None:
        self._ahead.add(row.tolist())
        if len(self._ahead.rows) == self._every + 1:
            self._knot(given)

    def _stand(self) -> None:
        """Begin to look ahead from what is held at the knot."""
        c = self._constants[: si.SITS.start].reshape(2, 4, 3)
        self._scale, self._bias = (1.0 - c[:, 2:]).reshape(12), c[:, :2].reshape(12)
        self._sits = rotation.from_rotation_vector(self._constants[si.SITS].reshape(2, 3))
        self._now = fitted_model(self._model, self._constants)
        self._ahead.begin(
            self._world.ravel().tolist(),
            self._scale.tolist(),
            self._bias.tolist(),
            self._now.lever_upper.tolist(),
            self._speed.tolist(),
        )

    def _knot(self, given: Floats | None) -> None:
        """Take the interval that ended."""
        rows = np.array(self._ahead.rows)
        if not self._settled:
            self._settled = True
            self._settle(rows)
            self._stand()
            return
        h = self._every * self._period
        read = rows[:, 8:20] * self._scale - self._bias
        inc = si.increments(
            self._now,
            self._period,
            self._every,
            (rows[:, 0:4], read[:, 0:3], read[:, 3:6]),
            (rows[:, 4:8], read[:, 6:9], read[:, 9:12]),
            rows[:, 20:23],
        )
        self._world = rows[-1, :8].reshape(2, 4)
        rates = read.mean(axis=0).reshape(4, 3)[::2]
        fastest = float(np.sqrt(np.square(rates).sum(axis=1).max()))
        watch, errors = self._watch, self._errors
        slow = hearing.slow(errors, self._size, self._speed, h)
        self._at_rest = watch.see(inc.velocity[0], fastest, h, slow=slow)
        listen = not watch.reason
        sits = self._constants[si.SITS]
        near = watch.since_rest_s < NEAR_REST_S
        if listen and self._at_rest:
            hearing.rest(errors, self._size, self._speed, rates.ravel(), watch.rest_s, h)
        moving = 1.0 if near else watch.shift / self._size.shift
        apart = errors.advance(inc, moving, sits, listen=listen)
        if listen:
            self._place = self._place + h * self._speed
            self._hear(h, given)
            sd = np.sqrt(np.diag(errors.covariance)[PLACE])
            watch.judge(self._place, self._speed, sd, apart, h)
        if watch.reason:
            self._lost(given)
            if watch.recovered():
                self._begin_again(rows)
        self._stand()

    def _hear(self, h: float, given: Floats | None) -> None:
        """Hear what holds at a knot."""
        size, watch, errors = self._size, self._watch, self._errors
        near = watch.since_rest_s < NEAR_REST_S
        variance = (2.0 * size.shift) ** 2 * 60.0 if near else watch.shift**2 * size.shift_s
        hearing.elbow_and_place(errors, size, self._now, self._world, self._place, variance / h, h)
        if given is not None and self._heading_sd is not None:
            hearing.heading(errors, self._world, given, self._heading_sd, h)
        if self._at_rest:
            sd = np.sqrt(np.diag(errors.covariance)[PLACE])
            posture = watch.tie(self._world, self._place + errors.mean[PLACE], sd)
            if posture is not None:
                hearing.back(errors, size, posture, self._world, self._place)
        self._take()

    def _take(self) -> None:
        """Take the mean of the errors into what is held."""
        x = self._errors.take()
        self._place, self._speed = self._place + x[PLACE], self._speed + x[SPEED]
        turn = rotation.from_rotation_vector(x[TURNS].reshape(2, 3))
        self._world = rotation.normalize(rotation.multiply(turn, self._world))
        self._constants = self._constants + x[SIZE:]

    def _gap(self, missing_s: float, row: Floats, given: Floats | None) -> None:
        """Go over a time without samples: a short one as if they lay on a straight line to `row`."""
        hearing.gap(self._errors, missing_s)
        if missing_s > LONGEST_GAP_S:
            self._watch.stop("samples were missing for too long")
        elif self._ahead.rows:
            before = np.array(self._ahead.rows[-1][8:])
            missing = round(missing_s / self._period)
            for i in range(missing):
                self._feed(before + (row - before) * ((i + 1) / (missing + 1)), given)

    def _lost(self, given: Floats | None) -> None:
        """Hold nothing of the shoulder; orientations are the orientation filter's, if it is there."""
        self._place, self._speed = np.zeros(3), np.zeros(3)
        self._errors.take()
        self._errors.forget(slice(0, 6), np.repeat([UNKNOWN_M, 1.0], 3))
        if given is not None:
            self._world = given

    def _settle(self, rows: Floats) -> None:
        if not hearing.settled(self._world, self._constants, rows[:, 8:20].mean(axis=0)):
            self._watch.stop("the accelerometers do not read gravity")

    def _begin_again(self, rows: Floats) -> None:
        """Begin at a rest; the shoulder may be anywhere, and heading is not known well."""
        self._settle(rows)
        size = self._size
        knot = np.repeat([size.shift, size.rest_speed], 3)
        self._errors.forget(slice(0, 12), np.concatenate([knot, [size.tilt, size.tilt, LOST_HEADING] * 2]))

    def _estimate(self, given: Floats | None) -> ShoulderEstimate:
        ahead, reason = self._ahead, self._watch.reason
        world = np.array(ahead.rows[-1][:8]).reshape(2, 4) if ahead.rows else self._world
        world = given if reason and given is not None else rotation.multiply(world, self._sits)
        since = self._period * max(len(ahead.rows) - 1, 0)
        go = np.concatenate([np.eye(3), since * np.eye(3)])
        spread = go.T @ self._errors.covariance[:6, :6] @ go
        return ShoulderEstimate(
            np.zeros(3) if reason else self._place + np.array(ahead.moved[:3]),
            spread,
            world[0],
            world[1],
            self._at_rest,
            not reason,
            reason,
        )

    def state(self) -> dict[str, Any]:
        """Return all that changes, as plain values."""
        return {
            "world": self._world.tolist(),
            "constants": self._constants.tolist(),
            "place": self._place.tolist(),
            "speed": self._speed.tolist(),
            "at_rest": self._at_rest,
            "settled": self._settled,
            "rows": [list(row) for row in self._ahead.rows],
            "moved": list(self._ahead.moved),
            "errors": self._errors.state(),
            "watch": self._watch.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as the filter of the same arm whose state this is would have."""
        self._world, self._constants = np.array(state["world"]), np.array(state["constants"])
        self._place, self._speed = np.array(state["place"]), np.array(state["speed"])
        self._at_rest, self._settled = state["at_rest"], state["settled"]
        self._errors.restore(state["errors"])
        self._watch.restore(state["watch"])
        self._ahead.rows = [list(row) for row in state["rows"]][-1:]
        self._stand()
        self._ahead.restore([list(row) for row in state["rows"]], list(state["moved"]))
