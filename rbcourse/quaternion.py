"""Unit quaternions (w, x, y, z) as rotations; q and −q give the same rotation.

Parameters
----------
q : array_like, shape (..., 4)
    Quaternions of any norm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import (
    as_array,
    as_finite,
    as_time,
    as_tolerance,
    as_unit,
    check_broadcast,
    first_index,
)
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse._quaternions import canonical
from rbcourse._taylor import multiply
from rbcourse._taylor import slerp as slerp_jet
from rbcourse._valid import as_unit_quaternions
from rbcourse.conversions import (
    quaternion_from_rotation_vector,
    quaternion_from_zyx,
    rotation_vector_from_quaternion,
    zyx_from_quaternion,
)

__all__ = [
    "canonical_quaternion",
    "continuous_quaternions",
    "is_unit_quaternion",
    "project_quaternion",
    "quaternion_conjugate",
    "quaternion_from_rotation_vector",
    "quaternion_from_zyx",
    "quaternion_multiply",
    "rotate_by_quaternion",
    "rotation_vector_from_quaternion",
    "slerp",
    "slerp_long",
    "zyx_from_quaternion",
]

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def is_unit_quaternion(q: ArrayLike, atol: float = 1e-9) -> NDArray[np.bool_]:
    """Return whether quaternions have norm 1.

    Source: RR 1.2, RR (3).

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Quaternions with non-finite entries give False.
    atol : float, optional
        The largest accepted difference of the norm from 1.

    Returns
    -------
    ndarray of bool, shape (...)

    Examples
    --------
    >>> is_unit_quaternion([[0.6, 0, 0.8, 0], [1, 1, 0, 0]])
    array([ True, False])
    """
    atol = as_tolerance("atol", atol)
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.linalg.norm(as_array("q", q, 4), axis=-1)
        return ((np.abs(norm - 1) <= atol) & np.isfinite(norm))[()]


@described_by(returns="(..., 4)")
def quaternion_multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Return Hamilton's product p q of quaternions (w, x, y, z): rotation by q, and then by p.

    Source: RR 2.2.

    Parameters
    ----------
    p, q : array_like, shape (..., 4)
        Quaternions of any norm.

    Examples
    --------
    >>> quaternion_multiply([0, 1, 0, 0], [0, 0, 1, 0])  # i j = k
    array([0., 0., 0., 1.])
    """
    p, q = as_finite("p", p, 4), as_finite("q", q, 4)
    check_broadcast(p=(p, 1), q=(q, 1))
    return np.moveaxis(multiply(np.moveaxis(p, -1, 0), np.moveaxis(q, -1, 0)), 0, -1)


@described_by(__doc__, returns="(..., 4)")
def quaternion_conjugate(q: ArrayLike) -> Array:
    """Return (w, −x, −y, −z), the inverse of a unit quaternion.

    Source: RR 2.2.

    Examples
    --------
    >>> quaternion_multiply([0.6, 0, 0.8, 0], quaternion_conjugate([0.6, 0, 0.8, 0]))
    array([1., 0., 0., 0.])
    """
    return as_finite("q", q, 4) * _CONJUGATE + 0.0


@described_by(returns="(..., 3)")
def rotate_by_quaternion(q: ArrayLike, p: ArrayLike) -> Array:
    """Return rotated points: the vector part of q p q⁻¹.

    Source: RR 2.2.

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Unit quaternions.
    p : array_like, shape (..., 3)
        Vectors.

    Examples
    --------
    >>> rotate_by_quaternion([0, 0, 0, 1], [1, 2, 3])  # a half-turn about z
    array([-1., -2.,  3.])
    """
    q, p = as_unit_quaternions("q", q), as_finite("p", p, 3)
    check_broadcast(q=(q, 1), p=(p, 1))
    pure = np.concatenate([np.zeros((*p.shape[:-1], 1)), p], axis=-1)
    return quaternion_multiply(quaternion_multiply(q, pure), quaternion_conjugate(q))[..., 1:]


@described_by(returns="(..., 4)")
def project_quaternion(q: ArrayLike) -> Array:
    """Return the unit quaternion nearest to q, which is q/‖q‖.

    Singular set: q = 0, to which all unit quaternions are equally near; it raises ValueError.
    Source: RR 1.5, RR (6), RR Fig. 2.

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Quaternions (w, x, y, z) other than 0.

    Examples
    --------
    >>> project_quaternion([10, 10, 10, 10])
    array([0.5, 0.5, 0.5, 0.5])
    """
    return as_unit("q", q, 4)


@described_by(__doc__, returns="(..., 4)")
def canonical_quaternion(q: ArrayLike) -> Array:
    """Return q or −q, whichever has w ≥ 0: a unique quaternion for each rotation.

    Singular set: half-turns, where ``abs(w) < 4 eps``. Then w is set to 0, and the sign is
    chosen so that the component of largest magnitude is positive. If several components have the
    largest magnitude (up to 1e-8), the first of them is made positive.
    Source: BK Remark 7.

    Examples
    --------
    >>> canonical_quaternion([[-0.6, 0, 0.8, 0], [0, -1, 0, 0]]) + 0.0
    array([[ 0.6,  0. , -0.8,  0. ],
           [ 0. ,  1. ,  0. ,  0. ]])
    """
    return canonical(as_finite("q", q, 4))


def continuous_quaternions(q: ArrayLike) -> Array:
    """Choose the signs of quaternions along a path so that each is near to the previous one.

    Unlike the quaternions of `quaternion_from_matrix`, the result does not jump where w passes
    through 0. Singular set: successive rotations are a half-turn apart. The sign is then changed if
    the previous sign was changed.

    Parameters
    ----------
    q : array_like, shape (N, ..., 4) or (4,)
        Quaternions of any norm; the first axis is time. A single quaternion is returned unchanged.

    Returns
    -------
    ndarray, shape (N, ..., 4) or (4,)
        The quaternions ± q; the first one keeps its sign.

    Examples
    --------
    >>> continuous_quaternions([[0.28, 0.96, 0, 0], [0.28, -0.96, 0, 0]])
    array([[ 0.28,  0.96,  0.  ,  0.  ],
           [-0.28,  0.96,  0.  ,  0.  ]])
    """
    q = as_finite("q", q, 4)
    if q.ndim < 2:
        return q + 0.0
    turned = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0
    q[1:] *= np.cumprod(np.where(turned, -1.0, 1.0), axis=0)
    return q + 0.0


@described_by(returns="t.shape + (..., 4)")
def slerp(q0: ArrayLike, q1: ArrayLike, t: ArrayLike) -> Array:
    """Return the quaternions on the shorter arc from the rotation q0 to the rotation q1.

    The angular speed is constant. Singular set: half-turns, where q0 · q1 is 0 up to 4 eps. Of the
    two shortest arcs, the arc to the given q1 is returned.
    Source: BK Remark 7; K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985.

    Parameters
    ----------
    q0, q1 : array_like, shape (..., 4)
        Unit quaternions. The arc ends at q1 or −q1, whichever is nearer to q0.
    t : array_like
        Times in [0, 1], of any shape.

    Examples
    --------
    >>> slerp([1, 0, 0, 0], [0, 0, 0, 1], [0, 1 / 3, 1]).round(3)
    array([[1.   , 0.   , 0.   , 0.   ],
           [0.866, 0.   , 0.   , 0.5  ],
           [0.   , 0.   , 0.   , 1.   ]])
    """
    q0, q1 = as_unit_quaternions("q0", q0), as_unit_quaternions("q1", q1)
    batch = check_broadcast(q0=(q0, 1), q1=(q1, 1))
    u = as_time(t, len(batch))
    nearer = np.where(np.sum(q0 * q1, axis=-1, keepdims=True) < -4 * EPS, -q1, q1)
    first, last = (
        np.moveaxis(np.broadcast_to(q, (*batch, 4)), -1, 0).reshape(4, *[1] * np.ndim(t), *batch)
        for q in (q0, nearer)
    )
    (value,) = slerp_jet([first], [last], [u])
    return np.moveaxis(value, 0, -1)


@described_by(slerp, returns="t.shape + (..., 4)")
def slerp_long(q0: ArrayLike, q1: ArrayLike, t: ArrayLike) -> Array:
    """Return the quaternions on the longer arc from the rotation q0 to the rotation q1.

    If `slerp` turns by the angle a about an axis, this function turns by 2π − a about the opposite
    axis. If `slerp` ends at q1, this function ends at −q1, and vice versa. Singular set: q0 and q1
    are the same rotation up to 4 eps; ValueError is raised. Near this set, the axis is accurate to
    eps/‖q1 − q0‖.
    Source: BK Remark 7; K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985.

    Examples
    --------
    >>> slerp_long([1, 0, 0, 0], [0.5**0.5, 0, 0, 0.5**0.5], [0, 2 / 3, 1]).round(3) + 0.0
    array([[ 1.   ,  0.   ,  0.   ,  0.   ],
           [ 0.   ,  0.   ,  0.   , -1.   ],
           [-0.707,  0.   ,  0.   , -0.707]])
    """
    q0, q1 = as_unit_quaternions("q0", q0), as_unit_quaternions("q1", q1)
    u = as_time(t, len(check_broadcast(q0=(q0, 1), q1=(q1, 1))) + 1)
    back = np.where(np.sum(q0 * q1, axis=-1, keepdims=True) < -4 * EPS, -q1, q1) - q0
    size = _norm(back)
    if (size < 4 * EPS).any():
        entry = first_index("q1", size[..., 0] < 4 * EPS)
        raise ValueError(f"{entry} is the same rotation as q0: the long way round has no axis")
    angle = 2 * np.pi - 4 * np.arctan2(size, _norm(back + 2 * q0))
    side = np.sum(back * q0, axis=-1, keepdims=True) * q0 - back
    return np.cos(u * angle / 2) * q0 + np.sin(u * angle / 2) * side / _norm(side)


def _norm(q: Array) -> Array:
    return np.linalg.norm(q, axis=-1, keepdims=True)
