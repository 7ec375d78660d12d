"""Optima through many poses: Newton's method solves for all legs together.

Vary a curve R(t) to R exp(η̂), with η = 0 at the poses. On each leg of an optimum, R p = c, as
between two poses (see `rbcourse.curves.functionals`). The variation of the cost is then a sum over
the ends of the legs. Each term is the product of the momenta and the change of the end values; for
a ball, it is 4 w' · δw. So at an optimum the momenta are the same on both sides of each inner pose,
and 0 at natural ends.

A Newton step linearises each leg (`_collocation`). The changes of the momenta, for unit changes of
the end values, give a symmetric matrix for each leg. Together these matrices form the linear system
for the values at the poses (`curves.velocities.KnotSystem`), the second derivative of the cost. If
it is positive definite, and each leg is a strict local minimum among the curves with its ends
(`_second_variation`), the whole spline is a strict local minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from rbcourse._chebyshev import along, chebyshev, grid, primitives
from rbcourse._numerics import Array, blocks, matvec
from rbcourse.curves.functionals import BallAcceleration, Effort, Functional
from rbcourse.curves.velocities import (
    Conditions,
    KnotSystem,
)
from rbcourse.optimum._collocation import (
    EXACT,
    LONGEST_STEP,
    NODES,
    TOGETHER,
    Arrays,
    BallStationary,
    Equations,
    Failure,
    Solution,
    Stationary,
    by_ends_of,
    cayley,
    on_nodes,
    orthogonal,
    rates_at_nodes,
    refined,
)
from rbcourse.optimum._guesses import cost_at_nodes, gauss_newton, rates_of, with_derivatives
from rbcourse.so3 import exp_so3, log

STEPS, DESCENT_STEPS = 20, 150
LOWERED, BUMPS = 33, 8  # nodes of curves whose costs are lowered, and polynomials on each leg
DESCENTS = 1e-2, 1e-4, 1e-6
"""Shares of the cost. If Newton's method finds no minimum, Gauss–Newton steps lower the cost of its
start until a step lowers it by less than the first share; if it fails again, the next share."""
SHARES = 1, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001  # multiples of a step; the best one is used
SHIFTS = 0.0, *(4.0**k for k in range(-3, 10))
FLAT = 1e-9  # eigenvalues below this share of the diagonal may be 0


class Problem(NamedTuple):
    """The data of a spline: rotations, durations with mean 1, end conditions, and functional.

    A curve is given by its rotations at Chebyshev nodes of the legs, shape (N − 1, n, 3, 3).
    """

    R: Array
    h: Array
    ends: Conditions
    functional: Functional

    @property
    def scale(self) -> Array:
        """The powers of `h` that scale values at both ends of the legs to unit time."""
        orders = np.arange(1, 1 + self.functional.ends // 2)
        return np.tile(np.repeat(self.h[:, None] ** orders, 3, axis=1), 2)

    @property
    def weight(self) -> Array:
        """The weight of each leg in the cost: the factor of ∫ ‖u‖² dt for times from 0 to 1."""
        return np.asarray(self.functional.scale * self.h ** -(self.functional.ends + 1.0))

    def cost(self, R: Array) -> float:
        """Return the cost of a curve."""
        return float(np.sum(cost_at_nodes(self.functional, R) * self.weight))

    def values(self, R: Array) -> Array:
        """Return w (and w') of a curve at the poses, as given at its ends."""
        rates = np.concatenate(rates_of(R, self.functional.ends // 2), axis=-1)
        rates /= self.scale[:, None, : rates.shape[-1]]
        values = np.append(rates[:, 0], rates[-1:, -1], axis=0)
        if self.ends.periodic:
            values[[0, -1]] = (values[0] + values[-1]) / 2
        return np.where(self.ends.fixed[:, None], self.ends.given, values)

    def equations(self, values: Array, n: int) -> Equations:
        """Return the equations R p = c of the legs, for n nodes and values at the poses."""
        parts = self.R[:-1], self.R[1:], self.own(values)
        if isinstance(self.functional, BallAcceleration):
            return BallStationary(*parts, coarse=9 if n < 33 else 17)
        return Stationary(self.functional, *parts)

    def own(self, values: Array) -> Array:
        """Return w0, w1 (and a0, a1) of the legs for times from 0 to 1, shape (N − 1, m, 3)."""
        both = self.scale * np.append(values[:-1], values[1:], axis=1)
        return both.reshape(len(both), 2, -1, 3).swapaxes(1, 2).reshape(len(both), -1, 3)

    def solved(self, system: KnotSystem, shifts: Sequence[float] = SHIFTS) -> tuple[float, Array]:
        """Return the first shift of a system for which it is positive definite, and its solution.

        The shift is a multiple of the largest diagonal entries; it is added to the diagonal.
        """
        ends = self.ends._replace(given=np.zeros_like(self.ends.given))
        sizes = np.abs(np.diagonal(system.A + system.D, axis1=1, axis2=2)).max(axis=0)
        for shift in shifts:
            more = shift * np.diag(sizes)
            with suppress(np.linalg.LinAlgError):
                return shift, system._replace(A=system.A + more, D=system.D + more).solve(ends)
        raise np.linalg.LinAlgError("the system of a step is singular")


class Found(NamedTuple):
    """The result of Newton's method; `shift` makes the last system positive definite."""

    R: Array
    values: Array
    legs: list[Solution]
    cost: float
    shift: float


def solve_spline(problem: Problem, R: Array) -> Found | Failure:
    """Return a minimum that Newton's method finds.

    If a curve turns about one axis only, no step leaves this axis. For a body, curves that leave
    the axis can cost less, so a second search starts from a curve off the axis.
    """
    found = _searched(problem, R, (None, *DESCENTS))
    if isinstance(problem.functional, Effort) and (
        isinstance(found, Failure)
        or np.linalg.matrix_rank(log(found.R[0, 0].T @ found.R).reshape(-1, 3), rtol=1e-6) < 2
    ):
        t = grid(R.shape[1]).t[:, None]
        sides = (-1.0) ** np.arange(len(R))[:, None, None] * [0.4, 0.6, 0.8]  # rad, in mid-leg
        aside = R @ exp_so3(16 * t**2 * (1 - t) ** 2 * sides)
        other = _searched(problem, aside, DESCENTS)
        return other if other.cost < found.cost * (1 - 1e-9) else found
    return found


def _searched(problem: Problem, R: Array, descents: Sequence[float | None]) -> Found | Failure:
    """Return a minimum that Newton's method finds from a curve (None) or from cheaper curves.

    The minimum must not cost more than its start. For the jerk, this is not required, and the cost
    is not lowered, since the start does not have all given end values.
    """
    of_jerk = problem.functional.ends == 4
    bound = np.inf if of_jerk else problem.cost(R)
    for worthwhile in descents[:1] if of_jerk else descents:
        if worthwhile is not None:
            R, bound = _lowered(problem, on_nodes(R, LOWERED), worthwhile)
        found: Found | Failure = Failure(np.inf, STEPS)
        with suppress(FloatingPointError, np.linalg.LinAlgError):
            found = _newton(problem, R)
        if isinstance(found, Found) and found.shift <= FLAT and found.cost < bound * (1 + 1e-4):
            return found
    return found if isinstance(found, Failure) else Failure(found.legs[0].residual, STEPS)


@np.errstate(over="raise", invalid="raise", divide="raise")
def _newton(problem: Problem, R: Array) -> Found | Failure:
    """Return the result of Newton's method from a curve."""
    values, last = problem.values(R), np.inf
    unknowns: Arrays = R, *problem.equations(values, R.shape[1]).first(R)
    for step in range(STEPS):
        for n in NODES[NODES.index(unknowns[0].shape[1]) :]:  # more nodes if these are too few
            legs = problem.equations(values, n)
            if n > unknowns[0].shape[1]:
                unknowns = refined(legs, n, unknowns)
            left, parts = legs.errors(unknowns)
            tail = legs.tails(unknowns).max()
            if tail < EXACT or last > 1e3 * tail:
                break
        else:
            return Failure(float(left.max()), step)
        system, responses = _linearised(problem, legs, unknowns, parts)
        _, change = problem.solved(system)
        if max(left.max(), tail) < EXACT and last < 1e-5:
            k, c, costs = legs.solution(unknowns)
            cost = float(np.sum(costs * problem.weight))
            # momenta that differ at the poses would let a step lower the cost
            decrease = np.sum(system.b0 * change[:-1] + system.b1 * change[1:])
            rounding = np.sum(values[:-1] * matvec(system.A, values[:-1]))
            if decrease <= 1e-22 * cost + 1e-26 * rounding:
                shift, _ = problem.solved(system, (-FLAT, FLAT, *SHIFTS[1:]))
                each = zip(unknowns[0], k, c, costs.tolist(), left.tolist(), strict=True)
                solutions = [Solution(*one, iterations=step) for one in each]
                return Found(unknowns[0], values, solutions, cost, shift)
        x = np.insert(problem.own(change).reshape(len(left), -1), 0, 1, axis=1)
        turn, *changes = (np.einsum("i...j,ij->i...", y, x) for y in responses)
        last = float(np.linalg.norm(turn, axis=-1).max())
        share = LONGEST_STEP / max(LONGEST_STEP, last)
        others = [y + share * dy for y, dy in zip(unknowns[1:], changes, strict=True)]
        unknowns = orthogonal(cayley(share * turn) @ unknowns[0]), *others
        values = values + share * change
    return Failure(float(left.max()), STEPS)


def _linearised(
    problem: Problem, legs: Equations, unknowns: Arrays, parts: Arrays
) -> tuple[KnotSystem, Arrays]:
    """Return the linear system of a Newton step, and the responses of the legs' unknowns."""
    m, count = problem.functional.ends, len(problem.h)
    made = []
    for some in blocks(count, TOGETHER):
        own, data = (tuple(x[some] for x in arrays) for arrays in (unknowns, parts))
        made.append(legs.take(some).responses(own, data, by_ends=True))
    responses = tuple(np.concatenate(x) for x in zip(*made, strict=True))
    rates = rates_at_nodes(legs.ends, legs.bend(unknowns))[:m]
    momenta, slopes = problem.functional.momenta(*(x[:, [0, -1]] for x in rates))
    by, bends = primitives(unknowns[0].shape[1], m), legs.bend_by(unknowns, responses)
    change = np.zeros((*momenta.shape, 1 + 3 * m))
    for E, K, D in zip(by.from_ends, by.from_k, slopes, strict=False):
        change += D @ along(K[[0, -1]], bends)
        change[..., 1:] += by_ends_of(E[[0, -1]], D)
    # the values of a leg are sorted by order and end in `own`, by end and order in a system
    by_values = change[..., 1:].reshape(count, 3 * m, m // 2, 2, 3).swapaxes(2, 3)
    factors = np.repeat([-1, 1], 3 * m // 2) * problem.weight[:, None] * problem.scale
    H = factors[..., None] * by_values.reshape(count, 3 * m, 3 * m) * problem.scale[:, None]
    b = -factors * (momenta + change[..., 0]).reshape(count, 3 * m)
    n, H = 3 * m // 2, (H + H.mT) / 2
    return KnotSystem(H[:, :n, :n], H[:, :n, n:], H[:, n:, n:], b[:, :n], b[:, n:]), responses


def _lowered(problem: Problem, R: Array, worthwhile: float) -> tuple[Array, float]:
    """Lower the cost of a curve by Gauss–Newton steps; return the curve and its cost.

    The steps are those of `guesses.lowered`, but η is a cubic with any η' at the poses, plus a sum
    of `BUMPS` polynomials t² (1 − t)² p(t), whose coefficients are eliminated leg by leg.
    """
    h, weight, cost = problem.h[:, None], problem.weight[:, None, None], problem.cost(R)
    t = grid(R.shape[1]).t[:, None]
    bumps = t * (1 - t) * chebyshev(t[:, 0], BUMPS)
    shapes = with_derivatives(t * (1 - t) * np.concatenate([1 - t, -t, bumps], axis=1), 2)
    for _ in range(DESCENT_STEPS):
        J, u = gauss_newton(problem.functional, R, shapes)
        outer, inner = np.append(J[..., :6], u, axis=2), J[..., 6:]
        by_outer = np.linalg.solve(inner.mT @ inner, inner.mT @ outer)
        rest = outer - inner @ by_outer
        E = weight * (rest.mT @ rest)
        H, b = h[..., None] ** 2 * E[:, :6, :6], -h * E[:, :6, 6]
        system = KnotSystem(H[:, :3, :3], H[:, :3, 3:], H[:, 3:, 3:], b[:, :3], b[:, 3:])
        _, change = problem.solved(system)
        x = h * np.append(change[:-1], change[1:], axis=1)
        z = -matvec(by_outer[..., :6], x) - by_outer[..., 6]
        eta = shapes[0] @ np.append(x, z, axis=1).reshape(len(h), -1, 3)
        tried = [R, *(R @ cayley(share * eta) for share in SHARES)]
        costs = [cost, *(problem.cost(one) for one in tried[1:])]
        best = int(np.nanargmin(costs))
        before, cost, R = cost, costs[best], tried[best]
        if cost >= (1 - worthwhile) * before:
            break
    return R, cost
