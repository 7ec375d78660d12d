import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse import metrics

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2)
R, LEFT, RIGHT = rb.sample_rotation((3, 50), rng=1)
d, e, w, z = RNG.normal(size=(4, 50, 3))
A, MOVE = rb.pose_from_components(R, d), rb.pose_from_components(LEFT, e)
S, T = RNG.normal(size=(2, 50, 6))
ON_SO3, ON_SE3 = (R, LEFT, w, z, rb.connection.BASIS_SO3), (A, MOVE, S, T, rb.connection.BASIS_SE3)


def assert_close(value, wanted, units=400):
    assert np.abs(value - wanted).max() <= units * EPS


@pytest.mark.source("BK (11)", "BK (13)", "BK Prop. 1", "BK 3.1", "BK 3.2")
def test_the_trace_metric_is_invariant_under_rotations_only():
    for inner, n in ((metrics.inner_gl, 4), (metrics.inner_ga, 4), (metrics.inner_gl, 1)):
        X, Y = RNG.normal(size=(2, 5, n, n))
        by_definition = [np.trace(x.T @ y) for x, y in zip(X, Y, strict=True)]
        assert np.abs(inner(X, Y) - by_definition).max() < 20 * EPS * n * n
    X, Y = RNG.normal(size=(2, 50, 3, 3))
    assert_close(metrics.inner_gl(LEFT @ X @ RIGHT, LEFT @ Y @ RIGHT), metrics.inner_gl(X, Y))
    shear = np.eye(3) + np.eye(3, k=1)
    assert abs(metrics.inner_gl(shear @ X, shear @ X) - metrics.inner_gl(X, X)).max() > 0.1


@pytest.mark.source("BK 3.1", "errata 30")
def test_the_tangent_space_of_the_matrices_is_a_vector_space_and_GL3_is_none():
    """The sum of two velocities is a velocity; the sum of two invertible matrices need not be
    invertible. The metric (11) is defined for singular velocities, too."""
    X = LEFT @ rb.hat_so3(w)  # velocities of rotations; all of them are singular
    assert np.abs(np.linalg.det(X)).max() < 1e-13 * np.linalg.norm(w, axis=1).max() ** 3
    assert np.abs(metrics.inner_gl(X, X) - 2 * np.vecdot(w, w)).max() < 100 * EPS
    assert np.abs(np.linalg.det(LEFT)).min() > 0.9
    assert np.all(np.linalg.det(LEFT + -LEFT) == 0)


@pytest.mark.source("BK 6", "BK (14)", "errata 31")
def test_the_metric_on_poses_is_a_product_without_a_parameter():
    """The paper asks for a = 0, and defines no a. An off-diagonal block would couple ω and v."""
    turning, moving = S.copy(), T.copy()
    turning[:, 3:], moving[:, :3] = 0, 0
    X, Y = (metrics.tangent_from_components(A, x) for x in (turning, moving))
    assert_close(metrics.inner_se3(X, Y), 0)
    coupled = rb.metrics.METRIC_SE3 + 0.5 * np.eye(6, k=3) + 0.5 * np.eye(6, k=-3)
    assert np.abs(metrics.inner_left_invariant(coupled, A, X, Y)).min() > 1e-3


@pytest.mark.source("BK (12)", "BK Remark 1", "BK Remark 2", "BK 3.1", "errata 1")
@pytest.mark.source("BK (14)", "BK Remark 3", "BK Remark 4", "BK Remark 5", "BK 3.2")
def test_induced_trace_metrics_are_twice_the_energy_of_a_ball():
    """On SO(3) the metric is twice the identity. On SE(3) a translation on the right changes the
    metric.

    Six equal masses on the axes have total mass 1 and, like a ball, the moment 2 about every axis.
    """
    points = np.sqrt(3) * np.concatenate([np.eye(3), -np.eye(3)])
    X, Y = metrics.tangent_from_components(R, w), metrics.tangent_from_components(R, z)
    assert_close(metrics.inner_so3(X, Y), 2 * np.vecdot(w, z))
    energy = np.sum((points @ X.mT) ** 2, axis=(-2, -1)) / 6
    assert_close(energy / metrics.inner_so3(X, X), 1, 100)
    gram, printed = (
        metrics.inner_gl(rb.connection.BASIS_SO3[:, None], rb.connection.BASIS_SO3),
        np.eye(3),
    )
    assert np.array_equal(gram, rb.metrics.METRIC_SO3)
    assert np.array_equal(gram, 2 * printed)
    X, Y = metrics.tangent_from_components(A, S), metrics.tangent_from_components(A, T)
    wanted = 2 * np.vecdot(S[:, :3], T[:, :3]) + np.vecdot(S[:, 3:], T[:, 3:])
    assert_close(metrics.inner_se3(X, Y), wanted)
    velocities = points @ X[:, :3, :3].mT + X[:, None, :3, 3]
    assert_close(np.sum(velocities**2, axis=(-2, -1)) / 6 / metrics.inner_se3(X, X), 1, 100)
    gram = metrics.inner_ga(rb.connection.BASIS_SE3[:, None], rb.connection.BASIS_SE3)
    assert np.array_equal(gram, rb.metrics.METRIC_SE3)
    assert np.array_equal(gram, np.diag([2, 2, 2, 1, 1, 1]))
    turn = rb.pose_from_components(RIGHT, np.zeros(3))
    shift = rb.pose_from_components(np.eye(3), [1, 0, 0])
    assert_close(metrics.inner_se3(MOVE @ X @ turn, MOVE @ Y @ turn), wanted)
    assert np.abs(metrics.inner_se3(X @ shift, Y @ shift) - wanted).max() > 0.1


@pytest.mark.source("BK (1)", "BK (4)", "BK (5)", "BK (6)", "BK (7)", "BK 2.2", "BK 2.3")
@pytest.mark.source("errata 35")
@pytest.mark.parametrize(("group", "left", "x", "y", "basis"), [ON_SO3, ON_SE3])
def test_left_invariant_fields_agree_with_their_definition(group, left, x, y, basis):
    """A field is the sum of its components times the moved basis vectors; the printed basis L_i,
    without its bar, belongs to the identity. A change of frame does not change a metric."""
    X, Y = metrics.tangent_from_components(group, x), metrics.tangent_from_components(group, y)
    assert_close(X, np.einsum("bi,bjk,ikl->bjl", x, group, basis))
    printed = np.einsum("bi,ikl->bkl", x, basis)
    assert np.abs(X - printed).max(axis=(1, 2)).min() > 0.1
    assert_close(metrics.components_from_tangent(group, X), x)
    assert_close(metrics.tangent_from_components(left @ group, x), left @ X)
    assert_close(metrics.components_from_tangent(left @ group, left @ X), x)
    G = RNG.normal(size=(4, 1, x.shape[-1], x.shape[-1]))
    G = G @ G.mT
    value = metrics.inner_left_invariant(G, group, X, Y)
    assert_close(value, np.einsum("bi,acij,bj->ab", x, G, y))
    assert_close(metrics.inner_left_invariant(G, left @ group, left @ X, left @ Y), value, 4000)
    small, large = X * 1e-200, np.eye(x.shape[-1]) * 1e308
    value = metrics.inner_left_invariant(large, group, small, 1e-100 * Y)
    assert_close(value / 1e8, np.vecdot(x, y))
    # a symmetric part of Rᵀ X is ignored
    X[:, :3, :3] += group[:, :3, :3] @ [[1, 4, 5], [4, 2, 6], [5, 6, 3]]
    X[:, 3:] = 7
    assert_close(metrics.components_from_tangent(group, X), x)


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


@pytest.mark.source("BK 3")
def test_the_weighted_trace_induces_the_inertia_of_a_body():
    P = RNG.normal(size=(50, 3, 8))
    W = P @ P.mT
    X, Y = metrics.tangent_from_components(R, w), metrics.tangent_from_components(R, z)
    weighted = np.trace(X.mT @ Y @ W, axis1=-2, axis2=-1)
    G = metrics.inertia_from_weight(W)
    assert_close(metrics.inner_left_invariant(G, R, X, Y), weighted, 1e4)
    assert_close(metrics.weight_from_inertia(G), W, 1000)
    by_points = sum(p @ p * np.eye(3) - np.outer(p, p) for p in P[0].T)
    assert_close(G[0], by_points, 1000)
    # Gauss's rule with two points for each axis integrates the inertia of a box exactly
    sides = np.array([[0.3, 0.2, 0.03], [1.0, 2, 3], [2.0, 1.0, 0]])
    p = sides[:, None] * (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) / np.sqrt(3)
    exact, box = metrics.inertia_from_weight(5 / 8 * p.mT @ p), rb.Body.box(sides, 5)
    assert_close(box.inertia, exact, 16 * exact.max())
    assert box.mass == 5
    metrics.weight_from_inertia(box.inertia)  # the inertia of a body is accepted
    assert rb.Body.box([1e6, 1, 1], 12).inertia[0, 0] == 2  # no digits cancel


@pytest.mark.source("BK 3")
def test_a_weight_exists_if_the_moments_satisfy_triangle_inequalities():
    for moments in ([2, 3, 4.9], [2, 3, 5 - 1e-12], [1, 2, 3], [1, 1, 2], [0, 1, 1], [0, 0, 0]):
        G = R @ np.diag(moments) @ R.mT
        W = metrics.weight_from_inertia(G)
        least = np.linalg.eigvalsh(W)[:, 0]
        assert_close(least, (moments[0] + moments[1] - moments[2]) / 2, 40)
        assert_close(metrics.inertia_from_weight(W), G, 40)
        rb.projection.project_so_weighted(np.eye(3), W)  # the weight is accepted
    assert np.array_equal(metrics.weight_from_inertia(np.diag([1, 2, 3])), np.diag([2, 1, 0]))
    for moments in ([1, 2, 3 + 1e-13], [1, 2, 4], [-1, 5, 5], [-1e-13, 1, 1], [-2, -2, -2]):
        with pytest.raises(ValueError, match=r"moments .*; each must be at most the sum"):
            metrics.weight_from_inertia(R[0] @ np.diag(moments) @ R[0].T)
    for size in (1e-300, 3e307):
        W = metrics.weight_from_inertia(size * np.diag([2.0, 3, 4]))
        assert_close(W / size, np.diag([2.5, 1.5, 0.5]), 8)


def test_arguments_that_do_not_fit_each_other_are_refused():
    one, crooked = np.eye(3), np.eye(3, k=1)
    inner, weight = "inner_left_invariant", "weight_from_inertia"
    for name, arguments, message in (
        ("inner_gl", (np.eye(2), one), "X and Y: matrices of the same size are wanted"),
        ("inner_ga", ([[1]], [[1]]), "X: shape (..., n+1, n+1) is wanted"),
        ("tangent_from_components", (np.eye(2), [1]), "A: shape (..., 3, 3) or (..., 4, 4) is"),
        ("tangent_from_components", (one, np.ones(6)), "x: shape (..., 3)"),
        ("components_from_tangent", (np.eye(4), one), "X: shape (..., 4, 4)"),
        (inner, (np.eye(6), *[one] * 3), "G: shape (..., 3, 3)"),
        (inner, (crooked, *[one] * 3), "G is not symmetric"),
        ("semi_riemannian_metric_se3", (0, 1), "alpha is 0.0, a number above 0 is wanted"),
        ("semi_riemannian_metric_se3", (1, [1]), "beta: shape () is wanted, got (1,)"),
        ("inertia_from_weight", (crooked,), "W is not symmetric"),
        (weight, (crooked,), "G is not symmetric"),
        (weight, ([one, np.diag([1, 2, 4])],), "G[1] has the principal moments 1, 2, 4; each must"),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
            getattr(metrics, name)(*arguments)


@pytest.mark.source("BK 4", "BK Prop. 2")
def test_the_mean_rotation_has_the_least_sum_of_squared_distances():
    rng = np.random.default_rng(90)
    R = rb.exp_so3(0.4 * rng.normal(size=(5, 12, 3)))
    w = rng.uniform(0.1, 2, (5, 12))
    mean = rb.metrics.mean_rotation(R, w)
    assert rb.is_so(mean, 1e-14).all()

    def cost(x):
        moved = (mean @ rb.exp_so3(x))[:, None]
        return np.sum(w * np.sum((moved - R) ** 2, axis=(-2, -1)), axis=-1)

    for step in 1e-3 * rng.normal(size=(20, 3)):
        assert (cost(step) > cost(0 * step)).all()
        assert np.abs(cost(step) - cost(-step)).max() < 1e-7  # the gradient is 0
    for k in range(5):
        theirs = Rotation.from_matrix(R[k]).mean(w[k]).as_matrix()
        assert np.abs(mean[k] - theirs).max() < 1e-13
    L, Q = rb.exp_so3(rng.normal(size=(2, 3)))
    assert np.abs(rb.metrics.mean_rotation(L @ R @ Q, w) - L @ mean @ Q).max() < 1e-14
    d = rng.normal(size=(5, 12, 3))
    poses = rb.metrics.mean_rotation(rb.pose_from_components(R, d), w)
    assert np.abs(poses[:, :3, :3] - mean).max() < 1e-15
    assert np.abs(poses[:, :3, 3] - np.einsum("ki,kij->kj", w, d) / w.sum(1)[:, None]).max() < 1e-14


def test_a_mean_rotation_that_is_not_unique_is_refused():
    half_turn = rb.exp_so3([[0, 0, 0], [0, 0, np.pi]])
    with pytest.raises(ValueError, match="rotations: their mean is not unique"):
        rb.metrics.mean_rotation(half_turn)
    assert np.abs(rb.metrics.mean_rotation(half_turn, [2, 1]) - np.eye(3)).max() < 1e-15
    for weights, message in (([1, -1], r"weights\[1\] is -1"), ([1], "weights: shape")):
        with pytest.raises(ValueError, match=f"^{message}"):
            rb.metrics.mean_rotation(half_turn, weights)
    with pytest.raises(ValueError, match=r"^rotations: shape"):
        rb.metrics.mean_rotation(np.eye(3))
    far = rb.exp_so3(np.random.default_rng(5).normal(size=(300, 4, 3)))
    near = rb.exp_so3(0.99 * np.pi / 2 * rb.log_so3(far) / np.pi)  # within 90° of I
    assert rb.is_so(rb.metrics.mean_rotation(near), 1e-12).all()
