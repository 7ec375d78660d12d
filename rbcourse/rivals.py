"""Other closed forms with the ends of the projected cubic: the roads that BK 1 names, and kin."""

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import first_index
from rbcourse.quaternion_curves import (
    Bezier,
    CayleyCubic,
    CumulativeBezier,
    ExponentialCubic,
    QuaternionCubic,
    bezier_legs,
    to_given,
)
from rbcourse.so3 import log_so3


def exponential_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> ExponentialCubic:
    """Return R0 exp(σ̂(t)), σ(t) the cubic in exponential coordinates about R0 with these ends.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    ExponentialCubic
        A `Curve` that meets all four ends: σ(0) = 0, σ'(0) = w0, σ(1) = log_so3(R0ᵀ R1), and σ'(1)
        by `right_jacobian_inverse_so3`.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    See Also
    --------
    projected_cubic_so3, minimum_acceleration_so3

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
    given = to_given(R0, R1, w0, w1)
    return ExponentialCubic(given, log_so3(given.turn))


def bezier_so3(R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Bezier:
    """Return the cubic Bézier curve with these ends: de Casteljau's construction by geodesics.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time, ‖w‖ < 3π.

    Returns
    -------
    Bezier
        A `Curve` that meets all four ends, with the control points R0, R0 exp(ŵ0/3),
        R1 exp(−ŵ1/3), R1.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, the batches do not broadcast, or a
        velocity is 3π or more: its leg would be no shortest geodesic.

    See Also
    --------
    cumulative_bezier_so3 : From the same control points, quicker.

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
    given = to_given(R0, R1, w0, w1)
    for name, w in (("w0", w0), ("w1", w1)):
        speed = np.linalg.norm(w, axis=-1)
        fast = speed >= 3 * np.pi
        if fast.any():
            raise ValueError(
                f"{first_index(name, fast)}: a norm below 3π is wanted, got {speed[fast][0]:.4g}"
            )
    return Bezier(given, bezier_legs(given))


def cumulative_bezier_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> CumulativeBezier:
    """Return R0 exp(β₁ v̂₁) exp(β₂ v̂₂) exp(β₃ v̂₃), the cubic Bézier curve in cumulative form.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    CumulativeBezier
        A `Curve` that meets all four ends: v₁ = w0/3, v₃ = w1/3, v₂ the shortest turn between, and
        β₁ = 1 − (1 − t)³, β₂ = 3t² − 2t³, β₃ = t³.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

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
    given = to_given(R0, R1, w0, w1)
    return CumulativeBezier(given, bezier_legs(given))


def quaternion_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> QuaternionCubic:
    """Return the projection of a cubic in R⁴ on the unit quaternions: BK's idea in another space.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    QuaternionCubic
        A `Curve` that meets all four ends; with ``margin``. The cubic has q' = q (0, w)/2 at its
        ends; of q1 and −q1 the one nearer to q0 is its goal.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast. The
        curve, when called at a time when the cubic is zero, to rounding.

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
    return QuaternionCubic(to_given(R0, R1, w0, w1))


def cayley_cubic_so3(R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> CayleyCubic:
    """Return the cubic in Cayley's parameters about R0 with these ends.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1, no half-turn apart; what is none is not repaired (see
        `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    CayleyCubic
        A `Curve` that meets all four ends. Cayley's parameters of a turn by a about the unit
        vector n are g = tan(a/2) n; its quaternion is (1, g) over its norm, and along a curve
        2 g' = w + g × w + (g·w) g.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, the batches do not broadcast, or R0 and R1
        are a half-turn apart, to rounding.

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
    return CayleyCubic(to_given(R0, R1, w0, w1))
