"""Sensors from sample to sample, in plain floats: a tenth of the cost of arrays of one row. Pure."""

from math import cos, sin, sqrt

from brachium_fusion.joint_matrices import Quaternion, product
from brachium_fusion.shoulder_model import GRAVITY

Vector = tuple[float, float, float]


def turned(q: Quaternion, before: Vector, now: Vector, period_s: float) -> Quaternion:
    """Return world_from_sensor after `period_s` with rates in rad/s at both ends: the trapezium rule and the
    second-order correction for a turning axis (Miller 1983)."""
    half, wobble = 0.5 * period_s, period_s * period_s / 12.0
    c = cross(before, now)
    x = half * (before[0] + now[0]) + wobble * c[0]
    y = half * (before[1] + now[1]) + wobble * c[1]
    z = half * (before[2] + now[2]) + wobble * c[2]
    angle = sqrt(x * x + y * y + z * z)
    scale = sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return unit(product(q, (cos(0.5 * angle), scale * x, scale * y, scale * z)))


def unit(q: Quaternion) -> Quaternion:
    """Return q over its length."""
    s = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


def rotated(q: Quaternion, v: Vector) -> Vector:
    """Return v in the world's axes."""
    w, x, y, z = q
    tx, ty, tz = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


class Ahead:
    """Both sensors from a knot on, and where the upper arm's says the shoulder has gone since."""

    def __init__(self, period_s: float) -> None:
        self._period = period_s
        self.rows: list[list[float]] = []
        """Samples since the knot, that one first: world_from_sensor of the upper arm's sensor and of the
        forearm's (8 numbers), then what was added (15)."""
        self.moved = [0.0] * 6
        """Displacement m and speed m/s gained since the knot."""

    def begin(
        self,
        world: list[float],
        scale: list[float],
        bias: list[float],
        lever: list[float],
        speed: list[float],
    ) -> None:
        """Stand on a knot: orientations (8), what the errors known do to 12 readings, the upper arm's lever
        arm (3) m, the shoulder's speed (3) m/s."""
        self._scale, self._bias, self._lever, self._speed = scale, bias, (lever[0], lever[1], lever[2]), speed
        self.moved = [0.0] * 6
        if self.rows:
            self.rows = [[*world, *self.rows[-1][8:]]]
            self._last = self._corrected(self.rows[0][8:20])
        self._world = world

    def add(self, row: list[float]) -> None:
        """Take one sample: gyr and acc of the upper arm's sensor, of the forearm's (12), the trunk's velocity
        (3)."""
        now = self._corrected(row)
        if not self.rows:
            self.rows, self._last = [[*self._world, *row]], now
            return
        old, last = self.rows[-1], self._last
        upper = turned(_four(old, 0), _three(last, 0), _three(now, 0), self._period)
        forearm = turned(_four(old, 4), _three(last, 6), _three(now, 6), self._period)
        before, after = rotated(_four(old, 0), _three(last, 3)), rotated(upper, _three(now, 3))
        leaving = rotated(_four(old, 0), cross(_three(last, 0), self._lever))
        arriving = rotated(upper, cross(_three(now, 0), self._lever))
        moved = self.moved
        for i in range(3):
            force = before[i] + after[i] - (2.0 * GRAVITY if i == 2 else 0.0)
            gained = 0.5 * self._period * force + arriving[i] - leaving[i] - row[12 + i] + old[20 + i]
            moved[i] += self._period * (self._speed[i] + moved[3 + i] + 0.5 * gained)
            moved[3 + i] += gained
        self.rows.append([*upper, *forearm, *row])
        self._last = now

    def restore(self, rows: list[list[float]], moved: list[float]) -> None:
        """Go on with samples since the knot, after `begin`."""
        self.rows, self.moved = rows, moved
        if rows:
            self._last = self._corrected(rows[-1][8:20])

    def _corrected(self, row: list[float]) -> list[float]:
        return [x * s - b for x, s, b in zip(row, self._scale, self._bias, strict=False)]


def _four(row: list[float], at: int) -> Quaternion:
    return (row[at], row[at + 1], row[at + 2], row[at + 3])


def _three(row: list[float], at: int) -> Vector:
    return (row[at], row[at + 1], row[at + 2])
