"""Conversions between rotation matrices, quaternions, rotation vectors and ZYX angles.

Parameters
----------
q : array_like, shape (..., 4)
    Unit quaternions.
R : array_like, shape (..., 3, 3)
    Rotation matrices.
w : array_like, shape (..., 3)
    Rotation vectors, in rad.
angles : array_like, shape (..., 3)
    Angles (yaw, pitch, roll), in rad.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse._quaternions import axis_and_angle, quaternion_of, rotation_vector_of
from rbcourse._taylor import matrix
from rbcourse._valid import as_rotations, as_unit_quaternions


@described_by(__doc__, returns="(..., 3, 3)")
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
    return matrix(np.moveaxis(as_unit_quaternions("q", q), -1, 0))


@described_by(__doc__, returns="(..., 4)")
def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix, with w ≥ 0.

    The matrix 4 q qᵀ is linear in R. The row that contains the largest diagonal entry is
    normalised. The result is accurate to a few eps. Singular set: half-turns, where
    `canonical_quaternion` chooses between q and −q.
    Source: BK Remark 7.

    Examples
    --------
    >>> quaternion_from_matrix([[-1, 0, 0], [0, -1, 0], [0, 0, 1]])
    array([0., 0., 0., 1.])
    """
    return quaternion_of(as_rotations("R", R))


@described_by(__doc__)
def quaternion_from_rotation_vector(w: ArrayLike) -> Array:
    """Return the quaternion (cos(a/2), sin(a/2) w/a) of the rotation by a = ‖w‖ about w.

    Source: BK 2.5, RR 2.2.

    Returns
    -------
    ndarray, shape (..., 4)
        The quaternion is (−1, 0, 0, 0) for one full turn, and (1, 0, 0, 0) for two full turns.

    Examples
    --------
    >>> quaternion_from_rotation_vector([[0, 0, np.pi], [0, 0, 2 * np.pi]]).round(12) + 0.0
    array([[ 0.,  0.,  0.,  1.],
           [-1.,  0.,  0.,  0.]])
    """
    axis, angle = axis_and_angle(as_finite("w", w, 3))
    return np.concatenate([np.cos(angle / 2), np.sin(angle / 2) * axis], axis=-1)


@described_by(__doc__, returns="(..., 3)")
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


@described_by(__doc__, returns="(..., 3, 3)")
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


@described_by(__doc__)
def zyx_from_matrix(R: ArrayLike) -> Array:
    """Return the angles (α, β, γ) with R = R_z(α) R_y(β) R_x(γ), as `zyx_from_quaternion` does.

    Source: RR 2.1, RR (7), RR (8).

    Returns
    -------
    ndarray, shape (..., 3)
        The angles reproduce R to a few eps (in gimbal lock, to 40 eps).

    Examples
    --------
    >>> zyx_from_matrix(matrix_from_zyx([0.1, 0.2, 0.3])).round(12)
    array([0.1, 0.2, 0.3])
    """
    return zyx_from_quaternion(quaternion_from_matrix(R))


@described_by(__doc__)
def quaternion_from_zyx(angles: ArrayLike) -> Array:
    """Return q_z(α) q_y(β) q_x(γ) for angles (α, β, γ) of any size: yaw, pitch and roll.

    Source: RR 2.2, where α turns about x and γ about z.

    Returns
    -------
    ndarray, shape (..., 4)
        Unit quaternions.

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


@described_by(__doc__)
def zyx_from_quaternion(q: ArrayLike) -> Array:
    """Return the angles (α, β, γ) with q = ± q_z(α) q_y(β) q_x(γ).

    Singular set: gimbal lock, where β differs from ±π/2 by less than 16 eps. Then only α − γ (for β
    = −π/2, only α + γ) is determined, and γ = 0 is returned. Near gimbal lock, α and γ are accurate
    to eps divided by the distance of β from ±π/2, but α ∓ γ is accurate to eps.
    Source: RR 2.2; E. Bernardes and S. Viollet, Quaternion to Euler angles conversion, PLoS ONE
    17(11), 2022.

    Returns
    -------
    ndarray, shape (..., 3)
        α and γ are in (−π, π], and β is in [−π/2, π/2]. The angles reproduce q to a few eps (in
        gimbal lock, to 20 eps).

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
