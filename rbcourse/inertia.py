"""Inertias and the weights behind them: which metrics of SO(3) a weighted trace induces."""

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array, as_symmetric, first_index, scaled


def inertia_from_weight(W: ArrayLike) -> Array:
    """Return tr(W) I − W: the metric that tr(XᵀY W) induces on SO(3).

    Parameters
    ----------
    W : array_like, shape (..., 3, 3)
        Symmetric. Of a body, ∫ p pᵀ dm over its points p, in kg m², body frame.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        The matrix G of the metric; of a body, its inertia about the origin.

    Raises
    ------
    ValueError
        If `W` is not finite, not of that shape or not symmetric.

    See Also
    --------
    weight_from_inertia : The way back, and which metrics are reached.
    project_so_weighted : The nearest rotation in that metric.

    References
    ----------
    BK 3, for the metrics that the paper leaves to a later publication.

    Examples
    --------
    >>> inertia_from_weight(np.eye(3))
    array([[2., 0., 0.],
           [0., 2., 0.],
           [0., 0., 2.]])
    """
    W = as_symmetric("W", W, 3)
    return _trace_times_identity(W) - W


def weight_from_inertia(G: ArrayLike) -> Array:
    """Return the weight W with tr(W) I − W = G: tr(G)/2 I − G.

    Parameters
    ----------
    G : array_like, shape (..., 3, 3)
        Symmetric and positive definite, each eigenvalue less than the sum of the other two.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Symmetric and positive definite.

    Raises
    ------
    ValueError
        If `G` is not finite, not of that shape, not symmetric, or its eigenvalues, the principal
        moments of inertia, do not satisfy the triangle inequality strictly.

    See Also
    --------
    inertia_from_weight : The way back.

    Notes
    -----
    Every solid body satisfies the inequality. A flat one reaches equality: its W is singular, and
    tr(XᵀY W) no metric on the matrices. A G that violates it belongs to no body, and no positive
    definite W induces it.

    References
    ----------
    BK 3, for the metrics that the paper leaves to a later publication.

    Examples
    --------
    >>> weight_from_inertia(np.diag([2.0, 3, 4]))
    array([[2.5, 0. , 0. ],
           [0. , 1.5, 0. ],
           [0. , 0. , 0.5]])
    """
    G = as_symmetric("G", G, 3)
    moments = np.linalg.eigvalsh(scaled(G))
    slack = moments[..., 0] + moments[..., 1] - moments[..., 2]
    refused = ~(slack > 16 * EPS * np.abs(moments).max(axis=-1))
    if refused.any():
        least, middle, largest = np.linalg.eigvalsh(G[refused][0])
        raise ValueError(
            f"{first_index('G', refused)} has the principal moments {least:.6g}, {middle:.6g}, "
            f"{largest:.6g}; each must be less than the sum of the other two"
        )
    return _trace_times_identity(G / 2) - G


def _trace_times_identity(matrix: Array) -> Array:
    trace: Array = np.trace(matrix, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    return trace
