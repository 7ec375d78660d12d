"""Unit quaternions (w, x, y, z): the unit sphere in R⁴, where q and −q are the same rotation."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import EPS, Array, as_array, as_finite, as_time, check_broadcast, sinc

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def is_unit_quaternion(q: ArrayLike, atol: float = 1e-9) -> NDArray[np.bool_]:
    """Tell which quaternions have norm 1.

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Candidates. NaN and infinity are no errors here, they fail.
    atol : float, optional
        The largest difference between norm and 1 that passes.

    Returns
    -------
    ndarray of bool, shape (...)

    Raises
    ------
    ValueError
        If `q` is not an array of real numbers of that shape.

    See Also
    --------
    is_so : The same question for rotation matrices.

    References
    ----------
    RR 1.2, RR (3).

    Examples
    --------
    >>> is_unit_quaternion([[0.6, 0, 0.8, 0], [1, 1, 0, 0]])
    array([ True, False])
    """
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.linalg.norm(as_array("q", q, 4), axis=-1)
        return (np.abs(norm - 1) <= atol)[()]


def quaternion_multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Return Hamilton's product p q: turn by q first, then by p.

    Parameters
    ----------
    p, q : array_like, shape (..., 4)
        Quaternions (w, x, y, z), of any norm.

    Returns
    -------
    ndarray, shape (..., 4)
        Its norm is the product of the norms.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> quaternion_multiply([0, 1, 0, 0], [0, 0, 1, 0])  # i j = k
    array([0., 0., 0., 1.])
    """
    p, q = as_finite("p", p, 4), as_finite("q", q, 4)
    check_broadcast(p=(p, 1), q=(q, 1))
    (a, u), (b, v) = _split(p), _split(q)
    scalar = a * b - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([scalar, a * v + b * u + np.cross(u, v)], axis=-1)


def quaternion_conjugate(q: ArrayLike) -> Array:
    """Return (w, −x, −y, −z): for a unit quaternion its inverse, the turn back.

    Parameters
    ----------
    q : array_like, shape (..., 4)

    Returns
    -------
    ndarray, shape (..., 4)

    Raises
    ------
    ValueError
        If `q` is not finite or not of that shape.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> quaternion_multiply([0.6, 0, 0.8, 0], quaternion_conjugate([0.6, 0, 0.8, 0]))
    array([1., 0., 0., 0.])
    """
    return as_finite("q", q, 4) * _CONJUGATE + 0.0


def rotate_by_quaternion(q: ArrayLike, p: ArrayLike) -> Array:
    """Rotate points: the vector part of q p q⁻¹.

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Unit quaternions; any other norm scales the points by its square.
    p : array_like, shape (..., 3)
        Points.

    Returns
    -------
    ndarray, shape (..., 3)

    Raises
    ------
    ValueError
        If an argument is not finite, not of its shape, or the batches do not broadcast.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> rotate_by_quaternion([0, 0, 0, 1], [1, 2, 3])  # a half-turn about z
    array([-1., -2.,  3.])
    """
    q, p = as_finite("q", q, 4), as_finite("p", p, 3)
    check_broadcast(q=(q, 1), p=(p, 1))
    pure = np.concatenate([np.zeros((*p.shape[:-1], 1)), p], axis=-1)
    return quaternion_multiply(quaternion_multiply(q, pure), quaternion_conjugate(q))[..., 1:]


def matrix_from_quaternion(q: ArrayLike) -> Array:
    """Return the rotation matrix R of a unit quaternion; q and −q give the same.

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Unit quaternions; any other norm scales R by its square.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Its columns are the images of the three axes.

    Raises
    ------
    ValueError
        If `q` is not finite or not of that shape.

    See Also
    --------
    quaternion_from_matrix : The way back.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> matrix_from_quaternion([0, 0, 0, 1])
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    axes = rotate_by_quaternion(as_finite("q", q, 4)[..., None, :], np.eye(3))
    return np.swapaxes(axes, -1, -2)


def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Return the unit quaternion of a rotation matrix, with w ≥ 0.

    The ten products of two components of q are linear in R. They form the matrix 4 q qᵀ; its row
    with the largest diagonal entry is a multiple of q that never vanishes.

    Parameters
    ----------
    R : array_like, shape (..., 3, 3)
        Rotation matrices; what is none is not repaired (see `project_so`).

    Returns
    -------
    ndarray, shape (..., 4)
        Unit quaternions (w, x, y, z), accurate to a few eps.

    Raises
    ------
    ValueError
        If `R` is not finite or not of that shape.

    Notes
    -----
    Singular set: at a half-turn w = 0, and q and −q are equally good. The one whose component of
    largest magnitude (the first of equals) is positive is returned, with w = 0. What differs from
    a half-turn by rounding only, w below 4 eps, counts as one.

    References
    ----------
    BK Remark 7.

    Examples
    --------
    >>> quaternion_from_matrix([[-1, 0, 0], [0, -1, 0], [0, 0, 1]])
    array([0., 0., 0., 1.])
    """
    four_qq = _four_outer(as_finite("R", R, 3, 3))
    largest = np.argmax(np.diagonal(four_qq, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(four_qq, largest[..., None, None], axis=-2)[..., 0, :]
    q = row / _norm(row)
    w, v = _split(q)
    half_turn = np.abs(w) < 4 * EPS
    size = np.abs(v)
    first = np.argmax(size > size.max(axis=-1, keepdims=True) - 1e-8, axis=-1)[..., None]
    sign = np.where(half_turn, np.take_along_axis(v, first, axis=-1), w)
    return np.concatenate([np.where(half_turn, 0.0, w), v], axis=-1) * np.where(sign < 0, -1.0, 1.0)


def slerp(q0: ArrayLike, q1: ArrayLike, t: ArrayLike) -> Array:
    """Return the quaternions on the shorter arc from the rotation q0 to the rotation q1.

    Parameters
    ----------
    q0, q1 : array_like, shape (..., 4)
        Unit quaternions. q1 and −q1 are one rotation: the nearer of the two is the goal.
    t : array_like
        Times in [0, 1], of any shape.

    Returns
    -------
    ndarray, shape t.shape + (..., 4)
        Unit quaternions, at constant angular speed.

    Raises
    ------
    ValueError
        If an argument is not finite, not of its shape, the batches do not broadcast, or a time
        lies outside [0, 1].

    See Also
    --------
    geodesic_so3 : The same curve in matrices, with its velocity.

    Notes
    -----
    Singular set: where q0 · q1 = 0, to 4 eps, the rotations are a half-turn apart and both arcs
    are shortest; the one to q1 as given is taken. Equal quaternions need no care.

    References
    ----------
    BK Remark 7; K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985.

    Examples
    --------
    >>> slerp([1, 0, 0, 0], [0, 0, 0, 1], [0, 1 / 3, 1]).round(3)
    array([[1.   , 0.   , 0.   , 0.   ],
           [0.866, 0.   , 0.   , 0.5  ],
           [0.   , 0.   , 0.   , 1.   ]])
    """
    q0, q1 = as_finite("q0", q0, 4), as_finite("q1", q1, 4)
    u = as_time(t, len(check_broadcast(q0=(q0, 1), q1=(q1, 1))) + 1)
    q1 = np.where(np.sum(q0 * q1, axis=-1, keepdims=True) < -4 * EPS, -q1, q1)
    angle = 2 * np.arctan2(_norm(q1 - q0), _norm(q1 + q0))
    weight0 = (1 - u) * sinc((1 - u) * angle) / sinc(angle)
    weight1 = u * sinc(u * angle) / sinc(angle)
    return weight0 * q0 + weight1 * q1


def _norm(q: Array) -> Array:
    return np.linalg.norm(q, axis=-1, keepdims=True)


def _split(q: Array) -> tuple[Array, Array]:
    return q[..., :1], q[..., 1:]


def _four_outer(R: Array) -> Array:
    """Return 4 q qᵀ, shape (..., 4, 4), for the quaternion q of R."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(R, (-2, -1), (0, 1))
    rows = [
        [1 + a + e + i, h - f, c - g, d - b],
        [h - f, 1 + a - e - i, b + d, c + g],
        [c - g, b + d, 1 - a + e - i, f + h],
        [d - b, c + g, f + h, 1 - a - e + i],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
