"""The straight line between two rotations: its singular values, and θ and f, which time it."""

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import (
    Array,
    as_angle,
    as_finite,
    as_time,
    check_broadcast,
    check_order,
    sinc,
)

_PI_REST = 1.2246467991473532e-16  # π − np.pi


def line_singular_value(t: ArrayLike, angle: ArrayLike) -> Array:
    """Return s(t): the line (1 − t) I + t R2 has the singular values 1, s(t), s(t).

    Parameters
    ----------
    t : array_like
        Where on the line, any real numbers; broadcasts with `angle`.
    angle : array_like
        The angle ‖ω₀‖ of the rotation R2, in [0, π] rad.

    Returns
    -------
    ndarray
        √(cos²(‖ω₀‖/2) + (2t − 1)² sin²(‖ω₀‖/2)), accurate to a few eps relative.

    Raises
    ------
    ValueError
        If an argument is not finite, `angle` is outside [0, π], or they do not broadcast.

    Notes
    -----
    It vanishes at t = 1/2, angle π only: the middle of the line between rotations a half-turn
    apart has no unique nearest rotation.

    References
    ----------
    BK (17).

    Examples
    --------
    >>> line_singular_value([0, 0.5, 1], np.pi / 2).round(3)
    array([1.   , 0.707, 1.   ])
    """
    t, angle = _where_and_angle(as_finite("t", t), angle)
    return np.hypot(np.cos(angle / 2), (2 * t - 1) * np.sin(angle / 2))


def theta(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return how far along the geodesic the projection of the straight line is.

    The nearest rotation to (1 − t) I + t exp(ω̂₀) is exp(ω̂₀ θ(t)). For a line that is run
    through as f(t), θ is ``theta(f(t), angle)``.

    Parameters
    ----------
    t : array_like
        Where on the line, any real numbers; broadcasts with `angle`.
    angle : array_like
        The angle ‖ω₀‖, in [0, π] rad.
    order : {0, 1, 2}, optional
        Which derivative with respect to t.

    Returns
    -------
    ndarray
        θ = 1/2 + atan((2t − 1) tan(‖ω₀‖/2))/‖ω₀‖, accurate to a few eps times max(1, |θ|); or a
        derivative, accurate to a few eps relative.

    Raises
    ------
    ValueError
        If an argument is not finite, `angle` is outside [0, π], they do not broadcast, or `order`
        is another.

    See Also
    --------
    f : The inverse function of t.

    Notes
    -----
    Angle 0: the limit, θ(t) = t. Angle π is singular: θ is 0 before t = 1/2, 1/2 there and 1 after
    it. `numpy.pi` is less than π by 1.2e-16, so there the jump has the finite slope 1e16.

    References
    ----------
    BK (16), BK Prop. 6, BK Cor. 1. The derivative is (sin ‖ω₀‖/‖ω₀‖)/s², where the paper prints
    s, with s from BK (17).

    Examples
    --------
    >>> theta([0, 0.25, 0.5, 1], np.pi / 2).round(3)
    array([0.   , 0.205, 0.5  , 1.   ])
    """
    t, angle = _where_and_angle(as_finite("t", t), angle)
    if check_order(order) == 0:
        tiny = angle < 1e-290
        turn = np.where(tiny, 1.0, angle)
        return np.where(tiny, t, 0.5 + np.arctan((2 * t - 1) * np.tan(turn / 2)) / turn)[()]
    s = line_singular_value(t, angle)
    if order == 1:
        return sinc(angle) / s**2
    return -4 * (2 * t - 1) * np.sin(angle / 2) ** 2 * sinc(angle) / s**4


def f(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return where on the straight line to be at time t, for a projection of constant speed.

    It is the inverse of `theta`: theta(f(t)) = t. Rounding f disturbs that by up to
    eps · 2 tan(‖ω₀‖/2)/‖ω₀‖, the greatest slope of θ.

    Parameters
    ----------
    t : array_like
        Times in [0, 1]; broadcasts with `angle`.
    angle : array_like
        The angle ‖ω₀‖, in [0, π] rad.
    order : {0, 1, 2}, optional
        Which derivative with respect to t.

    Returns
    -------
    ndarray
        f = sin(‖ω₀‖ t)/(sin(‖ω₀‖ (1 − t)) + sin(‖ω₀‖ t)), or a derivative; accurate to a few eps
        relative.

    Raises
    ------
    ValueError
        If an argument is not finite, a time is outside [0, 1], `angle` is outside [0, π], they do
        not broadcast, or `order` is another.

    See Also
    --------
    theta : The inverse function of t.

    Notes
    -----
    Angle 0: the limit, f(t) = t. Angle π is singular: f is 0 at t = 0, 1 at t = 1, and 1/2 at all
    times between. `numpy.pi` is less than π by 1.2e-16, so there f' is about 1e16 at the ends.

    References
    ----------
    BK Cor. 2.

    Examples
    --------
    >>> f([0, 0.25, 0.5, 1], np.pi / 2).round(3)
    array([0.   , 0.293, 0.5  , 1.   ])
    """
    t, angle = _where_and_angle(as_time(t, 0), angle)
    before, near = t <= 0.5, np.minimum(t, 1 - t)
    cosine = np.sin(((np.pi - angle) + _PI_REST) / 2 + angle * near)  # cos(angle (1/2 − t))
    if check_order(order) == 0:
        first_half = near * sinc(angle * near) / (sinc(angle / 2) * cosine)
        return np.where(before, first_half, 1 - first_half)[()]
    middle_speed = np.cos(angle / 2) / sinc(angle / 2)
    if order == 1:
        return middle_speed / cosine**2
    return -2 * angle * middle_speed * np.sin(angle * (0.5 - t)) / cosine**3


def _where_and_angle(t: Array, angle: ArrayLike) -> tuple[Array, Array]:
    angle = as_angle(angle)
    check_broadcast(t=(t, 0), angle=(angle, 0))
    return t, angle
