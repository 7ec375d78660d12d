"""Curves to start an optimum from, at Chebyshev nodes, and what lowers their cost."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rbcourse._chebyshev import along, chebyshev, grid
from rbcourse._numerics import Array, blocks
from rbcourse.curves import Ends
from rbcourse.functionals import Functional
from rbcourse.relaxation import cayley
from rbcourse.so3 import exp_so3, hat, log_so3, vee

MOST_TURNS = 4  # starts have fewer full turns more than the shortest way
SHARES = np.array([1.0, 0.25, 3.0])  # of a step that lowers the cost: the best of these
_TOGETHER = 32  # curves that are lowered together, in the cache


def starts(ends: Ends, n: int, bend: Array | float = 0.0) -> tuple[NDArray[np.intp], Array]:
    """Return curves with these ends at n nodes, and the numbers of the problems they are for.

    From Bézier's control point C₁ = R0 exp(ŵ0/3) to the other one, R1 exp(−ŵ1/3), turns v: the
    shortest way and the other way round, and both with k full turns more where the legs ŵ0/3 and
    ŵ1/3, and what accelerations `bend` them by, are together longer than 2k − 1 full turns. With
    β = 3t² − 2t³ the curve

        R = C₁ exp(β v̂) exp(η̂),    η = (t³ w1 − (1 − t)³ w0)/3,

    has the wanted ends. Moved ends give it moved, and R1, R0, −w1, −w0 give it run backwards.
    """
    first, last = (np.clip(w, -1e6, 1e6) / 3 for w in (ends.w0, ends.w1))  # fast enough to start
    ahead, back = exp_so3(np.stack([first, -last]))
    C1 = ends.R0 @ ahead
    v = log_so3(C1.mT @ ends.R1 @ back)
    along_v = v + 1e-9 * (first + last)  # a direction where v is 0
    full = 2 * np.pi * along_v / np.maximum(np.linalg.norm(along_v, axis=-1), 1e-300)[:, None]
    length = np.linalg.norm([first, last], axis=-1).sum(axis=0) + bend
    problem, turns = [], []
    for more in range(MOST_TURNS):
        some = np.flatnonzero(length >= (4 * more - 2) * np.pi)
        problem += [some, some]
        turns += [(v + more * full)[some], (v - (more + 1) * full)[some]]
    number, turn = np.concatenate(problem), np.concatenate(turns)
    t = grid(n).t[:, None]
    between = exp_so3(t * t * (3 - 2 * t) * turn[:, None])
    over = exp_so3(t**3 * last[:, None] - (1 - t) ** 3 * first[:, None])
    return number, C1[number, None] @ between @ over[number]


def with_accelerations(R: Array, a0: Array, a1: Array) -> Array:
    """Return the curves R exp(η̂), which have w' = a0 and a1 at their ends; R and w stay there.

    η = ½ t² (1 − t)³ (a0 − w'(0)) + ½ t³ (1 − t)² (a1 − w'(1)), w' of the curves R.
    """
    _, a = rates_of(R, 2)
    t = grid(R.shape[1]).t[:, None]
    s, lacking0, lacking1 = 1 - t, (a0 - a[:, 0])[:, None], (a1 - a[:, -1])[:, None]
    return R @ exp_so3((t * s) ** 2 / 2 * (s * lacking0 + t * lacking1))


def lowered(
    functional: Functional, R: Array, *, bumps: int, steps: int, worthwhile: float
) -> tuple[Array, Array]:
    """Return curves with the same ends, after steps of Gauss and Newton, and their costs.

    For R exp(η̂) the rates change by δw = η' + w × η and its derivatives, so the deviation, to first
    order, by D₀ η + D₁ η' + D₂ η'' (+ D₃ η'''). A step takes the η for which the integral of its
    square is least, of all polynomials tᵐ (1 − t)ᵐ p(t), p with `bumps` coefficients; or a quarter
    or three times as much, where that is better. The last one takes less than `worthwhile` of the
    cost away.
    """
    R, cost, active = R.copy(), cost_at_nodes(functional, R), np.arange(len(R))
    for _ in range(steps):
        before = cost[active]
        for part in blocks(len(active), _TOGETHER):
            which = active[part]
            R[which], cost[which] = _lower(functional.of(which), R[which], cost[which], bumps)
        active = active[cost[active] < (1 - worthwhile) * before]
        if not len(active):
            break
    return R, cost


def _lower(functional: Functional, R: Array, cost: Array, bumps: int) -> tuple[Array, Array]:
    """Take one step: the best of `SHARES` of it, or none."""
    shares = SHARES[:, None, None, None] * _best_change(functional, R, bumps)
    tried = R @ cayley(shares)
    number = np.tile(np.arange(len(R)), len(SHARES))
    costs = cost_at_nodes(functional.of(number), tried.reshape(-1, *R.shape[1:]))
    tried, costs = np.concatenate([R[None], tried]), np.vstack([cost, costs.reshape(-1, len(R))])
    best = np.fmin(costs, np.inf).argmin(axis=0), np.arange(len(R))
    return tried[best], costs[best]


def _best_change(functional: Functional, R: Array, bumps: int) -> Array:
    """Return η of a step, at the nodes."""
    order = functional.ends // 2 + 1
    nodes, bump = grid(R.shape[1]), _bumps(R.shape[1], order, bumps)
    rates = rates_of(R, order)
    root, u = np.sqrt(nodes.integral[-1])[:, None], functional.deviation(*rates)
    by_eta = sum(
        shape[:, None, :, None] * D[:, :, :, None]
        for shape, D in zip(bump, _by_eta(functional.deviation_by(*rates), rates), strict=True)
    )
    J = (root[..., None, None] * by_eta).reshape(len(R), 3 * len(root), 3 * bumps)
    x = np.linalg.solve(J.mT @ J, -(J.mT @ (root * u).reshape(len(R), 3 * len(root), 1)))
    return bump[0] @ x.reshape(len(R), bumps, 3)


def _by_eta(by: list[Array], rates: list[Array]) -> list[Array]:
    """Return D₀, D₁, … of `lowered`, from the derivatives of u by w and its derivatives.

    By Leibniz's rule δw⁽ⁱ⁾ = η⁽ⁱ⁺¹⁾ + Σ (i over j) w⁽ⁱ⁻ʲ⁾ × η⁽ʲ⁾.
    """
    W = [hat(rate) for rate in rates]
    if len(by) == 2:
        return [by[0] @ W[0] + by[1] @ W[1], by[0] + by[1] @ W[0], by[1]]
    return [
        by[0] @ W[0] + by[1] @ W[1] + by[2] @ W[2],
        by[0] + by[1] @ W[0] + 2 * by[2] @ W[1],
        by[1] + by[2] @ W[0],
        by[2],
    ]


def cost_at_nodes(functional: Functional, R: Array) -> Array:
    """Return ∫ ‖u‖² dt of curves given by R at the nodes, about."""
    u = functional.deviation(*rates_of(R, functional.ends // 2 + 1))
    return np.sum(u**2, axis=-1) @ grid(R.shape[1]).integral[-1]


def rates_of(R: Array, count: int) -> list[Array]:
    """Return w, w', … at the nodes, so many, from R there."""
    derivative = grid(R.shape[1]).derivative
    rates = [vee(R.mT @ along(derivative, R))]
    for _ in range(count - 1):
        rates.append(derivative @ rates[-1])
    return rates


@lru_cache
def _bumps(n: int, m: int, count: int) -> list[Array]:
    """Return tᵐ (1 − t)ᵐ times Chebyshev polynomials at the nodes, and m derivatives."""
    nodes = grid(n)
    shapes: list[Array] = [(nodes.t * (1 - nodes.t))[:, None] ** m * chebyshev(nodes.t, count)]
    for _ in range(m):
        shapes.append(nodes.derivative @ shapes[-1])
    return shapes
