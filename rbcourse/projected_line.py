"""The straight line between two rotations, its projection on SO(3), and its timing by θ and f."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_angle, as_array, as_finite, as_time, check_broadcast, check_order
from rbcourse._numerics import EPS, Array, sinc
from rbcourse.curves import (
    AlongGeodesic,
    check_defined,
    geodesic_data,
    identity,
    near_margins,
    which_curve,
)
from rbcourse.projection import NOT_UNIQUE, warn_if_nearly_singular

__all__ = [
    "Progress",
    "ProjectedLine",
    "f",
    "line_singular_value",
    "projected_line_so3",
    "theta",
]

Progress = Callable[[Array, int], ArrayLike]

_PI_REST = 1.2246467991473532e-16  # π − np.pi


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ProjectedLine(AlongGeodesic):
    """The projection of a straight line between two rotations; here p(t) = θ(f(t)).

    Source: BK Prop. 6, BK (15), BK (17).

    Attributes
    ----------
    margin : ndarray, shape (...)
        2 cos(‖σ‖/2). This is the minimum, over all M on the line, of the sum of the two smallest
        eigenvalues of RᵀM, where R is the projection of M. If the margin is 0, the middle of the
        line has no unique projection.
    """

    timing: Progress
    number: NDArray[np.intp]  # for each given timing, the index of its curve in the stack
    timed: tuple[int, ...]  # the shape of this stack

    @property
    def margin(self) -> Array:
        """The minimum over time of the sum of the two smallest eigenvalues of RᵀM."""
        return 2 * np.cos(self._angle / 2)

    @property
    def _angle(self) -> Array:
        return as_angle(np.linalg.norm(self.rotation_vector, axis=-1))

    def _progress(self, t: Array, order: int) -> Array:
        """Return θ(f(t)) or a derivative, by the chain rule."""
        on_line, angle = self.on_line(t, 0), self._angle
        s = _singular_value(on_line, angle)
        check_defined(t, s < 8 * EPS, NOT_UNIQUE)
        if order == 0:
            return _theta(on_line, angle)
        slope, speed = _theta_rate(angle, s), self.on_line(t, 1)
        if order == 1:
            return slope * speed
        bend, push = _theta_bend(on_line, angle, s), self.on_line(t, 2)
        if order == 2:
            return bend * speed**2 + slope * push
        third = _theta_third(on_line, angle, s) * speed**3
        return third + 3 * bend * speed * push + slope * self.on_line(t, 3)

    def on_line(self, t: Array, order: int) -> Array:
        """Return f or a derivative for the curves of a stack, shape (T, count) or (T, 1)."""
        if self.timing is identity:
            return identity(t, order)
        if t.shape[1] == 1 and t.size:
            values = np.take(self._f_at(t[:, 0], order), self.number, axis=1, mode="clip")
        elif t.size and self._f_at(t[0, :1], order).shape[1] == 1:  # f is the same for all curves
            values = self._f_at(t.ravel(), order).reshape(t.shape)
        else:
            values = np.empty(t.shape)
            for curve, number in enumerate(self.number):
                values[:, curve] = self._f_at(t[:, curve], order)[:, number]
        check_defined(t, ~np.isfinite(values), f"f(t, {order}) is not a finite number")
        return values

    def _f_at(self, t: Array, order: int) -> Array:
        """Return f or a derivative at the times t; the shape is (T, 1), or (T, N) for N curves."""
        name, shape, each = f"f(t, {order})", (len(t), *self.timed), [1] * len(self.timed)
        value = as_array(name, self.timing(t.copy().reshape(-1, *each), order))
        try:
            np.broadcast_to(value, shape)
        except ValueError as error:
            raise ValueError(f"{name}: shape {shape} is wanted, got {value.shape}") from error
        if value.size == 1 or value.shape[-len(shape) :] == (len(t), *each):
            return np.broadcast_to(value.reshape(-1, 1), (len(t), 1))
        return np.broadcast_to(value, shape).reshape(len(t), -1)

    @property
    def breakpoints(self) -> Array:
        """The `Curve.breakpoints`, refined near t = 1/2 if the margin is small."""
        return near_margins(super().breakpoints, 0.5, self.margin)


def projected_line_so3(
    R0: ArrayLike, R1: ArrayLike, f: Progress | None = None, *, duration: ArrayLike = 1.0
) -> ProjectedLine:
    """Return the curve R0 exp(σ̂ θ(f(t))): the projection of the line R0 + (R1 − R0) f(t) on SO(3).

    Source: BK Prop. 6, BK Cor. 1, BK Cor. 2, BK (15), BK (16).

    Parameters
    ----------
    R0, R1, duration
        As for `projected_cubic_so3`.
    f : callable, optional
        For order 0, ``f(t, order)`` returns the position on the line at time t, with f(0) = 0 and
        f(1) = 1 up to 1e-12. For orders 1 and 2, it returns the derivatives. The jerk ``c(t, 3)``
        also needs order 3. The times are from 0 to 1 and have an axis of length 1 for each batch
        axis. By default f(t) = t.

    Returns
    -------
    ProjectedLine
        A `Curve` with the attribute ``margin``.

    Notes
    -----
    Singular set: R0 and R1 are a half-turn apart. At f(t) = 1/2, the projection then jumps from R0
    to R1, and a call of the curve raises ValueError. The computed ``margin`` is accurate to a few
    eps; a ``margin`` below 1e-6 gives a RuntimeWarning. The projection is accurate to eps divided
    by the sum of the two smallest eigenvalues of RᵀM. This sum is at least ``margin``. A call of
    the curve also raises ValueError if `f` returns non-finite values or an array of the wrong
    shape.

    Examples
    --------
    >>> from rbcourse import exp_so3, log_so3
    >>> from rbcourse.projected_line import f
    >>> R0, R1 = np.eye(3), exp_so3([0, 0, 1.5])
    >>> log_so3(projected_line_so3(R0, R1)([0.25, 0.5, 0.75]))[:, 2].round(3)  # slow, fast, slow
    array([0.314, 0.75 , 1.186])
    >>> c = projected_line_so3(R0, R1, lambda t, order: f(t, 1.5, order))
    >>> log_so3(c([0.25, 0.5, 0.75]))[:, 2].round(3)  # uniform
    array([0.375, 0.75 , 1.125])
    """
    if not (f is None or callable(f)):
        raise ValueError(f"f: a callable f(t, order) is wanted, got {f!r}")
    return _projected_line(geodesic_data(R0, R1, duration), f or identity)


def _projected_line(data: dict[str, Array], timing: Progress) -> ProjectedLine:
    if timing is f:
        raise ValueError("f: bind it to an angle, as in lambda t, order: f(t, angle, order)")
    shape = data["duration"].shape
    number = np.arange(math.prod(shape)).reshape(shape)
    curve = ProjectedLine(**data, timing=timing, number=number, timed=shape)
    warn_if_nearly_singular(curve.margin, 0.5, "t" if timing is identity else "f(t)")
    start, end = curve.take(number.ravel()).on_line(np.array([[0.0], [1.0]]), 0)
    for i in np.flatnonzero((np.abs(start) > 1e-12) | (np.abs(end - 1) > 1e-12)):
        raise ValueError(
            f"f{which_curve(int(i), shape)}: f(0) = 0 and f(1) = 1 are wanted, "
            f"got {start[i]} and {end[i]}"
        )
    return curve


def line_singular_value(t: ArrayLike, angle: ArrayLike) -> Array:
    """Return s(t) for the line (1 − t) I + t R2, whose singular values are 1, s(t), s(t).

    s vanishes only for the angle π at t = 1/2, where the nearest rotation is not unique.
    Source: BK (17).

    Parameters
    ----------
    t, angle : array_like, shape (...)
        The positions on the line, which may be any real numbers, and the angle ‖ω₀‖ of R2 in [0,
        π].

    Returns
    -------
    ndarray, shape (...)
        √(cos²(‖ω₀‖/2) + (2t − 1)² sin²(‖ω₀‖/2)), with a relative error of a few eps.

    Examples
    --------
    >>> line_singular_value([0, 0.5, 1], np.pi / 2).round(3)
    array([1.   , 0.707, 1.   ])
    """
    return _singular_value(*_where_and_angle(as_finite("t", t), angle))


def theta(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return θ(t), or a derivative, where exp(ω̂₀ θ(t)) is nearest to (1 − t) I + t exp(ω̂₀).

    For the angle 0, the limit θ(t) = t is returned. The angle π is singular: θ is 0 before t = 1/2,
    1/2 at this time and 1 after it. For `numpy.pi`, which is less than π by 1.2e-16, the jump has
    the finite slope 1e16.
    Source: BK (16), BK Prop. 6, BK Cor. 1. The derivative is (sin ‖ω₀‖/‖ω₀‖)/s², with s from BK
    (17); the paper prints s instead of s².

    Parameters
    ----------
    t, angle : array_like, shape (...)
        The positions on the line, which may be any real numbers, and the angle ‖ω₀‖ in [0, π].
    order : {0, 1, 2, 3}, optional
        The order of the derivative with respect to t.

    Returns
    -------
    ndarray, shape (...)
        θ = 1/2 + atan((2t − 1) tan(‖ω₀‖/2))/‖ω₀‖, accurate to a few eps times max(1, abs(θ)).
        Derivatives have a relative error of a few eps.

    Examples
    --------
    >>> theta([0, 0.25, 0.5, 1], np.pi / 2).round(3)
    array([0.   , 0.205, 0.5  , 1.   ])
    """
    t, angle = _where_and_angle(as_finite("t", t), angle)
    if check_order(order, 3) == 0:
        return _theta(t, angle)
    s = _singular_value(t, angle)
    if order == 1:
        return _theta_rate(angle, s)
    return _theta_bend(t, angle, s) if order == 2 else _theta_third(t, angle, s)


def f(t: ArrayLike, angle: ArrayLike, order: int = 0) -> Array:
    """Return the position f(t) for which the projection has constant speed, or a derivative.

    The function f is the inverse of `theta`: theta(f(t)) = t. The rounding of f changes theta(f(t))
    by up to eps · 2 tan(‖ω₀‖/2)/‖ω₀‖, that is, eps times the greatest slope of θ.

    For the angle 0, the limit f(t) = t is returned. The angle π is singular: f is 0 at t = 0, 1 at
    t = 1, and 1/2 at all times in between. For `numpy.pi`, which is less than π by 1.2e-16, f' is
    about 1e16 at the ends.
    Source: BK Cor. 2.

    Parameters
    ----------
    t : array_like, shape (...)
        Times in [0, 1].
    angle, order
        As for `theta`.

    Returns
    -------
    ndarray, shape (...)
        sin(‖ω₀‖ t)/(sin(‖ω₀‖ (1 − t)) + sin(‖ω₀‖ t)) or a derivative, with a relative error of a
        few eps.

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


def _singular_value(t: Array, angle: Array) -> Array:
    return np.hypot(np.cos(angle / 2), (2 * t - 1) * np.sin(angle / 2))


def _theta(t: Array, angle: Array) -> Array:
    tiny = angle < 1e-290
    turn = np.where(tiny, 1.0, angle)
    return np.where(tiny, t, 0.5 + np.arctan((2 * t - 1) * np.tan(turn / 2)) / turn)[()]


def _theta_rate(angle: Array, s: Array) -> Array:
    return sinc(angle) / s**2


def _theta_bend(t: Array, angle: Array, s: Array) -> Array:
    return -4 * (2 * t - 1) * np.sin(angle / 2) ** 2 * sinc(angle) / s**4


def _theta_third(t: Array, angle: Array, s: Array) -> Array:
    steep = 4 * (2 * t - 1) * np.sin(angle / 2) ** 2
    return sinc(angle) * (2 * steep**2 / s**2 - 8 * np.sin(angle / 2) ** 2) / s**4
