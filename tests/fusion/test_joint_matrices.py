"""The small rotations of the joint's estimators, against the general ones."""

import numpy as np
import pytest

from brachium_body import rotation
from brachium_fusion.joint_matrices import (
    headings,
    matrix_of,
    orthonormal,
    product,
    quaternion_of,
    turn,
    turn_by,
    vector_of,
)


@pytest.fixture(scope="module")
def some():
    """Return unit quaternions (200, 4) and vectors (200, 3), vectors of less than half a turn."""
    random = np.random.default_rng(0)
    q = np.vstack([np.eye(4), random.normal(size=(196, 4))])
    v = random.normal(size=(200, 3))
    return rotation.normalize(q), v * (
        random.uniform(0.0, 3.1, (200, 1)) / np.linalg.norm(v, axis=1, keepdims=True)
    )


def test_matrices_and_quaternions_are_the_same_rotations(some):
    q, _ = some
    np.testing.assert_allclose(matrix_of(q), rotation.to_matrix(q), atol=1e-14)
    back = np.array([quaternion_of(matrix) for matrix in matrix_of(q)])
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", back, q)), 1.0, atol=1e-14)


def test_turns_and_vectors_are_each_other_s_inverse(some):
    _, v = some
    for size in (1.0, 1e-4, 1e-10, 0.0):
        np.testing.assert_allclose(vector_of(turn_by(size * v)), size * v, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(
        np.array([turn(*one) for one in v.tolist()]), rotation.from_rotation_vector(v), atol=1e-14
    )


def test_products_and_headings(some):
    q, _ = some
    pairs = [product(tuple(a), tuple(b)) for a, b in zip(q.tolist(), q[::-1].tolist(), strict=True)]
    np.testing.assert_allclose(np.array(pairs), rotation.multiply(q, q[::-1]), atol=1e-14)
    np.testing.assert_allclose(
        np.exp(1j * headings(matrix_of(q[4:]))), np.exp(1j * rotation.heading(q[4:])), atol=1e-9
    )


def test_what_is_nearly_a_rotation_becomes_one(some):
    q, _ = some
    matrix = orthonormal((1.0 + 1e-6) * matrix_of(q))
    np.testing.assert_allclose(
        matrix @ matrix.swapaxes(1, 2), np.broadcast_to(np.eye(3), matrix.shape), atol=1e-11
    )
