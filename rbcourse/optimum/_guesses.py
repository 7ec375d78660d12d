"""Starting curves of the search (`_search`), and Gauss–Newton steps that lower their costs.

`starts` and `between_free_motions` make curves with the given ends, `spun` adds spin to curves of a
body, and `lowered` changes a curve R to R exp(η̂).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array, blocks, matvec
from rbcourse._polynomials import chebyshev, grid, hermite
from rbcourse.curves.ends import Ends
from rbcourse.curves.functionals import Functional
from rbcourse.optimum._collocation import TOGETHER, cayley, on_nodes, rates_of, with_derivatives
from rbcourse.so3 import exp_so3, hat, log

FAST = 4 * np.pi  # if ‖w0‖ + ‖w1‖ is larger, all four of the `starts` are used
DAMPINGS = 0.0, 1e-8, 1e-6, 1e-4, 1e-2, 1.0  # shares of the diagonal of JᵀJ; the best is used
SHARES = np.array([1.0, 0.25])  # of a Gauss–Newton step; the best is used [1, 3: 51 of 1,200 rods]
SAME = 1e-9  # numbers with a smaller relative difference count as equal
TINY = 1e-150  # replaces norms that are 0 before a division; its square does not underflow

Numbers: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Curves:
    """A set of curves, given on the same Chebyshev nodes; each belongs to a problem of a stack."""

    problem: Numbers  # the problem of each curve: its number in the stack
    R: Array  # rotations at the nodes, shape (N, n, 3, 3)
    cost: Array  # ∫ ‖u‖² dt, or inf before `lowered` has computed it

    @staticmethod
    def of(problem: Numbers, R: Array) -> Curves:
        return Curves(problem, R, np.full(len(R), np.inf))

    @staticmethod
    def for_each(R: Array) -> Curves:
        """Return m curves for each of N problems, from rotations of the shape (m, N, n, 3, 3)."""
        m, count = R.shape[:2]
        return Curves.of(np.tile(np.arange(count), m), R.reshape(-1, *R.shape[2:]))

    @staticmethod
    def none(n: int) -> Curves:
        return Curves.of(np.empty(0, int), np.empty((0, n, 3, 3)))

    @property
    def nodes(self) -> int:
        return self.R.shape[1]

    def __len__(self) -> int:
        return len(self.R)

    def take(self, index: Any) -> Curves:
        return Curves(self.problem[index], self.R[index], self.cost[index])

    def joined(self, *others: Curves) -> Curves:
        parts = [(one.problem, one.R, one.cost) for one in (self, *others)]
        return Curves(*map(np.concatenate, zip(*parts, strict=True)))

    def on_nodes(self, n: int) -> Curves:
        return Curves.of(self.problem, on_nodes(self.R, n))

    def with_ends(self, ends: Array) -> Curves:
        """Multiply the curves by factors exp(η̂) that correct w0, w1 and, if given, a0, a1.

        On too few nodes, the polynomials through R have other end velocities; Δw₀ and Δw₁ are the
        differences. The first factor has η = t (1 − t)² Δw₀ − t² (1 − t) Δw₁. The second one has
        η = ½ t² (1 − t)³ Δa₀ + ½ t³ (1 − t)² Δa₁. The shape of `ends` is (…, 2, 3) or (…, 4, 3).
        """
        t, R = grid(self.nodes).t[:, None], self.R
        for order in range(1, 1 + ends.shape[1] // 2):
            now = rates_of(R, order)[-1][:, [0, -1]]
            given = ends[self.problem, 2 * order - 2 : 2 * order]
            lacking = _bounded(given - now)[:, :, None]
            share = (t * (1 - t)) ** order / order
            change = (1 - t) * lacking[:, 0] + (-1) ** order * t * lacking[:, 1]
            R = R @ exp_so3(share * change)
        return Curves.of(self.problem, R)

    def least(self, count: int) -> Array:
        """Return the cost of the cheapest curve of each of `count` problems; inf if it has none."""
        least = np.full(count, np.inf)
        np.fmin.at(least, self.problem, self.cost)
        return least


def starts(ends: Ends, n: int, *accelerations: Array) -> Curves:
    """Return two starting curves at n nodes for each problem, and two more if its ends are fast.

    They turn the short and the long way, and do not depend on the frames. The ends R1, R0, −w1, −w0
    give the reversed curves. If all vectors are along one axis, the number of full turns is best.
    """
    speeds = np.linalg.norm([ends.w0, ends.w1, *(a / 2 for a in accelerations)], axis=-1)
    fast = speeds.sum(axis=0) > FAST
    curves = _between_control_points(ends, n)
    if not fast.any():
        return curves
    more = _beside_free_end(ends, n, *accelerations)
    return curves.joined(more.take(fast[more.problem]))


def _between_control_points(ends: Ends, n: int) -> Curves:
    """Return two curves for each problem that turn from one Bézier control point to the other.

    The control points are C₁ = R0 exp(ŵ0/3) and C₂ = R1 exp(−ŵ1/3). With β = 3t² − 2t³ and a
    rotation vector v from C₁ to C₂, the curves are

        R = C₁ exp(β v̂) exp(η̂),    η = (t³ w1 − (1 − t)³ w0)/3.
    """
    t = grid(n).t[:, None]
    first, last = _bounded(ends.w0) / 3, _bounded(ends.w1) / 3
    forward, backward = exp_so3(np.stack([first, -last]))
    C1 = ends.R0 @ forward
    v = _both_ways(C1.mT @ ends.R1 @ backward, hint=first + last)
    turn = _beta(t) * v[:, :, None]
    eta = t**3 * last[:, None] - (1 - t) ** 3 * first[:, None]
    return Curves.for_each(C1[:, None] @ exp_so3(turn) @ exp_so3(eta))


def _beside_free_end(ends: Ends, n: int, *accelerations: Array) -> Curves:
    """Return two curves for each problem that follow a motion whose end is free.

    Let F be the motion from R0 whose velocity L in the fixed frame is the line from R0 w0 to R1 w1
    (or the cubic with the derivatives R0 a0 and R1 a1, if `accelerations` are given). It costs
    least if the rotation at t = 1 is free. From t to t + h, it turns by
    ∫ L dt − h² (L(t) × L(t + h))/12, to fourth order in h. With β = 3t² − 2t³, the curves are

        R = F exp(β v̂),    v from F(1) to R1.
    """
    t = grid(n).t[:, None]
    rates = [_bounded(x) for x in (ends.w0, ends.w1, *accelerations)]
    in_room = [matvec(R, x) for R, x in zip((ends.R0, ends.R1) * 2, rates, strict=False)]
    L = hermite(in_room, t[..., None])
    h = np.diff(t, axis=0)[..., None]
    integral = np.tensordot(grid(n).integral, L, axes=1)
    turns = np.diff(integral, axis=0) - h**2 / 12 * np.cross(L[:-1], L[1:])
    steps = [ends.R0]
    for turn in exp_so3(turns):
        steps.append(turn @ steps[-1])
    F = np.stack(steps, axis=1)
    v = _both_ways(F[:, -1].mT @ ends.R1, hint=rates[0] / 3 + rates[1] / 3)
    return Curves.for_each(F @ exp_so3(_beta(t) * v[:, :, None]))


def _both_ways(goal: Array, hint: Array) -> Array:
    """Return two logarithms of `goal`: the shortest one, and the one that turns the other way.

    If the first one is 0, the other is along `hint`. Rounding does not choose between turns by π.
    """
    v = log(goal)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    half_turn = angle > (1 - SAME) * np.pi
    opposite = v * (1 - 2 * np.pi / np.maximum(angle, 1))
    v = np.where(half_turn & (leading_sign(v) < 0), opposite, v)
    along_v = v + 1e-9 * hint
    size = np.linalg.norm(along_v, axis=-1, keepdims=True)
    return np.stack([v, v - 2 * np.pi * along_v / np.maximum(size, TINY)])


def leading_sign(v: Array) -> Array:
    """Return the sign of the largest component of v (of the first one, if several are equal)."""
    size = np.abs(v)
    is_largest = size > (1 - SAME) * size.max(axis=-1, keepdims=True)
    first = np.argmax(is_largest, axis=-1)
    return np.sign(np.take_along_axis(v, first[..., None], axis=-1))


def between_free_motions(ends: Ends, G: Array, n: int) -> Curves:
    """Return two curves at n nodes for each problem; they lead from one free motion to another.

    For a body of inertia G, let F be the free motion that starts at R0 with w0, and let B be the
    free motion that arrives at R1 with w1. With β = 3t² − 2t³ and a logarithm v of FᵀB that is
    continuous in time (`_continuous_log`), the curve R = F exp(β v̂) has the given ends. The
    logarithms are computed at 2 n − 1 nodes; every second one is a node of R.
    """
    R0 = np.stack([ends.R0, ends.R1])
    w0 = _bounded(np.stack([ends.w0, -ends.w1]))  # B runs backward
    motions = free_motions(R0, w0, G, grid(2 * n - 1).t)
    F, backward = motions[:, 0], motions[:, 1]
    v = _continuous_log(F.mT @ backward[::-1])[:, ::2]
    R = F[::2] @ exp_so3(_beta(grid(n).t[:, None, None]) * v)
    rates = np.stack([ends.w0, ends.w1], axis=1)
    return Curves.for_each(np.moveaxis(R, 1, 2)).with_ends(rates)


def free_motions(R0: Array, w0: Array, G: Array, t: Array) -> Array:
    """Return approximate free motions of bodies of inertia G: R at the times t.

    From t to t + h, a body turns by ∫ w dt + h² (w(t) × w(t + h))/12, to fourth order in h. The
    integral is h (w(t) + w(t + h))/2 + h² (w'(t) − w'(t + h))/12.
    """
    moments, axes = np.linalg.eigh(G)
    axes *= np.linalg.det(axes)[..., None, None]  # right-handed
    w, a = _free_rates(matvec(axes.mT, w0), moments, t)
    h = np.diff(t).reshape(-1, *(1 for _ in w0.shape))
    bends = a[:-1] - a[1:] + np.cross(w[:-1], w[1:])
    R = [R0 @ axes]
    for turn in exp_so3(h / 2 * (w[1:] + w[:-1]) + h**2 / 12 * bends):
        R.append(R[-1] @ turn)
    return np.stack(R) @ axes.mT


def _free_rates(w: Array, moments: Array, t: Array) -> tuple[Array, Array]:
    """Return w and w' of free bodies at the times t, in principal axes, from w at the first time.

    Euler's equations wᵢ' = (Gⱼ − Gₖ) wⱼ wₖ/Gᵢ are solved by the classical Runge–Kutta method. After
    each step, w is scaled so that ‖G w‖ is constant.
    """
    after, before = np.array([1, 2, 0]), np.array([2, 0, 1])
    gyration = (moments[..., after] - moments[..., before]) / moments

    def rate(w: Array) -> Array:
        return gyration * w.take(after, axis=-1) * w.take(before, axis=-1)

    path = [w]
    momentum = np.linalg.norm(moments * w, axis=-1)
    for h in np.diff(t):
        k1 = rate(w)
        k2 = rate(w + h / 2 * k1)
        k3 = rate(w + h / 2 * k2)
        k4 = rate(w + h * k3)
        w = w + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        now = np.linalg.norm(moments * w, axis=-1)
        w = w * (momentum / np.maximum(now, TINY))[..., None]
        path.append(w)
    return np.stack(path), rate(np.stack(path))


def _continuous_log(R: Array) -> Array:
    """Return two logarithms of R that are continuous along the first axis, whose length is odd.

    At the middle of this axis, they are the shortest one and the one that turns the other way.
    """
    shortest = log(R)
    angle = np.linalg.norm(shortest, axis=-1, keepdims=True)
    axis = shortest / np.maximum(angle, TINY)
    v = np.stack([shortest, shortest - 2 * np.pi * axis])
    middle = len(R) // 2
    forward = [(i, i - 1) for i in range(middle + 1, len(R))]
    backward = [(i, i + 1) for i in reversed(range(middle))]
    for i, last in forward + backward:
        beyond = np.sum(v[:, last] * axis[i], axis=-1, keepdims=True) - angle[i]
        turns = np.round(beyond / (2 * np.pi))
        v[:, i] = shortest[i] + 2 * np.pi * turns * axis[i]
    return v


def _beta(t: Array) -> Array:
    return t * t * (3 - 2 * t)


def _bounded(w: Array) -> Array:
    return np.clip(w, -1e6, 1e6)  # to avoid overflow; faster problems are not solved


def spun(curves: Curves, ends: Array, G: Array, worth: Mask) -> Curves:
    """Return curves with more spin about the principal axes of the inertia G of each problem.

    The new curves are R exp(φ ê) with φ = ±2π (10 t³ − 15 t⁴ + 6 t⁵), a full turn, for each
    principal axis e that is `worth` it, and φ = ±π (4 t (1 − t))³, forth and back, for the first
    axis. The axes are ordered by their moments.
    """
    t = grid(curves.nodes).t[:, None]
    turn = 2 * np.pi * t**3 * (10 - 15 * t + 6 * t**2)
    swing = np.pi * (4 * t * (1 - t)) ** 3
    axes = np.linalg.eigh(G[curves.problem])[1].mT
    turning, axis = np.nonzero(worth[curves.problem])
    swinging = np.flatnonzero(worth[curves.problem, 0])
    turns = turn * axes[turning, axis][:, None]
    swings = swing * axes[swinging, 0][:, None]
    more = exp_so3(np.concatenate([turns, swings]))
    new = curves.take(np.tile(np.append(turning, swinging), 2))
    return Curves.of(new.problem, new.R @ np.concatenate([more, more.mT])).with_ends(ends)


class Steps(NamedTuple):
    """The limits of Gauss–Newton steps."""

    most: int
    worthwhile: float  # they end when one of them lowers the cost by less than this share
    damped: bool = False  # many dampings of a step are tried, instead of its `SHARES`


def lowered(functional: Functional, curves: Curves, steps: Steps) -> Curves:
    """Lower the costs of curves by Gauss–Newton steps.

    For R exp(η̂), the deviation u changes, to first order, by D₀ η + D₁ η' + D₂ η'' (+ D₃ η'''). A
    step uses the η that minimises the integral of the squared new deviation, or this η times
    another of the `SHARES` if the curve then costs less. Damped steps (Levenberg–Marquardt) add
    each of the `DAMPINGS` to the matrix of the least squares; they are slower, and succeed in
    curved valleys, as those of thin rods. Here η = tᵐ (1 − t)ᵐ p(t), which keeps the
    ends, and p has half as many coefficients as there are nodes.
    """
    of_curves = functional.take(curves.problem)
    R, cost = curves.R.copy(), cost_at_nodes(of_curves, curves.R)
    active = np.arange(len(curves))
    for _ in range(steps.most):
        before = cost[active]
        for part in blocks(len(active), TOGETHER):
            some = active[part]
            R[some], cost[some] = _lower(of_curves.take(some), R[some], cost[some], steps.damped)
        active = active[cost[active] < (1 - steps.worthwhile) * before]
        if not len(active):
            break
    return Curves(curves.problem, R, cost)


def _lower(functional: Functional, R: Array, cost: Array, damped: bool) -> tuple[Array, Array]:
    each = np.arange(len(R))
    bumps = _bumps(R.shape[1], functional.ends // 2 + 1)
    J, u = gauss_newton(functional, R, bumps)
    A, g = J.mT @ J, -(J.mT @ u)
    if damped:
        diagonal = np.eye(A.shape[-1]) * A
        x = np.stack([np.linalg.solve(A + share * diagonal, g) for share in DAMPINGS])
    else:
        x = SHARES[:, None, None, None] * np.linalg.solve(A, g)
    change = bumps[0] @ x.reshape(len(x), len(R), -1, 3)
    tried = R @ cayley(change)
    of_tried = functional.take(np.tile(each, len(x)))
    costs = cost_at_nodes(of_tried, tried.reshape(-1, *R.shape[1:]))
    tried = np.concatenate([R[None], tried])
    costs = np.vstack([cost, costs.reshape(-1, len(R))])
    best = np.fmin(costs, np.inf).argmin(axis=0)  # NaN counts as inf
    return tried[best, each], costs[best, each]


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

    They follow from δw = η' + w × η and its derivatives.
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


@lru_cache
def _bumps(n: int, m: int) -> list[Array]:
    """Return tᵐ (1 − t)ᵐ times n//2 Chebyshev polynomials at the nodes, and m derivatives."""
    t = grid(n).t
    return with_derivatives((t * (1 - t))[:, None] ** m * chebyshev(t, n // 2), m)
