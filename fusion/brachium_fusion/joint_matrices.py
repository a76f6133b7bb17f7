"""Rotation matrices of the few sensors on a joint: each function is a handful of array operations. Pure.

`brachium_body.rotation` is for long arrays of quaternions; for two sensors at a time its cost is that of its
many small steps.
"""

from math import atan2, cos, sin, sqrt

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def _matrix_rule() -> Floats:
    """Return (16, 9): a matrix's entries by the products of a unit quaternion's components."""
    rule = np.zeros((4, 4, 3, 3))
    for i in range(3):
        rule[0, 0, i, i] = 1.0
        for j in range(3):
            rule[1 + j, 1 + j, i, i] = 1.0 if i == j else -1.0
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        rule[1 + i, 1 + j, i, j] = rule[1 + i, 1 + j, j, i] = 2.0
        rule[0, 1 + k, i, j], rule[0, 1 + k, j, i] = -2.0, 2.0
    return rule.reshape(16, 9)


_MATRIX = _matrix_rule()


def matrix_of(q: Floats) -> Floats:
    """Return the matrices (..., 3, 3) of unit quaternions (..., 4)."""
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    entries: Floats = products @ _MATRIX
    return entries.reshape(*q.shape[:-1], 3, 3)


def turn_by(v: Floats) -> Floats:
    """Return the rotations (n, 3, 3) by |v| rad about v (n, 3)."""
    return matrix_of(np.array([turn(x, y, z) for x, y, z in v.tolist()]))


def vector_of(matrix: Floats) -> Floats:
    """Return the rotation vectors (n, 3) of rotations (n, 3, 3) by less than half a turn."""
    vectors = []
    for (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) in matrix.tolist():
        x, y, z = 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)
        sine = sqrt(x * x + y * y + z * z)
        scale = atan2(sine, 0.5 * (xx + yy + zz - 1.0)) / sine if sine > 1e-9 else 1.0
        vectors.append((scale * x, scale * y, scale * z))
    return np.array(vectors)


def orthonormal(matrix: Floats) -> Floats:
    """Return what is nearly a rotation as a rotation, to second order (one step of Newton's)."""
    nearer: Floats = 1.5 * matrix - 0.5 * (matrix @ (np.swapaxes(matrix, -1, -2) @ matrix))
    return nearer


def headings(matrix: Floats) -> Floats:
    """Return the angles (...) rad of rotations (..., 3, 3) about the vertical: the twist of swing-twist."""
    angle: Floats = np.arctan2(matrix[..., 1, 0] - matrix[..., 0, 1], matrix[..., 0, 0] + matrix[..., 1, 1])
    return angle


Quaternion = tuple[float, float, float, float]


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation p q of single quaternions as plain numbers."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def quaternion_of(matrix: Floats) -> Quaternion:
    """Return the unit quaternion of a rotation (3, 3), its largest component taken from the diagonal."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix.tolist()
    four = (1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz)
    largest = max(four)
    if four[0] == largest:
        w, x, y, z = largest, zy - yz, xz - zx, yx - xy
    elif four[1] == largest:
        w, x, y, z = zy - yz, largest, xy + yx, xz + zx
    elif four[2] == largest:
        w, x, y, z = xz - zx, xy + yx, largest, yz + zy
    else:
        w, x, y, z = yx - xy, xz + zx, yz + zy, largest
    shorter = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return shorter * w, shorter * x, shorter * y, shorter * z


def turn(x: float, y: float, z: float) -> Quaternion:
    """Return the rotation about (x, y, z) by its length, rad."""
    angle = sqrt(x * x + y * y + z * z)
    share = sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return cos(0.5 * angle), share * x, share * y, share * z
