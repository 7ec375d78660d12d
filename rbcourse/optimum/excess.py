"""An estimate of the excess of a curve's cost over the optimum, for small excursions."""

from __future__ import annotations

import numpy as np

from rbcourse._numerics import Array, blocks
from rbcourse._polynomials import grid, tails
from rbcourse.curves.cost import smooth_legs, summed
from rbcourse.curves.curve import Curve
from rbcourse.optimum._second_variation import on_each_axis, polynomials, products
from rbcourse.so3 import hat

_NODES, _BUMPS = 33, 12
_TOGETHER = 1000  # curves computed together, which bounds the memory: 30 MB an array
_SMOOTH = 1e-6  # bound on the last two Chebyshev coefficients of w', divided by √∫ ‖w'‖² dt
SPEED_LIMIT = 2.5
"""In rad per duration: no estimate is given for a curve that turns at this speed or faster. Up to
2.4, estimates of projected cubics are right to 0.1 % of the excess."""


def excess_estimate(curve: Curve) -> Array:
    """Return an estimate of a curve's excess over the optimum, without solving for the optimum.

    The optimum has the same ends. That of a `chain` has the same rotations and velocities at its
    poses, so that the excess over `minimum_acceleration_spline` is larger. Costs are those of a
    ball.
    Source: beyond BK 11; BK (19).

    Parameters
    ----------
    curve : Curve
        A smooth curve on SO(3), or a stack of such curves, whose body is the ball. (For another
        body, divide `acceleration_cost` by the ``cost`` of the optimum.)

    Returns
    -------
    ndarray, shape curve.batch_shape
        An estimate of (cost of the curve)/(cost of the optimum) − 1. If the velocity of a `chain`
        jumps, RuntimeError is raised. The estimate is NaN if the curve reaches the `SPEED_LIMIT`,
        costs more than about twice the optimum, is not smooth enough for 33 nodes, costs nothing,
        or is NaN itself. It is also NaN if the second variation is not positive definite.

    Notes
    -----
    Domain: ‖w‖ times the duration is below 2.5 rad at all times, and the excess is at most 1. On
    random problems with an excess of at least 1e-8, the estimates were within 1.4 % of the excess
    for closed forms, and within 7 % for quintics with random end accelerations. For problems with
    ‖w‖ < 1 at all times, these figures were 0.04 % and 1.6 %. An excess below 1e-22 is lost in
    rounding. If ‖w‖ reaches 3π/4, the optimum may turn the other way round; the estimate is then
    the excess over the nearby stationary curve. The estimate is the decrement of one step of
    Newton's method, divided by the cost that remains (docs/near_optimal.md, section 6).

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_cubic
    >>> ends = np.eye(3), exp_so3([0, 0, 0.9]), [0, 0, 0], [0, 1, 0]
    >>> float(excess_estimate(projected_cubic(*ends)).round(4))
    0.0197
    """
    legs = smooth_legs(curve, "excess estimate", 1)
    if not curve.body.is_ball:
        raise ValueError(f"curve: the estimate is for the ball, got {curve.body!r}")
    t, _, integral, _ = grid(_NODES)
    w, a = (np.moveaxis(legs.flat.values(t[:, None], order), 1, 0) for order in (1, 2))
    left_out = ~(np.linalg.norm(w, axis=-1).max(axis=1) < SPEED_LIMIT)
    w[left_out], a[left_out] = 0, 0
    cost = np.sum(a**2, axis=-1) @ integral[-1]
    left_out |= tails(a) > _SMOOTH * np.sqrt(cost)
    saved: Array = np.zeros(len(w))
    for some in blocks(len(w), _TOGETHER):
        saved[some] = _decrement(w[some], a[some])
    saved[left_out | ~(saved <= cost / 2)] = np.nan
    all_saved, total = (summed(curve, x, legs, 3) for x in (saved, cost))
    with np.errstate(invalid="ignore"):  # 0/0
        return all_saved / (total - all_saved)


def _decrement(w: Array, a: Array) -> Array:
    """Return g · H⁻¹ g from w and w' at the nodes, (N, n, 3); NaN if H is not positive definite.

    To second order, the cost of R exp(η̂) is J − 2 g · η + η · H η. With x = η' + w × η,

        g · η = −∫ w' · x' dt,    η · H η = ∫ ‖x'‖² − w' · (η × x)' dt.
    """
    eta, rate, bend = (on_each_axis(x, np.eye(3)) for x in polynomials(_BUMPS, 2, _NODES)[:3])
    W, A = hat(w), hat(a)
    x, x_rate = rate + W @ eta, bend + A @ eta + W @ rate
    weights = grid(_NODES).integral[-1]
    H = products(weights, x_rate, x_rate)
    # −w' · (p × q) is p · (w' × q)
    H += products(weights, rate, A @ x) + products(weights, eta, A @ x_rate)
    g = products(weights, x_rate, a[..., None])
    values, vectors = np.linalg.eigh((H + H.mT) / 2)
    values[values[:, 0] <= 0] = np.nan
    return np.sum((vectors.mT @ g)[..., 0] ** 2 / values, axis=-1)
