import numpy as np
import pytest

import rbcourse as rb
from rbcourse import metrics

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2)
R = rb.sample_rotation(50, rng=1)


@pytest.mark.source("BK 3")
def test_the_weighted_trace_induces_an_inertia():
    P = RNG.normal(size=(50, 3, 8))
    W = P @ P.mT
    w, z = RNG.normal(size=(2, 50, 3))
    X, Y = metrics.tangent_from_components(R, w), metrics.tangent_from_components(R, z)
    weighted = np.trace(X.mT @ Y @ W, axis1=-2, axis2=-1)
    G = metrics.inertia_from_weight(W)
    assert np.abs(metrics.inner_left_invariant(G, R, X, Y) - weighted).max() < 1e4 * EPS
    assert np.abs(metrics.weight_from_inertia(G) - W).max() < 1000 * EPS
    by_points = sum(p @ p * np.eye(3) - np.outer(p, p) for p in P[0].T)
    assert np.abs(G[0] - by_points).max() < 1000 * EPS


@pytest.mark.source("BK 3")
def test_weights_are_for_moments_of_which_each_is_at_most_the_sum_of_the_others():
    for moments in ([2, 3, 4.9], [2, 3, 5 - 1e-12], [1, 2, 3], [1, 1, 2], [0, 1, 1], [0, 0, 0]):
        G = R @ np.diag(moments) @ R.mT
        W = metrics.weight_from_inertia(G)
        least = np.linalg.eigvalsh(W)[:, 0]
        assert np.abs(least - (moments[0] + moments[1] - moments[2]) / 2).max() < 40 * EPS
        assert np.abs(metrics.inertia_from_weight(W) - G).max() < 40 * EPS
        rb.project_so_weighted(np.eye(3), W)  # is taken
    assert np.array_equal(metrics.weight_from_inertia(np.diag([1, 2, 3])), np.diag([2, 1, 0]))
    for moments in ([1, 2, 3 + 1e-13], [1, 2, 4], [-1, 5, 5], [-1e-13, 1, 1], [-2, -2, -2]):
        with pytest.raises(ValueError, match="has the principal moments"):
            metrics.weight_from_inertia(R[0] @ np.diag(moments) @ R[0].T)


def test_a_box_has_the_inertia_of_its_points():
    """∫ (p·p I − p pᵀ) dm by the rule of Gauss with two points an axis, exact for squares."""
    assert metrics.box_inertia([1e9, 1, 1], 12)[0, 0] == 2  # nothing cancels
    sides = np.array([[0.3, 0.2, 0.03], [1.0, 2, 3], [2.0, 0, 0]])
    nodes = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) / np.sqrt(3)
    p = sides[:, None] * nodes
    squares = np.sum(p**2, axis=-1)[..., None, None] * np.eye(3)
    exact = 5 * np.mean(squares - p[..., :, None] * p[..., None, :], axis=1)
    assert np.abs(metrics.box_inertia(sides, 5) - exact).max() < 16 * EPS * exact.max()
    metrics.weight_from_inertia(metrics.box_inertia(sides))  # of a body


def test_no_inertia_is_too_large_or_too_small():
    for size in (1e-300, 3e307):
        W = metrics.weight_from_inertia(size * np.diag([2.0, 3, 4]))
        assert np.abs(W / size - np.diag([2.5, 1.5, 0.5])).max() < 8 * EPS


@pytest.mark.parametrize(
    ("function", "arguments", "said"),
    [
        ("box_inertia", ([1, -2, 3],), r"^sides: lengths from 0 up are wanted, got -2"),
        ("box_inertia", ([[1, 2, 3], [1, -2, 3]],), r"^sides\[1\]: lengths from 0 up are wanted"),
        ("box_inertia", ([1, 2, 3], 0), r"^mass"),
        ("inertia_from_weight", (np.eye(3, k=1),), "^W is not symmetric"),
        ("weight_from_inertia", (np.eye(3, k=1),), "^G is not symmetric"),
        (
            "weight_from_inertia",
            ([np.eye(3), np.diag([1, 2, 4])],),
            r"^G\[1\] has the principal moments 1, 2, 4; each must be at most the sum",
        ),
    ],
)
def test_bad_arguments_are_named(function, arguments, said):
    with pytest.raises(ValueError, match=said):
        getattr(metrics, function)(*arguments)
