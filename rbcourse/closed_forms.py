"""Other closed forms, with the boundary conditions of the projected cubic (BK section 1).

Each is a fixed rotation times the rotation of a quaternion Q(t) of any norm. `CLOSED_FORMS` lists
those for two rotations and two angular velocities that are compared; a new one is added there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import first_index
from rbcourse._hermite import hermite
from rbcourse._numerics import EPS, Array, matvec
from rbcourse._taylor import (
    Jet,
    angular_velocity,
    cross,
    exp,
    multiply,
    product,
    rotation,
    slerp,
    times,
)
from rbcourse.conversions import quaternion_from_matrix, quaternion_from_rotation_vector
from rbcourse.curves import (
    Curve,
    Ends,
    check_defined,
    graded,
    identity,
    least_over_time,
    near_margins,
    which_curve,
    with_inertia,
)
from rbcourse.projected_cubic import ends_of_quintic, projected_cubic_so3
from rbcourse.quaternion import quaternion_conjugate, quaternion_multiply
from rbcourse.so3 import exp_so3, hat, log_so3, right_jacobian_inverse_so3

Legs = tuple[Array, Array, Array]


def exponential_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> ExponentialCubic:
    """Return R0 exp(σ̂(t)), σ(t) the cubic in exponential coordinates about R0 with these ends.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    duration : array_like, shape (...), optional
        How long it takes.

    Returns
    -------
    ExponentialCubic
        A `Curve` that meets all four ends: σ(0) = 0, σ'(0) = w0, σ(1) = log_so3(R0ᵀ R1), and σ'(1)
        by `right_jacobian_inverse_so3`.

    See Also
    --------
    projected_cubic_so3 : In the space of matrices.

    Notes
    -----
    Singular set: R0 and R1 a half-turn apart, where the curve is that of the rotation vector which
    `log_so3` chooses. The curve itself is smooth everywhere. Velocities along the geodesic give the
    optimum among all curves that turn by this vector.

    Moved ends give the moved curve; but run backwards, from R1 to R0, it is another one.

    References
    ----------
    BK 1, its reference 13.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = exponential_cubic_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    return _exponential_cubic(ends, T, log_so3(ends.turn))


def exponential_cubic_long_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> ExponentialCubic:
    """Return the exponential cubic that turns the other way round, by 2π − ‖σ‖.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like
        As for `exponential_cubic_so3`.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    ExponentialCubic
        A `Curve` that meets all four ends, with σ(1) = (1 − 2π/‖σ‖) σ, σ = log_so3(R0ᵀ R1).

    See Also
    --------
    exponential_cubic_so3 : The short way round.

    Notes
    -----
    Singular set: that of `exponential_cubic_so3`; and R0 = R1, where no axis is the other one, and
    the curve is that of `exponential_cubic_so3`.

    References
    ----------
    beyond BK 10.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = exponential_cubic_long_so3(np.eye(3), exp_so3([0, 0, 3]), [0, 0, -4], [0, 0, -4])
    >>> log_so3(c([0.25, 0.75])).round(2) + 0.0
    array([[ 0.  ,  0.  , -0.89],
           [ 0.  ,  0.  , -2.4 ]])
    """
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    return _exponential_cubic(ends, T, other_way(log_so3(ends.turn)))


def bezier_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> Bezier:
    """Return the cubic Bézier curve with these ends: de Casteljau's construction by geodesics.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at both ends. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time; ‖w‖ times the duration < 3π.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    Bezier
        A `Curve` that meets all four ends, with the control points R0, R0 exp(ŵ0/3),
        R1 exp(−ŵ1/3), R1.

    Raises
    ------
    ValueError
        If a velocity times the duration is 3π or more: its leg would be no shortest geodesic.

    See Also
    --------
    cumulative_bezier_so3 : From the same control points, faster to evaluate.
    corrected_bezier_so3 : Nearer to the optimum.

    Notes
    -----
    Singular set: the two inner control points a half-turn apart; the geodesic between them is that
    of `log_so3`. No other leg can become a half-turn: those of the next level are, by the triangle
    inequality, never longer than the longest two before.

    Moved ends give the moved curve, and R1, R0, −w1, −w0 give the curve run backwards.

    References
    ----------
    BK 1, its references 3 to 5.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = bezier_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    return _bezier(*_slow_ends(R0, R1, w0, w1, duration))


def bezier_long_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> Bezier:
    """Return the Bézier curve with these ends whose middle leg turns the other way round.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like
        As for `bezier_so3`.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    Bezier
        A `Curve` that meets all four ends, with the control points of `bezier_so3`. Where the end
        velocities are large, it may cost less than that.

    See Also
    --------
    bezier_so3 : The short way round.

    Notes
    -----
    Singular set: that of `bezier_so3`; and the two inner control points equal, where no axis is the
    other one, and the curve is that of `bezier_so3`.

    Moved ends give the moved curve, and R1, R0, −w1, −w0 give the curve run backwards.

    References
    ----------
    beyond BK 10.

    Examples
    --------
    >>> from rbcourse import acceleration_cost, exp_so3
    >>> ends = np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, -2.4], [0, 0, -2.4]
    >>> [float(acceleration_cost(c(*ends)).round(1)) for c in (bezier_so3, bezier_long_so3)]
    [365.0, 136.3]
    """
    ends, T, (first, middle, last) = _slow_ends(R0, R1, w0, w1, duration)
    return _bezier(ends, T, (first, other_way(middle), last))


def cumulative_bezier_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> CumulativeBezier:
    """Return R0 exp(β₁ v̂₁) exp(β₂ v̂₂) exp(β₃ v̂₃), the cubic Bézier curve in cumulative form.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    duration : array_like, shape (...), optional
        How long it takes.

    Returns
    -------
    CumulativeBezier
        A `Curve` that meets all four ends: v₁ = w0/3, v₃ = w1/3, v₂ the shortest turn between, and
        β₁ = 1 − (1 − t)³, β₂ = 3t² − 2t³, β₃ = t³.

    See Also
    --------
    bezier_so3 : De Casteljau's construction, from the same control points.

    Notes
    -----
    Singular set: R0 exp(ŵ0/3) and R1 exp(−ŵ1/3) a half-turn apart, where v₂ is what `log_so3`
    chooses. The curve itself is smooth everywhere.

    Moved ends give the moved curve; but run backwards, from R1 to R0, it is another one.

    References
    ----------
    BK 1; M.-J. Kim, M.-S. Kim and S. Y. Shin, A general construction scheme for unit quaternion
    curves with simple high order derivatives, SIGGRAPH 1995.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = cumulative_bezier_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    halves = np.stack(bezier_legs(ends), axis=-2) / 2
    return CumulativeBezier(duration=T, start=quaternion_from_matrix(ends.R0), controls=halves)


def corrected_bezier_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> CorrectedBezier:
    """Return Bézier's curve less its leading deviation from the optimum.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at both ends. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time; ‖w‖ times the duration < 3π.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    CorrectedBezier
        A `Curve` that meets all four ends: R_m exp(−δ̂/2) R_mᵀ B(t) exp(−δ̂/2), with B Bézier's
        curve, R_m = R0 exp(σ̂/2) the rotation half-way, and δ(t) of `bezier_deviation`.

    See Also
    --------
    bezier_so3 : The curve without the correction.
    minimum_acceleration_so3 : The optimum.
    excess_estimate : How far above the optimum a curve is.

    Notes
    -----
    Near-optimal for small excursions: data s times as large have a relative excess over the
    optimum about s⁸ times as large, that of the other closed forms s⁴ or s² times. δ is of third
    order in the data: where the ends are fast it is large, and makes the curve cost more than
    Bézier's (see docs/near_optimal.md).

    σ is the logarithm of R0ᵀ R1, of any length, that is nearest to the sum of Bézier's three legs.
    Singular set: that of `bezier_so3`, and where two logarithms are equally near.

    Moved ends give the moved curve, and R1, R0, −w1, −w0 give the curve run backwards.

    References
    ----------
    beyond BK 10.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = corrected_bezier_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, T, legs = _slow_ends(R0, R1, w0, w1, duration)
    curve = _bezier(ends, T, legs)
    sigma = nearest_turn(log_so3(ends.turn), legs[0] + legs[1] + legs[2])
    deviation = bezier_deviation(sigma, *seen_from_the_middle(sigma, ends.w0, ends.w1))
    middle = quaternion_from_rotation_vector(sigma / 2)
    points = quaternion_multiply(quaternion_conjugate(middle)[..., None, :], curve.controls)
    pure = [np.concatenate([np.zeros_like(c[..., :1]), c], axis=-1) for c in deviation]
    return CorrectedBezier(
        duration=T,
        start=quaternion_multiply(curve.start, middle),
        controls=np.concatenate([points, np.stack(pure, axis=-2)], axis=-2),
    )


def quaternion_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> QuaternionCubic:
    """Return the projection of a cubic in R⁴ on the unit quaternions: BK's idea in another space.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    duration : array_like, shape (...), optional
        How long it takes.

    Returns
    -------
    QuaternionCubic
        A `Curve` that meets all four ends; with ``margin``. The cubic has q' = q (0, w)/2 at its
        ends; of q1 and −q1 the one nearer to q0 is its goal.

    Raises
    ------
    ValueError
        From the curve, when called at a time when the cubic is zero, to rounding.

    See Also
    --------
    projected_cubic_so3 : The same with matrices.

    Notes
    -----
    Singular set: R0 and R1 a half-turn apart, where q1 and −q1 are equally near: the one that
    `canonical_quaternion` chooses for R0ᵀ R1 is taken. And where the cubic is zero at some time;
    near it, where ``margin`` is small, the body turns by up to a full turn in a moment, and the
    curve is accurate to eps over ``margin`` at that time, its derivatives to that over its square
    and its cube.

    Moved ends give the moved curve, and R1, R0, −w1, −w0 give the curve run backwards.

    References
    ----------
    BK 1, BK Remark 7.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = quaternion_cubic_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> float(c.margin.round(3))
    0.933
    """
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    turn, one = quaternion_from_matrix(ends.turn), np.ones(T.shape)
    return QuaternionCubic(**_cubic_from_the_goal(ends, T, turn, one, 0 * one))


def cayley_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> CayleyCubic:
    """Return the cubic in Cayley's parameters about R0 with these ends.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at both ends, no half-turn apart. Validity is not checked; see
        `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    CayleyCubic
        A `Curve` that meets all four ends. Cayley's parameters of a turn by a about the unit
        vector n are g = tan(a/2) n; its quaternion is (1, g) over its norm, and along a curve
        2 g' = w + g × w + (g·w) g.

    Raises
    ------
    ValueError
        If R0 and R1 are a half-turn apart, to rounding.

    See Also
    --------
    exponential_cubic_so3 : The same in exponential coordinates.

    Notes
    -----
    Singular set: half-turns, which have no such parameters. No curve ever turns by 180° from R0,
    so near them it is a long way round: the cost grows without bound.

    Moved ends give the moved curve; but run backwards, from R1 to R0, it is another one.

    References
    ----------
    BK 1, its reference 8.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = cayley_cubic_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    turn = quaternion_from_matrix(ends.turn)
    infinite = np.flatnonzero(turn[..., 0] == 0)
    if len(infinite):
        curve = which_curve(infinite[0], T.shape)
        raise ValueError(f"R0 and R1{curve} are a half-turn apart: no Cayley parameters")
    growth = np.sum(turn[..., 1:] * ends.w1, axis=-1) / (2 * turn[..., 0])
    return CayleyCubic(**_cubic_from_the_goal(ends, T, turn, 1 / turn[..., 0], growth))


def normal_cubic_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    inertia: ArrayLike,
    *,
    duration: ArrayLike = 1.0,
) -> NormalCubic:
    """Return the cubic with these ends in normal coordinates of a body's metric, to second order.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    inertia : array_like, shape (..., 3, 3)
        G, body frame: symmetric and positive definite.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    NormalCubic
        A `Curve` that meets all four ends: R0 exp(ŷ), y = x − ½ G⁻¹(x × G x), with x(t) the cubic
        with x(0) = 0, x'(0) = w0 and the x(1) and x'(1) that give R1 and w1.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, `inertia` is not symmetric and positive
        definite, the batches do not broadcast, or no x(1), or no x'(1), is found.

    See Also
    --------
    minimum_acceleration_so3 : The optimum.
    weighted_cubic_so3 : The projection in the metric of a body.
    exponential_cubic_so3 : With G a multiple of I it is that curve.

    Notes
    -----
    A geodesic of the metric G, the motion of a free body, starts from R0 with the velocity x as
    R0 exp(ŷ) with y = x t − ½ G⁻¹(x × G x) t² + …: Euler's equation is G w' = −w × G w. So x is
    its initial velocity, the Riemannian normal coordinate of R0 exp(ŷ), to second order. Cubics in
    normal coordinates are Hermite interpolation as Zimmermann 2020 has it; with the map cut off
    after its second term, a retraction of second order, we know no source. It is no Riemannian
    cubic: that is the name of the optimum.

    Near-optimal for small excursions: data s times as large have a relative excess over the
    optimum about s⁴ times as large.

    Singular set: R0 and R1 a half-turn apart, where the curve is that of the rotation vector y(1)
    which `log_so3` chooses; and where x ↦ y is singular at x(1). Every y is reached, as
    yᵀ G x = xᵀ G x bounds all x with this y. With y(1) up to π the moments 1, 2, 2.9 have no such
    place; flat strips, thin bodies with three different moments, do, beyond about 2 rad about their
    middle axis. Near it the curve is long.

    Moved ends give the moved curve; but run backwards, from R1 to R0, it is another one.

    References
    ----------
    beyond BK 7; R. Zimmermann, Hermite interpolation and data processing errors on Riemannian
    matrix manifolds, SIAM Journal on Scientific Computing 2020.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1, book = exp_so3([0, 0, 1.5]), np.diag([1.0, 2.22, 3.18])
    >>> c = normal_cubic_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0], book)
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, G = with_inertia(Ends(R0, R1, w0, w1), inertia)
    ends, T = ends.over(duration)
    G = np.broadcast_to(G, (*T.shape, 3, 3))
    inverse, turn = np.linalg.inv(G), log_so3(ends.turn)
    goal, by_goal = _normal_coordinates(turn, G, inverse)
    rate = right_jacobian_inverse_so3(turn) @ ends.w1[..., None]
    end_rate = np.linalg.solve(by_goal, rate)[..., 0]
    cubic = np.stack([np.zeros_like(turn), goal, ends.w0, end_rate], axis=-2)
    return NormalCubic(
        duration=T,
        start=quaternion_from_matrix(ends.R0),
        controls=np.concatenate([cubic, G, inverse], axis=-2),
    )


def exponential_quintic_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    a0: ArrayLike,
    a1: ArrayLike,
    *,
    duration: ArrayLike = 1.0,
) -> ExponentialQuintic:
    """Return R0 exp(σ̂(t)), σ(t) the quintic with these ends: near-optimal minimum jerk.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    a0, a1 : array_like, shape (..., 3)
        Angular accelerations w' there, body frame, in rad per unit time squared.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    ExponentialQuintic
        A `Curve` that meets all six ends: σ(0) = 0, σ(1) = log_so3(R0ᵀ R1), and the derivatives of
        σ that give w and w' there.

    See Also
    --------
    minimum_jerk_so3 : The optimum with the same ends.
    projected_quintic_so3 : In the space of matrices, far from the optimum where turns are large.
    jerk_cost : What they cost.

    Notes
    -----
    Near-optimal for small excursions (see docs/near_optimal.md). From rest to rest it is the
    optimum.

    Singular set: R0 and R1 a half-turn apart, where the curve is that of the rotation vector which
    `log_so3` chooses. The curve itself is smooth everywhere. Moved ends give the moved curve; but
    run backwards, from R1 to R0, it is another one.

    References
    ----------
    beyond BK 8; the cubic is in BK 1, its reference 13.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> rest = [0, 0, 0]
    >>> c = exponential_quintic_so3(np.eye(3), exp_so3([0, 0, 1.5]), rest, rest, rest, [0, 0, 2])
    >>> c([0, 1], 2).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 0., 2.]])
    """
    ends, a0, a1, T = ends_of_quintic(R0, R1, w0, w1, a0, a1, duration)
    curve = _exponential_cubic(ends, T, log_so3(ends.turn))
    turn, end_rate = 2 * curve.controls[..., 1, :], 2 * curve.controls[..., 3, :]
    straight = exp([np.moveaxis(x, -1, 0) / 2 for x in (turn, end_rate, 0 * end_rate)])
    w_rate = np.moveaxis(angular_velocity(straight), 0, -1)
    bend = matvec(right_jacobian_inverse_so3(turn), a1 - w_rate)
    more = np.stack([a0, bend], axis=-2) / 2
    controls = np.concatenate([curve.controls, more], axis=-2)
    return ExponentialQuintic(duration=T, start=curve.start, controls=controls)


CLOSED_FORMS: dict[str, Callable[..., Curve]] = {
    make.__name__: make
    for make in (
        projected_cubic_so3,
        exponential_cubic_so3,
        bezier_so3,
        corrected_bezier_so3,
        cumulative_bezier_so3,
        quaternion_cubic_so3,
        cayley_cubic_so3,
    )
}
"""The closed forms for two rotations and two angular velocities, by name."""


def bezier_legs(ends: Ends) -> Legs:
    """Return the turns from each of Bézier's control points to the next, the shortest."""
    first, last = ends.w0 / 3, ends.w1 / 3
    return first, log_so3(exp_so3(-first) @ ends.turn @ exp_so3(-last)), last


def _slow_ends(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, duration: ArrayLike
) -> tuple[Ends, Array, Legs]:
    """Return ends for the time from 0 to 1, the duration, and Bézier's legs, of less than π."""
    ends, T = Ends(R0, R1, w0, w1).over(duration)
    for name, w in (("w0", ends.w0), ("w1", ends.w1)):
        angle = np.linalg.norm(w, axis=-1)
        fast = angle >= 3 * np.pi
        if fast.any():
            raise ValueError(
                f"{first_index(name, fast)}: a norm below 3π is wanted, got {angle[fast][0]:.4g}"
            )
    return ends, T, bezier_legs(ends)


def seen_from_the_middle(sigma: Array, w0: Array, w1: Array) -> tuple[Array, Array]:
    """Return e, the mean of two end velocities less σ, and d, their difference.

    The velocities are carried to the rotation half-way, R0 exp(σ̂/2), parallel in a bi-invariant
    metric: the body axes turn by σ/2 on each half of the way, and what is parallel by half of that.

    Parameters
    ----------
    sigma : ndarray, shape (..., 3)
        A logarithm of R0ᵀ R1.
    w0, w1 : ndarray, shape (..., 3)
        Angular velocities at the ends, body frame.

    Returns
    -------
    e, d : ndarray, shape (..., 3)
        0 for the geodesic at constant speed.
    """
    quarter = exp_so3(sigma / 4)
    u0, u1 = matvec(quarter.mT, w0), matvec(quarter, w1)
    return (u0 + u1) / 2 - sigma, u1 - u0


def bezier_deviation(sigma: Array, e: Array, d: Array) -> list[Array]:
    """Return what Bézier's curve is away from the optimum, to third order, as a polynomial.

    The deviation, a rotation vector, is δ(t) = t² (1 − t)² (c₀ + c₁ u + … + c₄ u⁴), u = 2t − 1.

    Parameters
    ----------
    sigma, e, d : ndarray, shape (..., 3)
        The displacement, and the velocities of `seen_from_the_middle`.

    Returns
    -------
    list of ndarray, shape (..., 3)
        c₀, …, c₄: sums of triple products a × (b × c); in the code ``sed`` is σ × (e × d).

    References
    ----------
    beyond BK 10.
    """
    first = np.stack([sigma, sigma, sigma, e, e, e, d, d])
    second = np.stack([sigma, sigma, e, sigma, sigma, e, sigma, e])
    third = np.stack([e, d, d, e, d, d, d, d])
    sse, ssd, sed, ese, esd, eed, dsd, ded = np.cross(first, np.cross(second, third))
    return [
        (17 * sed - 10 * ssd - 13 * esd) / 1080 + 97 * eed / 15120,
        11 * ded / 6048 - sse / 90 - ese / 60 - dsd / 720,
        sed / 180 - esd / 120 + 3 * eed / 560,
        17 * ded / 30240 - ese / 90,
        eed / 504,
    ]


def nearest_turn(turn: Array, way: Array) -> Array:
    """Return the turns to the same rotations, by full turns more or fewer, nearest to `way`."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    axis = turn / np.where(angle == 0, 1, angle)
    more = (np.sum(way * axis, axis=-1, keepdims=True) - angle) / (2 * np.pi)
    return turn + 2 * np.pi * np.round(more) * axis


def other_way(turn: Array) -> Array:
    """Return the turns to the same rotations the other way round, by 2π − angle; 0 stays 0."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    return turn - 2 * np.pi * turn / np.where(angle == 0, 1, angle)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class QuaternionCurve(Curve):
    """A `Curve` that is a fixed rotation times the rotation of a quaternion Q(t) of any norm.

    References
    ----------
    BK 1.
    """

    start: Array  # the fixed rotation as a quaternion, shape (..., 4)
    controls: Array  # what Q is made of, shape (..., n, components)

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the jet of Q at the times t, from controls that broadcast with them."""
        raise NotImplementedError

    def values(self, t: Array, order: int) -> Array:
        """Return the rotation of the start times Q, or a derivative."""
        by_curve = len(t) > self.count  # the longer axis last
        t, axis = (t.T, -1) if by_curve else (t, -2)
        Q = self.quaternion(np.expand_dims(self._first, axis), t, order)
        self._check(Q[0], t, by_curve)
        if order:
            values = np.moveaxis(angular_velocity(Q), 0, -1)
        else:
            values = rotation(multiply(np.expand_dims(self.start.T, axis), Q[0]))
        return values.swapaxes(0, 1) if by_curve else values

    def _check(self, Q: Array, t: Array, by_curve: bool) -> None:
        """Raise a SingularTime where Q has no direction."""

    @cached_property
    def _first(self) -> Array:
        """The controls, components first."""
        return np.ascontiguousarray(np.moveaxis(self.controls, (-2, -1), (0, 1)))


class ExponentialCubic(QuaternionCurve):
    """The `Curve` R0 exp(σ̂(t)), σ a cubic; σ(1) is any logarithm of the turn."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(σ/2)."""
        return exp(_polynomial(controls, t, order))


class ExponentialQuintic(ExponentialCubic):
    """The `Curve` R0 exp(σ̂(t)), σ a quintic."""


def _exponential_cubic(ends: Ends, T: Array, turn: Array) -> ExponentialCubic:
    end_rate = matvec(right_jacobian_inverse_so3(turn), ends.w1)
    controls = np.stack([np.zeros_like(turn), turn, ends.w0, end_rate], axis=-2) / 2
    return ExponentialCubic(duration=T, start=quaternion_from_matrix(ends.R0), controls=controls)


class NormalCubic(QuaternionCurve):
    """The `Curve` R0 exp(ŷ), y = x − ½ G⁻¹(x × G x), x a cubic."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(y/2), from the ends of x, G and G⁻¹."""
        x, G, inverse = _polynomial(controls[:4], t, order), controls[4:7], controls[7:]
        bent = cross(x, [np.einsum("ij...,j...->i...", G, each) for each in x])
        return exp(
            [
                each / 2 - np.einsum("ij...,j...->i...", inverse, bend) / 4
                for each, bend in zip(x, bent, strict=True)
            ]
        )


def _normal_coordinates(y: Array, G: Array, inverse: Array) -> tuple[Array, Array]:
    """Return x with x − ½ G⁻¹(x × G x) = y, and the derivative of the left side by x.

    Newton's method, for a quarter of y, two quarters, and so on.
    """
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
    _check_normal(~found, "x is not found for the goal, to rounding")
    _check_normal(~(np.abs(np.linalg.det(by_x)) > 1e-9), "the map from x to y is singular")
    return x, by_x


def _check_normal(lost: Array, why: str) -> None:
    if np.any(lost):
        curve = which_curve(int(np.flatnonzero(lost)[0]), np.shape(lost))
        raise ValueError(f"normal cubic{curve}: {why}")


class CumulativeBezier(QuaternionCurve):
    """The `Curve` R0 exp(β₁ v̂₁) exp(β₂ v̂₂) exp(β₃ v̂₃), β the cumulative Bernstein polynomials."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the product of exp(βᵢ vᵢ/2)."""
        s = 1 - t
        shares: list[Jet] = [
            [t * (1 + s + s * s), 3 * s * s, -6 * s, 6 + 0 * t],
            [t * t * (1 + 2 * s), 6 * t * s, 6 * (s - t), -12 + 0 * t],
            [t * t * t, 3 * t * t, 6 * t, 6 + 0 * t],
        ]
        first, second, third = (
            exp([beta * half for beta in share[: order + 1]])
            for share, half in zip(shares, controls, strict=True)
        )
        return product(product(first, second), third)


class Bezier(QuaternionCurve):
    """The `Curve` of de Casteljau's construction, geodesics in the place of straight lines."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return what the construction comes to from four control points."""
        share = [identity(t, k) for k in range(order + 1)]
        points = [[point, *[np.zeros_like(point)] * order] for point in controls]
        while len(points) > 1:
            points = [slerp(a, b, share) for a, b in pairwise(points)]
        return points[0]


def _bezier(ends: Ends, T: Array, legs: Legs) -> Bezier:
    point = np.broadcast_to(np.eye(4)[0], (*T.shape, 4))
    points = [point]
    for leg in legs:
        point = quaternion_multiply(point, quaternion_from_rotation_vector(leg))
        points.append(point)
    return Bezier(
        duration=T, start=quaternion_from_matrix(ends.R0), controls=np.stack(points, axis=-2)
    )


class CorrectedBezier(Bezier):
    """The `Curve` of de Casteljau's construction, less its leading deviation from the optimum.

    It is seen from the rotation half-way: there moving by −δ is exp(−δ̂/2) on both sides.
    """

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(−δ/4) Q exp(−δ/4), from four points and the coefficients of δ."""
        points, deviation = controls[:4], controls[4:, 1:]
        moved = exp([x / -4 for x in _clamped(deviation, t, order)])
        return product(product(moved, super().quaternion(points, t, order)), moved)


def _clamped(coefficients: Array, t: Array, order: int) -> Jet:
    """Return the jet of t² (1 − t)² (c₀ + c₁ u + …), u = 2t − 1."""
    s = 1 - t
    bump: Jet = [t * t * s * s, 2 * t * s * (s - t), 2 - 12 * t * s, 12 * (t - s)]
    powers: Jet = []
    for _ in range(order + 1):
        powers.append(sum(c * (t - s) ** k for k, c in enumerate(coefficients)))
        coefficients = np.stack([2 * k * c for k, c in enumerate(coefficients)][1:])
    return times(bump[: order + 1], powers)


class NormalizedCubic(QuaternionCurve):
    """The `Curve` of a cubic of quaternions, of norm 1 at its start and of another at its end.

    Its components are those seen from the goal: there Q(1) is real, and does not round w1 away,
    however large it is.
    """

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the cubic with these ends."""
        return _polynomial(controls, t, order)


def _cubic_from_the_goal(
    ends: Ends, T: Array, turn: Array, norm: Array, growth: Array
) -> dict[str, Array]:
    """Return the arrays of a `NormalizedCubic`, of a norm at its goal that grows so."""
    start, one = quaternion_conjugate(turn), np.eye(4)[0] + np.zeros_like(turn)
    end_rate = growth[..., None] * one + _rate(one, ends.w1)
    cubic = start, norm[..., None] * one, _rate(start, ends.w0), norm[..., None] * end_rate
    goal = quaternion_multiply(quaternion_from_matrix(ends.R0), turn)
    return {"duration": T, "start": goal, "controls": np.stack(cubic, axis=-2)}


class QuaternionCubic(NormalizedCubic):
    """The `Curve` of the unit quaternions nearest to a cubic between unit quaternions.

    Attributes
    ----------
    margin : ndarray, shape (...)
        The least norm of the cubic. At 0 the nearest unit quaternion is not unique.
    margin_time : ndarray, shape (...)
        When that is.
    """

    def _check(self, Q: Array, t: Array, by_curve: bool) -> None:
        size = np.expand_dims(np.abs(self._first).max(axis=(0, 1)), -1 if by_curve else -2)
        lost = np.abs(Q).max(axis=0) < 8 * EPS * size
        check_defined(t, lost, "the cubic of quaternions is zero", by_curve=by_curve)

    @property
    def margin(self) -> Array:
        """The least norm of the cubic."""
        return self._least[1]

    @property
    def margin_time(self) -> Array:
        """When the margin is reached."""
        return self._least[0] * self.duration

    @cached_property
    def _least(self) -> tuple[Array, Array]:
        def norm(t: Array) -> Array:
            return np.linalg.norm(_polynomial(self._first[:, :, None], t, 0)[0], axis=0)

        return least_over_time(norm, self.batch_shape)

    @property
    def breakpoints(self) -> Array:
        """As `Curve.breakpoints`."""
        return near_margins(super().breakpoints, *self._least)


class CayleyCubic(NormalizedCubic):
    """The `Curve` of a cubic in Cayley's parameters."""

    @property
    def breakpoints(self) -> Array:
        """As `Curve.breakpoints`; it turns most quickly where Q is small and its rate large."""

        def time_for_a_radian(t: Array) -> Array:
            jet = _polynomial(self._first[:, :, None], t, 1)
            Q, rate = (np.linalg.norm(x, axis=0) for x in jet)
            return Q / (1 + rate)

        return graded(super().breakpoints, *least_over_time(time_for_a_radian, self.batch_shape))


def _polynomial(ends: Array, t: Array, order: int) -> Jet:
    return [hermite(ends, t, k) for k in range(order + 1)]


def _rate(q: Array, w: Array) -> Array:
    """Return q' = q (0, w)/2."""
    return quaternion_multiply(q, np.concatenate([np.zeros_like(w[..., :1]), w], axis=-1)) / 2
