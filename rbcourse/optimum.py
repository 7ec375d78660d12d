"""What both solvers of BK (19) share: the curve they return, and the way to hard problems."""

import warnings
from collections.abc import Callable
from functools import cache, cached_property, lru_cache
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import Array, as_finite, check_broadcast
from rbcourse.curves import Chosen, Curve, runs
from rbcourse.projection import nearest
from rbcourse.quaternion_curves import other_way
from rbcourse.so3 import BASIS_SO3, exp_so3, log_so3


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
            "the end velocities may be too large, or the rotations a half-turn apart"
        )
        self.residual = residual
        self.iterations = iterations


class Ends(NamedTuple):
    """Boundary conditions of N problems: rotations and body angular velocities at t = 0 and 1."""

    R0: Array
    R1: Array
    w0: Array
    w1: Array

    def of(self, which: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Ends":
        """Return some of the problems."""
        return Ends(*(array[which] for array in self))


class Solution(NamedTuple):
    """One problem solved: R at the nodes, c = R w'', what was left, and after how many steps."""

    R: Array
    c: Array
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
    count, n = values.shape[:2]
    return (matrix @ values.reshape(count, n, -1)).reshape(count, -1, *values.shape[2:])


def hats(w: Array) -> Array:
    """Return `hat_so3` of (..., 3), unchecked."""
    return (w @ BASIS_SO3.reshape(3, 9)).reshape(*w.shape, 3)


def vees(W: Array) -> Array:
    """Return `vee_so3` of (..., 3, 3), unchecked."""
    return W.reshape(*W.shape[:-2], 9) @ (BASIS_SO3.reshape(3, 9).T / 2)


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
        R0, R1, w0, w1, with one batch axis: one entry for each problem, in their order.
    converged : bool, or ndarray of bool, shape (...)
        Where a solution was found. Elsewhere the curve, `c` and the cost are NaN.
    c : ndarray, shape (..., 3)
        R w'', which does not depend on t: the angular jerk in the fixed frame.
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
        residual = np.array([s.residual for s in solutions], float)
        iterations = np.array([s.iterations for s in solutions], int)
        self.c = c.reshape(*batch_shape, 3)
        self.converged, self.nodes, self.residual, self.iterations = (
            x.reshape(batch_shape) if batch_shape else x.item()
            for x in (nodes > 0, nodes, residual, iterations)
        )

    @property
    def cost(self) -> float | Array:
        """The integral of 2 ‖w'‖², BK (18), by the rule of the nodes; shape (...)."""
        cost = np.full(len(self.ends.w0), np.nan)
        for (index, R), (_, series) in zip(self._parts, self._velocities, strict=True):
            nodes = grid(R.shape[1])
            rates = chebyshev(nodes.t, series.shape[1]) @ series
            cost[index] = 2 * np.sum(rates**2, axis=-1) @ nodes.integral[-1]
        return cost.reshape(self.batch_shape) if self.batch_shape else cost.item()

    @cached_property
    def _rotations(self) -> list[Array]:
        """The Chebyshev series of R, for each number of nodes."""
        return [along(grid(R.shape[1]).series, R) for _, R in self._parts]

    @cached_property
    def _velocities(self) -> list[tuple[Array, Array]]:
        """The Chebyshev series of w and of w', for each number of nodes."""
        c = self.c.reshape(-1, 3)
        return [_rates(self.ends.of(i), in_body(R, c[i])) for i, R in self._parts]

    def _pick(self, chosen: Chosen) -> Self:
        numbers = chosen.reshape(-1)
        solutions = [self._solutions[i] for i in numbers]
        return type(self)(self.ends.of(numbers), solutions, chosen.shape)

    @cached_property
    def _places(self) -> dict[int, tuple[int, int]]:
        """For each problem that is solved the number of its part, and its place there."""
        indices = enumerate(index for index, _ in self._parts)
        return {int(i): (part, place) for part, index in indices for place, i in enumerate(index)}

    def _series(self, order: int) -> list[Array]:
        """Return the Chebyshev series of R, w or w', for each number of nodes."""
        return [part[order - 1] for part in self._velocities] if order else self._rotations

    def _write_each(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        parts = self._series(order)
        out[...] = np.nan
        for curve, run in runs(which):
            if curve in self._places:
                part, place = self._places[curve]
                series = parts[part][place]
                value = chebyshev(t[run], len(series)) @ series.reshape(len(series), -1)
                out[run] = value.reshape(-1, *out.shape[1:])
        if order == 0:
            out[...] = orthogonal(out)

    def _evaluate(self, t: Array, order: int) -> Array:
        core = (3,) if order else (3, 3)
        times = t.reshape(-1)
        values = np.full((len(times), len(self.ends.w0), *core), np.nan)
        for (index, _), part in zip(self._parts, self._series(order), strict=True):
            series = part.swapaxes(0, 1)
            value = chebyshev(times, len(series)) @ series.reshape(len(series), -1)
            values[:, index] = value.reshape(len(times), len(index), *core)
        time_shape = t.shape[: t.ndim - len(self.batch_shape)]
        values = values.reshape(*time_shape, *self.batch_shape, *core)
        return values if order else orthogonal(values)


def velocity(ends: Ends, jerk: Array) -> Array:
    """Return w at the nodes, from w'' there and w at the ends."""
    nodes = grid(jerk.shape[1])
    return nodes.blend @ np.stack([ends.w0, ends.w1], axis=1) + nodes.twice @ jerk


def defects(ends: Ends, R: Array, c: Array) -> tuple[Array, Array]:
    """Return E = R0 + ∫ R ŵ − R at the nodes, with R w'' = c, and ŵ."""
    W = hats(velocity(ends, in_body(R, c)))
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


CLOSE = 2.0  # with legs whose costs are within this factor both ways round are tried
COARSE = 17  # nodes, on which guesses are made and systems solved

Guess = Callable[[int], Array]
"""Rotations at the nodes, when told how many: shape (N, n, 3, 3)."""


def from_curve(curve: Callable[[Array], Array]) -> Guess:
    """Return a guess: a stack of curves at the nodes, kept for the next time."""
    return cache(lambda n: np.moveaxis(curve(grid(n).t), 0, 1))


def first_guess(ends: Ends, R: Array) -> tuple[Array, Array]:
    """Return R of a guess with the right ends, and c for which w'' = Rᵀc gives w most nearly."""
    nodes, R = grid(R.shape[1]), R.copy()
    R[:, 0], R[:, -1] = ends.R0, ends.R1
    w = vees(R.mT @ along(nodes.derivative, R))
    lacking = (w - velocity(ends, np.zeros_like(w))).reshape(len(R), -1, 1)
    effect = along(nodes.twice, R.mT).reshape(len(R), -1, 3)
    return R, np.linalg.solve(effect.mT @ effect, effect.mT @ lacking)[..., 0]


Solver = Callable[[Ends, Guess], list[Solution | Failure]]


def solve(
    solver: Solver, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Solve from a cumulative Bézier curve, its middle leg turned the short way or the other.

    The cheaper of the two is as a rule next to the cheaper optimum. Where the costs of both, worked
    out from the legs as for a curve in space, are within a factor of `CLOSE`, or nothing is found,
    both are tried.

    Raises
    ------
    ValueError
        If an argument is not finite or not of its shape, or the batches do not broadcast.
    ConvergenceError
        If both fail, for a single problem.

    Warns
    -----
    RuntimeWarning
        If both fail, for some of a stack.
    """
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    batch = check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1))
    rotations = (np.broadcast_to(nearest(R)[0], (*batch, 3, 3)).reshape(-1, 3, 3) for R in (R0, R1))
    velocities = (np.broadcast_to(w, (*batch, 3)).reshape(-1, 3) for w in (w0, w1))
    ends = Ends(*rotations, *velocities)
    with np.errstate(over="ignore", invalid="ignore"):
        solutions = _solutions(solver, ends)
    if not batch and isinstance(solutions[0], Failure):
        raise ConvergenceError(*solutions[0])
    curve = MinimumAcceleration(ends, solutions, batch)
    _warn_if_not_converged(curve)
    return curve


def _solutions(solver: Solver, ends: Ends) -> list[Solution | Failure]:
    legs = _legs(ends)
    bends = legs[:, 1:] - legs[:, :-1]
    costs = np.sum(bends**2, axis=(1, 3)) + np.sum(bends[:, 0] * bends[:, 1], axis=-1)
    cheaper = costs.argmin(axis=0)

    def attempt(which: NDArray[np.intp], way: NDArray[np.intp]) -> list[Solution | Failure]:
        part = ends.of(which)
        return _attempt(solver, part, from_curve(_bezier(part.R0, legs[way[which], :, which])))

    found = attempt(np.arange(len(cheaper)), cheaper)
    failed = np.array([isinstance(solution, Failure) for solution in found], bool)
    doubtful = np.flatnonzero((costs.max(axis=0) < CLOSE * costs.min(axis=0)) | failed)
    if doubtful.size:
        others, part = attempt(doubtful, 1 - cheaper), ends.of(doubtful)
        better = _costs(part, others) < _costs(part, [found[i] for i in doubtful])
        for k in np.flatnonzero(better):
            found[doubtful[k]] = others[k]
    return found


def _legs(ends: Ends) -> Array:
    """Return the turns between Bézier's control points, shape (2, 3, N, 3): both ways round.

    Here and in `_bezier` in matrices: quicker for a single problem.
    """
    first, last = (np.clip(w, -1e6, 1e6) / 3 for w in (ends.w0, ends.w1))  # fast enough to start
    back, ahead = exp_so3(np.stack([-first, -last]))
    middle = log_so3(back @ ends.R0.mT @ ends.R1 @ ahead)
    return np.stack([[first, middle, last], [first, other_way(middle), last]])


def _bezier(R0: Array, legs: Array) -> Callable[[Array], Array]:
    """Return the curves of `cumulative_bezier_so3` with these legs, shape (N, 3, 3)."""

    def curve(t: Array) -> Array:
        shares = np.stack([1 - (1 - t) ** 3, t * t * (3 - 2 * t), t**3])
        first, second, third = exp_so3(shares[..., None, None] * legs.swapaxes(0, 1)[:, None])
        return R0 @ first @ second @ third

    return curve


def _costs(ends: Ends, solutions: list[Solution | Failure]) -> Array:
    costs = MinimumAcceleration(ends, solutions, (len(solutions),)).cost
    return np.where(np.isnan(costs), np.inf, costs)


def _warn_if_not_converged(curve: MinimumAcceleration) -> None:
    failed = np.argwhere(~np.asarray(curve.converged))
    if len(failed):
        warnings.warn(
            f"{len(failed)} of {len(curve.ends.w0)} problems did not converge, the first of them "
            f"{[int(i) for i in failed[0]]}: there the curve is NaN (see converged)",
            RuntimeWarning,
            stacklevel=4,
        )


def _attempt(solver: Solver, ends: Ends, guess: Guess) -> list[Solution | Failure]:
    """Count what is singular or no number any more as not solved; in a stack, one by one."""
    try:
        return solver(ends, guess)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError):
        if len(ends.w0) == 1:
            return [Failure(np.inf, 0)]
    parts = [slice(i, i + 1) for i in range(len(ends.w0))]
    return [_attempt(solver, ends.of(one), _part(guess, one))[0] for one in parts]


def _part(guess: Guess, which: slice) -> Guess:
    return lambda n: guess(n)[which]
