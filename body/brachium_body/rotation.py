"""Unit quaternions on (..., 4) arrays, scalar first, and their matrices.

A quaternion named `a_from_b` takes vectors given in b's axes to a's axes; products read left to right by
cancelling: `a_from_c = multiply(a_from_b, b_from_c)`. Every function takes one rotation or any stack of them.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])


def normalize(q: npt.ArrayLike) -> Array:
    """Return q over its length, (..., 4). A zero quaternion gives NaN."""
    q = np.asarray(q, dtype=np.float64)
    unit: Array = q / np.sqrt(np.einsum("...i,...i->...", q, q))[..., None]
    return unit


def multiply(p: npt.ArrayLike, q: npt.ArrayLike) -> Array:
    """Return the Hamilton product p q of (..., 4) arrays: first q, then p."""
    pw, px, py, pz = _components(p)
    qw, qx, qy, qz = _components(q)
    return _joined(
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def _components(array: npt.ArrayLike) -> tuple[Array, ...]:
    a = np.asarray(array, dtype=np.float64)
    return tuple(a[..., i] for i in range(a.shape[-1]))


def _joined(*components: Array) -> Array:
    """Stack equal shapes along a new last axis: what np.stack does, at a fifth of its cost for few rows."""
    result = np.empty((*components[0].shape, len(components)))
    for i, component in enumerate(components):
        result[..., i] = component
    return result


_CONJUGATE: Array = np.array([1.0, -1.0, -1.0, -1.0])


def inverse(q: npt.ArrayLike) -> Array:
    """Return the inverse of unit quaternions (..., 4): `b_from_a` of `a_from_b`."""
    return np.asarray(q, dtype=np.float64) * _CONJUGATE


def rotate(q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Return the vectors v (..., 3), given in b's axes, in a's axes, q being `a_from_b`."""
    w, x, y, z = _components(q)
    vx, vy, vz = _components(v)
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return _joined(
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def from_rotation_vector(v: npt.ArrayLike) -> Array:
    """Return the rotation by |v| rad about v, (..., 3) -> (..., 4)."""
    v = np.asarray(v, dtype=np.float64)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)


def to_rotation_vector(q: npt.ArrayLike) -> Array:
    """Return the shortest rotation vector, (..., 4) -> (..., 3), its length in [0, pi]."""
    q = np.asarray(q, dtype=np.float64)
    q = np.where(q[..., :1] < 0.0, -q, q)
    s = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(s, q[..., :1])
    scale = np.where(s > 1e-12, angle / np.maximum(s, 1e-300), 2.0)
    return scale * q[..., 1:]


def angle_between(p: npt.ArrayLike, q: npt.ArrayLike) -> Array:
    """Return the angle in rad, [0, pi], of the rotation that takes p to q."""
    angle: Array = np.linalg.norm(to_rotation_vector(multiply(inverse(p), q)), axis=-1)
    return angle


def about(axis: int, angle: npt.ArrayLike) -> Array:
    """Return rotations by `angle` rad (...) about coordinate axis 0 (x), 1 (y) or 2 (z), as (..., 4)."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)
    q = np.zeros((*half.shape, 4))
    q[..., 0] = np.cos(half)
    q[..., 1 + axis] = np.sin(half)
    return q


def to_matrix(q: npt.ArrayLike) -> Array:
    """Return rotation matrices (..., 3, 3) whose columns are b's axes in a."""
    w, x, y, z = _components(q)
    entries = _joined(
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
    return entries.reshape(*w.shape, 3, 3)


def _cross_rule() -> Array:
    rule = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        rule[i, k, j], rule[i, j, k] = 1.0, -1.0
    return rule.reshape(3, 9)


_CROSS: Array = _cross_rule()


def cross_matrix(v: npt.ArrayLike) -> Array:
    """Return the matrices (..., 3, 3) whose product with x is v x x, of v (..., 3)."""
    v = np.asarray(v, dtype=np.float64)
    return (v @ _CROSS).reshape(*v.shape, 3)


def from_matrix(matrix: npt.ArrayLike) -> Array:
    """Return unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3).

    The largest of the four components is taken from the diagonal and the others from it (Shepperd 1978), so
    no division is by a small number.
    """
    m = np.asarray(matrix, dtype=np.float64)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    four = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=-1)
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 0, 1] + m[..., 1, 0], m[..., 0, 2] + m[..., 2, 0], m[..., 1, 2] + m[..., 2, 1]
    candidates = np.stack(
        [
            np.stack([four[..., 0], wx, wy, wz], axis=-1),
            np.stack([wx, four[..., 1], xy, xz], axis=-1),
            np.stack([wy, xy, four[..., 2], yz], axis=-1),
            np.stack([wz, xz, yz, four[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(four, axis=-1)
    q = normalize(np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :])
    return np.where(q[..., :1] < 0.0, -q, q)


def slerp(p: npt.ArrayLike, q: npt.ArrayLike, fraction: npt.ArrayLike) -> Array:
    """Return the rotation at `fraction` (0 is p, 1 is q) of the shorter way from p to q."""
    p = np.asarray(p, dtype=np.float64)
    step = to_rotation_vector(multiply(inverse(p), q))
    return multiply(p, from_rotation_vector(np.asarray(fraction, dtype=np.float64)[..., None] * step))


def mean(q: npt.ArrayLike) -> Array:
    """Return the mean rotation of (n, 4) quaternions of either sign: the largest eigenvector of their sum of
    outer products (Markley 2007)."""
    q = np.asarray(q, dtype=np.float64)
    _, vectors = np.linalg.eigh(q.T @ q)
    best: Array = vectors[:, -1]
    return best if best[0] >= 0.0 else -best


def heading(q: npt.ArrayLike) -> Array:
    """Return the rotation's angle about the vertical z axis in rad: the twist of swing-twist,
    (..., 4) -> (...)."""
    q = np.asarray(q, dtype=np.float64)
    return wrap(2.0 * np.arctan2(q[..., 3], q[..., 0]))


def wrap(angle: npt.ArrayLike) -> Array:
    """Return the same angle in rad within [-pi, pi)."""
    return (np.asarray(angle, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi


def mirror(q: npt.ArrayLike) -> Array:
    """Return the rotation seen in a mirror across the sagittal plane of ISB axes.

    That is S R S with S = diag(1, 1, -1): reversing Z keeps the turn about Z and turns
    those about X and Y round.
    """
    return np.asarray(q, dtype=np.float64) * _MIRROR


_MIRROR: Array = np.array([1.0, -1.0, -1.0, 1.0])
