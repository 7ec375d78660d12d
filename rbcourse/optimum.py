"""What both solvers of BK (19) share: the curve they return, and the way to hard problems."""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebint, chebvander
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_single
from rbcourse.curves import Curve, geodesic_so3
from rbcourse.polynomials import cubic_coefficients, polynomial
from rbcourse.projected import ProjectedPolynomial
from rbcourse.projection import project_so
from rbcourse.so3 import BASIS_SO3, exp_so3, hat_so3, right_jacobian_inverse_so3


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
    """Boundary conditions: rotations and body angular velocities at t = 0 and 1."""

    R0: Array
    R1: Array
    w0: Array
    w1: Array


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


@lru_cache
def grid(n: int) -> Grid:
    """Return the grid of n nodes."""
    x = -np.cos(np.pi * np.arange(n) / (n - 1))
    t = (x + 1) / 2
    series = np.linalg.inv(chebvander(x, n - 1))
    once, again = (chebint(series, m, lbnd=-1, scl=0.5) for m in (1, 2))
    derivative, integral, double = (
        chebvander(x, len(c) - 1) @ c for c in (chebder(series, scl=2), once, again)
    )
    blend, twice = np.stack([1 - t, t], axis=-1), double - np.outer(t, double[-1])
    return Grid(t, blend, derivative, integral, twice, series, once, again)


def along(matrix: Array, values: Array) -> Array:
    """Return a matrix of a `Grid` applied to values at the nodes, of any shape (n, ...)."""
    return (matrix @ values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])


def hats(w: Array) -> Array:
    """Return `hat_so3` of (n, 3), unchecked."""
    return (w @ BASIS_SO3.reshape(3, 9)).reshape(-1, 3, 3)


def vees(W: Array) -> Array:
    """Return `vee_so3` of (n, 3, 3), unchecked."""
    return W.reshape(-1, 9) @ BASIS_SO3.reshape(3, 9).T / 2


class MinimumAcceleration(Curve):
    """A `Curve` on SO(3) that solves (19), as Chebyshev series.

    Attributes
    ----------
    ends : Ends
        R0, R1, w0, w1.
    c : ndarray, shape (3,)
        R w'', which does not depend on t: the angular jerk in the fixed frame.
    residual : float
        The largest entry of R0 + ∫ R ŵ dt − R(t) at the nodes, w from R w'' = c and the ends.
    iterations : int
        How many steps the solver took at the end.
    nodes : int
        How many nodes carry it.

    References
    ----------
    BK (19). It says that R w'' is constant: (R w'')' = R (w''' + w × w'').
    """

    batch_shape = ()

    def __init__(self, ends: Ends, R: Array, c: Array, iterations: int) -> None:
        self.ends, self.c, self.iterations, self.nodes = ends, c, iterations, len(R)
        self._R = R
        nodes, jerk = grid(self.nodes), np.swapaxes(R, -1, -2) @ c
        self._tail = np.abs(nodes.series[-2:] @ R.reshape(-1, 9)).max()
        off = ends.R0 + along(nodes.integral, R @ hats(velocity(ends, jerk))) - R
        self.residual = float(np.abs(off).max())

    @property
    def cost(self) -> float:
        """The integral of 2 ‖w'‖², BK (18), by the rule of the nodes."""
        nodes, (_, _, series) = grid(self.nodes), self._series
        rates = chebvander(2 * nodes.t - 1, len(series) - 1) @ series
        return float(2 * nodes.integral[-1] @ np.sum(rates**2, axis=-1))

    @property
    def resolved(self) -> bool:
        """Whether the nodes carry the curve, to rounding."""
        return bool(self._tail < 1e-13 and self.residual < 1e-11)

    @cached_property
    def _series(self) -> tuple[Array, Array, Array]:
        """The Chebyshev series of R, of w and of w'."""
        jerk = np.swapaxes(self._R, -1, -2) @ self.c
        return along(grid(self.nodes).series, self._R), *_rates(self.ends, jerk)

    def _evaluate(self, t: Array, order: int) -> Array:
        series = self._series[order]
        value = chebvander(2 * t - 1, len(series) - 1) @ series.reshape(len(series), -1)
        if order:
            return value.reshape(*t.shape, 3)
        R = value.reshape(*t.shape, 3, 3)
        return R @ (3 * np.eye(3) - np.swapaxes(R, -1, -2) @ R) / 2  # rounding, made orthogonal


def velocity(ends: Ends, jerk: Array) -> Array:
    """Return w at the nodes, from w'' there and w at the ends."""
    nodes = grid(len(jerk))
    return nodes.blend @ np.array([ends.w0, ends.w1]) + nodes.twice @ jerk


def _rates(ends: Ends, jerk: Array) -> tuple[Array, Array]:
    """Return the series of w and w', from w'' at the nodes and w at the ends."""
    nodes = grid(len(jerk))
    w, acceleration = nodes.again @ jerk, nodes.once @ jerk
    slope = ends.w1 - ends.w0 - w.sum(axis=0)
    acceleration[0] += slope
    w[:2] += slope / 2
    w[0] += ends.w0
    return w, acceleration


Guess = Callable[[Array], Array]
"""Rotations over time; a `Curve` is one."""


def first_guess(ends: Ends, guess: Guess, n: int) -> tuple[Array, Array]:
    """Return R of a guess at n nodes, and the c for which w'' = Rᵀc gives w most nearly."""
    nodes = grid(n)
    R = guess(nodes.t)
    R[0], R[-1] = ends.R0, ends.R1
    Rt = np.swapaxes(R, -1, -2)
    w = vees(Rt @ along(nodes.derivative, R))
    lacking = w - velocity(ends, np.zeros_like(w))
    effect = along(nodes.twice, Rt)
    return R, np.linalg.lstsq(effect.reshape(-1, 3), lacking.ravel())[0]


Solver = Callable[[Ends, Guess], MinimumAcceleration]


def solve(
    solver: Solver, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Solve from the projected cubic; if that fails, by continuation.

    Where the projected cubic may jump, a cubic in exponential coordinates is tried too.

    Raises
    ------
    ValueError
        If an argument is not finite or not of its shape.
    ConvergenceError
        If both fail.
    """
    ends = Ends(
        project_so(as_single("R0", R0, 3, 3)),
        project_so(as_single("R1", R1, 3, 3)),
        as_single("w0", w0, 3),
        as_single("w1", w1, 3),
    )
    cubic = _projected_cubic(ends)
    try:
        curve = _attempt(solver, ends, cubic)
    except ConvergenceError:
        return _continue(solver, ends)
    if not cubic.may_jump():
        return curve
    with suppress(ConvergenceError):  # a guess that jumps may have led to a turn too many
        other = _attempt(solver, ends, _exponential_cubic(ends))
        curve = min(curve, other, key=lambda found: found.cost)
    return curve


def _attempt(solver: Solver, ends: Ends, guess: Guess) -> MinimumAcceleration:
    """Count an overflow, what comes of it, and a singular system as no convergence."""
    try:
        with np.errstate(over="raise", invalid="raise"):
            return solver(ends, guess)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError) as error:
        raise ConvergenceError(np.inf, 0) from error


class _ProjectedCubic(ProjectedPolynomial):
    """The projected cubic as a guess: where the nearest rotation is not unique, any one."""

    def _evaluate(self, t: Array, order: int) -> Array:
        return project_so(self._ambient(t, order))


def _projected_cubic(ends: Ends) -> _ProjectedCubic:
    V0, V1 = ends.R0 @ hat_so3(ends.w0), ends.R1 @ hat_so3(ends.w1)
    return _ProjectedCubic(cubic_coefficients(ends.R0, ends.R1, V0, V1))


def _exponential_cubic(ends: Ends) -> Guess:
    """Return R0 exp(σ(t)), with σ the cubic of these ends."""
    turn = geodesic_so3(ends.R0, ends.R1).rotation_vector
    end_rate = right_jacobian_inverse_so3(turn) @ ends.w1
    coefficients = cubic_coefficients(np.zeros(3), turn, ends.w0, end_rate)
    return lambda t: ends.R0 @ exp_so3(polynomial(coefficients, t[:, None]))


def _continue(solver: Solver, ends: Ends) -> MinimumAcceleration:
    """Change the end velocities from those of the geodesic to the wanted ones, step by step."""
    geodesic = geodesic_so3(ends.R0, ends.R1)
    guess: Guess = geodesic
    start = geodesic.rotation_vector
    done, step = 0.0, 0.25
    while True:
        share = min(done + step, 1.0)
        w0, w1 = (start + share * (w - start) for w in (ends.w0, ends.w1))
        try:
            curve = _attempt(solver, Ends(ends.R0, ends.R1, w0, w1), guess)
        except ConvergenceError:
            step /= 2
            if step < 1 / 256:
                raise
        else:
            if share == 1:
                return curve
            guess, done, step = curve, share, 2 * step
