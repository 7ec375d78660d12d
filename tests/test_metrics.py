import re

import numpy as np
import pytest

import rbcourse as rb
from rbcourse import metrics

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2)
R = rb.sample_rotation(50, rng=1)
A = rb.pose_from_components(R, RNG.normal(size=(50, 3)))
LEFT, RIGHT = rb.sample_rotation(50, rng=2), rb.sample_rotation(50, rng=3)
MOVE = rb.pose_from_components(LEFT, RNG.normal(size=(50, 3)))
w, z = RNG.normal(size=(2, 50, 3))
S, T = RNG.normal(size=(2, 50, 6))


def assert_close(value, wanted, units=400):
    assert np.abs(value - wanted).max() <= units * EPS


@pytest.mark.source("BK (11)", "BK (13)", "BK 3.1", "BK 3.2")
@pytest.mark.parametrize(
    ("inner", "n"), [(metrics.inner_gl, 4), (metrics.inner_ga, 4), (metrics.inner_gl, 1)]
)
def test_the_trace_is_the_sum_of_products(inner, n):
    X, Y = RNG.normal(size=(2, 5, n, n))
    by_definition = [np.trace(x.T @ y) for x, y in zip(X, Y, strict=True)]
    assert np.abs(inner(X, Y) - by_definition).max() < 20 * EPS * n * n


@pytest.mark.source("BK Prop. 1", "BK 3.1")
def test_the_trace_is_invariant_under_rotations_on_both_sides_and_not_under_a_shear():
    X, Y = RNG.normal(size=(2, 50, 3, 3))
    assert_close(metrics.inner_gl(LEFT @ X @ RIGHT, LEFT @ Y @ RIGHT), metrics.inner_gl(X, Y))
    shear = np.eye(3) + np.eye(3, k=1)
    assert abs(metrics.inner_gl(shear @ X, shear @ X) - metrics.inner_gl(X, X)).max() > 0.1


@pytest.mark.source("BK (12)", "BK Remark 1", "BK 3.1", "errata 1")
def test_the_trace_induces_twice_the_identity_on_so3():
    X, Y = metrics.tangent_from_components(R, w), metrics.tangent_from_components(R, z)
    assert_close(metrics.inner_so3(X, Y), 2 * np.vecdot(w, z))
    gram = metrics.inner_gl(rb.BASIS_SO3[:, None], rb.BASIS_SO3)
    printed, corrected = np.eye(3), 2 * np.eye(3)
    assert np.array_equal(gram, corrected)
    assert not np.array_equal(gram, printed)
    assert np.array_equal(rb.METRIC_SO3, corrected)


@pytest.mark.source("BK (14)", "BK Remark 3", "BK Remark 4", "BK 3.2")
def test_the_trace_on_se3_is_invariant_on_the_left_and_on_the_right_under_rotations_only():
    X, Y = metrics.tangent_from_components(A, S), metrics.tangent_from_components(A, T)
    wanted = 2 * np.vecdot(S[:, :3], T[:, :3]) + np.vecdot(S[:, 3:], T[:, 3:])
    assert_close(metrics.inner_se3(X, Y), wanted)
    assert_close(metrics.inner_left_invariant(rb.METRIC_SE3, A, X, Y), wanted)
    gram = metrics.inner_ga(rb.BASIS_SE3[:, None], rb.BASIS_SE3)
    assert np.array_equal(gram, np.diag([2, 2, 2, 1, 1, 1]))
    assert np.array_equal(rb.METRIC_SE3, gram)
    turn = rb.pose_from_components(RIGHT, np.zeros(3))
    shift = rb.pose_from_components(np.eye(3), [1, 0, 0])
    for left, right, same in (
        (MOVE, np.eye(4), True),
        (np.eye(4), turn, True),
        (MOVE, shift, False),
    ):
        moved = metrics.inner_se3(left @ X @ right, left @ Y @ right)
        assert (
            np.abs(moved - wanted).max() < 400 * EPS if same else np.abs(moved - wanted).max() > 0.1
        )


@pytest.mark.source("BK Remark 2", "BK Remark 5")
def test_it_is_the_energy_of_a_ball():
    """Six equal masses on the axes: the moments of a ball, 2 in all directions, mass 1."""
    points = np.sqrt(3) * np.concatenate([np.eye(3), -np.eye(3)])
    X, turning = metrics.tangent_from_components(A, S), metrics.tangent_from_components(R, w)
    for velocities, inner in (
        (points @ X[:, :3, :3].mT + X[:, None, :3, 3], metrics.inner_se3(X, X)),
        (points @ turning.mT, metrics.inner_so3(turning, turning)),
    ):
        twice_the_energy = (velocities**2).sum(axis=(-2, -1)) / 6
        assert np.abs(twice_the_energy / inner - 1).max() < 100 * EPS


@pytest.mark.source("BK (4)", "BK (5)", "BK (1)", "BK 2.2")
@pytest.mark.parametrize(
    ("group", "left", "x", "basis"), [(R, LEFT, w, rb.BASIS_SO3), (A, MOVE, S, rb.BASIS_SE3)]
)
def test_a_left_invariant_field_is_its_components_times_the_moved_basis(group, left, x, basis):
    X = metrics.tangent_from_components(group, x)
    assert_close(X, np.einsum("bi,bjk,ikl->bjl", x, group, basis))
    assert_close(metrics.components_from_tangent(group, X), x)
    assert_close(metrics.tangent_from_components(left @ group, x), left @ X)
    assert_close(metrics.components_from_tangent(left @ group, left @ X), x)


@pytest.mark.source("BK (6)", "BK (7)", "BK 2.3")
@pytest.mark.parametrize(("group", "left", "x", "y"), [(R, LEFT, w, z), (A, MOVE, S, T)])
def test_a_left_invariant_metric(group, left, x, y):
    G = RNG.normal(size=(4, 1, x.shape[-1], x.shape[-1]))
    G = G @ G.mT
    X, Y = (metrics.tangent_from_components(group, components) for components in (x, y))
    value = metrics.inner_left_invariant(G, group, X, Y)
    assert_close(value, np.einsum("bi,acij,bj->ab", x, G, y))
    assert_close(metrics.inner_left_invariant(G, left @ group, left @ X, left @ Y), value, 4000)


@pytest.mark.source("BK (10)", "BK 2.6")
def test_the_indefinite_metric_is_invariant_on_both_sides():
    G = metrics.semi_riemannian_metric_se3(2, 3)
    assert np.array_equal(G, np.kron([[2, 3], [3, 0]], np.eye(3)))
    eigenvalues = np.linalg.eigvalsh(G)
    assert (eigenvalues > 0).sum() == (eigenvalues < 0).sum() == 3
    X, Y = metrics.tangent_from_components(A, S), metrics.tangent_from_components(A, T)
    value = metrics.inner_left_invariant(G, A, X, Y)
    for left, right in [(MOVE, np.eye(4)), (np.eye(4), MOVE)]:
        moved = (left @ matrices @ right for matrices in (A, X, Y))
        assert_close(metrics.inner_left_invariant(G, *moved), value, 4000)


def test_parts_beside_the_tangent_space_are_dropped():
    X = metrics.tangent_from_components(A, S)
    X[:, 3] = [1, 2, 3, 4]
    X[:, :3, :3] += A[:, :3, :3] @ np.diag([1, 2, 3])
    assert_close(metrics.components_from_tangent(A, X), S)


def test_no_metric_is_too_large_or_too_small():
    X, Y = rb.hat_so3([1e-200, 0, 0]), rb.hat_so3([1e-100, 0, 0])
    value = metrics.inner_left_invariant(1e308 * np.eye(3), np.eye(3), X, Y)
    assert value == pytest.approx(1e8, rel=1e-12)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        ("inner_gl", (np.eye(2), np.eye(3)), "X and Y: matrices of one size wanted"),
        ("inner_ga", ([[1]], [[1]]), "X: shape (..., n+1, n+1) wanted"),
        ("tangent_from_components", (np.eye(2), [1]), "A: shape (..., 3, 3) or (..., 4, 4) wanted"),
        ("tangent_from_components", (np.eye(3), np.ones(6)), "x: shape (..., 3)"),
        ("tangent_from_components", (R[:2], w[:3]), "broadcast: A (2,), x (3,)"),
        ("components_from_tangent", (np.eye(4), np.eye(3)), "X: shape (..., 4, 4)"),
        ("components_from_tangent", (R[:2], R[:3]), "broadcast: A (2,), X (3,)"),
        ("inner_left_invariant", (np.eye(6), *[np.eye(3)] * 3), "G: shape (..., 3, 3)"),
        ("inner_left_invariant", (np.eye(3, k=1), *[np.eye(3)] * 3), "G is not symmetric"),
        ("inner_left_invariant", (np.eye(3), R[0], np.eye(3), np.eye(4)), "Y: shape (..., 3, 3)"),
        ("inner_left_invariant", (np.eye(3), R[0], R[0], R[0] * np.nan), "Y[0, 0] is nan"),
        (
            "inner_left_invariant",
            (np.ones((4, 1, 1)) * np.eye(3), R[0], R[:2], R[:2]),
            "broadcast: G (4,), A (), X (2,), Y (2,)",
        ),
        ("semi_riemannian_metric_se3", (0, 1), "alpha: a positive number wanted, got 0"),
        ("semi_riemannian_metric_se3", (1, [1]), "beta: a positive number wanted, got [1"),
    ],
)
def test_bad_arguments_are_named(function, arguments, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        getattr(metrics, function)(*arguments)


def test_the_metrics_cannot_be_changed_by_accident():
    for metric in (rb.METRIC_SO3, rb.METRIC_SE3):
        with pytest.raises(ValueError, match="read-only"):
            metric[0, 0] = 1
