import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracker.geometry import rigid

coordinates = st.floats(-10, 10, allow_nan=False)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 1e-3).map(lambda v: v / np.linalg.norm(v))
# Angles everywhere, and where formulas lose digits: near nothing and near half a turn.
angles = st.one_of(
    st.floats(0, np.pi), st.floats(0, 1e-3), st.floats(1e-12, 1e-7), st.floats(0, 1e-6).map(lambda x: np.pi - x)
)
rotvecs = st.tuples(directions, angles).map(lambda da: da[0] * da[1])
transforms = st.tuples(rotvecs, vectors).map(lambda rt: rigid.transform(rigid.so3_exp(rt[0]), rt[1]))


def close(a, b, atol=1e-12):
    np.testing.assert_allclose(a, b, atol=atol, rtol=0)


@given(vectors, vectors)
def test_skew_is_the_cross_product(v, u):
    close(rigid.skew(v) @ u, np.cross(v, u))


@given(rotvecs)
def test_exp_is_a_rotation_and_the_right_one(rotvec):
    R = rigid.so3_exp(rotvec)
    close(R @ R.T, np.eye(3))
    assert np.linalg.det(R) == pytest.approx(1)
    close(R, Rotation.from_rotvec(rotvec).as_matrix())


@given(rotvecs)
def test_exp_undoes_log(rotvec):
    R = rigid.so3_exp(rotvec)
    log = rigid.so3_log(R)
    assert np.linalg.norm(log) <= np.pi + 1e-12
    close(rigid.so3_exp(log), R)


@given(st.tuples(directions, st.floats(0, np.pi - 1e-5)).map(lambda da: da[0] * da[1]))
def test_log_undoes_exp_short_of_half_a_turn(rotvec):
    close(rigid.so3_log(rigid.so3_exp(rotvec)), rotvec, atol=1e-10)
    close(rigid.quaternion_log(rigid.quaternion_exp(rotvec)), rotvec, atol=1e-10)


@given(directions, st.floats(-3, 3), st.floats(-3, 3))
def test_turns_about_one_axis_add(axis, a, b):
    close(rigid.so3_exp(axis * a) @ rigid.so3_exp(axis * b), rigid.so3_exp(axis * (a + b)))


@pytest.mark.slow
@given(rotvecs)
def test_quaternions_and_matrices_agree(rotvec):
    q, R = rigid.quaternion_exp(rotvec), rigid.so3_exp(rotvec)
    assert np.linalg.norm(q) == pytest.approx(1)
    close(rigid.matrix_from_quaternion(q), R)
    close(rigid.matrix_from_quaternion(3.0 * q), R)  # normalized first
    back = rigid.quaternion_from_matrix(R)
    assert back[0] >= 0
    close(rigid.matrix_from_quaternion(back), R)


@pytest.mark.slow
@given(rotvecs, rotvecs, rotvecs)
def test_quaternion_product(a, b, c):
    qa, qb, qc = (rigid.quaternion_exp(v) for v in (a, b, c))
    close(rigid.matrix_from_quaternion(rigid.quaternion_multiply(qa, qb)), rigid.so3_exp(a) @ rigid.so3_exp(b))
    close(
        rigid.quaternion_multiply(rigid.quaternion_multiply(qa, qb), qc),
        rigid.quaternion_multiply(qa, rigid.quaternion_multiply(qb, qc)),
    )


@pytest.mark.slow
@given(transforms, transforms, transforms)
def test_group_laws(a, b, c):
    close((a @ b) @ c, a @ (b @ c), atol=1e-10)
    close(rigid.inverse(a) @ a, np.eye(4), atol=1e-11)
    close(a @ rigid.inverse(a), np.eye(4), atol=1e-11)
    close(rigid.inverse(a @ b), rigid.inverse(b) @ rigid.inverse(a), atol=1e-10)


@pytest.mark.slow
@given(transforms, transforms, vectors)
def test_apply_composes(T_a_b, T_b_c, point_c):
    close(rigid.apply(T_a_b @ T_b_c, point_c), rigid.apply(T_a_b, rigid.apply(T_b_c, point_c)), atol=1e-10)


def test_quarter_turn_by_hand():
    T = rigid.transform(rigid.so3_exp(np.array([0.0, 0.0, np.pi / 2])), np.array([1.0, 2.0, 3.0]))
    close(rigid.apply(T, np.array([[1.0, 0.0, 0.0]])), [[1.0, 3.0, 3.0]])


def test_batches_are_the_single_ones():
    rotvecs_batch = np.random.default_rng(0).normal(size=(2, 5, 3))
    rotvecs_batch[0, 0] = 0
    R = rigid.so3_exp(rotvecs_batch)
    assert R.shape == (2, 5, 3, 3)
    for i in np.ndindex(2, 5):
        close(R[i], rigid.so3_exp(rotvecs_batch[i]))
    for function in (rigid.so3_log, rigid.quaternion_from_matrix):
        for i in np.ndindex(2, 5):
            close(function(R)[i], function(R[i]))
    Ts = np.stack([rigid.transform(r, v) for r, v in zip(R[0], rotvecs_batch[1], strict=True)])
    close(rigid.inverse(Ts) @ Ts, np.broadcast_to(np.eye(4), (5, 4, 4)))


def test_small_angles_keep_their_digits():
    # The first-order term alone is exact to 1e-18 here; a naive (1 - cos)/x^2 would be off by far more.
    v = np.array([3e-9, -4e-9, 0.0])
    close(rigid.so3_exp(v) - np.eye(3), rigid.skew(v), atol=1e-16)
    np.testing.assert_allclose(rigid.so3_log(rigid.so3_exp(v)), v, rtol=1e-7)
