"""Quaternions (w, x, y, z), rotation vectors and matrices: conversions without checks."""

from __future__ import annotations

import numpy as np

from rbcourse._checks import as_finite
from rbcourse._numerics import EPS, Array


def canonical(q: Array) -> Array:
    """Return q or −q, as `rbcourse.quaternion.canonical_quaternion` does."""
    w, v = q[..., :1], q[..., 1:]
    half_turn = np.abs(w) < 4 * EPS
    size = np.abs(v)
    first = np.argmax(size > size.max(axis=-1, keepdims=True) - 1e-8, axis=-1)[..., None]
    sign = np.where(half_turn, np.take_along_axis(v, first, axis=-1), w)
    return np.concatenate([np.where(half_turn, 0.0, w), v], axis=-1) * np.where(sign < 0, -1.0, 1.0)


def quaternion_of(R: Array) -> Array:
    """Compute `quaternion_from_matrix` without checks."""
    four_qq = _four_outer(R)
    largest = np.argmax(np.diagonal(four_qq, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(four_qq, largest[..., None, None], axis=-2)[..., 0, :]
    return canonical(row / np.linalg.norm(row, axis=-1, keepdims=True))


def rotation_vector_of(q: Array) -> Array:
    """Compute `rotation_vector_from_quaternion` without checks."""
    q = canonical(q)
    w, v = q[..., :1], q[..., 1:]
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    turning = sine > 0
    return v * np.where(turning, 2 * np.arctan2(sine, w) / np.where(turning, sine, 1.0), 2.0)


def axis_and_angle(w: Array) -> tuple[Array, Array]:
    """Return the unit vector n, shape (..., 3), and a ≥ 0, shape (..., 1), with w = a n.

    If w is 0, n and a are 0. If the norm overflows, ValueError is raised.
    """
    with np.errstate(over="ignore"):
        angle = np.linalg.norm(w, axis=-1, keepdims=True)
        extreme = ~((angle > 1e-150) & (angle < 1e150))[..., 0]
        if extreme.any():  # w is zero, or its square overflows or underflows
            angle[extreme] = np.hypot.reduce(w[extreme], axis=-1, keepdims=True)
            as_finite("norm of w", angle[..., 0])
    return w / np.where(angle == 0, 1.0, angle), angle


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
