"""Minimum acceleration on SO(3), BK (19): R w'' is constant; solved for the whole curve at once."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import Array, blocks
from rbcourse.curves import Chosen, Curve, Ends, check_ends, combine
from rbcourse.projection import nearest
from rbcourse.so3 import exp_so3, hat, log_so3, vee

COARSE = 17  # nodes, on which curves are started and systems solved;
LESS_COARSE = 33  # where that does not do
MOST_TURNS = 4  # starts have fewer full turns more than the shortest way
DESCENTS = 3  # steps that lower the cost of a start
BUMPS = 8  # polynomials that each component of such a step is made of
CLOSE = 2.0  # starts that cost more than this many times the cheapest are dropped,
FAST = 12.0  # rad: but where ‖w0‖ + ‖w1‖ is larger, not before their cost is lowered
FASTER = 24.0  # rad: beyond this both are done
ABOUT = 1.01  # the cost of a start, known at its nodes only, times this is a bound
STEPS = 25
EXACT = 3e-12  # what may be left of the equation, and of R in the last Chebyshev coefficients
LONGEST_STEP = 0.5
ROUGH = 1e-2  # rad: with shorter steps the fewest nodes are left
_BLOCK = 128  # problems whose linear systems fit into the cache together


def minimum_acceleration_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Return the minimum-acceleration curve with these ends, by relaxation.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    MinimumAcceleration
        A `Curve`, or a stack of them, that meets all four ends and solves w''' + w × w'' = 0. Its
        ``converged``, ``residual``, ``iterations`` and ``nodes`` tell how it was found, and ``c``
        is the constant R w''.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.
    ConvergenceError
        For a single problem, if Newton's method converges from none of its starts. Of 1,000 random
        problems (see Notes) this happened in none with ‖w0‖, ‖w1‖ < 30, and in 29 with less than
        50.

    Warns
    -----
    RuntimeWarning
        For a stack, if that happens to some: there the curve is NaN and ``converged`` False.

    See Also
    --------
    rbcourse.textbook.minimum_acceleration_so3 : The equation, and SciPy's `solve_bvp`.
    shoot_minimum_acceleration_so3 : The same by shooting.
    projected_cubic_so3 : Its near-optimal stand-in, in closed form.
    acceleration_cost : What both cost.
    retime : From [0, 1] to T seconds.

    Notes
    -----
    Singular set: none is known in closed form. (19) is necessary, not sufficient, and has several
    solutions: a turn by σ and one by σ ± 2π reach the same rotation. There is a start for each way
    round, and more of them, with full turns more, where ‖w0‖ + ‖w1‖ > 6π. A few steps of Gauss and
    Newton lower the cost of each. Newton's method then goes on from the cheapest and from those
    that cost up to twice as much; where that does not do, and where ‖w0‖ + ‖w1‖ > 24, from all of
    them, unlowered, on more nodes. The cheapest curve that it finds is returned. It is stationary.
    That none costs less is not proven, but was tried on random problems, with σ in a ball of radius
    π and w0, w1 in larger ones:

    - ‖w0‖, ‖w1‖ < 12, 20,000 problems of two seeds: none costs more than one of the six closed
      forms with the same ends, nor than what Newton's method finds from `cumulative_bezier_so3`
      either way round. Turning the room or the body, or reversing time, changes the cost by less
      than 1e-11, relatively. Eight random starts found a cheaper curve for 1 of 4,000, by 0.9 %.
    - ‖w0‖, ‖w1‖ < 20, 3,000 problems: none costs more than a closed form, 5 more than a curve that
      was found from one way round; reversing time changes the cost of 12. Eight random starts found
      a cheaper curve for 2 of 1,000.

    End velocities along the geodesic give R0 exp(σ̂ p(t)), with p a cubic and σ a logarithm of
    R0ᵀR1, the shortest or one with full turns more or the other way round. Of those the cheapest
    was found for all of 4,800 such problems with velocities up to 40.

    References
    ----------
    BK (19), BK 6.2, BK Prop. 7.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = minimum_acceleration_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> c.residual < 1e-12
    True
    """
    return solve(relax, check_ends(R0, R1, w0, w1))


class ConvergenceError(RuntimeError):
    """No curve was found; the message says how far the iteration got.

    Attributes
    ----------
    residual : float
        What was left at the end.
    iterations : int
        How many steps were taken.
    """

    def __init__(self, residual: float, iterations: int) -> None:
        super().__init__(
            f"no convergence: residual {residual:.1e} after {iterations} iterations; "
            "the end velocities may be too large"
        )
        self.residual = residual
        self.iterations = iterations

    def __reduce__(self) -> tuple[type, tuple[float, int]]:
        """Return how to make it again; its only argument would be the message."""
        return type(self), (self.residual, self.iterations)


class Solution(NamedTuple):
    """One problem solved: R at the nodes, c = R w'', its cost, what was left, the steps."""

    R: Array
    c: Array
    cost: float
    residual: float
    iterations: int


class Failure(NamedTuple):
    """One problem not solved: what was left, and after how many steps."""

    residual: float
    iterations: int


class Grid(NamedTuple):
    """Chebyshev–Lobatto nodes on [0, 1], and matrices that act on values there.

    `blend` goes from (1, 0) to (0, 1). `derivative`, `integral` from 0 and `twice` give values at
    the nodes, `twice` of the solution y of y'' = values that is 0 at both ends. `series`, `once`
    and `again` give the Chebyshev coefficients of the function, of its integral from 0 and of the
    integral of that.
    """

    t: Array
    blend: Array
    derivative: Array
    integral: Array
    twice: Array
    series: Array
    once: Array
    again: Array


def chebyshev(t: Array, count: int) -> Array:
    """Return the first Chebyshev polynomials on [0, 1] at the times t, shape (n, count)."""
    from numpy.polynomial.chebyshev import chebvander

    return chebvander(2 * t - 1, count - 1)


@lru_cache
def grid(n: int) -> Grid:
    """Return the grid of n nodes."""
    from numpy.polynomial.chebyshev import chebder, chebint

    t = (1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2
    series = np.linalg.inv(chebyshev(t, n))
    once, again = (chebint(series, m, lbnd=-1, scl=0.5) for m in (1, 2))
    derivative, integral, double = (
        chebyshev(t, len(c)) @ c for c in (chebder(series, scl=2), once, again)
    )
    blend, twice = np.stack([1 - t, t], axis=-1), double - np.outer(t, double[-1])
    return Grid(t, blend, derivative, integral, twice, series, once, again)


def along(matrix: Array, values: Array) -> Array:
    """Return a matrix of a `Grid` applied to values at the nodes, of any shape (N, n, ...)."""
    count, n, *core = values.shape
    columns = values.reshape(count, n, math.prod(core))
    return (matrix @ columns).reshape(count, len(matrix), *core)


def in_body(R: Array, c: Array) -> Array:
    """Return Rᵀc at the nodes, shape (N, n, 3)."""
    return (c[:, None, None] @ R)[:, :, 0]


def orthogonal(R: Array) -> Array:
    """Return R without its rounding: one step of Newton and Schulz."""
    return R @ (1.5 * np.eye(3) - 0.5 * (R.mT @ R))


class MinimumAcceleration(Curve):
    """A `Curve` on SO(3), or a stack of them, that solves (19); as Chebyshev series.

    Attributes
    ----------
    ends : Ends
        The boundary conditions, with one batch axis: one entry for each problem.
    converged : bool, or ndarray of bool, shape (...)
        Where a solution was found. Elsewhere the curve, `c` and the cost are NaN.
    c : ndarray, shape (..., 3)
        R w'', which does not depend on t: the angular jerk in the fixed frame.
    cost : float or ndarray, shape (...)
        The integral of 2 ‖w'‖², BK (18), by the rule of the nodes.
    residual : float or ndarray, shape (...)
        The largest entry of R0 + ∫ R ŵ dt − R(t) at the nodes, w from R w'' = c and the ends.
    iterations, nodes : int or ndarray of int, shape (...)
        How many steps the solver took, and how many nodes carry the curve.

    References
    ----------
    BK (19). It says that R w'' is constant: (R w'')' = R (w''' + w × w'').
    """

    def __init__(
        self, ends: Ends, solutions: list[Solution | Failure], batch_shape: tuple[int, ...]
    ) -> None:
        self.ends, self.batch_shape, self._solutions = ends, batch_shape, solutions
        found = {i: s for i, s in enumerate(solutions) if isinstance(s, Solution)}
        nodes, c = np.zeros(len(solutions), int), np.full((len(solutions), 3), np.nan)
        for i, solution in found.items():
            nodes[i], c[i] = len(solution.R), solution.c
        same = [np.flatnonzero(nodes == n) for n in np.unique(nodes[nodes > 0])]
        self._parts = [(index, np.stack([found[int(i)].R for i in index])) for index in same]
        self._part, self._place = np.full((2, len(solutions)), -1)
        for number, index in enumerate(same):
            self._part[index], self._place[index] = number, np.arange(len(index))
        cost = np.array([s.cost if isinstance(s, Solution) else np.nan for s in solutions], float)
        residual = np.array([s.residual for s in solutions], float)
        iterations = np.array([s.iterations for s in solutions], int)
        self.c = c.reshape(*batch_shape, 3)
        self.converged, self.nodes, self.cost, self.residual, self.iterations = (
            x.reshape(batch_shape) if batch_shape else x.item()
            for x in (nodes > 0, nodes, cost, residual, iterations)
        )

    @cached_property
    def _rotations(self) -> list[Array]:
        """The Chebyshev series of R, for each number of nodes."""
        return [along(grid(R.shape[1]).series, R) for _, R in self._parts]

    @cached_property
    def _velocities(self) -> list[tuple[Array, Array]]:
        """The Chebyshev series of w and of w', for each number of nodes."""
        c = self.c.reshape(-1, 3)
        return [_rates(self.ends.of(i), in_body(R, c[i])) for i, R in self._parts]

    def _picked(self, chosen: Any) -> Self:
        numbers = np.reshape(chosen, -1)
        solutions = [self._solutions[i] for i in numbers]
        return type(self)(self.ends.of(numbers), solutions, np.shape(chosen))

    def _series(self, order: int) -> list[Array]:
        """Return the Chebyshev series of R, w or w', for each number of nodes."""
        return [part[order - 1] for part in self._velocities] if order else self._rotations

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        out[...] = np.nan
        part, place = self._part[which], self._place[which]
        for number, series in enumerate(self._series(order)):
            there = np.flatnonzero(part == number)
            if there.size:
                times = t if t.shape[1] == 1 else t[:, there]
                weights = np.moveaxis(chebyshev(times, series.shape[1]), -1, 0)
                terms = series.reshape(*series.shape[:2], -1).swapaxes(0, 1)
                values = np.empty((len(t), len(there), terms.shape[2]))
                combine(weights, terms, place[there], values)
                out[:, there] = values.reshape(*values.shape[:2], *self._core(order))
        if order == 0:
            out[...] = orthogonal(out)

    def __repr__(self) -> str:
        """Return what it is, what it costs, and what is left of the equation."""
        cost = "" if self.batch_shape else f", cost {self.cost:.6g}"
        return f"{super().__repr__()[:-1]}{cost}, residual {np.max(self.residual, initial=0):.1e}>"


def velocity(ends: Ends, R: Array, c: Array) -> Array:
    """Return w at the nodes, from R w'' = c: Rᵀc twice integrated, with w0 and w1 at the ends."""
    nodes = grid(R.shape[1])
    return nodes.blend @ np.stack([ends.w0, ends.w1], axis=1) + nodes.twice @ in_body(R, c)


def defects(ends: Ends, R: Array, c: Array) -> tuple[Array, Array]:
    """Return E = R0 + ∫ R ŵ − R at the nodes, with R w'' = c, and ŵ."""
    W = hat(velocity(ends, R, c))
    return ends.R0[:, None] + along(grid(R.shape[1]).integral, R @ W) - R, W


def tails(R: Array) -> Array:
    """Return the larger of the last two Chebyshev coefficients: what the nodes do not carry."""
    return np.abs(along(grid(R.shape[1]).series[-2:], R)).max(axis=(1, 2, 3))


def _rates(ends: Ends, jerk: Array) -> tuple[Array, Array]:
    """Return the series of w and w', from w'' at the nodes and w at the ends."""
    nodes = grid(jerk.shape[1])
    w, acceleration = nodes.again @ jerk, nodes.once @ jerk
    slope = ends.w1 - ends.w0 - w.sum(axis=1)
    acceleration[:, 0] += slope
    w[:, :2] += slope[:, None] / 2
    w[:, 0] += ends.w0
    return w, acceleration


def exact_cost(ends: Ends, R: Array, c: Array) -> Array:
    """Return ∫ 2 ‖w'‖² dt, by the rule of the nodes, of solutions R, c."""
    nodes = grid(R.shape[1])
    _, series = _rates(ends, in_body(R, c))
    rates = chebyshev(nodes.t, series.shape[1]) @ series
    return 2 * np.sum(rates**2, axis=-1) @ nodes.integral[-1]


def at_nodes(curve: Curve) -> Array:
    """Return a stack of N curves at 17 nodes, to `relax` from, shape (N, 17, 3, 3)."""
    return np.moveaxis(curve(grid(COARSE).t), 0, 1)


def first_guess(ends: Ends, R: Array) -> tuple[Array, Array]:
    """Return R of a guess with the right ends, and c for which w'' = Rᵀc gives w most nearly."""
    nodes, R = grid(R.shape[1]), R.copy()
    R[:, 0], R[:, -1] = ends.R0, ends.R1
    w = vee(R.mT @ along(nodes.derivative, R))
    lacking = (w - velocity(ends, R, np.zeros((len(R), 3)))).reshape(len(R), -1, 1)
    effect = along(nodes.twice, R.mT).reshape(len(R), -1, 3)
    return R, np.linalg.solve(effect.mT @ effect, effect.mT @ lacking)[..., 0]


Solver = Callable[[Ends, Array], list[Solution | Failure]]
"""Takes ends and rotations to start from, shape (N, n, 3, 3)."""


def solve(solver: Solver, given: Ends) -> MinimumAcceleration:
    """Return for each problem the cheapest curve that the solver finds from its `starts`.

    Raises
    ------
    ConvergenceError
        If all fail, for a single problem.

    Warns
    -----
    RuntimeWarning
        If all fail, for some of a stack.
    """
    batch, ends = given.w0.shape[:-1], given.flat()
    R0, R1 = (nearest(R)[0] for R in ends[:2])  # written with few digits, (19) would not settle
    ends = ends._replace(R0=R0, R1=R1)
    with np.errstate(over="ignore", invalid="ignore"):
        solutions = _cheapest(solver, ends)
    if not batch and isinstance(solutions[0], Failure):
        raise ConvergenceError(*solutions[0])
    curve = MinimumAcceleration(ends, solutions, batch)
    _warn_if_not_converged(curve)
    return curve


def _cheapest(solver: Solver, ends: Ends) -> list[Solution | Failure]:
    """Follow the starts that cost little when `lowered`; where that is not enough, all as they are.

    It is not where nothing is found, or what is found costs more than a start, lowered or not.
    """
    problem, R = starts(ends, COARSE)
    raw = cost_at_nodes(R)
    speed = np.linalg.norm([ends.w0, ends.w1], axis=-1).sum(axis=0)
    some, cost = (speed > FAST)[problem] | _are_close(problem, raw), raw.copy()
    R[some], cost[some] = lowered(R[some])
    likely = _are_close(problem, cost)
    found = _followed(solver, ends, problem[likely], R[likely])
    bound = ABOUT * np.fmin(raw, cost)
    dear = np.array([_cost(one) for one in found])[problem] > bound
    lost = np.unique(problem[dear | (speed > FASTER)[problem]])
    if lost.size:
        again, R = starts(ends.of(lost), LESS_COARSE)
        for i, one in zip(lost, _followed(solver, ends.of(lost), again, R), strict=True):
            found[i] = min(found[i], one, key=_cost)
    return found


def _are_close(problem: NDArray[np.intp], cost: Array) -> NDArray[np.bool_]:
    """Tell which starts cost less than `CLOSE` times the cheapest of their problem, or as much."""
    least = np.full(problem.max(initial=-1) + 1, np.inf)
    np.fmin.at(least, problem, cost)
    return ~(cost > CLOSE * least[problem])


def _followed(
    solver: Solver, ends: Ends, problem: NDArray[np.intp], R: Array
) -> list[Solution | Failure]:
    """Return the cheapest solution of each problem from these starts, which have its number."""
    found: list[Solution | Failure] = [Failure(np.inf, 0)] * len(ends.w0)
    for i, one in zip(problem, _attempt(solver, ends.of(problem), R), strict=True):
        if isinstance(found[i], Failure) or _cost(one) < _cost(found[i]):
            found[i] = one
    return found


def _cost(one: Solution | Failure) -> float:
    return one.cost if isinstance(one, Solution) else np.inf


def starts(ends: Ends, n: int) -> tuple[NDArray[np.intp], Array]:
    """Return curves with these ends at n nodes, and the numbers of the problems they are for.

    From Bézier's control point C₁ = R0 exp(ŵ0/3) to the other one, R1 exp(−ŵ1/3), turns v: the
    shortest way and the other way round, and both with k full turns more where the legs ŵ0/3 and
    ŵ1/3 are together longer than 2k − 1 full turns. With β = 3t² − 2t³ the curve

        R = C₁ exp(β v̂) exp(η̂),    η = (t³ w1 − (1 − t)³ w0)/3,

    has the wanted ends. Moved ends give it moved, and R1, R0, −w1, −w0 give it run backwards.
    """
    first, last = (np.clip(w, -1e6, 1e6) / 3 for w in (ends.w0, ends.w1))  # fast enough to start
    ahead, back = exp_so3(np.stack([first, -last]))
    C1 = ends.R0 @ ahead
    v = log_so3(C1.mT @ ends.R1 @ back)
    along_v = v + 1e-9 * (first + last)  # a direction where v is 0
    full = 2 * np.pi * along_v / np.maximum(np.linalg.norm(along_v, axis=-1), 1e-300)[:, None]
    length = np.linalg.norm([first, last], axis=-1).sum(axis=0)
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


def lowered(R: Array) -> tuple[Array, Array]:
    """Return curves with the same ends after three steps of Gauss and Newton, and their costs.

    The acceleration of R exp(η̂) is, to first order, w' + (w × η)' + η''. Each step takes the η for
    which the integral of its square is least, of all polynomials t²(1 − t)² p(t), p of degree 7.
    """
    nodes, (bump, slope, bend) = grid(R.shape[1]), _bumps(R.shape[1])
    root = np.sqrt(nodes.integral[-1])[:, None]
    for _ in range(DESCENTS):
        w, a = _rates_at_nodes(R)
        by_eta = bump[:, None, :, None] * hat(a)[:, :, :, None]
        by_eta += slope[:, None, :, None] * hat(w)[:, :, :, None]
        by_eta += bend[:, None, :, None] * np.eye(3)[:, None]
        J = (root[..., None, None] * by_eta).reshape(len(R), 3 * len(root), 3 * BUMPS)
        x = np.linalg.solve(J.mT @ J, -(J.mT @ (root * a).reshape(len(R), 3 * len(root), 1)))
        R = R @ exp_so3(bump @ x.reshape(len(R), BUMPS, 3))
    return R, cost_at_nodes(R)


def cost_at_nodes(R: Array) -> Array:
    """Return ∫ 2 ‖w'‖² dt of curves given by R at the nodes, about."""
    return 2 * np.sum(_rates_at_nodes(R)[1] ** 2, axis=-1) @ grid(R.shape[1]).integral[-1]


def _rates_at_nodes(R: Array) -> tuple[Array, Array]:
    """Return w and w' at the nodes, from R there."""
    derivative = grid(R.shape[1]).derivative
    w = vee(R.mT @ along(derivative, R))
    return w, derivative @ w


@lru_cache
def _bumps(n: int) -> Array:
    """Return t²(1 − t)² times Chebyshev polynomials at the nodes, and two derivatives."""
    nodes = grid(n)
    bump = (nodes.t * (1 - nodes.t))[:, None] ** 2 * chebyshev(nodes.t, BUMPS)
    slope = nodes.derivative @ bump
    return np.stack([bump, slope, nodes.derivative @ slope])


def _warn_if_not_converged(curve: MinimumAcceleration) -> None:
    failed = np.argwhere(~np.asarray(curve.converged))
    if len(failed):
        warnings.warn(
            f"{len(failed)} of {len(curve.ends.w0)} problems did not converge, the first of them "
            f"{[int(i) for i in failed[0]]}: there the curve is NaN (see converged)",
            RuntimeWarning,
            stacklevel=4,
        )


def _attempt(solver: Solver, ends: Ends, R: Array) -> list[Solution | Failure]:
    """Treat singular or non-finite problems as failures, one problem at a time."""
    try:
        return solver(ends, R)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError):
        if len(R) == 1:
            return [Failure(np.inf, 0)]
    parts = [slice(i, i + 1) for i in range(len(R))]
    return [_attempt(solver, ends.of(one), R[one])[0] for one in parts]


def relax(ends: Ends, R: Array) -> list[Solution | Failure]:
    """Solve (19) for a stack by Newton's method, from rotations at nodes, shape (N, n, 3, 3).

    First on these nodes, until the steps are short; then on twice as many, and twice as many again,
    until the last Chebyshev coefficients of R have decayed.
    """
    return [one for block in blocks(len(R), _BLOCK) for one in _relax(ends.of(block), R[block])]


def _relax(ends: Ends, R: Array) -> list[Solution | Failure]:
    found: list[Solution | Failure] = [Failure(np.inf, 0)] * len(R)
    which, steps = np.arange(len(R)), np.zeros(len(R), int)
    R, c = first_guess(ends, R)
    intervals = R.shape[1] - 1
    for stride in (1, 2, 4, 8, 16):
        if not len(which):
            break
        if stride > 1:
            R = orthogonal(along(_interpolation(R.shape[1], stride * intervals + 1), R))
            R[:, 0], R[:, -1] = ends.R0, ends.R1
        now = _newton(ends, R, c, stride)
        steps += now.steps
        solved, finer = now.verdict == SOLVED, now.verdict == FINER
        for i, left, taken in zip(which, now.left.tolist(), steps.tolist(), strict=True):
            found[i] = Failure(left, taken)
        costs = exact_cost(ends.of(solved), now.R[solved], now.c[solved])
        for k, cost in zip(np.flatnonzero(solved), costs.tolist(), strict=True):
            found[which[k]] = Solution(now.R[k], now.c[k], cost, *found[which[k]])
        ends, (which, steps, R, c) = (
            ends.of(finer),
            (x[finer] for x in (which, steps, now.R, now.c)),
        )
    return found


FAILED, FINER, SOLVED = range(3)


class Iterate(NamedTuple):
    """What Newton's method makes of a stack on its nodes: solved, failed, or for finer ones."""

    R: Array
    c: Array
    left: Array
    steps: NDArray[np.intp]
    verdict: NDArray[np.intp]


def _newton(ends: Ends, R: Array, c: Array, stride: int) -> Iterate:
    """Improve R and c, no node turned by more than half a rad at once."""
    R, c, count = R.copy(), c.copy(), len(R)
    left, size = np.full((2, count), np.inf)
    steps, verdict = np.zeros((2, count), int)
    active = np.arange(count)
    for _ in range(STEPS):
        E, W = defects(ends.of(active), R[active], c[active])
        before, left[active] = left[active], np.abs(E).max(axis=(1, 2, 3))
        left[np.isnan(left)] = np.inf
        verdict[active] = (
            np.where(size[active] < ROUGH, FINER, FAILED)
            if stride == 1
            else _verdicts(R[active], left[active], before, size[active])
        )
        going = (verdict[active] == FAILED) & np.isfinite(left[active])
        if not going.any():
            break
        active, E, W = active[going], E[going], W[going]
        turn, dc = _newton_step(R[active], c[active], E, W, stride)
        size[active] = np.linalg.norm(turn, axis=-1).max(axis=1)
        share = LONGEST_STEP / np.maximum(size[active], LONGEST_STEP)
        R[active] = _turned(R[active], share[:, None, None] * turn)
        c[active] += share[:, None] * dc
        steps[active] += 1
    return Iterate(R, c, left, steps, verdict)


def _verdicts(R: Array, left: Array, before: Array, size: Array) -> NDArray[np.intp]:
    """Tell what is solved, and what wants finer nodes, after a step of that size; else FAILED.

    It is solved where the equation and the last coefficients are small; it wants finer nodes where
    the coefficients are the larger, or where rounding stops the iteration.
    """
    tail = tails(R)
    stalled = (size < 1e-6) & (left > before / 2)
    enough = stalled | (tail > EXACT) & (size < 1e3 * tail)
    return np.where((tail < EXACT) & (left < EXACT), SOLVED, np.where(enough, FINER, FAILED))


def _turned(R: Array, turn: Array) -> Array:
    """Return the rotations R turned, in the fixed frame, by Cayley's formula: 2 tan(a/2) for a."""
    H = hat(turn)
    share = 1 / (1 + np.sum(turn**2, axis=-1) / 4)
    HR = H @ R
    return R + share[..., None, None] * (HR + H @ HR / 2)


def _newton_step(R: Array, c: Array, E: Array, W: Array, stride: int) -> tuple[Array, Array]:
    """Return the turns ε of the nodes, in the fixed frame, and the change of c.

    With w'' = Rᵀc, so w = (1 − t) w0 + t w1 + G Rᵀc, the unknowns are R and c. The equation is
    R' = R ŵ in integral form; its defect is E = R0 + ∫ R ŵ − R. When ε turns R, Rᵀc changes by
    Rᵀ(ĉ ε + dc), and to first order

        ε = d + ∫ R G Rᵀ (ĉ ε + dc),    d = vee(E Rᵀ + ∫ E ŵ Rᵀ),

    with ε = 0 at the end. It is solved for ĉ ε on every `stride`-th node; the integrals smooth so
    much that the right side, worked out on all nodes, is as good as a solution on all of them.
    """
    nodes, Rt = grid(R.shape[1]), np.ascontiguousarray(R.mT)  # faster to multiply with
    defect = vee(E @ Rt + along(nodes.integral, E @ W @ Rt))
    coarse = _coarse_causes(R[:, ::stride], c, defect[:, ::stride])
    causes = along(_interpolation(coarse.shape[1], len(nodes.t)), coarse)
    causes[..., 1:] += np.eye(3)
    effects = along(nodes.integral, R @ along(nodes.twice, Rt @ causes))
    effects[..., 0] += defect
    dc = -np.linalg.solve(effects[:, -1, :, 1:], effects[:, -1, :, :1])[..., 0]
    return effects[..., 0] + (effects[..., 1:] @ dc[:, None, :, None])[..., 0], dc


def _coarse_causes(R: Array, c: Array, defect: Array) -> Array:
    """Return ĉ ε that comes from d and from each unit of dc, at the nodes, shape (N, n, 3, 4).

    Only the two components of ε across c count: a linear system for each problem, for these.
    """
    count, n = R.shape[:2]
    nodes, (across, ahead) = grid(n), _across(c)
    rows, causes = ((x[:, None] @ R).reshape(count, 2 * n, 3) for x in (across, -ahead.mT))
    between = (rows @ causes.mT) * _for_each_entry(n)
    system = along(nodes.integral, between.reshape(count, n, -1)).reshape(count, 2 * n, 2 * n)
    np.einsum("...ii->...i", system)[...] += 1
    by_c = along(nodes.integral, R @ along(nodes.twice, R.mT))
    right = across[:, None] @ np.concatenate([defect[..., None], by_c], axis=-1)
    x = np.linalg.solve(system, right.reshape(count, 2 * n, 4)).reshape(count, n, 2, 4)
    return ahead[:, None] @ x


def _across(c: Array) -> tuple[Array, Array]:
    """Return two unit vectors across c as rows, shape (N, 2, 3), and c × both as columns.

    They are rows of Householder's reflection that takes c to the third axis.
    """
    v = c.copy()
    v[:, 2] += np.copysign(np.sqrt(np.sum(c * c, axis=-1)), c[:, 2])
    square = np.sum(v * v, axis=-1)
    twice = v * (2 / np.where(square == 0, 1, square))[:, None]
    across = np.eye(2, 3) - v[:, :2, None] * twice[:, None]
    return across, hat(c) @ across.mT


@lru_cache
def _for_each_entry(n: int) -> Array:
    """Return the Kronecker product of `twice` with the 2 × 2 matrix of ones."""
    return np.kron(grid(n).twice, np.ones((2, 2)))


@lru_cache
def _interpolation(few: int, many: int) -> Array:
    """Return the matrix that goes from the values at some nodes to those at more."""
    return chebyshev(grid(many).t, few) @ grid(few).series
