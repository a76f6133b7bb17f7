import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from brachium_body import rotation

number = st.floats(-1.0, 1.0, width=32)


@st.composite
def quaternions(draw):
    q = np.array(draw(st.tuples(number, number, number, number)))
    assume(np.linalg.norm(q) > 1e-2)
    return q / np.linalg.norm(q)


vectors = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)
angles = st.floats(-20.0, 20.0)


def judge(q):
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def same_rotation(p, q):
    return (judge(p).inv() * judge(q)).magnitude()


@given(quaternions(), quaternions())
def test_multiply_is_composition(p, q):
    assert same_rotation(rotation.multiply(p, q), np.roll((judge(p) * judge(q)).as_quat(), 1)) < 1e-12


@given(quaternions())
def test_inverse_undoes(q):
    assert np.allclose(rotation.multiply(q, rotation.inverse(q)), rotation.IDENTITY, atol=1e-14)


@given(quaternions(), vectors)
def test_rotate_and_to_matrix_agree_with_scipy(q, v):
    assert np.allclose(rotation.rotate(q, v), judge(q).apply(v), atol=1e-12)
    assert np.allclose(rotation.to_matrix(q), judge(q).as_matrix(), atol=1e-13)


@given(vectors, vectors)
def test_a_cross_matrix_times_a_vector_is_their_cross_product(v, x):
    assert np.array_equal(rotation.cross_matrix(v) + rotation.cross_matrix(v).T, np.zeros((3, 3)))
    assert np.allclose(rotation.cross_matrix([v, x]) @ x, np.cross([v, x], x), atol=1e-12)


@given(quaternions())
def test_from_matrix_is_the_inverse_of_to_matrix(q):
    back = rotation.from_matrix(judge(q).as_matrix())
    assert same_rotation(back, q) < 1e-8
    assert back[0] >= 0.0
    assert abs(np.linalg.norm(back) - 1.0) < 1e-12


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("angle", [np.pi, -np.pi, np.pi - 1e-9, 0.0, 1e-9])
def test_from_matrix_at_half_turns_and_at_rest(axis, angle):
    q = rotation.about(axis, angle)
    assert (
        np.abs(rotation.to_matrix(rotation.from_matrix(rotation.to_matrix(q))) - rotation.to_matrix(q)).max()
        < 1e-14
    )


@given(vectors)
def test_rotation_vectors_go_there_and_back(v):
    assume(np.linalg.norm(v) < np.pi - 1e-6)
    q = rotation.from_rotation_vector(v)
    assert same_rotation(q, np.roll(Rotation.from_rotvec(v).as_quat(), 1)) < 1e-12
    assert np.allclose(rotation.to_rotation_vector(q), v, atol=1e-9)
    assert np.allclose(rotation.to_rotation_vector(-q), v, atol=1e-9)


@given(st.floats(0.0, 1e-6))
def test_small_rotation_vectors_keep_their_digits(size):
    v = np.array([0.0, size, 0.0])
    assert rotation.to_rotation_vector(rotation.from_rotation_vector(v))[1] == pytest.approx(
        size, rel=1e-9, abs=1e-30
    )


@given(quaternions(), quaternions())
def test_angle_between_is_scipys_magnitude(p, q):
    assert rotation.angle_between(p, q) == pytest.approx((judge(p).inv() * judge(q)).magnitude(), abs=1e-7)


@given(st.sampled_from([0, 1, 2]), angles)
def test_about_turns_about_one_axis(axis, angle):
    assert np.allclose(
        rotation.to_matrix(rotation.about(axis, angle)), Rotation.from_euler("xyz"[axis], angle).as_matrix()
    )


@given(quaternions(), quaternions(), st.floats(0.0, 1.0))
def test_slerp_is_scipys(p, q, fraction):
    assume((judge(p).inv() * judge(q)).magnitude() < np.pi - 1e-3)
    expected = Slerp([0.0, 1.0], Rotation.concatenate([judge(p), judge(q)]))(fraction)
    assert (judge(rotation.slerp(p, q, fraction)).inv() * expected).magnitude() < 1e-7


@given(quaternions(), st.integers(0, 2**32 - 1))
def test_mean_is_scipys_whatever_the_signs(q, seed):
    rng = np.random.default_rng(seed)
    many = rotation.multiply(q, rotation.from_rotation_vector(rng.normal(0.0, 0.3, (20, 3))))
    many = many * rng.choice([-1.0, 1.0], (20, 1))
    assert (judge(rotation.mean(many)).inv() * judge(many).mean()).magnitude() < 1e-6


@given(angles, st.floats(-np.pi, np.pi), st.floats(0.0, 3.0))
def test_heading_is_what_is_left_without_the_tilt(yaw, direction, tilt):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    q = rotation.multiply(rotation.about(2, yaw), rotation.from_rotation_vector(tilt * axis))
    assert abs(rotation.wrap(rotation.heading(q) - yaw)) < 1e-9


@given(st.floats(-1e4, 1e4))
def test_wrap_changes_by_whole_turns_only(angle):
    wrapped = float(rotation.wrap(angle))
    assert -np.pi <= wrapped < np.pi
    turns = (angle - wrapped) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


@given(quaternions())
def test_mirror_is_s_r_s(q):
    s = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(rotation.to_matrix(rotation.mirror(q)), s @ rotation.to_matrix(q) @ s, atol=1e-13)


def test_normalize_gives_unit_length_in_stacks():
    q = np.random.default_rng(0).normal(size=(4, 5, 4)) * 7.0
    assert np.allclose(np.linalg.norm(rotation.normalize(q), axis=-1), 1.0)
    assert np.allclose(rotation.normalize(q)[2, 3], q[2, 3] / np.linalg.norm(q[2, 3]))


def test_one_equals_many():
    rng = np.random.default_rng(1)
    p, q = rotation.normalize(rng.normal(size=(2, 30, 4)))
    v = rng.normal(size=(30, 3))
    for function, first, second in (
        (rotation.multiply, p, q),
        (rotation.rotate, p, v),
        (rotation.angle_between, p, q),
        (lambda a, b: rotation.slerp(a, b, np.full(np.shape(a)[:-1], 0.3)), p, q),
        (lambda a, _: rotation.to_rotation_vector(a), p, q),
        (lambda a, _: rotation.from_matrix(rotation.to_matrix(a)), p, q),
        (lambda a, _: rotation.heading(a), p, q),
    ):
        many = function(first, second)
        assert np.allclose(many, [function(a, b) for a, b in zip(first, second, strict=True)], atol=1e-15)
