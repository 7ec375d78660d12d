import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2002)
RANDOM = (lambda q: q / np.linalg.norm(q, axis=-1, keepdims=True))(RNG.normal(size=(200, 4)))


def same_rotation(p, q):
    """The distance of p to the nearer of q and −q."""
    return np.minimum(np.linalg.norm(p - q, axis=-1), np.linalg.norm(p + q, axis=-1))


def awkward_quaternions():
    half = awkward.ANGLES[:, None, None] / 2
    q = np.concatenate(
        np.broadcast_arrays(np.cos(half), np.sin(half) * awkward.UNIT_AXES), axis=-1
    )[..., [0, 3, 4, 5]]
    return q.reshape(-1, 4)


@pytest.mark.source("RR 1.2", "RR (3)")
def test_a_unit_quaternion_has_norm_one():
    q = np.array([[1, 0, 0, 0], [2, 0, 0, 0], [0.5, 0.5, 0.5, -0.5], [1, 1e-4, 0, 0]])
    assert np.array_equal(rb.is_unit_quaternion(q), [True, False, True, False])
    assert rb.is_unit_quaternion([1.009, 0, 0, 0], atol=0.01)
    assert not rb.is_unit_quaternion([1.011, 0, 0, 0], atol=0.01)
    assert not rb.is_unit_quaternion([[np.nan, 0, 0, 1], [np.inf, 0, 0, 0], [1e200] * 4]).any()
    with pytest.raises(ValueError, match=r"q: shape \(\.\.\., 4\) wanted, got \(3,\)"):
        rb.is_unit_quaternion([1, 0, 0])


@pytest.mark.source("RR 2.2")
def test_hamiltons_rules():
    one, i, j, k = np.eye(4)
    for unit in (i, j, k):
        assert np.array_equal(rb.quaternion_multiply(unit, unit), -one)
    for a, b, c in [(i, j, k), (j, k, i), (k, i, j)]:
        assert np.array_equal(rb.quaternion_multiply(a, b), c)
        assert np.array_equal(rb.quaternion_multiply(b, a), -c)


@pytest.mark.source("RR 2.2")
def test_multiplication_is_associative_bilinear_and_keeps_the_norm():
    p, q, r = RNG.normal(size=(3, 50, 4))
    product = rb.quaternion_multiply(p, q)
    scale = np.linalg.norm(p, axis=-1) * np.linalg.norm(q, axis=-1)
    assert np.all(np.abs(np.linalg.norm(product, axis=-1) - scale) < 4 * EPS * scale)
    left = rb.quaternion_multiply(product, r)
    right = rb.quaternion_multiply(p, rb.quaternion_multiply(q, r))
    assert np.abs(left - right).max() < 8 * EPS * (scale * np.linalg.norm(r, axis=-1)).max()
    assert np.allclose(rb.quaternion_multiply(p + r, q), product + rb.quaternion_multiply(r, q))


def test_the_conjugate_turns_back():
    identity = rb.quaternion_multiply(RANDOM, rb.quaternion_conjugate(RANDOM))
    assert np.abs(identity - [1, 0, 0, 0]).max() < 4 * EPS


@pytest.mark.source("RR 2.2")
def test_rotation_of_points_agrees_with_scipy():
    points = RNG.normal(size=(200, 3))
    want = Rotation.from_quat(RANDOM, scalar_first=True).apply(points)
    size = np.linalg.norm(points, axis=1).max()
    assert np.abs(rb.rotate_by_quaternion(RANDOM, points) - want).max() < 8 * EPS * size


@pytest.mark.source("RR 2.2")
def test_turning_by_a_product_is_turning_twice():
    p, q, x = RANDOM[:100], RANDOM[100:], RNG.normal(size=(100, 3))
    once = rb.rotate_by_quaternion(rb.quaternion_multiply(p, q), x)
    assert np.allclose(once, rb.rotate_by_quaternion(p, rb.rotate_by_quaternion(q, x)), atol=1e-14)


@pytest.mark.parametrize("q", [RANDOM, awkward_quaternions()], ids=["random", "awkward"])
def test_matrices_agree_with_scipy(q):
    want = Rotation.from_quat(q, scalar_first=True).as_matrix()
    R = rb.matrix_from_quaternion(q)
    assert np.abs(R - want).max() < 4 * EPS
    assert np.abs(rb.matrix_from_quaternion(-q) - R).max() == 0


@pytest.mark.parametrize("q", [RANDOM, awkward_quaternions()], ids=["random", "awkward"])
def test_there_and_back(q):
    back = rb.quaternion_from_matrix(rb.matrix_from_quaternion(q))
    assert same_rotation(back, q).max() < 4 * EPS
    assert np.all(back[..., 0] >= 0)


def test_half_turns_keep_their_axis_with_every_sign():
    matrices, axes = awkward.half_turns()
    q = rb.quaternion_from_matrix(matrices)
    want = np.concatenate([np.zeros((len(axes), 1)), axes], axis=1)
    assert same_rotation(q, want).max() < 2 * EPS
    assert np.all(q[:, 0] == 0)
    largest = np.argmax(np.abs(axes) > np.abs(axes).max(axis=1, keepdims=True) - 1e-9, axis=1)
    assert np.all(np.take_along_axis(q[:, 1:], largest[:, None], axis=1) > 0)


def test_rounding_chooses_no_sign_at_a_half_turn():
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(7))
    q = rb.quaternion_from_matrix(np.swapaxes(R0, -1, -2) @ R1)
    first = np.argmax(np.abs(n) > np.abs(n).max(axis=1, keepdims=True) - 1e-9, axis=1)
    assert np.all(q[:, 0] == 0)
    assert np.all(np.take_along_axis(q[:, 1:], first[:, None], axis=1) > 0)
    goals = rb.quaternion_multiply(RANDOM[0], np.insert(n, 0, 0, axis=1))
    assert np.abs(rb.slerp(RANDOM[0], goals, 1) - goals).max() < 4 * EPS


def test_any_batch_is_the_stack_of_its_members():
    q, p = RANDOM[:6].reshape(2, 3, 4), RANDOM[6:9]
    R = rb.matrix_from_quaternion(q)
    for i in np.ndindex(2, 3):
        assert np.abs(R[i] - rb.matrix_from_quaternion(q[i])).max() < 4 * EPS
        back = rb.quaternion_from_matrix(R)[i] - rb.quaternion_from_matrix(R[i])
        assert np.abs(back).max() < 4 * EPS
        single = rb.slerp(q[i], p[i[1]], 0.3)
        assert np.abs(rb.slerp(q, p, [0.3, 0.4])[0][i] - single).max() < 4 * EPS
    assert rb.slerp(q, p, np.zeros((5, 1))).shape == (5, 1, 2, 3, 4)


@pytest.mark.source("BK Remark 7")
def test_slerp_is_the_constant_speed_arc():
    """q0 (q0⁻¹ q1)ᵗ, by mpmath's logarithm of the rotation between."""
    for q0, q1 in zip(RANDOM[:20], RANDOM[20:40], strict=True):
        R0, R1 = rb.matrix_from_quaternion(np.array([q0, q1]))
        turn = oracles.log_so3(R0.T @ R1)
        for t in (0.0, 0.2, 0.5, 1.0):
            got = rb.matrix_from_quaternion(rb.slerp(q0, q1, t))
            assert np.abs(got - R0 @ oracles.exp_so3(t * turn)).max() < 20 * EPS


@pytest.mark.source("BK Remark 7")
def test_slerp_is_the_formula_of_the_paper():
    q0, q1 = RANDOM[0], RANDOM[1]
    q1 = q1 * np.sign(q0 @ q1)
    a, u = np.arccos(q0 @ q1), np.linspace(0, 1, 11)[:, None]
    printed = (np.sin((1 - u) * a) * q0 + np.sin(u * a) * q1) / np.sin(a)
    assert np.abs(rb.slerp(q0, q1, u[:, 0]) - printed).max() < 40 * EPS


def test_slerp_near_its_singular_sets():
    one = np.array([1.0, 0, 0, 0])
    assert np.array_equal(rb.slerp(one, one, [0, 0.3, 1]), [one] * 3)
    assert np.array_equal(rb.slerp(one, -one, 0.5), one)
    near = rb.slerp(one, [1, 1e-12, 0, 0], 0.25)
    assert abs(near[1] / 0.25e-12 - 1) < 4 * EPS
    for angle in (np.pi / 2 + 1e-9, np.pi / 2 + 0.05, np.pi - 1e-9):  # −q is the nearer goal
        there = np.array([np.cos(angle), np.sin(angle), 0, 0])
        assert np.abs(rb.slerp(one, there, 1) + there).max() < 4 * EPS
    half = np.sqrt(0.5)
    quarter = rb.slerp(one, [0, 0, 1, 0], 0.5)
    assert np.abs(quarter - [half, 0, half, 0]).max() < 2 * EPS
    assert np.abs(rb.slerp(one, [0, 0, -1, 0], 0.5) - [half, 0, -half, 0]).max() < 2 * EPS


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match=r"q1: shape \(\.\.\., 4\) wanted, got \(3,\)"):
        rb.slerp([1, 0, 0, 0], [1, 0, 0], 0)
    with pytest.raises(ValueError, match=r"p \(2,\), q \(3,\)"):
        rb.quaternion_multiply(RANDOM[:2], RANDOM[:3])
    with pytest.raises(ValueError, match=r"R\[0, 1\] is nan"):
        rb.quaternion_from_matrix([[1, np.nan, 0], [0, 1, 0], [0, 0, 1]])
