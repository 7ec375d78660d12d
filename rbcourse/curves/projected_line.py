"""The straight line between two rotations, its projection on SO(3), and its timing by θ and f."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_angle, as_array
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse.curves.curve import Curve, check_defined, identity, near_margins, which_curve
from rbcourse.curves.ends import Given, between
from rbcourse.curves.geodesics import AlongGeodesic, geodesic, geodesic_data
from rbcourse.curves.rigid import moving
from rbcourse.projection import NOT_UNIQUE, warn_if_nearly_singular
from rbcourse.straight_line import f as straight_line_f
from rbcourse.straight_line import singular_value, theta_at, theta_bend, theta_rate, theta_third

Progress = Callable[[Array, int], ArrayLike]


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
        s = singular_value(on_line, angle)
        check_defined(t, s < 8 * EPS, NOT_UNIQUE)
        if order == 0:
            return theta_at(on_line, angle)
        slope, speed = theta_rate(angle, s), self.on_line(t, 1)
        if order == 1:
            return slope * speed
        bend, push = theta_bend(on_line, angle, s), self.on_line(t, 2)
        if order == 2:
            return bend * speed**2 + slope * push
        third = theta_third(on_line, angle, s) * speed**3
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


@described_by(geodesic)
def projected_line(
    start: ArrayLike, goal: ArrayLike, f: Progress | None = None, *, duration: ArrayLike = 1.0
) -> Curve:
    """Return the projection of the line R0 + (R1 − R0) f(t) on SO(3): R0 exp(σ̂ θ(f(t))).

    Source: BK Prop. 6, BK Cor. 1, BK Cor. 2, BK (15), BK (16).

    Parameters
    ----------
    f : callable, optional
        For order 0, ``f(t, order)`` returns the position on the line at time t, with f(0) = 0 and
        f(1) = 1 up to 1e-12. For orders 1 and 2, it returns the derivatives. The jerk ``c(t, 3)``
        also needs order 3. The times are from 0 to 1 and have an axis of length 1 for each batch
        axis. By default f(t) = t.

    Returns
    -------
    Curve
        A curve with the attribute ``margin``. For poses, the origin moves on a straight line at
        constant speed.

    Notes
    -----
    Singular set: the rotations are a half-turn apart. At f(t) = 1/2, the projection then jumps from
    R0 to R1, and a call of the curve raises ValueError. The computed ``margin`` is accurate to a
    few eps; a ``margin`` below 1e-6 gives a RuntimeWarning. The projection is accurate to eps
    divided by the sum of the two smallest eigenvalues of RᵀM. This sum is at least ``margin``. A
    call of the curve also raises ValueError if `f` returns non-finite values or an array of the
    wrong shape.

    Examples
    --------
    >>> from rbcourse import exp_so3, log_so3
    >>> from rbcourse.straight_line import f
    >>> R0, R1 = np.eye(3), exp_so3([0, 0, 1.5])
    >>> log_so3(projected_line(R0, R1)([0.25, 0.5, 0.75]))[:, 2].round(3)  # slow, fast, slow
    array([0.314, 0.75 , 1.186])
    >>> c = projected_line(R0, R1, lambda t, order: f(t, 1.5, order))
    >>> log_so3(c([0.25, 0.5, 0.75]))[:, 2].round(3)  # uniform
    array([0.375, 0.75 , 1.125])
    """
    if not (f is None or callable(f)):
        raise ValueError(f"f: a callable f(t, order) is wanted, got {f!r}")
    if f is straight_line_f:
        raise ValueError("f: bind it to an angle, as in lambda t, order: f(t, angle, order)")
    given = between(start, goal, duration=duration)
    return moving(given._replace(path=given.path[:2]), _checked_line(given, f or identity))


def _checked_line(given: Given, timing: Progress) -> ProjectedLine:
    shape = given.duration.shape
    number = np.arange(math.prod(shape)).reshape(shape)
    turn, terms = geodesic_data(given)
    curve = ProjectedLine(
        duration=given.duration,
        rotation_vector=turn,
        terms=terms,
        timing=timing,
        number=number,
        timed=shape,
    )
    warn_if_nearly_singular(curve.margin, 0.5, "t" if timing is identity else "f(t)")
    start, end = curve.take(number.ravel()).on_line(np.array([[0.0], [1.0]]), 0)
    for i in np.flatnonzero((np.abs(start) > 1e-12) | (np.abs(end - 1) > 1e-12)):
        raise ValueError(
            f"f{which_curve(int(i), shape)}: f(0) = 0 and f(1) = 1 are wanted, "
            f"got {start[i]} and {end[i]}"
        )
    return curve
