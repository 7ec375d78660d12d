"""Optima through many poses: Newton's method solves for all legs together.

On each leg R p = c, as between two poses (`_collocation`). Vary R(t) to R exp(η̂), with η = 0 at the
poses. Then the cost changes by a sum over the legs,

    δJ = Σ (μ · δx at the end − μ · δx at the start),    x = w (for the jerk, also w'),

where μ are the momenta (`rbcourse.curves.functionals`). So at an optimum the momenta are the same
on both sides of each inner pose, and 0 at natural ends. A Newton step linearises each leg. The
changes of its momenta, for unit changes of x at its ends, are a symmetric matrix. Together these
matrices are the second derivative of the cost, and the linear system for the values x. If it is
positive definite, and each leg is a strict local minimum (`_second_variation`), so is the spline.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, blocks, matvec, solve
from rbcourse._polynomials import along, chebyshev, grid, primitives
from rbcourse.curves.functionals import BallAcceleration, Effort, Functional
from rbcourse.curves.velocities import Conditions, KnotSystem
from rbcourse.optimum._collocation import (
    EXACT,
    LONGEST_STEP,
    NODES,
    TOGETHER,
    UNRESOLVED,
    BallStationary,
    Change,
    Errors,
    Failure,
    Solution,
    Stationary,
    Unknowns,
    by_ends_of,
    cayley,
    joined,
    on_nodes,
    orthogonal,
    rates_at_nodes,
    rates_of,
    take,
    with_derivatives,
)
from rbcourse.optimum._guesses import SAME, cost_at_nodes, gauss_newton
from rbcourse.so3 import exp_so3, log

STEPS = 20  # of Newton's method; then it has failed
SHORT = 1e-5  # rad: a result is accepted after a step shorter than this
WORTHLESS = 1e-22  # a step is not needed if it lowers the cost by less than this share of it
ROUNDING = 1e-26  # and this share of the terms of the system, whose momenta have rounding errors
NOTHING = (
    1e-12  # rad: after a step that turns no node by more, only rounding errors are left [2e-13]
)
STANDS = 1e-12  # rad: rounding errors of η at the nodes, which a start's cost has [3e-13]
TOLERANCE = 1e-4  # a minimum may cost more than its start by this share
FLAT = 1e-9  # eigenvalues below this share of the diagonal may be 0
SHIFTS = 0.0, *(4.0**k for k in range(-3, 10))  # multiples of the diagonal that are added to it
NEARLY_FLAT = 0.1  # rad: below, the cost is nearly quadratic, and has one minimum
ON_AXIS = 1e-6  # a curve is about one axis if rotation vectors have a smaller part across it
BEND = np.array([0.4, 0.6, 0.8])  # rad: the turn by which a curve leaves its axis in mid-leg
DESCENTS = 1e-2, 1e-4, 1e-6
"""Shares of the cost. If Newton's method finds no minimum, Gauss–Newton steps lower the cost of its
start until a step lowers it by less than the first share; if it fails again, the next share."""
DESCENT_STEPS = 150  # at most, for each share
SHARES = 1, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001  # multiples of a Gauss–Newton step; the best is used
LOWERED, BUMPS = 33, 8  # nodes of curves whose costs are lowered, and polynomials on each leg


class Problem(NamedTuple):
    """The data of a spline. A curve is given at the nodes of its legs, shape (N − 1, n, 3, 3)."""

    R: Array
    h: Array  # the durations, with mean 1
    ends: Conditions
    functional: Functional

    @property
    def scale(self) -> Array:
        """The powers of `h` that scale values at both ends of the legs to unit time."""
        orders = np.arange(1, 1 + self.functional.ends // 2)
        at_one_end = np.repeat(self.h[:, None] ** orders, 3, axis=1)
        return np.tile(at_one_end, 2)

    @property
    def weight(self) -> Array:
        """The factors of ∫ ‖u‖² dt of the legs in the cost, for times from 0 to 1."""
        power = self.functional.ends + 1.0
        return np.asarray(self.functional.scale * self.h**-power)

    def cost(self, R: Array) -> float:
        return self.total(cost_at_nodes(self.functional, R))

    def total(self, costs: ArrayLike) -> float:
        """Return the cost from ∫ ‖u‖² dt of each leg."""
        return float(np.sum(np.asarray(costs) * self.weight))

    def values(self, R: Array) -> Array:
        """Return w (and w') of a curve at the poses, as given at its ends."""
        rates = np.concatenate(rates_of(R, self.functional.ends // 2), axis=-1)
        rates /= self.scale[:, None, : rates.shape[-1]]
        values = np.append(rates[:, 0], rates[-1:, -1], axis=0)
        if self.ends.periodic:
            values[[0, -1]] = (values[0] + values[-1]) / 2
        return np.where(self.ends.fixed[:, None], self.ends.given, values)

    def equations(self, values: Array, n: int) -> Stationary:
        of_ball = isinstance(self.functional, BallAcceleration)
        kind = BallStationary if of_ball else Stationary
        coarse = 9 if n < 33 else 17
        return kind(self.functional, self.R[:-1], self.R[1:], self.own(values), coarse)

    def own(self, values: Array) -> Array:
        """Return w0, w1 (and a0, a1) of the legs for times from 0 to 1, shape (N − 1, m, 3)."""
        count = len(self.h)
        both = self.scale * np.append(values[:-1], values[1:], axis=1)
        by_end = both.reshape(count, 2, -1, 3)
        by_order = by_end.swapaxes(1, 2)
        return by_order.reshape(count, -1, 3)


class Found(NamedTuple):
    """The result of Newton's method; `shift` makes the last system positive definite."""

    R: Array
    values: Array
    legs: list[Solution]
    cost: float
    shift: float


def solve_spline(problem: Problem, R: Array) -> Found | Failure:
    """Return a minimum that Newton's method finds.

    For a body, a curve that leaves an axis can cost less, but no step leaves it; so a second search
    starts off the axis.
    """
    found = _searched(problem, R, (None, *DESCENTS))
    if not isinstance(problem.functional, Effort):
        return found
    if isinstance(found, Found) and not _about_one_axis(found.R):
        return found
    other = _searched(problem, _off_the_axis(R), DESCENTS)
    return other if other.cost < found.cost * (1 - SAME) else found


def _about_one_axis(R: Array) -> bool:
    """Tell whether a curve that is large enough to leave its axis turns about one axis."""
    turns = log(R[0, 0].T @ R)
    if np.linalg.norm(turns, axis=-1).max() < NEARLY_FLAT:
        return False
    rank = np.linalg.matrix_rank(turns.reshape(-1, 3), rtol=ON_AXIS)
    return bool(rank < 2)


def _off_the_axis(R: Array) -> Array:
    """Return a curve that leaves its axis on each leg, to one side and to the other in turn.

    The side is the part of `BEND` across the axis or, if this is small, another direction.
    """
    turns = log(R[0, 0].T @ R).reshape(-1, 3)
    _, _, (axis, other, _) = np.linalg.svd(turns, full_matrices=False)
    side = BEND - (BEND @ axis) * axis
    if np.linalg.norm(side) < 0.5:
        side = other
    t = grid(R.shape[1]).t[:, None]
    share = 16 * t**2 * (1 - t) ** 2
    signs = (-1.0) ** np.arange(len(R))
    sides = signs[:, None, None] * side
    return R @ exp_so3(share * sides)


def _searched(problem: Problem, R: Array, descents: Sequence[float | None]) -> Found | Failure:
    """Return a minimum that Newton's method finds from a curve (None) or from cheaper curves.

    It must not cost more than its start; but for the jerk, the start does not have all given end
    values, so its cost is no bound, and is not lowered.
    """
    of_jerk = problem.functional.ends == 4
    bound = np.inf if of_jerk else problem.cost(R)
    for worthwhile in descents[:1] if of_jerk else descents:
        if worthwhile is not None:
            R, bound = _lowered(problem, on_nodes(R, LOWERED), worthwhile)
        found: Found | Failure = Failure(np.inf, STEPS)
        with suppress(FloatingPointError, np.linalg.LinAlgError):
            found = _newton(problem, R)
        most = (1 + TOLERANCE) * (np.sqrt(bound) + np.sqrt(problem.total(STANDS**2))) ** 2
        if isinstance(found, Found) and found.shift <= FLAT and found.cost <= most:
            return found
    if isinstance(found, Found):
        return Failure(found.legs[0].residual, STEPS)
    return found


class Legs(NamedTuple):
    """The state of Newton's method on one set of nodes."""

    equations: Stationary
    unknowns: Unknowns
    errors: Errors
    tail: float  # the largest of the last Chebyshev coefficients

    @property
    def left(self) -> float:
        return float(self.errors.largest.max())

    def stepped(self, step: Change, share: float) -> Unknowns:
        shares = np.full(len(step.c), share)
        R, k, c = self.equations.stepped(self.unknowns, step, shares)
        return self.equations.unknowns(orthogonal(R), k, c)

    def solutions(self, steps: int) -> list[Solution]:
        costs = self.equations.costs(self.unknowns.k).tolist()
        left = self.errors.largest.tolist()
        each = zip(*self.unknowns, costs, left, strict=True)
        return [Solution(*one, iterations=steps) for one in each]

    def resolved(self, turned: float) -> bool:
        """Tell whether there are enough nodes, after a step that turned a node by so much."""
        return self.tail < EXACT or turned > UNRESOLVED * self.tail


@np.errstate(over="raise", invalid="raise", divide="raise")
def _newton(problem: Problem, R: Array) -> Found | Failure:
    values = problem.values(R)
    turned = np.inf  # rad: the largest turn of a node by the last step
    unknowns = problem.equations(values, R.shape[1]).first(R)
    for step in range(STEPS):
        legs = _on_enough_nodes(problem, values, unknowns, turned)
        if not legs.resolved(turned):
            return Failure(legs.left, step)
        responses = responses_of(legs)
        system = _system(problem, legs, responses)
        _, change = minimum(system, problem.ends)
        if max(legs.left, legs.tail) < EXACT and turned < SHORT:
            solutions = legs.solutions(step)
            cost = problem.total([one.cost for one in solutions])
            if turned < NOTHING or not _lowers(change, system, values, cost):
                shift, _ = minimum(system, problem.ends, (-FLAT, FLAT, *SHIFTS[1:]))
                return Found(legs.unknowns.R, values, solutions, cost, shift)
        of_legs = combined(responses, problem.own(change).reshape(len(problem.h), -1))
        turned = float(np.linalg.norm(of_legs.turn, axis=-1).max())
        share = LONGEST_STEP / max(LONGEST_STEP, turned)
        unknowns = legs.stepped(of_legs, share)
        values = values + share * change
    return Failure(legs.left, STEPS)


def _on_enough_nodes(problem: Problem, values: Array, unknowns: Unknowns, turned: float) -> Legs:
    """Return the legs on the fewest nodes that suffice, or else on the most nodes."""
    n = unknowns.R.shape[1]
    for more in NODES[NODES.index(n) :]:
        equations = problem.equations(values, more)
        if more > n:
            unknowns = equations.refined(unknowns, more)
        errors = equations.errors(unknowns)
        tail = float(equations.tails(unknowns).max())
        legs = Legs(equations, unknowns, errors, tail)
        if legs.resolved(turned):
            break
    return legs


def responses_of(legs: Legs) -> Change:
    """Return a Newton step of each leg, and its responses to unit changes of its end values."""
    made = []
    for some in blocks(len(legs.unknowns.R), TOGETHER):
        equations = legs.equations.take(some)
        unknowns = take(legs.unknowns, some)
        errors = take(legs.errors, some)
        made.append(equations.responses(unknowns, errors, by_ends=True))
    return joined(made)


def combined(responses: Change, ends: Array) -> Change:
    """Return a Newton step plus the responses to changes of the end values, shape (N, …)."""
    x = np.insert(ends, 0, 1, axis=1)
    return Change(*(np.einsum("i...j,ij->i...", y, x) for y in responses))


def _system(problem: Problem, legs: Legs, responses: Change) -> KnotSystem:
    """Return the second derivative of the cost, and minus its gradient after a step of each leg."""
    scale = problem.scale
    size = scale.shape[1]
    momenta, changes = end_momenta(problem.functional, legs, responses)
    momenta = momenta + changes[..., 0]
    by_order = changes[..., 1:].reshape(-1, size, size // 6, 2, 3)  # as in `Problem.own`
    by_end = by_order.swapaxes(2, 3).reshape(-1, size, size)
    signs = np.repeat([-1, 1], size // 2)  # at the start and at the end
    factors = signs * problem.weight[:, None] * scale
    H = factors[..., None] * by_end * scale[:, None]
    b = -factors * momenta.reshape(-1, size)
    return knot_system((H + H.mT) / 2, b)


def end_momenta(functional: Functional, legs: Legs, responses: Change) -> tuple[Array, Array]:
    """Return the momenta at both ends of the legs, and their changes for each response."""
    m = functional.ends
    k = legs.unknowns.k
    by = primitives(k.shape[1], m)
    rates = rates_at_nodes(legs.equations.ends, k)[:m]
    at_ends = [x[:, [0, -1]] for x in rates]
    momenta, slopes = functional.momenta(*at_ends)
    changes = np.zeros((*momenta.shape, responses.k.shape[-1]))
    by_ends = slice(1, 1 + 3 * m)
    for from_ends, from_k, slope in zip(by.from_ends, by.from_k, slopes, strict=False):
        changes += slope @ along(from_k[[0, -1]], responses.k)
        changes[..., by_ends] += by_ends_of(from_ends[[0, -1]], slope)
    return momenta, changes


def knot_system(H: Array, b: Array) -> KnotSystem:
    """Return the system of matrices and loads of the legs; the values at the start come first."""
    m = b.shape[1] // 2
    A, B, D = H[:, :m, :m], H[:, :m, m:], H[:, m:, m:]
    return KnotSystem(A, B, D, b0=b[:, :m], b1=b[:, m:])


def minimum(
    system: KnotSystem, ends: Conditions, shifts: Sequence[float] = SHIFTS
) -> tuple[float, Array]:
    """Return the first shift of a system for which it is positive definite, and its solution.

    The shift is a multiple of the largest diagonal entries; it is added to the diagonal. The
    solution is a change of the values, so it is 0 where a value is given.
    """
    ends = ends._replace(given=np.zeros_like(ends.given))
    diagonals = np.diagonal(system.A + system.D, axis1=1, axis2=2)
    sizes = np.abs(diagonals).max(axis=0)
    for shift in shifts:
        more = shift * np.diag(sizes)
        shifted = system._replace(A=system.A + more, D=system.D + more)
        with suppress(np.linalg.LinAlgError):
            return shift, shifted.solve(ends)
    raise np.linalg.LinAlgError("the system of a step is singular")


def _lowers(change: Array, system: KnotSystem, values: Array, cost: float) -> bool:
    """Tell whether a step would lower the cost, since the momenta differ at the poses."""
    starts = values[:-1]
    decrease = np.sum(system.b0 * change[:-1] + system.b1 * change[1:])
    terms = np.sum(starts * matvec(system.A, starts))
    least = WORTHLESS * cost + ROUNDING * terms
    return bool(decrease > least)


def _lowered(problem: Problem, R: Array, worthwhile: float) -> tuple[Array, float]:
    """Lower the cost of a curve by Gauss–Newton steps; return the curve and its cost.

    The steps are those of `_guesses.lowered`, but η is a cubic with any η' at the poses, plus a sum
    of `BUMPS` polynomials t² (1 − t)² p(t), whose coefficients are eliminated leg by leg.
    """
    cost = problem.cost(R)
    t = grid(R.shape[1]).t[:, None]
    bumps = t * (1 - t) * chebyshev(t[:, 0], BUMPS)
    eta = t * (1 - t) * np.concatenate([1 - t, -t, bumps], axis=1)
    shapes = with_derivatives(eta, 2)
    for _ in range(DESCENT_STEPS):
        change = _best_change(problem, R, shapes)
        tried = [R, *(R @ cayley(share * change) for share in SHARES)]
        costs = [problem.cost(one) for one in tried]
        best = int(np.nanargmin(costs))
        before = cost
        R, cost = tried[best], costs[best]
        if cost >= (1 - worthwhile) * before:
            break
    return R, cost


def _best_change(problem: Problem, R: Array, shapes: list[Array]) -> Array:
    """Return the η of a Gauss–Newton step at the nodes; the shapes of η are cubics and bumps."""
    h = problem.h[:, None]
    J, u = gauss_newton(problem.functional, R, shapes)
    cubics = np.append(J[..., :6], u, axis=2)
    bumps = J[..., 6:]
    by_cubics = solve(bumps.mT @ bumps, bumps.mT @ cubics)
    rest = cubics - bumps @ by_cubics
    weight = problem.weight[:, None, None]
    E = weight * (rest.mT @ rest)
    H = h[..., None] ** 2 * E[:, :6, :6]
    b = -h * E[:, :6, 6]
    _, change = minimum(knot_system(H, b), problem.ends)
    slopes = h * np.append(change[:-1], change[1:], axis=1)
    of_bumps = -matvec(by_cubics[..., :6], slopes) - by_cubics[..., 6]
    coefficients = np.append(slopes, of_bumps, axis=1)
    return shapes[0] @ coefficients.reshape(len(h), -1, 3)
