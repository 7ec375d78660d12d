"""The straight line between two rotations: the timings θ and f of its projection on SO(3).

Parameters
----------
t : array_like, shape (...)
    The positions on the line, which may be any real numbers.
angle : array_like, shape (...)
    The angle ‖ω₀‖ of the rotation R2 = exp(ω̂₀) at the end of the line, in [0, π].
order : {0, 1, 2, 3}, optional
    The order of the derivative with respect to t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_angle, as_finite, as_time, check_broadcast, check_order
from rbcourse._docs import described_by
from rbcourse._numerics import Array, sinc

__all__ = ["f", "line_singular_value", "theta"]

_PI_REST = 1.2246467991473532e-16  # π − np.pi


@described_by(__doc__, returns="ndarray, shape (...)")
def line_singular_value(t: ArrayLike, angle: ArrayLike) -> Array:
    """Return s(t) for the line (1 − t) I + t R2, whose singular values are 1, s(t), s(t).

    s vanishes only for the angle π at t = 1/2, where the nearest rotation is not unique. s(t) is
    √(1 − 2 t (1 − t) (1 − cos ‖ω₀‖)), computed as √(cos²(‖ω₀‖/2) + (2t − 1)² sin²(‖ω₀‖/2)) with a
    relative error of a few eps.
    Source: BK (17).

    Examples
    --------
    >>> line_singular_value([0, 0.5, 1], np.pi / 2).round(3)
    array([1.   , 0.707, 1.   ])
    """
    return singular_value(*_where_and_angle(as_finite("t", t), angle))


@described_by(__doc__, returns="ndarray, shape (...)")
def theta(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return θ(t), or a derivative, where exp(ω̂₀ θ(t)) is nearest to (1 − t) I + t exp(ω̂₀).

    With a = ‖ω₀‖, θ(t) = atan2(t sin a, 1 − t + t cos a)/a. (The paper prints the arguments of
    atan2 in the other order, and f(t) in place of t.) The form in the code is measured from the
    middle, where θ = 1/2; it loses no digits near a = π.

    For the angle 0, the limit θ(t) = t is returned. The angle π is singular: θ is 0 before t = 1/2,
    1/2 at this time and 1 after it. For `numpy.pi`, which is less than π by 1.2e-16, the jump has
    the finite slope 1e16. θ is accurate to a few eps times
    max(1, abs(θ)). Derivatives have a relative error of a few eps.
    Source: BK (16), BK Prop. 6, BK Cor. 1. The derivative is (sin ‖ω₀‖/‖ω₀‖)/s², with s from BK
    (17); the paper prints s instead of s².

    Examples
    --------
    >>> theta([0, 0.25, 0.5, 1], np.pi / 2).round(3)
    array([0.   , 0.205, 0.5  , 1.   ])
    """
    t, angle = _where_and_angle(as_finite("t", t), angle)
    if check_order(order, 3) == 0:
        return theta_at(t, angle)
    s = singular_value(t, angle)
    if order == 1:
        return theta_rate(angle, s)
    return theta_bend(t, angle, s) if order == 2 else theta_third(t, angle, s)


@described_by(theta, returns="ndarray, shape (...)")
def f(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return the position f(t) for which the projection has constant speed, or a derivative.

    The function f is the inverse of `theta`: theta(f(t)) = t, that is, a θ(f(t)) = a t with a =
    ‖ω₀‖, where the paper prints t on the right. The rounding of f changes theta(f(t)) by up to eps
    · 2 tan(‖ω₀‖/2)/‖ω₀‖, that is, eps times the greatest slope of θ.

    For the angle 0, the limit f(t) = t is returned. The angle π is singular: f is 0 at t = 0, 1 at
    t = 1, and 1/2 at all times in between. For `numpy.pi`, which is less than π by 1.2e-16, f' is
    about 1e16 at the ends. f(t) is sin(‖ω₀‖ t)/(sin(‖ω₀‖ (1 − t)) + sin(‖ω₀‖ t)). The result has a
    relative error of a few eps.
    Source: BK Cor. 2.

    Parameters
    ----------
    t : array_like, shape (...)
        Times in [0, 1].

    Examples
    --------
    >>> f([0, 0.25, 0.5, 1], np.pi / 2).round(3)
    array([0.   , 0.293, 0.5  , 1.   ])
    """
    t, angle = _where_and_angle(as_time(t, 0), angle)
    before, near = t <= 0.5, np.minimum(t, 1 - t)
    cosine = np.sin(((np.pi - angle) + _PI_REST) / 2 + angle * near)  # cos(angle (1/2 − t))
    if check_order(order, 3) == 0:
        first_half = near * sinc(angle * near) / (sinc(angle / 2) * cosine)
        return np.where(before, first_half, 1 - first_half)[()]
    middle_speed = np.cos(angle / 2) / sinc(angle / 2)
    if order == 1:
        return middle_speed / cosine**2
    sine = np.sin(angle * (0.5 - t))
    if order == 2:
        return -2 * angle * middle_speed * sine / cosine**3
    return 2 * angle**2 * middle_speed * (1 + 2 * sine**2) / cosine**4


def _where_and_angle(t: Array, angle: ArrayLike) -> tuple[Array, Array]:
    angle = as_angle(angle)
    check_broadcast(t=(t, 0), angle=(angle, 0))
    return t, angle


def singular_value(t: Array, angle: Array) -> Array:
    return np.hypot(np.cos(angle / 2), (2 * t - 1) * np.sin(angle / 2))


def theta_at(t: Array, angle: Array) -> Array:
    tiny = angle < 1e-290  # the quotient below would lose digits in subnormal numbers
    turn = np.where(tiny, 1.0, angle)
    return np.where(tiny, t, 0.5 + np.arctan((2 * t - 1) * np.tan(turn / 2)) / turn)[()]


def theta_rate(angle: Array, s: Array) -> Array:
    return sinc(angle) / s**2


def theta_bend(t: Array, angle: Array, s: Array) -> Array:
    return -4 * (2 * t - 1) * np.sin(angle / 2) ** 2 * sinc(angle) / s**4


def theta_third(t: Array, angle: Array, s: Array) -> Array:
    steep = 4 * (2 * t - 1) * np.sin(angle / 2) ** 2
    return sinc(angle) * (2 * steep**2 / s**2 - 8 * np.sin(angle / 2) ** 2) / s**4
