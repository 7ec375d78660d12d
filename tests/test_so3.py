import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
VECTORS = awkward.ROTATION_VECTORS
RANDOM = np.random.default_rng(3).normal(size=(100, 3))


@pytest.mark.source("BK 2.1")
def test_hat_is_the_cross_product():
    w, x = RANDOM[:50], RANDOM[50:]
    assert np.array_equal(np.einsum("nij,nj->ni", rb.hat_so3(w), x), np.cross(w, x))
    assert np.array_equal(rb.vee_so3(rb.hat_so3(w)), w)
    symmetric = np.array([[2, 4, -8], [4, 1, 16], [-8, 16, 0]])
    assert np.abs(rb.vee_so3(rb.hat_so3(w) + symmetric) - w).max() < 16 * EPS


@pytest.mark.source("BK (2)", "errata 12")
def test_the_basis_is_the_hats_of_the_axes():
    assert np.array_equal(rb.BASIS_SO3, rb.hat_so3(np.eye(3)))
    assert np.array_equal(np.einsum("i,ijk", [1, 2, 3], rb.BASIS_SO3), rb.hat_so3([1, 2, 3]))
    with pytest.raises(ValueError, match="read-only"):
        rb.BASIS_SO3[0] = 0


@pytest.mark.source("BK 2.1", "BK (2)", "errata 12")
def test_what_is_printed_without_hats_is_no_basis_of_so3():
    """L_i⁰ = e_i, as printed, are vectors; and ω̂, printed as of se(3), is no 4 × 4 matrix."""
    printed, corrected = np.eye(3), rb.BASIS_SO3
    assert printed[0].shape != corrected[0].shape
    assert np.array_equal(corrected, -np.swapaxes(corrected, -1, -2))  # of so(3)
    w = np.array([1.0, 2, 3])
    assert np.array_equal(np.tensordot(w, corrected, 1) @ [4, 5, 6], np.cross(w, [4, 5, 6]))
    with pytest.raises(ValueError, match="4, 4"):
        rb.vee_se3(rb.hat_so3(w))


@pytest.mark.source("BK 2.5")
def test_exp_is_the_rotation_by_its_length():
    R = rb.exp_so3(VECTORS)
    exact = np.array([oracles.exp_so3(w) for w in VECTORS])
    assert np.abs(R - exact).max() < 4 * EPS
    assert np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() < 8 * EPS


@pytest.mark.source("BK 2.5")
def test_exp_of_long_vectors_loses_what_their_length_loses():
    for length in (6.3, 1e3, 1e8):
        w = length * awkward.UNIT_AXES[3]
        assert np.abs(rb.exp_so3(w) - oracles.exp_so3(w)).max() < 4 * EPS * length


@pytest.mark.parametrize("length", [1e16, 1e154, 1e160, 1.7e308])
def test_of_huge_vectors_exp_is_a_rotation_and_the_jacobian_a_projection(length):
    """About the axis: (1 − cos a)/a and (sin a)/a vanish, and n̂² + I is n nᵀ."""
    n = awkward.UNIT_AXES[3]
    R = rb.exp_so3(length * n)
    assert np.abs(R @ R.T - np.eye(3)).max() < 8 * EPS
    assert np.abs(R @ n - n).max() < 8 * EPS
    assert np.abs(rb.right_jacobian_so3(length * n) - np.outer(n, n)).max() < 8 * EPS + 2 / length
    inverse = rb.right_jacobian_inverse_so3(length / 1e3 * n)
    assert np.abs(inverse @ n - n).max() < 8 * EPS * length
    assert np.abs(np.linalg.norm(rb.quaternion_from_rotation_vector(length * n)) - 1) < 8 * EPS


@pytest.mark.parametrize(
    "function",
    [
        rb.exp_so3,
        rb.right_jacobian_so3,
        rb.right_jacobian_inverse_so3,
        rb.exp_se3,
        rb.quaternion_from_rotation_vector,
    ],
)
def test_a_norm_that_overflows_is_named(function):
    w = np.zeros((2, 6 if function is rb.exp_se3 else 3))
    w[1, :3] = 1.7e308
    with pytest.raises(ValueError, match=r"^norm of w\[1\] is inf"):
        function(w)


def test_exp_of_nothing_is_exact():
    assert np.array_equal(rb.exp_so3([0, 0, 0]), np.eye(3))
    assert np.array_equal(rb.exp_so3([1e-300, 0, 0])[2, 1], 1e-300)


@pytest.mark.source("BK 2.5", "errata 14")
def test_the_printed_exponential_at_R_has_its_vector_beside_the_exponent():
    R, w = oracles.exp_so3([0.5, -1, 2]), np.array([0.4, 0.1, -0.3])
    V = R @ rb.hat_so3(w)
    holds = R @ oracles.expm(R.T @ V)
    assert np.abs(holds - R @ rb.exp_so3(w)).max() < 8 * EPS
    printed = R @ oracles.expm(R.T) @ V
    assert np.abs(printed.T @ printed - np.eye(3)).max() > 0.1


@pytest.mark.source("BK 2.5")
def test_log_is_right_to_a_few_eps_at_every_awkward_rotation():
    for R in rb.exp_so3(VECTORS):
        assert np.abs(rb.log_so3(R) - oracles.log_so3(R)).max() < 4 * EPS


def test_log_undoes_exp():
    assert np.abs(rb.log_so3(rb.exp_so3(VECTORS)) - VECTORS).max() < 8 * EPS
    tiny = VECTORS[(VECTORS != 0).any(axis=1) & (np.abs(VECTORS).max(axis=1) < 1e-6)]
    back = rb.log_so3(rb.exp_so3(tiny))
    assert np.all(np.abs(back - tiny) <= 4 * EPS * np.abs(tiny).max(axis=1, keepdims=True))


def test_log_of_half_turns_has_the_named_sign():
    matrices, axes = awkward.half_turns()
    w = rb.log_so3(matrices)
    for got, axis in zip(w, axes, strict=True):
        largest = np.flatnonzero(np.abs(axis) > np.abs(axis).max() - 1e-9)[0]
        assert np.abs(got - np.pi * axis * np.sign(axis[largest])).max() < 8 * EPS


@pytest.mark.source("BK 2.5")
def test_the_jacobian_is_the_integral_it_stands_for():
    vectors = VECTORS[np.linalg.norm(VECTORS, axis=1) > 1e-13][::23]
    for w in [*vectors, [4, -3, 2]]:
        J = rb.right_jacobian_so3(w)
        assert np.abs(J - oracles.right_jacobian_so3(w)).max() < 8 * EPS * (1 + np.linalg.norm(w))


@pytest.mark.source("BK 2.5", "BK (1)")
def test_the_jacobian_turns_rates_into_angular_velocity():
    def curve(t):
        return rb.exp_so3(np.sin(t) * RANDOM[0] + t**2 * RANDOM[1])

    t = 0.4
    w, rate = np.sin(t) * RANDOM[0] + t**2 * RANDOM[1], np.cos(t) * RANDOM[0] + 2 * t * RANDOM[1]
    velocity = rb.vee_so3(curve(t).T @ oracles.derivative_by_differences(curve, t))
    assert np.abs(rb.right_jacobian_so3(w) @ rate - velocity).max() < 1e-11
    assert np.abs(rb.right_jacobian_inverse_so3(w) @ velocity - rate).max() < 1e-11


def test_the_inverse_jacobian_inverts():
    w = np.concatenate([VECTORS, RANDOM])
    product = rb.right_jacobian_inverse_so3(w) @ rb.right_jacobian_so3(w)
    assert np.abs(product - np.eye(3)).max() < 40 * EPS
    assert np.array_equal(rb.right_jacobian_inverse_so3([0, 0, 0]), np.eye(3))


def test_near_a_full_turn_the_inverse_jacobian_is_huge():
    assert np.abs(rb.right_jacobian_inverse_so3([0, 0, 2 * np.pi])).max() > 1e15


@pytest.mark.parametrize(
    "function",
    [rb.hat_so3, rb.exp_so3, rb.right_jacobian_so3, rb.right_jacobian_inverse_so3],
)
def test_functions_of_vectors(function):
    w = RANDOM[:6].reshape(2, 3, 3)
    for i in np.ndindex(2, 3):
        assert np.abs(function(w)[i] - function(w[i])).max() < 8 * EPS
    with pytest.raises(ValueError, match=r"w: shape \(\.\.\., 3\) wanted, got \(2,\)"):
        function([1, 2])
    with pytest.raises(ValueError, match=r"w\[1, 2\] is inf"):
        function([[0, 0, 0], [0, 0, np.inf]])
    with pytest.raises(ValueError, match="w: an array of numbers wanted"):
        function([[0, 0, 0], [0, 0]])


@pytest.mark.parametrize(("function", "name"), [(rb.vee_so3, "W"), (rb.log_so3, "R")])
def test_functions_of_matrices(function, name):
    R = rb.exp_so3(RANDOM[:6]).reshape(2, 3, 3, 3)
    for i in np.ndindex(2, 3):
        assert np.abs(function(R)[i] - function(R[i])).max() < 8 * EPS
    with pytest.raises(ValueError, match=rf"{name}: shape \(\.\.\., 3, 3\) wanted, got \(3,\)"):
        function([1, 2, 3])
    with pytest.raises(ValueError, match=rf"{name}\[0, 0\] is nan"):
        function(np.full((3, 3), np.nan))


@pytest.mark.source("BK 6.1")
def test_the_angle_between_rotations_is_that_of_the_turn_from_one_to_the_other():
    """Moved from the left or the right it is the same; it is a distance."""
    R, S, T = Rotation.random(60, rng=5).as_matrix().reshape(3, 20, 3, 3)
    want = (Rotation.from_matrix(R).inv() * Rotation.from_matrix(S)).magnitude()
    assert np.abs(rb.angle_between(R, S) - want).max() < 16 * EPS
    for moved in (rb.angle_between(T @ R, T @ S), rb.angle_between(R @ T, S @ T)):
        assert np.abs(moved - want).max() < 32 * EPS
    assert rb.angle_between(R[0], S).shape == (20,)
    assert rb.angle_between(np.eye(3), np.diag([1.0, -1, -1])) == np.pi
    assert np.all(rb.angle_between(R, T) <= want + rb.angle_between(S, T) + 8 * EPS)
    with pytest.raises(ValueError, match="batch shapes do not broadcast: R"):
        rb.angle_between(R, S[:7])
