"""How far above the optimum a curve is: its leading term by the ends, and an estimate by the curve.

For small excursions; `rbclassroom.surveys.atlas` has large ones.
"""

from __future__ import annotations

import csv
import os
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, matvec
from rbcourse.bezier import seen_from_the_middle
from rbcourse.cost import check_curve, summed
from rbcourse.curves import Curve, Ends
from rbcourse.optimum.chebyshev import grid, tails
from rbcourse.paths import smooth_parts
from rbcourse.so3 import exp_so3, log_so3

_NODES = 33
_SMOOTH = 1e-6  # of w', what its last two Chebyshev coefficients may be
SPEED_LIMIT = 2.5
"""In rad over the whole time: for a curve that turns as fast there is no estimate."""


def leading_excess(name: str, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Array:
    """Return the leading term of a closed form's excess over the optimum, from the ends alone.

    Source: beyond BK 10; docs/near_optimal.md derives E.

    Parameters
    ----------
    name : str
        One of `CLOSED_FORMS`, but not "corrected_bezier_so3".
    R0, R1, w0, w1
        As for `projected_cubic_so3`.

    Returns
    -------
    ndarray, shape (...)
        E/(12 ‖e‖² + ‖d‖²), which cost over optimum, minus 1, approaches for small data. With
        σ = log_so3(R0ᵀ R1), e and d are the mean less σ, and the difference, of the two end
        velocities, carried parallel to the rotation half-way. E is a polynomial of degree six in
        σ, e and d, of degree four for "cumulative_bezier_so3". NaN where e and d are 0: there the
        optimum costs nothing.

    Notes
    -----
    Domain: small excursions. The relative error falls with the square of their size, for
    "cumulative" with the size. With ‖σ‖ < 0.5 and ‖w0‖, ‖w1‖ < 1 it was at most 14 % on random
    problems, except for "cumulative". It can be larger where E is much smaller than is usual for
    such data, as for velocities along σ.
    Singular set: R0 and R1 a half-turn apart, where σ is what `log_so3` chooses.

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
    sigma = log_so3(ends.turn)
    e, d = seen_from_the_middle(sigma, ends.w0, ends.w1)
    pairs = (sigma, sigma), (e, e), (d, d), (sigma, e), (sigma, d), (e, d)
    inner = np.stack([np.sum(a * b, axis=-1) for a, b in pairs], axis=-1)
    powers, coefficients = forms[name]
    E = np.prod(inner[..., None, :] ** powers, axis=-1) @ coefficients
    optimum = 12 * inner[..., 1] + inner[..., 2]
    E = np.maximum(E, 0)  # but for rounding it is not negative
    return np.divide(E, optimum, out=np.full_like(E, np.nan), where=optimum > 0)[()]


@lru_cache
def _forms() -> dict[str, tuple[Array, Array]]:
    """Return the polynomials E: in each term the powers of the six inner products, and a factor."""
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
    """Return about how far above the optimum with the same ends a curve is, without solving.

    Source: beyond BK 11; BK (19).

    Parameters
    ----------
    curve : Curve
        On SO(3), or a stack of them; smooth, with derivatives up to w''.

    Returns
    -------
    ndarray, shape curve.batch_shape
        About cost over optimum, minus 1. A `chain`, whose velocity must not jump (RuntimeError), is
        compared with the best legs that have the same velocities at its poses. NaN where a curve
        turns at `SPEED_LIMIT` or faster at some time, costs more than about twice the optimum, is
        not smooth enough for 33 nodes, costs nothing, or is NaN itself.

    Notes
    -----
    Domain: ‖w‖ < 2.5 rad over the whole time, and an excess of at most 1. The relative error is of
    second order in ‖w‖; on random problems it was at most 16 %, up to ‖w‖ = 1 at most 2.1 %. An
    excess below 1e-13 is lost in rounding.

    The residual r = w''' + w × w'', 0 for the optimum, is to leading order the fourth derivative of
    the deviation δ from it, with δ = δ' = 0 at both ends. So δ'' is the second integral of r less
    its linear part, and ∫ ‖δ''‖² the excess cost, all carried parallel to the rotation half-way.

    Examples
    --------
    >>> from rbcourse import exp_so3, minimum_acceleration_so3, projected_cubic_so3
    >>> ends = np.eye(3), exp_so3([0, 0, 0.9]), [0, 0, 0], [0, 1, 0]
    >>> float(excess_estimate(projected_cubic_so3(*ends)).round(4))
    0.0197
    """
    check_curve(curve)
    legs = smooth_parts(curve, "excess estimate", 1)
    t, derivative, integral, _ = grid(_NODES)
    R, w, a, b = (legs.flat.values(t[:, None], order) for order in range(4))
    lost = np.isnan(R).any(axis=(0, -2, -1))
    R[:, lost] = np.eye(3)
    middle = R[_NODES // 2]
    r = np.tensordot(derivative, matvec(R, b), axes=1)  # R (w''' + w × w''), as (R w'')'
    parallel = exp_so3(log_so3(middle.mT @ R) / -2) @ middle.mT
    bend = np.tensordot(integral @ integral, matvec(parallel, r), axes=1)
    for line in (np.ones(_NODES), np.sqrt(3) * (2 * t - 1)):  # of norm 1, and orthogonal
        bend -= np.multiply.outer(line, np.tensordot(integral[-1] * line, bend, axes=1))
    saved, cost = (integral[-1] @ np.sum(x**2, axis=-1).reshape(_NODES, -1) for x in (bend, a))
    fast = np.linalg.norm(w, axis=-1).max(axis=0).ravel() >= SPEED_LIMIT
    rough = tails(np.moveaxis(a.reshape(_NODES, -1, 3), 1, 0)) > _SMOOTH * np.sqrt(cost)
    saved[fast | rough | lost.ravel() | (saved > cost / 2)] = np.nan
    saved, cost = (summed(curve, x, legs, 3) for x in (saved, cost))
    with np.errstate(invalid="ignore"):  # 0/0
        return saved / (cost - saved)
