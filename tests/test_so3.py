import tracemalloc

import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
VECTORS = awkward.ROTATION_VECTORS
RANDOM = np.random.default_rng(3).normal(size=(100, 3))
REST = np.zeros(3)


@pytest.mark.source("BK 2.1", "BK (2)")
def test_hat_is_the_cross_product():
    w, x = RANDOM[:50], RANDOM[50:]
    assert np.array_equal(np.einsum("nij,nj->ni", rb.hat_so3(w), x), np.cross(w, x))
    assert np.array_equal(rb.vee_so3(rb.hat_so3(w)), w)
    symmetric = np.array([[2, 4, -8], [4, 1, 16], [-8, 16, 0]])
    assert np.abs(rb.vee_so3(rb.hat_so3(w) + symmetric) - w).max() < 16 * EPS


@pytest.mark.source("BK (2)", "errata 12")
def test_components_in_the_basis_of_so3_are_the_angular_velocity_only_with_all_hats():
    """The printed e₂ and e₃ are vectors. Added to a matrix, a vector may mean rows, columns or a
    diagonal."""
    w, e = np.array([0.3, -1.2, 0.8]), np.eye(3)
    assert np.array_equal(np.tensordot(w, rb.connection.BASIS_SO3, 1), rb.hat_so3(w))
    for reading in (lambda v: v[None], lambda v: v[:, None], np.diag):
        printed = w[0] * rb.hat_so3(e[0]) + w[1] * reading(e[1]) + w[2] * reading(e[2])
        assert np.abs(printed - rb.hat_so3(w)).max() > 0.5


@pytest.mark.source("BK 2.1", "errata 24")
def test_the_basis_of_so3_spans_no_twist_with_a_linear_velocity():
    """The printed ω̂ in se(3) has components in a basis of se(3), not of so(3)."""
    S = np.array([0.3, -1.2, 0.8, 2, 0, -1.5])
    turns = rb.connection.BASIS_SE3[:3].reshape(3, 16).T
    for twist, rest in ((S, np.linalg.norm(S[3:])), (np.append(S[:3], REST), 0)):
        matrix = rb.hat_se3(twist).ravel()
        found, *_ = np.linalg.lstsq(turns, matrix)
        assert np.abs(found - S[:3]).max() < 8 * EPS
        assert abs(np.linalg.norm(turns @ found - matrix) - rest) < 8 * EPS


@pytest.mark.source("BK 2.5", "errata 29")
def test_only_half_turns_have_the_trace_minus_one_and_two_rotation_vectors():
    """The paper prints that angles *up to* π are excluded."""
    axes = awkward.UNIT_AXES[::5]
    for angle in (0.5, 2.0, 3.0, np.pi - 1e-3):
        R = rb.exp_so3(angle * axes)
        assert np.all(np.trace(R, axis1=1, axis2=2) > -1 + 1e-7)
        assert np.abs(rb.log_so3(R) - angle * axes).max() < 16 * EPS
        assert np.abs(R - rb.exp_so3(-angle * axes)).max(axis=(1, 2)).min() > 1e-3
    half = rb.exp_so3(np.pi * axes)
    assert np.abs(np.trace(half, axis1=1, axis2=2) + 1).max() < 8 * EPS
    assert np.abs(half - rb.exp_so3(-np.pi * axes)).max() < 8 * EPS


@pytest.mark.source("BK 2.5")
def test_exp_and_log_agree_with_mpmath():
    R, size = rb.exp_so3(VECTORS), np.abs(VECTORS).max(axis=1, keepdims=True)
    assert np.abs(R[::3] - [oracles.exp_so3(w) for w in VECTORS[::3]]).max() < 4 * EPS
    assert np.abs(R.mT @ R - np.eye(3)).max() < 8 * EPS
    assert np.array_equal(rb.exp_so3([0, 0, 0]), np.eye(3))
    assert np.array_equal(rb.exp_so3([1e-300, 0, 0])[2, 1], 1e-300)
    for length in (6.3, 1e3, 1e8):
        w = length * awkward.UNIT_AXES[3]
        assert np.abs(rb.exp_so3(w) - oracles.exp_so3(w)).max() < 4 * EPS * length
    w = rb.log_so3(R)
    assert np.abs(w[::5] - [oracles.log_so3(one) for one in R[::5]]).max() < 4 * EPS
    off = np.abs(w - VECTORS)
    assert off.max() < 8 * EPS
    assert np.all((off <= 4 * EPS * size) | (size >= 1e-6))


def test_each_entry_of_a_small_rotation_is_accurate():
    """The squares of small angles are below the rounding error of 1 − cos a."""
    for a in (1e-3, 1e-5, 1e-8):
        w = a * np.array([0.6, 0, 0.8])
        R, right = rb.exp_so3(w), oracles.exp_so3(w)
        assert abs(R[0, 2] / right[0, 2] - 1) < 8 * EPS  # (1 − cos a) n₀ n₂


def test_exp_of_huge_vectors_is_a_rotation_until_their_norm_overflows():
    """For huge angles a, (1 − cos a)/a and (sin a)/a vanish in the Jacobian, and n̂² + I is n
    nᵀ."""
    n = awkward.UNIT_AXES[3]
    for length in (1e16, 1e154, 1e160, 1.7e308):
        R, J = rb.exp_so3(length * n), rb.right_jacobian_so3(length * n)
        assert np.abs(R @ R.T - np.eye(3)).max() < 8 * EPS
        assert np.abs(R @ n - n).max() < 8 * EPS
        assert np.abs(J - np.outer(n, n)).max() < 8 * EPS + 2 / length
        inverse = rb.right_jacobian_inverse_so3(length / 1e3 * n)
        assert np.abs(inverse @ n - n).max() < 8 * EPS * length
        q = rb.quaternion.quaternion_from_rotation_vector(length * n)
        assert np.abs(np.linalg.norm(q) - 1) < 8 * EPS
    functions = rb.exp_so3, rb.right_jacobian_so3, rb.right_jacobian_inverse_so3, rb.exp_se3
    for function in (*functions, rb.quaternion.quaternion_from_rotation_vector):
        w = np.outer([0, 1.7e308], np.ones(6 if function is rb.exp_se3 else 3))
        with pytest.raises(ValueError, match=r"^norm of w\[1\] is inf"):
            function(w)


@pytest.mark.parametrize(
    ("function", "size"),
    [(rb.exp_so3, 3), (rb.exp_se3, 6), (rb.quaternion.matrix_from_quaternion, 4)],
)
def test_a_large_stack_equals_its_parts_and_needs_memory_for_one_array_of_results(function, size):
    x = np.random.default_rng(5).normal(size=(2, 50_000, size))
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    tracemalloc.start()
    found = function(x)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * (x.nbytes + found.nbytes)
    assert np.abs(found[1, -9:] - function(x[1, -9:])).max() < 4 * EPS


@pytest.mark.source("BK 2.5", "errata 14")
def test_the_printed_exponential_at_R_lacks_the_vector_in_the_exponent():
    R, w = oracles.exp_so3([0.5, -1, 2]), np.array([0.4, 0.1, -0.3])
    V = R @ rb.hat_so3(w)
    assert np.abs(R @ oracles.expm(R.T @ V) - R @ rb.exp_so3(w)).max() < 8 * EPS
    printed = R @ oracles.expm(R.T) @ V
    assert np.abs(printed.T @ printed - np.eye(3)).max() > 0.1


@pytest.mark.source("BK 2.5", "BK (1)")
def test_the_jacobian_equals_its_integral():
    """The inverse is huge near a full turn."""
    vectors = VECTORS[np.linalg.norm(VECTORS, axis=1) > 1e-13][::23]
    for w in [*vectors, [4, -3, 2]]:
        J = rb.right_jacobian_so3(w)
        assert np.abs(J - oracles.right_jacobian_so3(w)).max() < 8 * EPS * (1 + np.linalg.norm(w))

    w, rate = RANDOM[:2]
    R_rate = oracles.derivative_by_differences(lambda t: rb.exp_so3(w + t * rate), 0.0)
    velocity = rb.vee_so3(rb.exp_so3(w).T @ R_rate)
    assert np.abs(rb.right_jacobian_so3(w) @ rate - velocity).max() < 1e-11
    w = np.concatenate([VECTORS, RANDOM])
    product = rb.right_jacobian_inverse_so3(w) @ rb.right_jacobian_so3(w)
    assert np.abs(product - np.eye(3)).max() < 40 * EPS
    assert np.array_equal(rb.right_jacobian_inverse_so3([0, 0, 0]), np.eye(3))
    assert np.abs(rb.right_jacobian_inverse_so3([0, 0, 2 * np.pi])).max() > 1e15


@pytest.mark.source("BK 6.1")
def test_the_angle_between_rotations_agrees_with_scipy():
    R, S = Rotation.random(40, 5).as_matrix().reshape(2, 20, 3, 3)
    want = (Rotation.from_matrix(R).inv() * Rotation.from_matrix(S)).magnitude()
    assert np.abs(rb.angle_between(R, S) - want).max() < 16 * EPS
    assert rb.angle_between(np.eye(3), np.diag([1.0, -1, -1])) == np.pi
