"""Metrics on the matrices and on the groups inside them: the trace, what it induces, invariance.

Tangent vectors at A are matrices X = A hat(x); x are the components of X in the left-invariant
frame: an angular velocity on SO(3), a twist (ω, v) on SE(3), both in the body frame.
"""

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_finite, as_symmetric, check_broadcast
from rbcourse.se3 import hat_se3
from rbcourse.so3 import hat_so3, vee_so3

METRIC_SO3 = 2 * np.eye(3)
"""The matrix G of the metric that the trace induces on SO(3), shape (3, 3) (BK (12))."""
METRIC_SE3 = np.diag([2.0, 2, 2, 1, 1, 1])
"""The matrix G of the metric that the trace induces on SE(3), shape (6, 6) (BK (14))."""
METRIC_SO3.flags.writeable = METRIC_SE3.flags.writeable = False


def inner_gl(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY): the sum of the products of the entries.

    Parameters
    ----------
    X, Y : array_like, shape (..., n, n)
        Tangent vectors of GL(n), both at one point; which one does not matter.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the two do not fit.

    See Also
    --------
    inner_left_invariant : Any metric that moves along with the body.

    Notes
    -----
    Invariant under rotations, and mirrors, on either side: ``inner_gl(L @ X @ R, L @ Y @ R)`` is
    the same. Not under other matrices.

    References
    ----------
    BK 3.1, BK (11), BK Prop. 1.

    Examples
    --------
    >>> float(inner_gl([[1, 2], [3, 4]], [[1, 0], [0, 1]]))
    5.0
    """
    return _trace(as_finite("X", X, "n", "n"), as_finite("Y", Y, "n", "n"))


def inner_so3(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) of tangent vectors of SO(3): 2 x · y in their components.

    Parameters
    ----------
    X, Y : array_like, shape (..., 3, 3)
        Tangent vectors R hat_so3(x), both at one rotation R.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    Notes
    -----
    Invariant under rotations on both sides. It is the kinetic energy, times 2, of a ball with the
    moment of inertia 2.

    References
    ----------
    BK 3.1, BK (12), BK Prop. 1, BK Remark 1, BK Remark 2.

    Examples
    --------
    >>> float(inner_so3(tangent_from_components(np.eye(3), [1, 2, 3]), hat_so3([1, 0, 1])))
    8.0
    """
    return _trace(as_finite("X", X, 3, 3), as_finite("Y", Y, 3, 3))


def inner_ga(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) of tangent vectors of GA(n), the affine maps.

    Parameters
    ----------
    X, Y : array_like, shape (..., n + 1, n + 1)
        Tangent vectors of GA(n), both at one point; their last rows are 0.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, n ≥ 1, or the two do not fit.

    References
    ----------
    BK 3.2, BK (13).

    Examples
    --------
    >>> float(inner_ga([[1, 2], [0, 0]], [[3, 4], [0, 0]]))
    11.0
    """
    return _trace(as_finite("X", X, "n+1", "n+1"), as_finite("Y", Y, "n+1", "n+1"))


def inner_se3(X: ArrayLike, Y: ArrayLike) -> Array:
    """Return tr(XᵀY) of tangent vectors of SE(3): 2 ω_X · ω_Y + v_X · v_Y in their components.

    Parameters
    ----------
    X, Y : array_like, shape (..., 4, 4)
        Tangent vectors A hat_se3(x), both at one pose A; their last rows are 0.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    Notes
    -----
    Invariant under poses on the left; on the right under rotations only. It is the kinetic energy,
    times 2, of a ball of mass 1 and moment of inertia 2 whose centre is the body's origin.

    References
    ----------
    BK 3.2, BK (14), BK Remark 3, BK Remark 4, BK Remark 5.

    Examples
    --------
    >>> X = hat_se3([1, 0, 0, 0, 3, 0])
    >>> float(inner_se3(X, X))
    11.0
    """
    return _trace(as_finite("X", X, 4, 4), as_finite("Y", Y, 4, 4))


def tangent_from_components(A: ArrayLike, x: ArrayLike) -> Array:
    """Return the tangent vector X = A hat(x): the left-invariant field of x, at A.

    Parameters
    ----------
    A : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotations or poses.
    x : array_like, shape (..., 3) or (..., 6)
        Components: angular velocities, or twists (ω, v), body frame.

    Returns
    -------
    ndarray, shape (..., 3, 3) or (..., 4, 4)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the two do not fit.

    See Also
    --------
    components_from_tangent : The way back.

    References
    ----------
    BK 2.2, BK (4), BK (5).

    Examples
    --------
    >>> A = [[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    >>> tangent_from_components(A, [0, 0, 0, 1, 0, 0])[:3, 3] + 0.0  # ahead is the body's x axis
    array([0., 1., 0.])
    """
    A, size = as_rotation_or_pose("A", A)
    x = as_finite("x", x, size)
    check_broadcast(A=(A, 2), x=(x, 1))
    return A @ (hat_so3(x) if size == 3 else hat_se3(x))


def components_from_tangent(A: ArrayLike, X: ArrayLike) -> Array:
    """Return the components x of a tangent vector X at A: vee(A⁻¹ X), with Rᵀ for R⁻¹.

    Parameters
    ----------
    A : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotations or poses; what is none is not repaired.
    X : array_like, of the same core shape
        Tangent vectors. What sticks out of the tangent space is dropped.

    Returns
    -------
    ndarray, shape (..., 3) or (..., 6)
        Angular velocities, or twists (ω, v), body frame. Those of A' are the velocity of BK (1).

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the two do not fit.

    See Also
    --------
    tangent_from_components : The way back.

    References
    ----------
    BK 2.2, BK (1), BK (5).

    Examples
    --------
    >>> R = np.diag([-1, -1, 1])
    >>> components_from_tangent(R, tangent_from_components(R, [1, 2, 3]))
    array([1., 2., 3.])
    """
    A, _ = as_rotation_or_pose("A", A)
    X = as_finite("X", X, *A.shape[-2:])
    check_broadcast(A=(A, 2), X=(X, 2))
    return _components(A, X)


def inner_left_invariant(G: ArrayLike, A: ArrayLike, X: ArrayLike, Y: ArrayLike) -> Array:
    """Return ⟨X, Y⟩ at A of the left-invariant metric with the matrix G: xᵀ G y.

    Parameters
    ----------
    G : array_like, shape (..., 3, 3) for SO(3), (..., 6, 6) for SE(3)
        The metric at the identity, in the basis of angular velocities or twists: symmetric.
    A : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotations or poses.
    X, Y : array_like, of the same core shape as `A`
        Tangent vectors at `A`; x and y are their components.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, the batches do not broadcast, or `G` is
        not symmetric.

    See Also
    --------
    METRIC_SO3, METRIC_SE3 : The metrics that the trace induces.
    semi_riemannian_metric_se3 : The one whose geodesics are screws.

    References
    ----------
    BK 2.3, BK (6), BK (7).

    Examples
    --------
    >>> X = hat_so3([0, 0, 3])
    >>> float(inner_left_invariant(np.diag([1, 2, 3]), np.eye(3), X, X))
    27.0
    """
    A, size = as_rotation_or_pose("A", A)
    G = as_symmetric("G", G, size)
    X, Y = as_finite("X", X, *A.shape[-2:]), as_finite("Y", Y, *A.shape[-2:])
    check_broadcast(G=(G, 2), A=(A, 2), X=(X, 2), Y=(Y, 2))
    x, y = _components(A, X), _components(A, Y)
    return np.vecdot(x, (G @ y[..., None])[..., 0])


def semi_riemannian_metric_se3(alpha: float, beta: float) -> Array:
    """Return [[alpha I, beta I], [beta I, 0]]: invariant on both sides, and indefinite.

    Parameters
    ----------
    alpha, beta : float
        Positive: alpha weighs rotation, in m² for an energy per mass; beta couples it to
        translation, in m.

    Returns
    -------
    ndarray, shape (6, 6)
        With three positive and three negative eigenvalues: the "length" of a motion can be 0 or
        imaginary, and its geodesics are screws.

    Raises
    ------
    ValueError
        If `alpha` or `beta` is not a positive number.

    References
    ----------
    BK 2.6, BK (10).

    Examples
    --------
    >>> S = np.array([0, 0, 1, 0, 0, -1])  # a left-handed screw
    >>> float(S @ semi_riemannian_metric_se3(2, 1) @ S)
    0.0
    """
    for name, value in (("alpha", alpha), ("beta", beta)):
        number = as_finite(name, value)
        if number.ndim or not number > 0:
            raise ValueError(f"{name}: a positive number wanted, got {value!r}")
    return np.kron([[alpha, beta], [beta, 0.0]], np.eye(3))


def as_rotation_or_pose(name: str, value: ArrayLike) -> tuple[Array, int]:
    """Return matrices of SO(3) or SE(3), told by their size, and the dimension of the group.

    Raises
    ------
    ValueError
        If `value` is not finite, or neither 3 × 3 nor 4 × 4.
    """
    A = as_finite(name, value, "n", "n")
    if A.shape[-1] not in (3, 4):
        raise ValueError(f"{name}: shape (..., 3, 3) or (..., 4, 4) wanted, got {A.shape}")
    return A, 3 if A.shape[-1] == 3 else 6


def _components(A: Array, X: Array) -> Array:
    in_body = np.swapaxes(A[..., :3, :3], -1, -2) @ X[..., :3, :]
    w = vee_so3(in_body[..., :3])
    return w if A.shape[-1] == 3 else np.concatenate([w, in_body[..., 3]], axis=-1)


def _trace(X: Array, Y: Array) -> Array:
    check_broadcast(X=(X, 2), Y=(Y, 2))
    if X.shape[-1] != Y.shape[-1]:
        raise ValueError(f"X and Y: matrices of one size wanted, got {X.shape} and {Y.shape}")
    product: Array = (X * Y).sum(axis=(-2, -1))
    return product
