"""Unit quaternions (w, x, y, z), rotation vectors, ZYX angles, and conversions between them.

The quaternions q and −q give the same rotation.

Parameters
----------
q : array_like, shape (..., 4)
    Unit quaternions (w, x, y, z). (SciPy's ``as_quat()`` returns (x, y, z, w).)
R : array_like, shape (..., 3, 3)
    Rotation matrices.
w : array_like, shape (..., 3)
    Rotation vectors, in rad.
angles : array_like, shape (..., 3)
    Angles (yaw, pitch, roll), in rad.
p : array_like, shape (..., 3)
    Vectors.
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
from rbcourse._numerics import EPS, Array, in_blocks
from rbcourse._quaternions import (
    axis_and_angle,
    canonical,
    matrix,
    multiply,
    quaternion_of,
    rotation_vector_of,
)
from rbcourse._quaternions import slerp as slerp_jet
from rbcourse._valid import as_rotations, as_unit_quaternions

__all__ = [
    "canonical_quaternion",
    "continuous_quaternions",
    "is_unit_quaternion",
    "matrix_from_quaternion",
    "matrix_from_zyx",
    "project_quaternion",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_from_rotation_vector",
    "quaternion_from_zyx",
    "quaternion_multiply",
    "rotate_by_quaternion",
    "rotation_vector_from_quaternion",
    "slerp",
    "slerp_long",
    "zyx_from_matrix",
    "zyx_from_quaternion",
]

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def matrix_from_quaternion(q: ArrayLike) -> Array:
    """Return the rotation matrix R of a unit quaternion; q and −q give the same matrix.

    Source: RR 2.2.

    Examples
    --------
    >>> matrix_from_quaternion([0, 0, 0, 1])
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    q = as_unit_quaternions("q", q)
    return in_blocks(lambda some: matrix(np.moveaxis(some, -1, 0)), q, 3)


@described_by(__doc__, returns="ndarray, shape (..., 4)")
def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix, with w ≥ 0.

    The result is accurate to a few eps. Singular set: half-turns, where `canonical_quaternion`
    chooses between q and −q.
    Source: BK Remark 7.

    Examples
    --------
    >>> quaternion_from_matrix([[-1, 0, 0], [0, -1, 0], [0, 0, 1]])
    array([0., 0., 0., 1.])
    """
    return quaternion_of(as_rotations("R", R))


@described_by(__doc__, returns="ndarray, shape (..., 4)")
def quaternion_from_rotation_vector(w: ArrayLike) -> Array:
    """Return the quaternion (cos(a/2), sin(a/2) w/a) of the rotation by a = ‖w‖ about w.

    The quaternion is (−1, 0, 0, 0) for one full turn, and (1, 0, 0, 0) for two full turns.
    Source: BK 2.5, RR 2.2.

    Examples
    --------
    >>> quaternion_from_rotation_vector([[0, 0, np.pi], [0, 0, 2 * np.pi]]).round(12) + 0.0
    array([[ 0.,  0.,  0.,  1.],
           [-1.,  0.,  0.,  0.]])
    """
    axis, angle = axis_and_angle(as_finite("w", w, 3))
    return np.concatenate([np.cos(angle / 2), np.sin(angle / 2) * axis], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def rotation_vector_from_quaternion(q: ArrayLike) -> Array:
    """Return the shortest rotation vector of a unit quaternion; q and −q give the same vector.

    Up to rounding, the angle is in [0, π]. The result is accurate to a few eps. Singular set:
    half-turns, where `canonical_quaternion` chooses the axis.
    Source: BK 2.5, RR 2.2.

    Examples
    --------
    >>> rotation_vector_from_quaternion([-(0.5**0.5), 0, 0, -(0.5**0.5)]) + 0.0
    array([0.        , 0.        , 1.57079633])
    """
    return rotation_vector_of(as_unit_quaternions("q", q))


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def matrix_from_zyx(angles: ArrayLike) -> Array:
    """Return R_z(α) R_y(β) R_x(γ) for angles (α, β, γ) of any size: yaw, pitch and roll.

    The turns are about axes of the *body*: first z, then the new y, then the new x. Equivalently,
    they are about *fixed* axes: first x, then y, then z.
    Source: RR 2.1, RR (7), RR (8).

    Examples
    --------
    >>> matrix_from_zyx([np.pi / 2, 0, 0]).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    alpha, beta, gamma = np.moveaxis(as_finite("angles", angles, 3), -1, 0)
    return _turn_about(2, alpha) @ _turn_about(1, beta) @ _turn_about(0, gamma)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def zyx_from_matrix(R: ArrayLike) -> Array:
    """Return the angles (α, β, γ) with R = R_z(α) R_y(β) R_x(γ), as `zyx_from_quaternion` does.

    The angles reproduce R to a few eps (in gimbal lock, to 40 eps).
    Source: RR 2.1, RR (7), RR (8).

    Examples
    --------
    >>> zyx_from_matrix(matrix_from_zyx([0.1, 0.2, 0.3])).round(12)
    array([0.1, 0.2, 0.3])
    """
    return zyx_from_quaternion(quaternion_from_matrix(R))


@described_by(__doc__, returns="ndarray, shape (..., 4)")
def quaternion_from_zyx(angles: ArrayLike) -> Array:
    """Return q_z(α) q_y(β) q_x(γ) for angles (α, β, γ) of any size: yaw, pitch and roll.

    Source: RR 2.2, where α turns about x and γ about z.

    Examples
    --------
    >>> quaternion_from_zyx([np.pi, 0, 0]).round(12)
    array([0., 0., 0., 1.])
    """
    half = np.moveaxis(as_finite("angles", angles, 3), -1, 0) / 2
    ca, cb, cc = np.cos(half)
    sa, sb, sc = np.sin(half)
    w = ca * cb * cc + sa * sb * sc
    x = ca * cb * sc - sa * sb * cc
    y = ca * sb * cc + sa * cb * sc
    z = sa * cb * cc - ca * sb * sc
    return np.stack([w, x, y, z], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def zyx_from_quaternion(q: ArrayLike) -> Array:
    """Return the angles (α, β, γ) with q = ± q_z(α) q_y(β) q_x(γ).

    Singular set: gimbal lock, where β differs from ±π/2 by less than 16 eps. Then only α − γ (for β
    = −π/2, only α + γ) is determined, and γ = 0 is returned. Near gimbal lock, α and γ are accurate
    to eps divided by the distance of β from ±π/2, but α ∓ γ is accurate to eps. α and γ are in (−π,
    π], and β is in [−π/2, π/2]. The angles reproduce q to a few eps (in gimbal lock, to 20 eps).
    Source: RR 2.2; E. Bernardes and S. Viollet, Quaternion to Euler angles conversion, PLoS ONE
    17(11), 2022.

    Examples
    --------
    >>> zyx_from_quaternion([0.5, -0.5, 0.5, 0.5]).round(4)  # locked: 90° about z, 90° about y
    array([1.5708, 1.5708, 0.    ])
    """
    w, x, y, z = np.moveaxis(as_unit_quaternions("q", q), -1, 0)
    minus = 2 * np.arctan2(z - x, w + y)  # α − γ
    plus = 2 * np.arctan2(z + x, w - y)  # α + γ
    up, down = np.hypot(w + y, z - x), np.hypot(w - y, z + x)
    lock_up = down < 8 * EPS * up  # π/2 − |β| is twice the ratio
    lock_down = up < 8 * EPS * down
    plus, minus = np.where(lock_up, minus, plus), np.where(lock_down, plus, minus)
    alpha, gamma = _wrapped((plus + minus) / 2), _wrapped((plus - minus) / 2)
    beta = 2 * np.arctan2(up, down) - np.pi / 2
    return np.stack([alpha, beta, gamma], axis=-1)


@described_by(returns="ndarray of bool, shape (...)")
def is_unit_quaternion(q: ArrayLike, atol: float = 1e-9) -> NDArray[np.bool_]:
    """Return whether quaternions have norm 1.

    Source: RR 1.2, RR (3).

    Parameters
    ----------
    q : array_like, shape (..., 4)
        Quaternions with non-finite entries give False.
    atol : float, optional
        The largest accepted difference of the norm from 1.

    Examples
    --------
    >>> is_unit_quaternion([[0.6, 0, 0.8, 0], [1, 1, 0, 0]])
    array([ True, False])
    """
    atol = as_tolerance("atol", atol)
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.linalg.norm(as_array("q", q, 4), axis=-1)
        return ((np.abs(norm - 1) <= atol) & np.isfinite(norm))[()]


@described_by(returns="ndarray, shape (..., 4)")
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


@described_by(quaternion_multiply, returns="ndarray, shape (..., 4)")
def quaternion_conjugate(q: ArrayLike) -> Array:
    """Return (w, −x, −y, −z), the inverse of a unit quaternion.

    Source: RR 2.2.

    Examples
    --------
    >>> quaternion_multiply([0.6, 0, 0.8, 0], quaternion_conjugate([0.6, 0, 0.8, 0]))
    array([1., 0., 0., 0.])
    """
    return as_finite("q", q, 4) * _CONJUGATE + 0.0


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def rotate_by_quaternion(q: ArrayLike, p: ArrayLike) -> Array:
    """Return rotated points: the vector part of q p q⁻¹.

    Source: RR 2.2.

    Examples
    --------
    >>> rotate_by_quaternion([0, 0, 0, 1], [1, 2, 3])  # a half-turn about z
    array([-1., -2.,  3.])
    """
    q, p = as_unit_quaternions("q", q), as_finite("p", p, 3)
    check_broadcast(q=(q, 1), p=(p, 1))
    pure = np.concatenate([np.zeros((*p.shape[:-1], 1)), p], axis=-1)
    return quaternion_multiply(quaternion_multiply(q, pure), quaternion_conjugate(q))[..., 1:]


@described_by(returns="ndarray, shape (..., 4)")
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


@described_by(quaternion_multiply, returns="ndarray, shape (..., 4)")
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


@described_by(returns="ndarray, shape (N, ..., 4) or (4,)")
def continuous_quaternions(q: ArrayLike) -> Array:
    """Choose the signs of quaternions along a path so that each is near to the previous one.

    Unlike the quaternions of `quaternion_from_matrix`, the result does not jump where w passes
    through 0. Singular set: successive rotations are a half-turn apart. The sign is then changed if
    the previous sign was changed. The first quaternion keeps its sign.

    Parameters
    ----------
    q : array_like, shape (N, ..., 4) or (4,)
        Quaternions of any norm; the first axis is time. A single quaternion is returned unchanged.

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


@described_by(returns="ndarray, shape t.shape + (..., 4)")
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


@described_by(slerp, returns="ndarray, shape t.shape + (..., 4)")
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


def _wrapped(angle: Array) -> Array:
    """Wrap angles in (−2π, 2π) to (−π, π]; an angle that equals −π up to rounding becomes π."""
    angle = np.where(angle > np.pi, angle - 2 * np.pi, angle)
    angle = np.where(angle < -np.pi * (1 - 4 * EPS), angle + 2 * np.pi, angle)
    return np.minimum(angle, np.pi)


def _turn_about(axis: int, angle: Array) -> Array:
    """Return R_x, R_y or R_z, shape (..., 3, 3): the matrices of RR (7)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((*angle.shape, 3, 3))
    R[..., axis, axis] = 1
    R[..., i, i] = R[..., j, j] = np.cos(angle)
    R[..., j, i] = np.sin(angle)
    R[..., i, j] = -R[..., j, i]
    return R


def _norm(q: Array) -> Array:
    return np.linalg.norm(q, axis=-1, keepdims=True)
