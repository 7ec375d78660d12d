"""Starting curves of the search, at Chebyshev nodes, and steps that lower their costs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rbcourse._chebyshev import along, chebyshev, grid
from rbcourse._hermite import hermite
from rbcourse._numerics import Array, blocks, matvec
from rbcourse.curves.ends import Ends
from rbcourse.curves.functionals import Functional
from rbcourse.optimum._collocation import TOGETHER, cayley
from rbcourse.so3 import exp_so3, hat, log, vee

FAST = 4 * np.pi  # if ‖w0‖ + ‖w1‖ is larger, all four of the `starts` are used
SHARES = np.array([1.0, 0.25, 3.0])  # multiples of a Gauss–Newton step; the best multiple is used
SAME = 1e-9  # numbers with a smaller relative difference count as equal


def starts(ends: Ends, n: int, *accelerations: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the problem index of each starting curve, and these curves at n nodes.

    The Bézier control points are C₁ = R0 exp(ŵ0/3) and R1 exp(−ŵ1/3). With β = 3t² − 2t³ and
    rotation vectors v from C₁ to the other control point, two curves that have the given ends are

        R = C₁ exp(β v̂) exp(η̂),    η = (t³ w1 − (1 − t)³ w0)/3.

    Let F be the motion from R0 whose velocity in the fixed frame is the line from R0 w0 to R1 w1
    (or the cubic with the derivatives R0 a0 and R1 a1, if `accelerations` are given). It costs
    least if the rotation at t = 1 is free. If the ends are fast, two more curves are

        R = F exp(β v̂),    v from F(1) to R1.

    Each v turns the short way or the long way. The curves do not depend on the choice of frames.
    The ends R1, R0, −w1, −w0 give the reversed curves. If all vectors are along one axis, the
    number of full turns is the best one.
    """
    first, last = (_bounded(w) / 3 for w in (ends.w0, ends.w1))
    speeds = np.linalg.norm([ends.w0, ends.w1, *(a / 2 for a in accelerations)], axis=-1)
    fast = speeds.sum(axis=0) > FAST
    C1 = ends.R0 @ exp_so3(first)
    F = _with_free_end(ends, n, *accelerations)
    goals = C1.mT @ ends.R1 @ exp_so3(-last), F[:, -1].mT @ ends.R1
    v = np.concatenate([_both_ways(goal, first + last) for goal in goals])
    t = grid(n).t[:, None]
    between = exp_so3(t * t * (3 - 2 * t) * v[:, :, None])
    over = exp_so3(t**3 * last[:, None] - (1 - t) ** 3 * first[:, None])
    R = np.concatenate([C1[:, None] @ between[:2] @ over, F @ between[2:]])
    count = len(C1)
    problem = np.tile(np.arange(count), 4)
    used = np.append([True] * (2 * count), np.tile(fast, 2))
    return problem[used], R.reshape(-1, n, 3, 3)[used]


def _with_free_end(ends: Ends, n: int, *accelerations: Array) -> Array:
    """Return the motion F of `starts` at n nodes, shape (N, n, 3, 3).

    With the velocity L in the fixed frame, a ball turns from t to t + h by
    ∫ L dt − h² (L(t) × L(t + h))/12, to fourth order in h.
    """
    t, starting = grid(n).t, (ends.R0, ends.R1) * 2
    rates = map(_bounded, (ends.w0, ends.w1, *accelerations))
    L = hermite([matvec(R, x) for R, x in zip(starting, rates, strict=False)], t[:, None, None])
    turn = np.diff(np.tensordot(grid(n).integral, L, axes=1), axis=0)
    turn -= np.diff(t)[:, None, None] ** 2 / 12 * np.cross(L[:-1], L[1:])
    F = [ends.R0]
    for step in exp_so3(turn):
        F.append(step @ F[-1])
    return np.stack(F, axis=1)


def _both_ways(goal: Array, hint: Array) -> Array:
    """Return two logarithms of `goal`: the shortest one, and the one that turns the other way.

    If the shortest one is 0, the other one is along `hint`. Rounding does not choose between two
    turns by π.
    """
    v = log(goal)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    other = (angle > (1 - SAME) * np.pi) & (leading_sign(v) < 0)
    v = np.where(other, v * (1 - 2 * np.pi / np.maximum(angle, 1)), v)
    along_v = v + 1e-9 * hint
    size = np.linalg.norm(along_v, axis=-1, keepdims=True)
    return np.stack([v, v - 2 * np.pi * along_v / np.maximum(size, 1e-150)])


def leading_sign(v: Array) -> Array:
    """Return the sign of the largest component of v (of the first one, if several are equal)."""
    size = np.abs(v)
    largest = np.argmax(size > (1 - SAME) * size.max(axis=-1, keepdims=True), axis=-1)
    return np.sign(np.take_along_axis(v, largest[..., None], axis=-1))


def between_free_motions(ends: Ends, G: Array, n: int) -> tuple[NDArray[np.intp], Array]:
    """Return two curves at n nodes for each problem; they lead from one free motion to another.

    For a body of inertia G, let F be the free motion that starts at R0 with w0, and let B be the
    free motion that arrives at R1 with w1. With β = 3t² − 2t³ and a logarithm v of FᵀB that is
    continuous in time, the curve

        R = F exp(β v̂)

    has the given ends. At t = ½, one v is the shortest logarithm, and the other v turns the other
    way round. The first result is the problem index of each curve.
    """
    R0 = np.stack([ends.R0, ends.R1])
    w0 = _bounded(np.stack([ends.w0, -ends.w1]))  # B runs backward
    F, back = np.moveaxis(free_motions(R0, w0, G, grid(2 * n - 1).t), 1, 0)
    v = _continuous_log(F.mT @ back[::-1])[:, ::2]
    t = grid(n).t[:, None, None]
    R = F[::2] @ exp_so3(t * t * (3 - 2 * t) * v)
    R = np.moveaxis(R, 1, 2).reshape(-1, n, 3, 3)
    number = np.tile(np.arange(len(ends.w0)), 2)
    end_rates = np.stack([ends.w0, ends.w1], axis=1)
    return number, with_ends(R, end_rates[number])


def free_motions(R0: Array, w0: Array, G: Array, t: Array) -> Array:
    """Return approximate free motions of bodies of inertia G: R at the times t.

    Euler's equations in principal axes, wᵢ' = (Gⱼ − Gₖ) wⱼ wₖ/Gᵢ, are solved by a Runge–Kutta
    method that keeps ‖G w‖ constant.
    From t to t + h, a body turns by ∫ w dt + h² (w(t) × w(t + h))/12, to fourth order in h.
    """
    moments, axes = np.linalg.eigh(G)
    axes *= np.linalg.det(axes)[..., None, None]  # right-handed
    after, before = np.array([1, 2, 0]), np.array([2, 0, 1])
    gyration = (moments[..., after] - moments[..., before]) / moments

    def rate(w: Array) -> Array:
        return gyration * w.take(after, axis=-1) * w.take(before, axis=-1)

    path = [matvec(axes.mT, w0)]
    size = np.linalg.norm(moments * path[0], axis=-1)
    for h in np.diff(t):
        w = path[-1]
        k1 = rate(w)
        k2 = rate(w + h / 2 * k1)
        k3 = rate(w + h / 2 * k2)
        k4 = rate(w + h * k3)
        w = w + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        now = np.linalg.norm(moments * w, axis=-1)
        path.append(w * (size / np.maximum(now, 1e-150))[..., None])
    w = np.stack(path)
    a, h = rate(w), np.diff(t).reshape(-1, *(1 for _ in w0.shape))
    turn = h / 2 * (w[1:] + w[:-1]) + h**2 / 12 * (a[:-1] - a[1:] + np.cross(w[:-1], w[1:]))
    R = [R0 @ axes]
    for step in exp_so3(turn):
        R.append(R[-1] @ step)
    return np.stack(R) @ axes.mT


def _continuous_log(R: Array) -> Array:
    """Return two logarithms of R that are continuous along the first axis.

    The length of this axis is odd. At the middle of the axis, one logarithm is the shortest, and
    the other turns the other way round.
    """
    shortest = log(R)
    angle = np.linalg.norm(shortest, axis=-1, keepdims=True)
    axis = shortest / np.maximum(angle, 1e-150)
    v = np.stack([shortest, shortest - 2 * np.pi * axis])
    middle = len(R) // 2
    after, before = range(middle + 1, len(R)), range(middle - 1, -1, -1)
    for i, last in [*((i, i - 1) for i in after), *((i, i + 1) for i in before)]:
        beyond = np.sum(v[:, last] * axis[i], axis=-1, keepdims=True) - angle[i]
        v[:, i] = shortest[i] + 2 * np.pi * np.round(beyond / (2 * np.pi)) * axis[i]
    return v


def _bounded(w: Array) -> Array:
    """Return velocities clipped to ±1e6 to avoid overflow; faster problems are not solved."""
    return np.clip(w, -1e6, 1e6)


def spun(
    R: Array, ends: Array, G: Array, worth: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], Array]:
    """Return curves R with more spin about principal axes of G, and their indices in the stack R.

    With γ = 10 t³ − 15 t⁴ + 6 t⁵, the new curves are R exp(φ ê) with φ = ±2π γ (a full turn), for
    each principal axis e that is `worth` it, shape (N, 3). The axes are ordered by their moments.
    About the first axis, the curves with φ = ±π (4 t (1 − t))³ (forth and back) are added.
    """
    t, axes = grid(R.shape[1]).t[:, None], np.linalg.eigh(G)[1].mT
    turn, swing = 2 * np.pi * t**3 * (10 - 15 * t + 6 * t**2), np.pi * (4 * t * (1 - t)) ** 3
    index, axis = np.nonzero(worth)
    again = np.flatnonzero(worth[:, 0])
    turns = [turn * axes[index, axis][:, None], swing * axes[again, 0][:, None]]
    more, index = exp_so3(np.concatenate(turns)), np.append(index, again)
    index = np.tile(index, 2)
    curves = R[index] @ np.concatenate([more, more.mT])
    return index, with_ends(curves, ends[index])


def with_ends(R: Array, ends: Array) -> Array:
    """Multiply the curves R by factors exp(η̂) that correct w0, w1 and, if given, a0, a1.

    On too few nodes, the polynomials through R have other end velocities than w0 and w1; Δw₀ and
    Δw₁ are the differences. The factor for velocities has η = t (1 − t)² Δw₀ − t² (1 − t) Δw₁. For
    accelerations, a second factor has η = ½ t² (1 − t)³ Δa₀ + ½ t³ (1 − t)² Δa₁.
    """
    t = grid(R.shape[1]).t[:, None]
    for order in range(1, 1 + ends.shape[1] // 2):
        now = rates_of(R, order)[-1][:, [0, -1]]
        lacking0, lacking1 = np.moveaxis(_bounded(ends[:, 2 * order - 2 : 2 * order] - now), 1, 0)
        share = (t * (1 - t)) ** order / order
        change = (1 - t) * lacking0[:, None] + (-1) ** order * t * lacking1[:, None]
        R = R @ exp_so3(share * change)
    return R


def lowered(functional: Functional, R: Array, steps: int, worthwhile: float) -> tuple[Array, Array]:
    """Lower the costs of curves by Gauss–Newton steps; return the curves and their costs.

    For R exp(η̂), the rates change by δw = η' + w × η and its derivatives. So the deviation u
    changes, to first order, by D₀ η + D₁ η' + D₂ η'' (+ D₃ η'''). A step uses the η that minimises
    the integral of the squared new deviation. Here η = tᵐ (1 − t)ᵐ p(t), which keeps the ends, and
    p has half as many coefficients as there are nodes. A quarter of η or three times η is used
    instead if the curve then costs less. The steps end when one of them lowers the cost by less
    than the fraction `worthwhile`.
    """
    R, cost, active = R.copy(), cost_at_nodes(functional, R), np.arange(len(R))
    for _ in range(steps):
        before = cost[active]
        for part in blocks(len(active), TOGETHER):
            index = active[part]
            R[index], cost[index] = _lower(functional.take(index), R[index], cost[index])
        active = active[cost[active] < (1 - worthwhile) * before]
        if not len(active):
            break
    return R, cost


def _lower(functional: Functional, R: Array, cost: Array) -> tuple[Array, Array]:
    """Return the cheaper of R and the best curve after a step times `SHARES`, and its cost."""
    shares = SHARES[:, None, None, None] * _best_change(functional, R)
    tried = R @ cayley(shares)
    number = np.tile(np.arange(len(R)), len(SHARES))
    costs = cost_at_nodes(functional.take(number), tried.reshape(-1, *R.shape[1:]))
    tried, costs = np.concatenate([R[None], tried]), np.vstack([cost, costs.reshape(-1, len(R))])
    best = np.fmin(costs, np.inf).argmin(axis=0), np.arange(len(R))
    return tried[best], costs[best]


def _best_change(functional: Functional, R: Array) -> Array:
    """Return the η of a Gauss–Newton step at the nodes."""
    bumps = _bumps(R.shape[1], functional.ends // 2 + 1)
    J, u = gauss_newton(functional, R, bumps)
    x = np.linalg.solve(J.mT @ J, -(J.mT @ u))
    return bumps[0] @ x.reshape(len(R), -1, 3)


def gauss_newton(functional: Functional, R: Array, shapes: list[Array]) -> tuple[Array, Array]:
    """Return the derivatives J of the deviation u with respect to the coefficients of η, and u.

    η is a sum of `shapes`, given with their derivatives at the nodes. The sum of the squared
    entries of u, shape (N, 3 n, 1), approximates the integral of ‖u‖².
    """
    count, n = R.shape[:2]
    rates = rates_of(R, len(shapes) - 1)
    root = np.sqrt(grid(n).integral[-1])[:, None]
    by = by_eta(functional.deviation_by(*rates), rates)
    D = root[..., None, None] * np.stack(by, axis=-2)
    J = np.stack(shapes, axis=-1)[:, None] @ D
    u = root * functional.deviation(*rates)
    return J.reshape(count, 3 * n, -1), u.reshape(count, 3 * n, 1)


def by_eta(by: list[Array], rates: list[Array]) -> list[Array]:
    """Return D₀, D₁, … of `lowered`, from the derivatives of u with respect to w, w', ….

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
    """Return an approximation of ∫ ‖u‖² dt for curves given by R at the nodes."""
    u = functional.deviation(*rates_of(R, functional.ends // 2 + 1))
    return np.sum(u**2, axis=-1) @ grid(R.shape[1]).integral[-1]


def rates_of(R: Array, count: int) -> list[Array]:
    """Return `count` rates w, w', … at the nodes, from R at the nodes."""
    return with_derivatives(vee(R.mT @ along(grid(R.shape[1]).derivative, R)), count - 1)


def with_derivatives(values: Array, count: int) -> list[Array]:
    """Return values at the nodes, shape (..., n, columns), and their first derivatives."""
    found = [values]
    for _ in range(count):
        found.append(grid(values.shape[-2]).derivative @ found[-1])
    return found


@lru_cache
def _bumps(n: int, m: int) -> list[Array]:
    """Return tᵐ (1 − t)ᵐ times n//2 Chebyshev polynomials at the nodes, and m derivatives."""
    t = grid(n).t
    return with_derivatives((t * (1 - t))[:, None] ** m * chebyshev(t, n // 2), m)
