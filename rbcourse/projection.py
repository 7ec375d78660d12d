"""The nearest rotation, the nearest pose, and tests of membership, in any dimension n.

Parameters
----------
M : array_like, shape (..., n, n)
    Any square matrices.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import (
    as_array,
    as_finite,
    as_symmetric,
    as_tolerance,
    check_broadcast,
    first_index,
)
from rbcourse._docs import described_by
from rbcourse._foam import nearest_rotation, nearest_rotations
from rbcourse._numerics import EPS, Array, scaled

__all__ = [
    "distance_to_so",
    "is_se",
    "is_so",
    "orthonormalize_gram_schmidt",
    "project_se",
    "project_so",
    "project_so_weighted",
]

MANY = 20  # for this many matrices or more, FOAM is faster than the SVD
NOT_UNIQUE = "the nearest rotation is not unique, the curve jumps here (see margin)"


@described_by(returns="ndarray of bool, shape (...)")
def is_so(M: ArrayLike, atol: float = 1e-9) -> NDArray[np.bool_]:
    """Test whether matrices are rotations: MᵀM = I and det M = 1.

    Source: RR 1.1, RR (1), RR (2); BK 2.1.

    Parameters
    ----------
    M : array_like, shape (..., n, n)
        Matrices with non-finite entries give False and raise no error.
    atol : float, optional
        The largest accepted error of any entry of MᵀM − I and of det M − 1.

    Examples
    --------
    >>> is_so([[[0, -1], [1, 0]], [[0, 1], [1, 0]]])
    array([ True, False])
    """
    M, atol = as_array("M", M, "n", "n"), as_tolerance("atol", atol)
    with np.errstate(over="ignore", invalid="ignore"):
        gram = np.swapaxes(M, -1, -2) @ M
        defect = np.abs(gram - np.eye(M.shape[-1])).max(axis=(-2, -1))
        passes = defect <= atol
        passes &= np.abs(np.linalg.det(M) - 1) <= atol
    passes &= np.isfinite(M).all(axis=(-2, -1))
    return passes[()]


@described_by(returns="ndarray of bool, shape (...)")
def is_se(A: ArrayLike, atol: float = 1e-9) -> NDArray[np.bool_]:
    """Test whether matrices are poses [[R, d], [0, 1]], with a rotation R and finite d.

    Source: RR 1.3; BK 2.1.

    Parameters
    ----------
    A : array_like, shape (..., n + 1, n + 1)
        Matrices with non-finite entries give False and raise no error.
    atol : float, optional
        The largest accepted error of R, as for `is_so`, and of the last row.

    Examples
    --------
    >>> bool(is_se([[0, -1, 5], [1, 0, 7], [0, 0, 1]]))
    True
    """
    A, atol = as_array("A", A, "n+1", "n+1"), as_tolerance("atol", atol)
    with np.errstate(invalid="ignore"):
        off = np.abs(A[..., -1, :] - np.eye(A.shape[-1])[-1])
    passes = is_so(A[..., :-1, :-1], atol) & (off.max(axis=-1) <= atol)
    passes &= np.isfinite(A).all(axis=(-2, -1))
    return passes[()]


@described_by(__doc__, returns="ndarray, shape (..., n, n)")
def project_so(M: ArrayLike) -> Array:
    """Return the rotation R nearest to M in the Frobenius norm: U diag(1, …, 1, det(U Vᵀ)) Vᵀ.

    RᵀM is symmetric, and the sum of its two smallest eigenvalues is at least 0. For every rotation
    L, the projection of L M is L R, and that of M L is R L. The paper prints U Vᵀ, which is a
    reflection if det M < 0.
    Source: BK 4, BK Prop. 2, BK Prop. 3; RR 1.4, RR (4), RR (5), RR Fig. 1.

    Notes
    -----
    Singular set: matrices M for which the two smallest eigenvalues of RᵀM sum to 0. Such matrices
    have rank n − 2 or less, or they have det M < 0 and a repeated smallest singular value. Several
    rotations are then equally near, and one of them is returned. Near this set, R is accurate to a
    few eps ‖M‖ divided by the sum of these eigenvalues. FOAM (see `rbcourse._foam`) projects large
    stacks of 3 × 3 matrices, except near the singular set; the SVD projects all others.
    `rbcourse.textbook.project_so` is a version in three lines. See also `distance_to_so`.

    Examples
    --------
    >>> project_so([[0, -2], [3, 0]])
    array([[ 0., -1.],
           [ 1.,  0.]])
    """
    return np.ascontiguousarray(nearest(as_array("M", M, "n", "n", copy=False))[0])


@described_by(returns="ndarray, shape (..., n, n)")
def project_so_weighted(M: ArrayLike, W: ArrayLike) -> Array:
    """Return the rotation R that minimizes √tr(XᵀX W), where X = M − R: `project_so` of M W.

    For a body with points p, tr(XᵀX W) is the sum of the squared distances between M p and R p,
    weighted by mass. `rbcourse.metrics.weight_from_inertia` returns the W of a given metric. L M
    projects to L R for every rotation L; M L does *not* project to R L, unless L W = W L. On SO(3),
    W induces the left-invariant metric tr(W) I − W, which is the inertia of the body. Singular set:
    M W is in the singular set of `project_so`. A W of rank n − 1, as for a flat body, determines R
    if M W has the same rank. A W of rank n − 2 or less, as for a thin rod, never determines R.
    Source: BK 4, for metrics that the paper leaves to a later publication.

    Parameters
    ----------
    M, W : array_like, shape (..., n, n)
        W is symmetric (up to 1e-12 of the largest entry) and has no negative eigenvalues (up to a
        few eps of the largest). For a body, it is ∫ p pᵀ dm over its points p in the body frame. A
        scale factor of W does not matter.

    Examples
    --------
    >>> M = [[1, -0.2], [0, 1]]  # the axis of less weight turns
    >>> project_so_weighted(M, np.diag([100, 1])).round(3)
    array([[ 1.   , -0.002],
           [ 0.002,  1.   ]])
    """
    M = as_finite("M", M, "n", "n")
    W = as_symmetric("W", W, M.shape[-1])
    check_broadcast(M=(M, 2), W=(W, 2))
    W = scaled(W)
    sizes = np.linalg.eigvalsh(W)
    refused = sizes[..., 0] < -16 * W.shape[-1] * EPS * np.abs(sizes).max(axis=-1)
    if refused.any():
        raise ValueError(f"{first_index('W', refused)} has a negative eigenvalue")
    return nearest(scaled(M) @ W)[0]


@described_by(returns="ndarray, shape (..., n, n)")
def orthonormalize_gram_schmidt(M: ArrayLike) -> Array:
    """Orthonormalise the columns of M from left to right by the Gram–Schmidt method.

    The result Q has QᵀQ = I, and QᵀM is upper triangular with a positive diagonal. So Q is a
    reflection if det M < 0. Q is not the rotation nearest to M, since the first column keeps its
    direction. L M gives L Q for every rotation L; M L does *not* give Q L.
    Source: BK 4, BK Remark 6, BK Prop. 3.

    Parameters
    ----------
    M : array_like, shape (..., n, n)
        The columns must be linearly independent.

    Examples
    --------
    >>> orthonormalize_gram_schmidt([[1, 0.2], [0, 1]])  # the first column is already a unit vector
    array([[1., 0.],
           [0., 1.]])
    """
    M = as_finite("M", M, "n", "n")
    n = M.shape[-1]
    Q = scaled(M, axis=-2)
    for j in range(n):
        earlier, q = Q[..., :j], Q[..., j]
        size = np.linalg.norm(q, axis=-1)
        for _ in range(2):  # the second pass removes the rounding errors of the first
            q -= (earlier @ (np.swapaxes(earlier, -1, -2) @ q[..., None]))[..., 0]
        rest = np.linalg.norm(q, axis=-1)
        dependent = rest <= 4 * n * EPS * size
        if dependent.any():
            name = first_index("M", dependent)
            raise ValueError(f"{name}: column {j} depends on the columns before it")
        q /= rest[..., None]
    return Q


@described_by(__doc__, returns="ndarray, shape (...)")
def distance_to_so(M: ArrayLike) -> Array:
    """Return the Frobenius norm ‖M − R‖ for the nearest rotation R: √Σ (σ_i − 1)².

    Here σ_i are the singular values of M; the smallest is multiplied by the sign of det M.
    Source: BK 4, BK Remark 6, where the paper prints the square, without the sign.

    Examples
    --------
    >>> float(distance_to_so([[1, 0], [0, -1]]))  # a reflection: all rotations are equally far
    2.0
    """
    d = _signed_singular_values(as_finite("M", M, "n", "n"))
    return np.hypot.reduce(d - 1, axis=-1)


def nearest(M: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the nearest rotation to M, in the memory layout of M, and whether it is unique."""
    if M.size == 9 and (only := nearest_rotation(M)) is not None:
        return only.reshape(M.shape), np.ones(M.shape[:-2], bool)
    flat = M.reshape(-1, *M.shape[-2:])
    R, unique = np.empty_like(flat), np.zeros(len(flat), bool)
    if M.shape[-1] == 3 and len(flat) >= MANY:
        unique = nearest_rotations(flat.transpose(1, 2, 0), R.transpose(1, 2, 0))
    if not unique.all():
        left = np.flatnonzero(~unique)
        if not np.isfinite(flat[left]).all():
            as_finite("M", M)
        R[left], unique[left] = _nearest_by_svd(scaled(flat[left]))
    return R.reshape(M.shape), unique.reshape(M.shape[:-2])


def _nearest_by_svd(M: Array) -> tuple[Array, NDArray[np.bool_]]:
    U, d, Vt = np.linalg.svd(M)
    sign = np.sign(np.linalg.det(U @ Vt))
    U[..., -1] *= sign[..., None]
    d[..., -1] *= sign
    unique = d[..., -2:].sum(axis=-1) >= 8 * EPS * np.linalg.norm(d, axis=-1)
    return (U + U @ _rounding_left(M, U, d, Vt)) @ Vt, unique


def gap(M: Array) -> Array:
    """Return the sum of the two smallest eigenvalues of RᵀM, where R is nearest to M."""
    return _signed_singular_values(M)[..., -2:].sum(axis=-1)


def _signed_singular_values(M: Array) -> Array:
    d: Array = np.linalg.svd(M, compute_uv=False).astype(np.float64, copy=False)
    d[..., -1] *= np.linalg.slogdet(M).sign
    return d


def _rounding_left(M: Array, U: Array, d: Array, Vt: Array) -> Array:
    """Return the small skew-symmetric Ω with Ω d + d Ω = K − Kᵀ, where K = Uᵀ M V.

    After an SVD, K − Kᵀ is about ten eps ‖M‖. If d_i + d_j nearly vanishes, Ω_ij is set to 0: below
    1e-8, rounding alone would turn the result by 2e-7.
    """
    K = np.swapaxes(U, -1, -2) @ M @ np.swapaxes(Vt, -1, -2)
    sums = d[..., :, None] + d[..., None, :]
    firm = sums > 1e-8 * d[..., :1, None] + 1e-290
    turn: Array = (K - np.swapaxes(K, -1, -2)) / np.where(firm, sums, np.inf)
    return turn


@described_by(returns="ndarray, shape (..., n + 1, n + 1)")
def project_se(B: ArrayLike) -> Array:
    """Return [[project_so(B1), B2], [0, 1]]: the pose nearest to B = [[B1, B2], [0, 1]].

    Source: BK 5, BK Prop. 4, BK Prop. 5; RR 1.6.

    Parameters
    ----------
    B : array_like, shape (..., n + 1, n + 1)
        Its last row is replaced by [0, 1].

    Examples
    --------
    >>> project_se([[3, 2, 4], [2, 3, 2], [0, 1, 1]]).round(12) + 0.0
    array([[1., 0., 4.],
           [0., 1., 2.],
           [0., 0., 1.]])
    """
    A = as_finite("B", B, "n+1", "n+1")
    A[..., :-1, :-1] = project_so(A[..., :-1, :-1])
    A[..., -1, :] = np.eye(A.shape[-1])[-1]
    return A


def warn_if_nearly_singular(margin: Array, time: Array | float, name: str = "t") -> None:
    """Warn if a margin is below 1e-6; name the first such curve of a stack and the time."""
    low = np.argwhere(np.asarray(margin) < 1e-6)
    if len(low):
        first = tuple(low[0])
        which = f" of curve {[int(i) for i in first]}" if first else ""
        least, when = float(margin[first]), float(np.broadcast_to(time, np.shape(margin))[first])
        size = f"{least:.1e}" if least > 1e-12 else "below 1e-12"
        warnings.warn(
            f"margin < 1e-6{which}: {size} at {name} = {when:.6g}; "
            "another rotation is almost as near, and the curve almost jumps there",
            RuntimeWarning,
            stacklevel=4,
        )
