"""Quaternions (w, x, y, z) without checks: conversions, and functions of time with derivatives.

A jet lists the values of a function of time and of its derivatives: [x, x', x'', x'''] or fewer. In
jets, the first axis indexes the components: a quaternion has the shape (4, ...), a vector (3, ...).
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from rbcourse._checks import as_finite
from rbcourse._numerics import EPS, Array
from rbcourse._numerics import cross as cross_product

Jet = list[Array]

# Polynomial coefficients, highest power first, of the second and third derivatives of two
# functions: sin(√s)/√s, in powers of s, and arccos(x)², in powers of (1 − x)/2.
_SINC_BEND = [n * (n - 1) * (-1) ** n / math.factorial(2 * n + 1) for n in range(9, 1, -1)]
_ANGLE_BEND = [k * math.prod(j / (j + 0.5) for j in range(1, k + 1)) for k in range(13, 0, -1)]
_SINC_THIRD, _ANGLE_THIRD = np.polyder(_SINC_BEND), -np.polyder(_ANGLE_BEND) / 2


def canonical(q: Array) -> Array:
    """Return q or −q, as `rbcourse.quaternion.canonical_quaternion` does."""
    w, v = q[..., :1], q[..., 1:]
    half_turn = np.abs(w) < 4 * EPS
    size = np.abs(v)
    first = np.argmax(size > size.max(axis=-1, keepdims=True) - 1e-8, axis=-1)[..., None]
    sign = np.where(half_turn, np.take_along_axis(v, first, axis=-1), w)
    return np.concatenate([np.where(half_turn, 0.0, w), v], axis=-1) * np.where(sign < 0, -1.0, 1.0)


def quaternion_of(R: Array) -> Array:
    """Compute `quaternion_from_matrix` without checks: normalise the largest row of 4 q qᵀ."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(R, (-2, -1), (0, 1))
    rows = [
        [1 + a + e + i, h - f, c - g, d - b],
        [h - f, 1 + a - e - i, b + d, c + g],
        [c - g, b + d, 1 - a + e - i, f + h],
        [d - b, c + g, f + h, 1 - a - e + i],
    ]
    four_qq = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
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


def product(p: Jet, q: Jet) -> Jet:
    """Return the jet of Hamilton's product p q of two jets of the same length."""
    return _leibniz(multiply, p, q)


def multiply(p: Array, q: Array) -> Array:
    """Return Hamilton's product of two quaternions, shape (4, ...)."""
    (a, b, c, d), (w, x, y, z) = p, q
    return np.stack(
        [
            a * w - (b * x + c * y + d * z),
            a * x + w * b + (c * z - d * y),
            a * y + w * c + (d * x - b * z),
            a * z + w * d + (b * y - c * x),
        ]
    )


def exp(u: Jet) -> Jet:
    """Return the jet of exp(u) = (cos ‖u‖, sin(‖u‖)/‖u‖ u), where u is half the rotation vector."""
    s = dot(u, u)
    cosine, sinc = _cosine_and_sinc(s[0], len(u) - 1)
    real, share = _chain(cosine, s), _chain(sinc, s)
    return [np.stack([c, *v]) for c, v in zip(real, times(share, u), strict=True)]


def slerp(a: Jet, b: Jet, share: Jet) -> Jet:
    """Return the jet of (sin((1 − t) φ) a + sin(t φ) b)/sin φ, with the angle φ < π from a to b.

    Here t is `share`, and a and b are unit quaternions. sin(t φ)/sin φ = t sinc(t φ)/sinc φ is a
    smooth function of t and s = φ², and s is a smooth function of cos φ = a·b.
    """
    order = len(share) - 1
    cosine = dot(a, b)
    s = _chain(_squared_angle(cosine[0], order), cosine)
    whole = _chain(_cosine_and_sinc(s[0], order)[1], s)
    rest = [1 - share[0], *[-x for x in share[1:]]]
    parts = []
    for quaternion, t in ((a, rest), (b, share)):
        part = times(times(t, t), s)
        sinc = _chain(_cosine_and_sinc(part[0], order)[1], part)
        parts.append(times(_over(times(t, sinc), whole), quaternion))
    return [x + y for x, y in zip(*parts, strict=True)]


def times(share: Jet, x: Jet) -> Jet:
    """Return the jet of `share` times x, for a scalar `share` and a scalar or vector x."""
    return _leibniz(np.multiply, share, x)


def dot(x: Jet, y: Jet) -> Jet:
    """Return the jet of the inner product of two vectors."""
    return _leibniz(_dot, x, y)


def cross(x: Jet, y: Jet) -> Jet:
    """Return the jet of the cross product of two vectors."""
    return _leibniz(partial(cross_product, axis=0), x, y)


def matrix(q: Array, scale: float | Array = 1.0) -> Array:
    """Return `scale` ‖q‖² times the rotation matrix of q, shape (..., 3, 3)."""
    x, y, z = q[1:]
    ww, wx, wy, wz = scale * q[0] * q
    xx, xy, xz = scale * x * q[1:]
    yy, yz = scale * y * q[2:]
    zz = scale * z * z
    rows = (
        (ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)),
        (2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)),
        (2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz),
    )
    R = np.empty((*x.shape, 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            R[..., i, j] = entry
    return R


def rotation(q: Array) -> Array:
    """Return the rotation matrix of a quaternion of any norm except 0, shape (..., 3, 3)."""
    return matrix(q, 1 / _dot(q, q))


def angular_velocity(q: Jet) -> Array:
    """Return w for a jet [q, q'], w' for [q, q', q''], and w'' for [q, q', q'', q'''].

    q must not be 0. The result is in the body frame. With n = ‖q‖², n w = 2 im(q̄ q').
    So n w' + n' w = 2 im(q̄ q'') and n w'' + 2 n' w' + n'' w = 2 im(q̄ q''' + q̄' q'').
    """
    n = _dot(q[0], q[0])
    w = 2 * _imaginary(q[0], q[1]) / n
    if len(q) == 2:
        return w
    a = 2 * (_imaginary(q[0], q[2]) - _dot(q[0], q[1]) * w) / n
    if len(q) == 3:
        return a
    bend = _imaginary(q[0], q[3]) + _imaginary(q[1], q[2])
    n_bend = _dot(q[1], q[1]) + _dot(q[0], q[2])
    return 2 * (bend - 2 * _dot(q[0], q[1]) * a - n_bend * w) / n


def _imaginary(p: Array, q: Array) -> Array:
    """Return the vector part of p̄ q."""
    (a, b, c, d), (w, x, y, z) = p, q
    return np.stack(
        [
            a * x - b * w - c * z + d * y,
            a * y + b * z - c * w - d * x,
            a * z - b * y + c * x - d * w,
        ]
    )


def _dot(x: Array, y: Array) -> Array:
    return np.einsum("i...,i...->...", x, y)


def _leibniz(op: Callable[[Array, Array], Array], x: Jet, y: Jet) -> Jet:
    jet = [op(x[0], y[0])]
    if len(x) > 1:
        jet.append(op(x[1], y[0]) + op(x[0], y[1]))
    if len(x) > 2:
        jet.append(op(x[2], y[0]) + 2 * op(x[1], y[1]) + op(x[0], y[2]))
    if len(x) > 3:
        jet.append(op(x[3], y[0]) + 3 * (op(x[2], y[1]) + op(x[1], y[2])) + op(x[0], y[3]))
    return jet


def _chain(f: list[Array], x: Jet) -> Jet:
    """Return the jet of f(x); `f` lists the value of f and its derivatives at x."""
    jet = f[:1]
    if len(f) > 1:
        jet.append(f[1] * x[1])
    if len(f) > 2:
        jet.append(f[2] * x[1] ** 2 + f[1] * x[2])
    if len(f) > 3:
        jet.append(f[3] * x[1] ** 3 + 3 * f[2] * x[1] * x[2] + f[1] * x[3])
    return jet


def _over(x: Jet, y: Jet) -> Jet:
    """Return the jet of the quotient x/y of two numbers."""
    quotient: Jet = [x[0] / y[0]]
    if len(x) > 1:
        quotient.append((x[1] - quotient[0] * y[1]) / y[0])
    if len(x) > 2:
        quotient.append((x[2] - 2 * quotient[1] * y[1] - quotient[0] * y[2]) / y[0])
    if len(x) > 3:
        rest = 3 * (quotient[2] * y[1] + quotient[1] * y[2]) + quotient[0] * y[3]
        quotient.append((x[3] - rest) / y[0])
    return quotient


def _cosine_and_sinc(s: Array, order: int) -> tuple[list[Array], list[Array]]:
    """Return c = cos √s, k = sin(√s)/√s and their derivatives with respect to s.

    For small s, power series give k'' and k'''. The equations c' = −k/2, 4 s k'' + 6 k' + k = 0 and
    4 s k''' + 10 k'' + k' = 0 give the other derivatives.
    """
    root = np.sqrt(s)
    tangent = np.tan(root / 2)  # tan is NumPy's fastest trigonometric function
    sine = 2 * tangent / (1 + tangent * tangent)
    c, k = 1 - tangent * sine, np.where(root == 0, 1.0, sine / np.where(root == 0, 1.0, root))
    if order == 0:
        return [c], [k]
    small = s < 0.25
    direct = ((3 - s) * k - 3 * c) / np.where(small, 1.0, 4 * s * s)
    k2 = np.where(small, np.polyval(_SINC_BEND, s), direct)
    k1 = -(k / 2 + 2 * s * k2) / 3
    if order < 3:
        return [c, -k / 2, -k1 / 2][: order + 1], [k, k1, k2][: order + 1]
    direct = -(10 * k2 + k1) / np.where(small, 1.0, 4 * s)
    k3 = np.where(small, np.polyval(_SINC_THIRD, s), direct)
    return [c, -k / 2, -k1 / 2, -k2 / 2], [k, k1, k2, k3]


def _squared_angle(x: Array, order: int) -> list[Array]:
    """Return h = arccos(x)² and its derivatives with respect to x.

    Near x = 1, power series give h'' and h'''. Elsewhere, they follow from (1 − x²) h'' = 2 + x h'
    and (1 − x²) h''' = 3 x h'' + h'.
    """
    x = np.clip(x, -1.0, 1.0)
    angle, z = np.arccos(x), (1 - x) * (1 + x)
    g = np.where(x < 1, angle / np.sqrt(np.where(x < 1, z, 1.0)), 1.0)
    if order < 2:
        return [angle**2, -2 * g][: order + 1]
    small, near = x > 0.95, (1 - x) / 2
    direct = 2 * (1 - x * g) / np.where(small, 1.0, z)
    bend = np.where(small, np.polyval(_ANGLE_BEND, near), direct)
    if order == 2:
        return [angle**2, -2 * g, bend]
    direct = (3 * x * bend - 2 * g) / np.where(small, 1.0, z)
    return [angle**2, -2 * g, bend, np.where(small, np.polyval(_ANGLE_THIRD, near), direct)]
