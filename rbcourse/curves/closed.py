"""Closed forms with the same boundary conditions as the projected cubic (BK section 1).

Each curve is a fixed rotation times the rotation of a quaternion Q(t), whose norm need not be 1.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array, matvec
from rbcourse._quaternions import Jet, angular_velocity, cross, exp, quaternion_of
from rbcourse.body import Body
from rbcourse.curves.curve import (
    Curve,
    QuaternionCurve,
    check_defined,
    graded,
    least_over_time,
    near_margins,
    other_way,
    polynomial_jet,
    which_curve,
)
from rbcourse.curves.ends import Ends, Given, Rate, as_body, between
from rbcourse.curves.projected import projected_cubic, projected_quintic
from rbcourse.curves.rigid import moving
from rbcourse.quaternion import quaternion_conjugate, quaternion_multiply
from rbcourse.so3 import hat, log, right_jacobian_inverse_so3


@described_by(projected_cubic, returns="Curve")
def exponential_cubic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    long: bool = False,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return R0 exp(σ̂(t)) with these ends, where σ(t) is a cubic in exponential coordinates.

    The cubic has σ(0) = 0, σ'(0) = w0, σ(1) = log_so3(R0ᵀ R1), and σ'(1) from
    `right_jacobian_inverse_so3`. Singular set: R0 and R1 are a half-turn apart. `log_so3` then
    chooses σ(1). If R0 = R1, `long` has no effect. The curve itself is smooth everywhere. If both
    velocities are along the geodesic, the curve is the optimum among all curves that turn by σ(1).
    The curve does not depend on the choice of frames, but the reversed ends do not give the
    reversed curve.
    Source: BK 1, its reference 13; for ``long``, beyond BK 10.

    Parameters
    ----------
    long : bool, optional
        Whether the curve turns the other way round, by 2π − ‖log_so3(R0ᵀ R1)‖.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = exponential_cubic(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c(1, 1).round(12) + 0.0
    array([0., 1., 0.])
    """
    given = between(start, goal, v0, v1, duration=duration)
    turn = log(given.ends.turn)
    return moving(given, _exponential_cubic(given, other_way(turn) if long else turn))


@described_by(projected_cubic, returns="Curve")
def quaternion_cubic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the cubic in R⁴ with these ends, projected onto the unit quaternions.

    The cubic has q' = q (0, w)/2 at its ends. It ends at q1 or −q1, whichever is nearer to q0. If
    ‖w0‖ and ‖w1‖ are below 8 / duration, the curve turns the short way; for faster ends, it can
    turn by two more full turns. The curve has a ``margin``. Singular set: R0 and R1 are a half-turn
    apart. The `canonical_quaternion` of R0ᵀ R1 is then used. The curve is also singular at times at
    which the cubic is zero; a call at such a time raises ValueError. With k the larger of ‖w0‖ and
    ‖w1‖ and a the angle between R0 and R1, ``margin`` is at least cos(a/4) − (k duration/8)
    sin(a/4). If ``margin`` is small, the body turns by up to a full turn in a short time. The error
    of the curve is then about eps divided by ``margin``. The errors of its first two derivatives
    are about eps divided by the square and the cube of ``margin``. The curve does not depend on the
    choice of frames, and the ends R1, R0, −w1, −w0 give the reversed curve.
    Source: BK 1, its references 6 and 7; BK Remark 7.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = quaternion_cubic(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c(1, 1).round(12) + 0.0, float(c.margin.round(3))
    (array([0., 1., 0.]), 0.933)
    """
    given = between(start, goal, v0, v1, duration=duration)
    return moving(given, normalised_cubic(given.ends, given.duration))


def normalised_cubic(
    ends: Ends, T: Array, long: NDArray[np.bool_] | bool = False
) -> QuaternionCubic:
    """Return the quaternion cubic for ends in unit time; if `long`, it turns the long way round."""
    turn, one = quaternion_of(ends.turn), np.ones(T.shape)
    turn = np.where(np.expand_dims(long, -1), -turn, turn)
    goal, controls = _cubic_from_the_goal(ends, turn, one, 0 * one)
    return QuaternionCubic(duration=T, start=goal, controls=controls)


@described_by(projected_cubic, returns="Curve")
def cayley_cubic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the cubic with these ends in Cayley parameters about R0.

    The quaternion of the curve is (1, g), divided by its norm. The Cayley parameters of a turn by
    the angle a about the unit vector n are g = tan(a/2) n. Along a curve,
    2 g' = w + g × w + (g·w) g. Singular set: half-turns, which have no Cayley parameters. No Cayley
    cubic passes through a half-turn from R0. As R1 approaches a half-turn, the curve therefore
    becomes long, and its cost grows without bound. The curve does not depend on the choice of
    frames, but the reversed ends do not give the reversed curve.
    Source: BK 1, its reference 8.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = cayley_cubic(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c(1, 1).round(12) + 0.0
    array([0., 1., 0.])
    """
    given = between(start, goal, v0, v1, duration=duration)
    ends, T, turn = given.ends, given.duration, quaternion_of(given.ends.turn)
    infinite = np.flatnonzero(turn[..., 0] == 0)
    if len(infinite):
        curve = which_curve(infinite[0], T.shape)
        raise ValueError(f"start, goal{curve} are a half-turn apart: no Cayley parameters")
    growth = np.sum(turn[..., 1:] * ends.w1, axis=-1) / (2 * turn[..., 0])
    goal, controls = _cubic_from_the_goal(ends, turn, 1 / turn[..., 0], growth)
    return moving(given, CayleyCubic(duration=T, start=goal, controls=controls))


@described_by(projected_cubic, returns="Curve")
def normal_cubic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    body: Body,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the cubic with these ends in second-order normal coordinates of a body's metric.

    The curve is R0 exp(ŷ) with y = x − ½ G⁻¹(x × G x). Here x(t) is the cubic with x(0) = 0,
    x'(0) = w0 and the values of x(1) and x'(1) that give R1 and w1.
    Source: beyond BK 7; R. Zimmermann, Hermite interpolation and data processing errors on
    Riemannian matrix manifolds, SIAM Journal on Scientific Computing 2020.

    Parameters
    ----------
    body : Body
        The body that moves.

    Notes
    -----
    To second order, x is the Riemannian normal coordinate of R0 exp(ŷ): the initial velocity of the
    geodesic from R0 to R0 exp(ŷ). Zimmermann interpolates in normal coordinates; we know of no
    source for the second-order map. The curve is not the optimum, which is a Riemannian cubic. It
    is near-optimal for small excursions: if the excursion is multiplied by s, the relative excess
    over the optimum is multiplied by about s⁴. If G is a multiple of I, the curve is
    `exponential_cubic`.

    Singular set: R0 and R1 are a half-turn apart. `log_so3` then chooses y(1). Ends are also
    singular if the map x ↦ y is singular at x(1). Such ends raise ValueError, as do ends for which
    no x(1) is found. With the moments of inertia 1, 2, 2.9, the map is never singular for ‖y(1)‖ up
    to π. For thin bodies with three different moments, it is singular at some turns of more than
    about 2 rad about the middle axis. Near such ends, the curve is long. The curve does not depend
    on the choice of frames, but the reversed ends do not give the reversed curve.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1, book = exp_so3([0, 0, 1.5]), Body(np.diag([1.0, 2.22, 3.18]))
    >>> normal_cubic(np.eye(3), R1, v1=[0, 1, 0], body=book)(1, 1).round(12) + 0.0
    array([0., 1., 0.])
    """
    given = between(start, goal, v0, v1, body=as_body(body), duration=duration)
    ends, T = given.ends, given.duration
    G = np.broadcast_to(given.body.inertia, (*T.shape, 3, 3))
    inverse, turn = np.linalg.inv(G), log(ends.turn)
    goal, by_goal = _normal_coordinates(turn, G, inverse)
    rate = right_jacobian_inverse_so3(turn) @ ends.w1[..., None]
    end_rate = np.linalg.solve(by_goal, rate)[..., 0]
    cubic = np.stack([np.zeros_like(turn), goal, ends.w0, end_rate], axis=-2)
    rotation = NormalCubic(
        duration=T,
        body=given.body,
        start=quaternion_of(ends.R0),
        controls=np.concatenate([cubic, G, inverse], axis=-2),
    )
    return moving(given, rotation)


@described_by(projected_quintic, returns="Curve")
def exponential_quintic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    a0: Rate = None,
    a1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return R0 exp(σ̂(t)) with these ends, where σ(t) is a quintic.

    The quintic has σ(0) = 0, σ(1) = log_so3(R0ᵀ R1) and the derivatives that give w and w' at both
    ends. For small excursions, the curve is near-optimal for minimum jerk (see
    docs/near_optimal.md). From rest to rest, it is the optimum (`minimum_jerk`). The singular set
    is that of `exponential_cubic`. The curve does not depend on the choice of frames, but the
    reversed ends do not give the reversed curve.
    Source: beyond BK 8; the cubic is in BK 1, its reference 13.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> exponential_quintic(np.eye(3), exp_so3([0, 0, 1.5]), a1=[0, 0, 2])(1, 2).round(12) + 0.0
    array([0., 0., 2.])
    """
    given = between(start, goal, v0, v1, a0, a1, duration=duration)
    (a0, a1), curve = given.bends, _exponential_cubic(given, log(given.ends.turn))
    turn, end_rate = 2 * curve.controls[..., 1, :], 2 * curve.controls[..., 3, :]
    straight = exp([np.moveaxis(x, -1, 0) / 2 for x in (turn, end_rate, 0 * end_rate)])
    w_rate = np.moveaxis(angular_velocity(straight), 0, -1)
    bend = matvec(right_jacobian_inverse_so3(turn), a1 - w_rate)
    more = np.stack([a0, bend], axis=-2) / 2
    controls = np.concatenate([curve.controls, more], axis=-2)
    quintic = ExponentialQuintic(duration=given.duration, start=curve.start, controls=controls)
    return moving(given, quintic)


class ExponentialCubic(QuaternionCurve):
    """The `Curve` R0 exp(σ̂(t)) with a cubic σ(t)."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(σ/2)."""
        return exp(polynomial_jet(controls, t, order))


class ExponentialQuintic(ExponentialCubic):
    """The `Curve` R0 exp(σ̂(t)) with a quintic σ(t)."""


def _exponential_cubic(given: Given, turn: Array) -> ExponentialCubic:
    ends = given.ends
    end_rate = matvec(right_jacobian_inverse_so3(turn), ends.w1)
    controls = np.stack([np.zeros_like(turn), turn, ends.w0, end_rate], axis=-2) / 2
    first = quaternion_of(ends.R0)
    return ExponentialCubic(duration=given.duration, start=first, controls=controls)


class NormalCubic(QuaternionCurve):
    """The `Curve` R0 exp(ŷ), where y = x − ½ G⁻¹(x × G x) and x is a cubic."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(y/2); `controls` contains the ends of x, then the matrices G and G⁻¹."""
        x, G, inverse = polynomial_jet(controls[:4], t, order), controls[4:7], controls[7:]
        bent = cross(x, [np.einsum("ij...,j...->i...", G, each) for each in x])
        return exp(
            [
                each / 2 - np.einsum("ij...,j...->i...", inverse, bend) / 4
                for each, bend in zip(x, bent, strict=True)
            ]
        )


def _normal_coordinates(y: Array, G: Array, inverse: Any) -> tuple[Array, Array]:
    """Solve x − ½ G⁻¹(x × G x) = y for x by Newton's method; return x and ∂y/∂x."""
    x = np.zeros_like(y)
    for share in (0.25, 0.5, 0.75, 1):
        goal = share * y
        for _ in range(4 if share < 1 else 8):
            h = matvec(G, x)
            by_x = np.eye(3) - inverse @ (hat(x) @ G - hat(h)) / 2
            miss = x - matvec(inverse, np.cross(x, h)) / 2 - goal
            _check_normal(np.linalg.det(by_x) == 0, "the map from x to y is singular")
            x = x - np.linalg.solve(by_x, miss[..., None])[..., 0]
    size = 1 + np.abs(y).max(axis=-1) + np.abs(x - y).max(axis=-1)
    thin = np.linalg.cond(G)
    found = np.abs(miss).max(axis=-1) < 16 * EPS * thin * size + 1e-13 * size
    _check_normal(~found, "no x gives the goal to rounding")
    _check_normal(~(np.abs(np.linalg.det(by_x)) > 1e-9), "the map from x to y is singular")
    return x, by_x


def _check_normal(lost: Array, why: str) -> None:
    if np.any(lost):
        curve = which_curve(int(np.flatnonzero(lost)[0]), np.shape(lost))
        raise ValueError(f"normal cubic{curve}: {why}")


class NormalizedCubic(QuaternionCurve):
    """The `Curve` of a cubic of quaternions, whose norm at the end need not be 1.

    Quaternions are relative to the goal, so that Q(1) is real and w1 is not lost in rounding.
    """

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the cubic with these ends."""
        return polynomial_jet(controls, t, order)


def _cubic_from_the_goal(
    ends: Ends, turn: Array, norm: Array, growth: Array
) -> tuple[Array, Array]:
    """Return `start` and `controls` of a `NormalizedCubic`.

    `norm` is ‖Q‖ at the end, and `growth` the rate of log ‖Q‖ there.
    """
    start, one = quaternion_conjugate(turn), np.eye(4)[0] + np.zeros_like(turn)
    end_rate = growth[..., None] * one + _rate(one, ends.w1)
    cubic = start, norm[..., None] * one, _rate(start, ends.w0), norm[..., None] * end_rate
    goal = quaternion_multiply(quaternion_of(ends.R0), turn)
    return goal, np.stack(cubic, axis=-2)


class QuaternionCubic(NormalizedCubic):
    """The `Curve` of the unit quaternions nearest to a cubic that joins two unit quaternions.

    Its ``margin`` is the least norm of the cubic, reached at ``margin_time``; both have the shape
    (...). If the margin is 0, the nearest unit quaternion is not unique.
    """

    def _check(self, Q: Array, t: Array) -> None:
        lost = np.abs(Q).max(axis=0) < 8 * EPS * np.abs(self._first).max(axis=(0, 1))
        check_defined(t, lost, "the cubic of quaternions is zero")

    @property
    def margin(self) -> Array:
        """The least norm of the cubic."""
        return self._least[1].copy()

    @property
    def margin_time(self) -> Array:
        """The time at which the margin is reached."""
        return self._least[0] * self.duration

    @cached_property
    def _least(self) -> tuple[Array, Array]:
        def norm(t: Array) -> Array:
            return np.linalg.norm(polynomial_jet(self._first[:, :, None], t, 0)[0], axis=0)

        return least_over_time(norm, self.batch_shape)

    @property
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints`, refined near small margins."""
        return near_margins(super().breakpoints, *self._least)


class CayleyCubic(NormalizedCubic):
    """The `Curve` of a cubic in Cayley parameters."""

    @property
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints`, refined near the time when the curve turns fastest."""

        def time_for_a_radian(t: Array) -> Array:
            jet = polynomial_jet(self._first[:, :, None], t, 1)
            Q, rate = (np.linalg.norm(x, axis=0) for x in jet)
            return Q / (1 + rate)

        times, widths = least_over_time(time_for_a_radian, self.batch_shape)
        return graded(super().breakpoints, times.ravel(), widths.ravel())


def _rate(q: Array, w: Array) -> Array:
    return quaternion_multiply(q, np.concatenate([np.zeros_like(w[..., :1]), w], axis=-1)) / 2
