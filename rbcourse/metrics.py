"""Metrics on matrices and on the groups: trace metrics, means, invariance, inertia and weight.

Tangent vectors at A are matrices X = A hat(x), where x are the components of X in the
left-invariant frame: an angular velocity on SO(3), or a twist (ω, v) on SE(3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_positive, as_symmetric, check_all, check_broadcast
from rbcourse._docs import described_by
from rbcourse._numerics import Array, matvec
from rbcourse._valid import as_rotations_or_poses
from rbcourse.body import weight_of
from rbcourse.projection import nearest
from rbcourse.se3 import hat_se3, join
from rbcourse.so3 import hat_so3, vee

__all__ = [
    "METRIC_SE3",
    "METRIC_SO3",
    "components_from_tangent",
    "inertia_from_weight",
    "inner_ga",
    "inner_gl",
    "inner_left_invariant",
    "inner_se3",
    "inner_so3",
    "mean_rotation",
    "semi_riemannian_metric_se3",
    "tangent_from_components",
    "weight_from_inertia",
]

METRIC_SO3 = 2 * np.eye(3)
"""The matrix G of the metric that the trace induces on SO(3), shape (3, 3) (BK (12)).

The paper prints δ_ij in place of 2 δ_ij in its section 3.1."""
METRIC_SE3 = np.diag([2.0, 2, 2, 1, 1, 1])
"""The matrix G of the metric that the trace induces on SE(3), shape (6, 6) (BK (14))."""
METRIC_SO3.flags.writeable = METRIC_SE3.flags.writeable = False


@described_by(returns="ndarray, shape (...)")
def inner_gl(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) of tangent vectors X, Y of GL(n) at one point.

    This inner product is invariant under rotations and reflections on either side, but not under
    other matrices.
    Source: BK 3.1, BK (11), BK Prop. 1.

    Parameters
    ----------
    X, Y : array_like, shape (..., n, n)
        Tangent vectors at one point, as matrices.

    Examples
    --------
    >>> float(inner_gl([[1, 2], [3, 4]], [[1, 0], [0, 1]]))
    5.0
    """
    return _trace(X, Y, "n")


@described_by(returns="ndarray, shape (...)")
def inner_so3(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) = 2 x · y for tangent vectors X = R hat_so3(x), Y = R hat_so3(y).

    This inner product is invariant under rotations on both sides. For X = Y, it is twice the
    kinetic energy of a ball with moment of inertia 2.
    Source: BK 3.1, BK (12), BK Prop. 1, BK Remark 1, BK Remark 2.

    Parameters
    ----------
    X, Y : array_like, shape (..., 3, 3)
        Tangent vectors at one point, as matrices.

    Examples
    --------
    >>> float(inner_so3(tangent_from_components(np.eye(3), [1, 2, 3]), hat_so3([1, 0, 1])))
    8.0
    """
    return _trace(X, Y, 3)


@described_by(returns="ndarray, shape (...)")
def inner_ga(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) of tangent vectors of GA(n), the affine maps.

    Source: BK 3.2, BK (13).

    Parameters
    ----------
    X, Y : array_like, shape (..., n + 1, n + 1)
        Tangent vectors at one point, as matrices whose last rows are 0.

    Examples
    --------
    >>> float(inner_ga([[1, 2], [0, 0]], [[3, 4], [0, 0]]))  # the last rows are 0
    11.0
    """
    return _trace(X, Y, "n+1")


@described_by(returns="ndarray, shape (...)")
def inner_se3(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) = 2 ω_x · ω_y + v_x · v_y for X = A hat_se3(x), Y = A hat_se3(y).

    This inner product is invariant under poses on the left, but only under rotations on the right.
    For X = Y, it is twice the kinetic energy of a ball of mass 1 and moment of inertia 2, whose
    centre is the body's origin.
    Source: BK 3.2, BK (14), BK Remark 3, BK Remark 4, BK Remark 5.

    Parameters
    ----------
    X, Y : array_like, shape (..., 4, 4)
        Tangent vectors at one point, as matrices.

    Examples
    --------
    >>> X = hat_se3([1, 0, 0, 0, 3, 0])
    >>> float(inner_se3(X, X))
    11.0
    """
    return _trace(X, Y, 4)


@described_by(returns="ndarray, shape (...)")
def inner_left_invariant(G: ArrayLike, A: ArrayLike, X: ArrayLike, Y: ArrayLike) -> Array:
    """Return ⟨X, Y⟩ = xᵀ G y at A in the left-invariant metric with the matrix G.

    Source: BK 2.3, BK (6), BK (7).

    Parameters
    ----------
    G : array_like, shape (..., 3, 3) for SO(3), (..., 6, 6) for SE(3)
        The symmetric matrix of the metric at the identity, for angular velocities or twists.
    A, X, Y : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotations or poses A, and tangent vectors X and Y at A, with the components x and y.

    Examples
    --------
    >>> X = hat_so3([0, 0, 3])
    >>> float(inner_left_invariant(np.diag([1, 2, 3]), np.eye(3), X, X))
    27.0
    """
    A, size = as_rotations_or_poses("A", A)
    G = as_symmetric("G", G, size)
    X, Y = as_finite("X", X, *A.shape[-2:]), as_finite("Y", Y, *A.shape[-2:])
    check_broadcast(G=(G, 2), A=(A, 2), X=(X, 2), Y=(Y, 2))
    x, y = _components(A, X), _components(A, Y)
    return np.vecdot(x, matvec(G, y))


@described_by(returns="ndarray, shape (6, 6)")
def semi_riemannian_metric_se3(alpha: float, beta: float) -> Array:
    """Return [[alpha I, beta I], [beta I, 0]], an indefinite bi-invariant metric.

    Three eigenvalues are positive and three negative, so the "length" of a motion can be 0 or
    imaginary. The geodesics are screw motions.
    Source: BK 2.6, BK (10).

    Parameters
    ----------
    alpha, beta : float
        Positive numbers. alpha is the weight of rotation, and beta couples rotation to translation.
        If the result is an energy per mass, alpha is in m² and beta is in m.

    Examples
    --------
    >>> S = np.array([0, 0, 1, 0, 0, -1])  # a left-handed screw
    >>> float(S @ semi_riemannian_metric_se3(2, 1) @ S)
    0.0
    """
    alpha, beta = as_positive("alpha", alpha), as_positive("beta", beta)
    metric: Array = np.kron(np.array([[alpha, beta], [beta, 0.0]]), np.eye(3))
    return metric


@described_by(returns="ndarray, shape (..., 3, 3) or (..., 4, 4)")
def tangent_from_components(A: ArrayLike, x: ArrayLike) -> Array:
    """Return the tangent vector X = A hat(x), the value at A of the left-invariant field of x.

    Source: BK 2.2, BK (4), BK (5).

    Parameters
    ----------
    A, x : array_like, shapes (..., 3, 3) and (..., 3), or (..., 4, 4) and (..., 6)
        Rotations and angular velocities, or poses and twists.

    Examples
    --------
    >>> A = [[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    >>> tangent_from_components(A, [0, 0, 0, 1, 0, 0])[:3, 3] + 0.0  # the body's x axis
    array([0., 1., 0.])
    """
    A, size = as_rotations_or_poses("A", A)
    x = as_finite("x", x, size)
    check_broadcast(A=(A, 2), x=(x, 1))
    return A @ (hat_so3(x) if size == 3 else hat_se3(x))


@described_by(returns="ndarray, shape (..., 3) or (..., 6)")
def components_from_tangent(A: ArrayLike, X: ArrayLike) -> Array:
    """Return the components x = vee(A⁻¹ X) of tangent vectors X at A, using Rᵀ for R⁻¹.

    The part of X that is normal to the tangent space is dropped. The results are angular velocities
    or twists; the components of A' are the velocity of BK (1).
    Source: BK 2.2, BK (1), BK (5).

    Parameters
    ----------
    A, X : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotations or poses A, and tangent vectors X at A.

    Examples
    --------
    >>> R = np.diag([-1, -1, 1])
    >>> components_from_tangent(R, tangent_from_components(R, [1, 2, 3]))
    array([1., 2., 3.])
    """
    A, _ = as_rotations_or_poses("A", A)
    X = as_finite("X", X, *A.shape[-2:])
    check_broadcast(A=(A, 2), X=(X, 2))
    return _components(A, X)


@described_by(returns="ndarray, shape (..., 3, 3)")
def inertia_from_weight(W: ArrayLike) -> Array:
    """Return tr(W) I − W, the matrix of the metric that tr(XᵀY W) induces on SO(3).

    For a body, this is its inertia about the origin.
    Source: BK 3, for the metrics that the paper leaves to a later publication.

    Parameters
    ----------
    W : array_like, shape (..., 3, 3)
        Symmetric matrices. The W of a body is ∫ p pᵀ dm over its points p in the body frame, in kg
        m².

    Examples
    --------
    >>> inertia_from_weight(np.eye(3))
    array([[2., 0., 0.],
           [0., 2., 0.],
           [0., 0., 2.]])
    """
    W = as_symmetric("W", W, 3)
    return np.trace(W, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - W


@described_by(returns="ndarray, shape (..., 3, 3)")
def weight_from_inertia(G: ArrayLike) -> Array:
    """Return the weight W = tr(G)/2 I − G, which satisfies tr(W) I − W = G.

    The inertia of every body satisfies the condition on G below. For any other G, W has a negative
    eigenvalue. The eigenvalues of a body's W are the integrals ∫ x² dm along its principal axes. W
    has rank 2 for a flat body, and rank 1 for a rod without thickness. The largest moment of a flat
    body is the sum of the other two.
    Source: BK 3, for the metrics that the paper leaves to a later publication.

    Parameters
    ----------
    G : array_like, shape (..., 3, 3)
        Symmetric matrices. Each eigenvalue is at most the sum of the other two, up to a few eps of
        the largest.

    Examples
    --------
    >>> weight_from_inertia(np.diag([1.0, 2, 3])).diagonal()  # a flat body
    array([2., 1., 0.])
    """
    return weight_of("G", as_symmetric("G", G, 3))


def _components(A: Array, X: Array) -> Array:
    in_body = np.swapaxes(A[..., :3, :3], -1, -2) @ X[..., :3, :]
    w = vee(in_body[..., :3])
    return w if A.shape[-1] == 3 else np.concatenate([w, in_body[..., 3]], axis=-1)


def _trace(X: ArrayLike, Y: ArrayLike, size: int | str) -> Array:
    X, Y = as_finite("X", X, size, size), as_finite("Y", Y, size, size)
    check_broadcast(X=(X, 2), Y=(Y, 2))
    if X.shape[-1] != Y.shape[-1]:
        raise ValueError(
            f"X and Y: matrices of the same size are wanted, got {X.shape} and {Y.shape}"
        )
    product: Array = (X * Y).sum(axis=(-2, -1))
    return product


@described_by(returns="ndarray, shape (..., 3, 3) or (..., 4, 4)")
def mean_rotation(rotations: ArrayLike, weights: ArrayLike | None = None) -> Array:
    """Return the rotation R with the least Σ wᵢ ‖R − Rᵢ‖², or the pose: the mean, projected.

    Source: BK 4, BK Prop. 2, BK 5.

    Parameters
    ----------
    rotations : array_like, shape (..., N, 3, 3) or (..., N, 4, 4)
        N rotation matrices or poses.
    weights : array_like, shape (..., N), optional
        Positive weights, such as 1/σᵢ² for a noise of σᵢ rad.

    Raises
    ------
    ValueError
        Also if the mean is not unique, as of two rotations a half-turn apart.

    Notes
    -----
    ‖R − Rᵢ‖² = 6 − 2 tr RᵀRᵢ, so R has the largest tr RᵀM, where M = Σ wᵢ Rᵢ: the nearest rotation
    of M (Kabsch; Wahba). If the rotations are moved, R moves with them. It is unique if all
    rotations are less than 90° from one rotation. For normal noise of σ rad about each axis, the
    variance of R about each axis is (1 + σ²/3) σ²/N, up to terms in σ⁴.

    Examples
    --------
    >>> from rbcourse import exp_so3, log_so3
    >>> log_so3(mean_rotation(exp_so3([[0, 0, 0.1], [0, 0, 0.4]]), [2, 1])).round(3)
    array([0. , 0. , 0.2])
    """
    A, _ = as_rotations_or_poses("rotations", rotations)
    if A.ndim < 3:
        raise ValueError(f"rotations: shape (..., N, 3, 3) is wanted, got {A.shape}")
    w = np.ones(A.shape[-3]) if weights is None else as_finite("weights", weights, A.shape[-3])
    check_all(w > 0, "weights", w, "a number above 0")
    check_broadcast(rotations=(A, 3), weights=(w, 1))
    share = (w / w.sum(axis=-1, keepdims=True))[..., None, None]
    R, unique = nearest(np.sum(share * A[..., :3, :3], axis=-3))
    if not unique.all():
        raise ValueError("rotations: their mean is not unique, as of rotations a half-turn apart")
    if A.shape[-1] == 3:
        return R
    return join(R, np.sum(share[..., 0] * A[..., :3, 3], axis=-2))
