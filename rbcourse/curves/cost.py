"""Costs of curves: integrals of the squared acceleration (BK (18)), torque or jerk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._checks import as_single, check_broadcast
from rbcourse._docs import described_by
from rbcourse._numerics import EPS, Array, blocks
from rbcourse._polynomials import grid
from rbcourse.body import Body, of_point
from rbcourse.curves.chain import Chain
from rbcourse.curves.curve import HALVES, Curve, SingularTime, which_curve
from rbcourse.curves.ends import as_body
from rbcourse.curves.functionals import BallAcceleration, Effort, Functional, Jerk

_TOGETHER = 2000  # panels evaluated together, which bounds the memory
_HALVINGS = 30
_MOST = 50_000  # panels that may be halved in one pass, in addition to the number of first panels
Index: TypeAlias = NDArray[np.intp]
Density: TypeAlias = Callable[[Curve, Array, Index], Array]


def acceleration_cost(curve: Curve, *, body: Body | None = None, rtol: float = 1e-10) -> Array:
    """Return L_a, the integral of the squared acceleration in the metric of the body.

    Source: BK (18), with the covariant acceleration BK (9) in the metrics BK (12) and BK (14); for
    other inertias, beyond BK 1.

    Parameters
    ----------
    curve : Curve
        A curve on SO(3) or SE(3), or a stack of curves.
    body : Body, optional
        The body that moves along the curve: one for all curves of a stack, or one for each curve.
        The default is ``curve.body``. On SO(3), only its inertia matters.
    rtol : float, optional
        The relative error, from 1e-12 to 0.1. From 1e-8 on, the quadrature is 3 to 8 times as
        fast, but may miss a peak narrower than a hundredth of the interval.

    Returns
    -------
    ndarray, shape curve.batch_shape
        ∫ τᵀ G⁻¹ τ dt with the torque τ = G w' + w × G w. On SE(3), ∫ m ‖d_c''‖² dt is added, where
        d_c is the position of the centre of mass. For the ball, the cost is ∫ 2 ‖w'‖² dt, and on
        SE(3) ∫ (2 ‖w'‖² + ‖d''‖²) dt. For tiny costs, the absolute error is 1e-20 times a third of
        the trace of G (2e-20 for the ball). The errors may be larger if the acceleration has peaks
        or ripples that are narrower than a hundredth of the interval, for example if the ``f`` of a
        `projected_line` changes abruptly.

    Raises
    ------
    RuntimeError
        If the integral does not converge, if ``margin`` is below 1e-6, if the curve is NaN or
        `Timed`, or if the velocity of a `chain` jumps.

    Notes
    -----
    The vector G⁻¹τ is the covariant acceleration in the metric G, and τᵀ G⁻¹ τ is its squared norm.
    Free motions have the cost 0. On SE(3), the sum (of the `acceleration_cost_parts`) depends on
    the unit of length, and so do ratios of sums, unless inertia and mass are those of a body.

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_line
    >>> line = projected_line(np.eye(3), exp_so3([0, 0, 1.5]))
    >>> float(acceleration_cost(line).round(4))
    6.7627
    >>> book = Body(np.diag([1.0, 2, 2.5]))
    >>> float(acceleration_cost(line, body=book).round(4))  # 2.5 in place of 2
    8.4534
    """
    rotation, translation = acceleration_cost_parts(curve, body=body, rtol=rtol)
    return rotation + translation


@described_by(acceleration_cost)
def acceleration_cost_parts(
    curve: Curve, *, body: Body | None = None, rtol: float = 1e-10
) -> tuple[Array, Array]:
    """Return the two parts of `acceleration_cost`: rotation and translation.

    Source: BK (18); for other inertias, beyond BK 1.

    Returns
    -------
    rotation, translation : ndarray, shape curve.batch_shape
        The costs ∫ τᵀ G⁻¹ τ dt, for the ball ∫ 2 ‖w'‖² dt, and ∫ m ‖d_c''‖² dt, or 0 on SO(3).

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates, projected_cubic
    >>> c = projected_cubic(np.eye(4), pose_from_coordinates([0, 0, 0, 1, 0, 0]))
    >>> rotation, translation = acceleration_cost_parts(c)
    >>> float(rotation), float(translation.round(12))
    (0.0, 12.0)
    """
    name = "acceleration cost"
    legs = smooth_legs(curve, name, 1, on_so3=False)
    body = as_body(body, curve.body)
    functional: Functional = BallAcceleration()
    if not body.is_ball:
        functional = Effort(_inertias(curve, legs, body), of_torque=False)
    rotation = _rotation_cost(name, curve, legs, functional, rtol)
    translation: Array = np.zeros(legs.count)
    r = body.centre
    if legs.size == 4:

        def squared(some: Curve, t: Array, index: Index) -> Array:
            A = some.values(t, 2)
            V = some.values(t, 1) if r.any() else A  # the velocity does not matter at the origin
            return np.sum(of_point(r, V, A) ** 2, axis=-1)

        translation = body.mass * integral(name, legs, squared, rtol)
    return rotation, summed(curve, translation, legs, 3)


@described_by(acceleration_cost)
def torque_cost(curve: Curve, *, body: Body | None = None, rtol: float = 1e-10) -> Array:
    """Return ∫ ‖τ‖² dt, with the torque τ = G w' + w × G w that turns a body along the curve.

    The errors and the accuracy are those of `acceleration_cost`.
    Source: beyond BK 4.

    Returns
    -------
    ndarray, shape curve.batch_shape
        The cost. On SE(3), τ is the torque about the centre of mass.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic
    >>> c = geodesic(np.eye(3), exp_so3([1.0, 1.0, 0]))  # no acceleration, but w × G w
    >>> float(torque_cost(c, body=Body(np.diag([1.0, 2, 2.5]))).round(12))
    1.0
    """
    legs = smooth_legs(curve, "torque cost", 1, on_so3=False)
    inertias = _inertias(curve, legs, as_body(body, curve.body))
    return _rotation_cost("torque cost", curve, legs, Effort(inertias, of_torque=True), rtol)


@described_by(acceleration_cost, returns="ndarray, shape curve.batch_shape")
def jerk_cost(curve: Curve, *, rtol: float = 1e-10) -> Array:
    """Return ∫ 2 ‖w'' + ½ w × w'‖² dt, the integral of the squared covariant jerk in metric (12).

    The cost is the same for the inverse motion Rᵀ(t), unlike ∫ 2 ‖w''‖² dt. The curve must be on
    SO(3). The errors and the accuracy are those of `acceleration_cost`; an error is also raised if
    the acceleration of a `chain` jumps.
    Source: beyond BK 5; M. Žefran, V. Kumar and C. Croke 1998.

    Examples
    --------
    >>> from rbcourse import exp_so3, minimum_jerk
    >>> c = minimum_jerk(np.eye(3), exp_so3([0, 0, 1.5]))  # from rest to rest
    >>> float(jerk_cost(c).round(9))  # 2 · 720 · 1.5²
    3240.0
    """
    legs = smooth_legs(curve, "jerk cost", 2)
    return _rotation_cost("jerk cost", curve, legs, Jerk(), rtol)


def smooth_legs(curve: Curve, name: str, order: Literal[1, 2], *, on_so3: bool = True) -> Curve:
    """Return the curve, or the legs of a chain that passes `Chain.check_smooth`."""
    if not isinstance(curve, Curve):
        raise ValueError(f"curve: a Curve is wanted, got {type(curve).__name__}")
    if on_so3 and curve.size != 3:
        raise ValueError(
            f"curve: a curve on SO(3), as of poses[:, :3, :3], is wanted, got {curve!r}"
        )
    if not isinstance(curve, Chain):
        return curve
    curve.check_smooth(name, order)
    return curve.legs


def _inertias(curve: Curve, legs: Curve, body: Body) -> Array:
    G = body.inertia
    batch = check_broadcast(curve=(np.empty(curve.batch_shape), 0), body=(G, 2))
    if batch != curve.batch_shape:
        raise ValueError(
            f"body: a single body or a stack of shape {curve.batch_shape} is wanted, "
            f"got shape {body.batch_shape}"
        )
    return np.broadcast_to(G, (*legs.batch_shape, 3, 3)).reshape(-1, 3, 3)


def summed(curve: Curve, costs: Array, legs: Curve, power: int) -> Array:
    """Rescale the costs of legs from unit time to their durations; add up the costs of a chain."""
    with np.errstate(over="ignore"):
        costs = costs / legs.flat.duration**power
    return costs.sum() if legs is not curve else costs.reshape(curve.batch_shape)[()]


def _rotation_cost(
    name: str, curve: Curve, legs: Curve, functional: Functional, rtol: float
) -> Array:
    def density(some: Curve, t: Array, index: Index) -> Array:
        those = functional.take(index)
        rates = [some.values(t, order)[..., :3] for order in those.needs]
        u = those.deviation(*(np.moveaxis(rate, 0, 1) for rate in rates))
        return np.sum(u**2, axis=-1).T

    costs = functional.scale * integral(name, legs, density, rtol)
    return summed(curve, costs, legs, functional.ends + 1)


def integral(name: str, curve: Curve, density: Density, rtol: float) -> Array:
    """Integrate `density` over unit time for each curve of a stack, by adaptive quadrature.

    A panel is halved while the Clenshaw–Curtis rules with 9 and 17 nodes differ by more than `rtol`
    times the integral. ``density(some, t, index)`` returns the integrand at the times t, shape
    (T, K), for the K curves `some`, whose indices in the stack are `index`.
    """
    if not 1e-12 <= as_single("rtol", rtol) <= 0.1:
        raise ValueError(f"rtol: a number from 1e-12 to 0.1 is wanted, got {rtol}")
    flat = curve.flat
    if (nan := ~np.isfinite(flat.values(np.array([[0.0], [1.0]]), 1)).all(axis=(0, 2))).any():
        lost = which_curve(int(np.argmax(nan)), curve.batch_shape)
        raise RuntimeError(f"{name}{lost}: the curve is NaN, since it did not converge")
    fine, rough = grid(17), grid(9)
    cost = np.zeros(curve.count)
    panels = curve.breakpoints if rtol < 1e-8 else [HALVES] * curve.count
    index = np.repeat(np.arange(curve.count), [len(ends) - 1 for ends in panels])
    start = np.concatenate([cost[:0], *(ends[:-1] for ends in panels)])
    width = np.concatenate([cost[:0], *(np.diff(ends) for ends in panels)])
    most = _MOST + len(index)
    for _ in range(_HALVINGS):
        value, error = np.empty((2, len(index)))
        for part in blocks(len(index), _TOGETHER):
            t = start[part] + fine.t[:, None] * width[part]
            try:
                squares = density(flat._take(index[part]), t, index[part])
            except SingularTime as found:
                i = int(index[part][found.curve])
                raise SingularTime(found.time, i, found.reason, curve.batch_shape) from None
            value[part] = width[part] * (fine.integral[-1] @ squares)
            rest = width[part] * (rough.integral[-1] @ squares[::2])
            with np.errstate(invalid="ignore"):  # inf − inf
                error[part] = np.abs(value[part] - rest)
        expected = cost + np.bincount(index, value, curve.count)
        coarse = ~(error <= rtol * expected[index] + 1e-20)  # NaN counts as coarse
        lost = coarse & (width < 256 * EPS * (start + width))  # its times would coincide
        if lost.any() or np.count_nonzero(coarse) > most:
            break
        cost += np.bincount(index[~coarse], value[~coarse], curve.count)
        index = np.repeat(index[coarse], 2)
        start, width = (np.repeat(x[coarse], 2) for x in (start, width / 2))
        start[1::2] += width[1::2]
        if not len(index):
            return cost
    raise RuntimeError(
        f"{name}: the integral {expected.max():.6g} still has an uncertainty of "
        f"{error.sum():.1e} (see margin)"
    )
