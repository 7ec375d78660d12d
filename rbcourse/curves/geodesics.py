"""Motions along geodesics, among them projected lines, and along screws."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_angle, as_array, as_unit
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array
from rbcourse.curves.curve import (
    Curve,
    check_defined,
    identity,
    near_margins,
    weighted_sums,
    which_curve,
)
from rbcourse.curves.ends import Given, between
from rbcourse.curves.rigid import moving
from rbcourse.projection import NOT_UNIQUE, warn_if_nearly_singular
from rbcourse.se3 import exp_se3, inverse_se3, join, log_se3
from rbcourse.so3 import hat, log
from rbcourse.straight_line import f as straight_line_f
from rbcourse.straight_line import singular_value, theta_at, theta_bend, theta_rate, theta_third

Progress = Callable[[Array, int], ArrayLike]


@described_by(between, returns="Curve")
def geodesic(start: ArrayLike, goal: ArrayLike, *, duration: ArrayLike = 1.0) -> Curve:
    """Return the shortest curve between two rotations (metric (12)) or two poses (metric (14)).

    For rotations, it is R0 exp(σ̂ t) with constant angular velocity; its attribute
    ``rotation_vector`` is σ = log_so3(R0ᵀ R1), with ‖σ‖ ≤ π. For poses, its ``rotation`` is this
    curve, and the origin moves on a straight line at constant speed. The angular velocity and d'
    are constant, but v = Rᵀ d' is not. Singular set: start and goal are a half-turn apart. Two
    geodesics are then shortest. In the ``rotation_vector`` of the returned geodesic, the component
    of largest magnitude (the first, if several are equal) is positive. For poses, `screw` is a
    geodesic of another metric.
    Source: BK 6.1; for poses, BK 2.6, BK (14).

    Examples
    --------
    >>> from rbcourse import exp_so3, pose_from_coordinates
    >>> c = geodesic(np.eye(3), exp_so3([0, 0, 1.5]), duration=3)
    >>> c(0.3, 1).round(12)  # the velocity
    array([0. , 0. , 0.5])
    >>> A1 = pose_from_coordinates([0, 0, np.pi / 2, 2, 4, 0])
    >>> geodesic(np.eye(4), A1)(0.5).round(3)[:2] + 0.0
    array([[ 0.707, -0.707,  0.   ,  1.   ],
           [ 0.707,  0.707,  0.   ,  2.   ]])
    """
    given = between(start, goal, duration=duration)
    given = given._replace(path=given.path[:2])
    turn, terms = geodesic_data(given)
    rotation = AlongGeodesic(duration=given.duration, rotation_vector=turn, terms=terms)
    return moving(given, rotation)


def geodesic_data(given: Given) -> tuple[Array, Array]:
    """Return the ``rotation_vector`` and the ``terms`` of an `AlongGeodesic`."""
    turn, R0 = log(given.ends.turn), given.ends.R0
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    K = hat(turn / np.where(angle == 0, 1.0, angle))
    swept = R0 @ K
    return turn, np.stack([R0, swept, swept @ K], axis=-3)


@described_by(geodesic, returns="ScrewMotion")
def screw(start: ArrayLike, goal: ArrayLike, *, duration: ArrayLike = 1.0) -> ScrewMotion:
    """Return the screw motion between two poses, which has one fixed axis and a constant twist.

    Its covariant acceleration is (0, ω × v). Every point of the body moves on a helix about the
    axis (see `screw_from_pose`). A screw motion is a geodesic of the indefinite metric (10), not of
    metric (14) (see `geodesic`). Singular set: the poses are a half-turn apart. `log_so3` then
    chooses one of two ω. Additional full turns give other screw motions, with other twists.
    The motion is A0 exp_se3(S t) with the ``twist`` S = log_se3(A0⁻¹ A1), and turns by at most π.
    Source: BK 2.6.

    Parameters
    ----------
    start, goal : array_like, shape (..., 4, 4)
        Poses A0 and A1.

    Examples
    --------
    >>> A1 = exp_se3([0, 0, np.pi, 0, -np.pi, 2])  # half round the line x = 1, 2 m up
    >>> screw(np.eye(4), A1)(0.5)[:3, 3].round(12)
    array([ 1., -1.,  1.])
    """
    given = between(start, goal, duration=duration)
    if not given.path:
        raise ValueError("start, goal: poses, shape (..., 4, 4), are wanted, got rotations")
    (R0, R1, *_), (d0, d1, *_) = given.ends, given.path
    A0, A1 = join(R0, d0), join(R1, d1)
    return ScrewMotion(duration=given.duration, A0=A0, displacement=log_se3(inverse_se3(A0) @ A1))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AlongGeodesic(Curve):
    """The `Curve` R0 exp(σ̂ p(t)) on the geodesic from R0 to R0 exp(σ̂); by default, p(t) = t.

    Source: BK 6.1.
    """

    rotation_vector: Array  # σ, from the start to the goal, in the body frame, shape (..., 3)
    terms: Array  # R0, R0 K and R0 K², for Rodrigues' formula R0 (I + sin a K + (1 − cos a) K²)

    @property
    def R0(self) -> Array:
        """The start, shape (..., 3, 3)."""
        return self.terms[..., 0, :, :]

    def _progress(self, t: Array, order: int) -> Array:
        """Return p or a derivative, shape (T, count) or (T, 1)."""
        return identity(t, order)

    def values(self, t: Array, order: int) -> Array:
        """Return R0 exp(σ̂ p), or σ times a derivative of p."""
        progress, count = self._progress(t, order), self.count
        if order:
            values = np.empty((len(t), count, 3))
            for i in range(3):  # four times as fast as one product
                np.multiply(progress, self.rotation_vector[:, i], out=values[..., i])
            return values
        weights = np.empty((3, count, len(t)))
        one, sine, versine = weights  # 1, sin a and 1 − cos a, by tan(a/2)
        one[:] = 1
        tangent = np.tan(np.multiply(progress.T, self._half_angle, out=versine), out=versine)
        np.multiply(tangent, tangent, out=sine)
        sine += 1
        np.divide(tangent, sine, out=sine)
        sine *= 2
        versine *= sine
        return weighted_sums(weights.T, self.terms.reshape(count, 3, 9), 3, 3)

    @cached_property
    def _half_angle(self) -> Array:
        return np.linalg.norm(self.rotation_vector, axis=-1, keepdims=True) / 2


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ProjectedLine(AlongGeodesic):
    """The projection of a straight line between two rotations; here p(t) = θ(f(t)).

    Source: BK Prop. 6, BK (15), BK (17).
    """

    timing: Progress
    number: NDArray[np.intp]  # for each given timing, the index of its curve in the stack
    timed: tuple[int, ...]  # the shape of this stack

    @property
    def margin(self) -> Array:
        """The minimum, over all M on the line, of the sum of the two smallest eigenvalues of RᵀM.

        If it is 0, the middle of the line has no unique projection.
        """
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
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints`, refined near t = 1/2 if the margin is small."""
        return near_margins(super().breakpoints, 0.5, self.margin)


@described_by(geodesic, returns="Curve")
def projected_line(
    start: ArrayLike, goal: ArrayLike, f: Progress | None = None, *, duration: ArrayLike = 1.0
) -> Curve:
    """Return the projection of the line R0 + (R1 − R0) f(t) on SO(3): R0 exp(σ̂ θ(f(t))).

    The curve has the attribute ``margin``. For poses, the origin moves on a straight line at
    constant speed. Singular set: the rotations are a half-turn apart. At f(t) = 1/2, the projection
    then jumps from R0 to R1, and a call of the curve raises ValueError. The computed ``margin`` is
    accurate to a few eps; a ``margin`` below 1e-6 gives a RuntimeWarning. The projection is
    accurate to eps divided by the sum of the two smallest eigenvalues of RᵀM. This sum is at least
    ``margin``. A call of the curve also raises ValueError if `f` returns non-finite values or an
    array of the wrong shape.
    Source: BK Prop. 6, BK Cor. 1, BK Cor. 2, BK (15), BK (16).

    Parameters
    ----------
    f : callable, optional
        For order 0, ``f(t, order)`` returns the position on the line at time t, with f(0) = 0 and
        f(1) = 1 up to 1e-12. For orders 1 and 2, it returns the derivatives. The jerk ``c(t, 3)``
        also needs order 3. The times are from 0 to 1 and have an axis of length 1 for each batch
        axis. By default f(t) = t.

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
    start, end = curve._take(number.ravel()).on_line(np.array([[0.0], [1.0]]), 0)
    for i in np.flatnonzero((np.abs(start) > 1e-12) | (np.abs(end - 1) > 1e-12)):
        raise ValueError(
            f"f{which_curve(int(i), shape)}: f(0) = 0 and f(1) = 1 are wanted, "
            f"got {start[i]} and {end[i]}"
        )
    return curve


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ScrewMotion(Curve):
    """The `Curve` A0 exp_se3(S t) with constant twist S.

    ``A0`` is the start, ``twist`` is S = (ω, v) in the body frame, shape (..., 6), and
    ``displacement`` is S times the duration.
    Source: BK 2.6.
    """

    A0: Array
    displacement: Array

    size = 4

    @property
    def twist(self) -> Array:
        """The twist (ω, v) in the body frame."""
        return self.displacement / self.duration[..., None]

    def values(self, t: Array, order: int) -> Array:
        """Return A0 exp(S t), S, or (0, ω × v)."""
        S = self.displacement
        if order == 0:
            return self.A0 @ exp_se3(t[..., None] * S)
        if order == 2:
            S = np.concatenate([0 * S[:, :3], np.cross(S[:, :3], S[:, 3:])], axis=-1)
        return np.broadcast_to(S, (len(t), *S.shape))


@described_by(returns="Screw")
def screw_from_pose(A: ArrayLike) -> Screw:
    """Return the screw of a displacement in the fixed frame: axis, point, angle and slide.

    The screw also has the ``pitch``, the slide per radian of the turn. Singular set: half-turns,
    which have two screws (`log_so3` chooses the axis), and poses without a turn, which have no
    unique axis. A turn by less than 8 eps counts as a pure slide. For small angles, axis, slide and
    pitch have a relative error of a few eps divided by the angle. The point is then far away, and
    its error is a few eps ‖d‖ divided by the square of the angle.
    Source: BK 2.6.

    Parameters
    ----------
    A : array_like, shape (..., 4, 4)
        Poses. For the screw in the fixed frame that takes A0 to A1, use A1 @ inverse_se3(A0).

    Examples
    --------
    >>> screw = screw_from_pose(exp_se3([0, 0, 2, 0, -2, 1]))  # about the vertical through x = 1
    >>> screw.axis.round(12), screw.point.round(12) + 0.0, float(screw.pitch.round(12))
    (array([0., 0., 1.]), array([1., 0., 0.]), 0.5)
    """
    S = log_se3(A)
    w, v = S[..., :3], S[..., 3:]
    angle = np.linalg.norm(w, axis=-1)
    turns = angle > 8 * EPS
    along = np.where(turns[..., None], w, v)
    moves = np.any(along, axis=-1, keepdims=True)
    axis = np.where(moves, as_unit("A", np.where(moves, along, 1.0), 3), 0.0)
    angle = np.where(turns, angle, 0.0)
    point = np.cross(axis, v) / np.where(turns, angle, np.inf)[..., None]
    return Screw(axis, point, angle, np.vecdot(axis, v))


class Screw(NamedTuple):
    """A turn about an axis and a slide along it; every displacement is a screw (Chasles).

    Attributes
    ----------
    axis : ndarray, shape (..., 3)
        The unit vector along the axis. If there is no turn, it is the direction of the slide; if
        there is no motion, it is 0.
    point : ndarray, shape (..., 3)
        The point on the axis that is nearest to the origin, in m; 0 if there is no turn.
    angle, slide : ndarray, shape (...)
        The turn, in [0, π] rad, and the displacement along the axis, in m.
    """

    axis: Array
    point: Array
    angle: Array
    slide: Array

    def __repr__(self) -> str:
        """Return a description of the screw, or the shape of a stack."""
        if np.ndim(self.angle):
            return f"<Screw, stack of shape {self.angle.shape}>"
        axis, point = (", ".join(f"{x:.4g}" for x in v + 0.0) for v in (self.axis, self.point))
        turn = f"{np.degrees(self.angle):.4g}° about ({axis}) through ({point}) m"
        return f"<Screw: {turn}, slide {self.slide:.4g} m>"

    @property
    def pitch(self) -> Array:
        """The slide per radian of the turn, in m: inf for a pure slide, NaN for no motion."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.divide(self.slide, self.angle)
