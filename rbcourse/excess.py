"""The excess of a curve's cost over the optimum: the leading term, and an estimate.

The results hold for small excursions; `rbclassroom.atlas` treats large excursions.
"""

from __future__ import annotations

import csv
import os
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, blocks
from rbcourse.bezier import seen_from_the_middle
from rbcourse.cost import check_curve, summed
from rbcourse.curves import Curve, Ends
from rbcourse.optimum.chebyshev import grid, tails
from rbcourse.optimum.second_variation import on_each_axis, polynomials, products
from rbcourse.paths import smooth_parts
from rbcourse.so3 import hat, log

_NODES, _BUMPS = 33, 12
_TOGETHER = 64  # number of curves whose linear systems fit into the cache
_SMOOTH = 1e-6  # bound on the last two Chebyshev coefficients of w', divided by √∫ ‖w'‖² dt
SPEED_LIMIT = 2.5
"""In rad per duration: no estimate is given for a curve that turns at this speed or faster."""


def leading_excess(name: str, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Array:
    """Return the leading term of a closed form's excess over the optimum, from the ends alone.

    Source: beyond BK 10; docs/near_optimal.md derives E.

    Parameters
    ----------
    name : str
        One of `CLOSED_FORMS`, except "corrected_bezier_so3".
    R0, R1, w0, w1
        As for `projected_cubic_so3`. If the duration is not 1, multiply the velocities by it.

    Returns
    -------
    ndarray, shape (...)
        E/(12 ‖e‖² + ‖d‖²), the leading term of the excess for small excursions. Let σ = log_so3(R0ᵀ
        R1), and let both end velocities be parallel transported to the half-way rotation. Then e is
        the mean of these velocities minus σ, and d is their difference. E is a polynomial in σ, e
        and d of degree six (four for "cumulative_bezier_so3"). If e and d are 0, the optimum costs
        nothing, and the result is NaN.

    Notes
    -----
    Domain: small excursions. The relative error is proportional to the square of the excursion (for
    "cumulative_bezier_so3", to the excursion itself). On random problems with ‖σ‖ < 0.5 and ‖w0‖,
    ‖w1‖ < 1, this error was at most 14 % for all other forms. The error can be larger if E is much
    smaller than usual for ends of this size, for example if the velocities are along σ. Singular
    set: R0 and R1 are a half-turn apart. `log_so3` then chooses σ.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1, rest = exp_so3([0, 0, 0.2]), [0, 0, 0]
    >>> float(leading_excess("projected_cubic_so3", np.eye(3), R1, rest, rest).round(9))
    5.6841e-05
    """
    forms = _forms()
    if not isinstance(name, str) or name not in forms:
        raise ValueError(f"name: one of {', '.join(forms)} is wanted, got {name!r}")
    ends = Ends(R0, R1, w0, w1)
    sigma = log(ends.turn)
    e, d = seen_from_the_middle(sigma, ends.w0, ends.w1)
    pairs = (sigma, sigma), (e, e), (d, d), (sigma, e), (sigma, d), (e, d)
    inner = np.stack([np.sum(a * b, axis=-1) for a, b in pairs], axis=-1)
    powers, coefficients = forms[name]
    E = np.prod(inner[..., None, :] ** powers, axis=-1) @ coefficients
    optimum = 12 * inner[..., 1] + inner[..., 2]
    E = np.maximum(E, 0)  # only rounding makes E negative
    return np.divide(E, optimum, out=np.full_like(E, np.nan), where=optimum > 0)[()]


@lru_cache
def _forms() -> dict[str, tuple[Array, Array]]:
    """Return the terms of each polynomial E: powers of six inner products, and coefficients."""
    path = os.path.join(os.path.dirname(__file__), "leading_excess.csv")
    with open(path, encoding="utf-8") as file:
        head, over, *rows = csv.reader(file)
    powers = np.array([row[:6] for row in rows], dtype=int)
    forms = {}
    for column in range(6, len(head)):
        numbers = np.array([row[column] for row in rows], dtype=float)
        there = numbers != 0
        forms[head[column]] = powers[there], numbers[there] / float(over[column])
    return forms


def excess_estimate(curve: Curve) -> Array:
    """Return an estimate of a curve's excess over the optimum, without solving for the optimum.

    Source: beyond BK 11; BK (19).

    Parameters
    ----------
    curve : Curve
        A smooth curve on SO(3), or a stack of such curves.

    Returns
    -------
    ndarray, shape curve.batch_shape
        An estimate of (cost of the curve)/(cost of the optimum) − 1. A `chain` is compared with the
        optimal legs that have the same velocities at its poses; if its velocity jumps, RuntimeError
        is raised. The estimate is NaN if the curve reaches the `SPEED_LIMIT`, costs more than about
        twice the optimum, is not smooth enough for 33 nodes, costs nothing, or is NaN itself. It is
        also NaN if H (see the notes) is not positive definite.

    Notes
    -----
    Domain: ‖w‖ times the duration is below 2.5 rad at all times, and the excess is at most 1. On
    random problems with an excess of at least 1e-8, the estimates were within 1.4 % of the excess
    for closed forms, and within 7 % for quintics with random end accelerations. For problems with
    ‖w‖ < 1 at all times, these figures were 0.04 % and 1.6 %. For a smaller excess, the computed
    costs are not accurate enough for a comparison. An excess below 1e-22 is lost in rounding. If
    ‖w‖ reaches 3π/4, the optimum may turn the other way round; the estimate is then the excess over
    the nearby stationary curve.

    Let J = ∫ ‖w'‖² dt. Let η be small, with η = η' = 0 at both ends. To second order, J of the
    curve R exp(η̂) is J − 2 g · η + η · H η. With x = η' + w × η,

        g · η = −∫ w' · x' dt,    η · H η = ∫ ‖x'‖² − w' · (η × x)' dt.

    The least value over polynomials η is J − g · H⁻¹ g. The difference g · H⁻¹ g is the decrement
    of a step of Newton's method. To leading order, it is ∫ ‖δ''‖² dt, where δ is the deviation from
    the optimum.

    Examples
    --------
    >>> from rbcourse import exp_so3, minimum_acceleration_so3, projected_cubic_so3
    >>> ends = np.eye(3), exp_so3([0, 0, 0.9]), [0, 0, 0], [0, 1, 0]
    >>> float(excess_estimate(projected_cubic_so3(*ends)).round(4))
    0.0197
    """
    check_curve(curve)
    legs = smooth_parts(curve, "excess estimate", 1)
    t, _, integral, _ = grid(_NODES)
    w, a = (np.moveaxis(legs.flat.values(t[:, None], order), 1, 0) for order in (1, 2))
    left_out = ~(np.linalg.norm(w, axis=-1).max(axis=1) < SPEED_LIMIT)
    w[left_out], a[left_out] = 0, 0
    cost = np.sum(a**2, axis=-1) @ integral[-1]
    left_out |= tails(a) > _SMOOTH * np.sqrt(cost)
    parts = blocks(len(w), _TOGETHER)
    saved = np.concatenate([np.zeros(0), *(_decrement(w[some], a[some]) for some in parts)])
    saved[left_out | ~(saved <= cost / 2)] = np.nan
    saved, cost = (summed(curve, x, legs, 3) for x in (saved, cost))
    with np.errstate(invalid="ignore"):  # 0/0
        return saved / (cost - saved)


def _decrement(w: Array, a: Array) -> Array:
    """Return g · H⁻¹ g from w and w' at the nodes, (N, n, 3); NaN if H is not positive definite."""
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
