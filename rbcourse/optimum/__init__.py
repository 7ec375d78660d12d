"""Curves on SO(3) with the least acceleration (BK (19)), the least torque or the least jerk.

`rbcourse.textbook.minimum_acceleration_so3` has (19) as it is printed, and `optimum.collocation`
solves it fast, as R w'' = c.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._chebyshev import along, chebyshev, grid, primitives
from rbcourse._checks import as_time
from rbcourse._numerics import Array
from rbcourse.curves.curve import Curve, Ends, retime, weighted_sums, with_inertia
from rbcourse.curves.functionals import Functional
from rbcourse.curves.projected_polynomial import ends_of_quintic
from rbcourse.optimum._collocation import EXACT, Failure, Solution, orthogonal
from rbcourse.optimum._search import LIMITS, Task, ball, body, cheapest, jerk

_FOUND = [
    ("converged", bool),
    ("nodes", int),
    ("iterations", int),
    ("cost", float),
    ("residual", float),
]


def minimum_acceleration_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    inertia: ArrayLike | None = None,
    *,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the minimum-acceleration curve with these ends, for a ball or for any body.

    Source: BK (19), BK 6.2, BK Prop. 7; beyond BK 3 (for bodies, see
    `rbcourse.curves.functionals.Effort`).

    Parameters
    ----------
    R0, R1, w0, w1, duration
        As for `projected_cubic_so3`.
    inertia : array_like, shape (..., 3, 3), optional
        G, the inertia of a body in its frame, or a metric; a symmetric, positive definite matrix.
        The default is 2 I, the metric (12).

    Returns
    -------
    Optimum
        A `Curve` that meets all four boundary conditions. Its cost, ∫ 2 ‖w'‖² dt, is the lowest
        that was found, and ``c`` is the constant R w''. With an inertia, the cost is ∫ τᵀ G⁻¹ τ dt,
        where τ = G w' + w × G w is the torque, and ``c`` is the constant R p of `Optimum.costate`.

    Raises
    ------
    ConvergenceError
        For a single problem, if Newton's method does not converge from any of its starting curves.

    Warns
    -----
    RuntimeWarning
        If Newton's method does not converge for some problems of a stack (their curves are NaN), or
        if a starting curve costs less than the returned curve. In both cases, ``converged`` is
        False for the problem.

    See Also
    --------
    rbcourse.textbook.minimum_acceleration_so3 : The equation, solved by SciPy's `solve_bvp`.
    rbcourse.textbook.shoot : The same optimum by shooting.
    corrected_bezier_so3, excess_estimate : A near-optimal formula; an estimate of the excess.

    Notes
    -----
    Singular set: none is known in closed form. Equation (19) is a necessary condition, not a
    sufficient one, and has several solutions. Costs with a relative difference below 1e-9 count as
    equal, so that rounding does not decide which curve is returned.

    The starting curves turn the short way or the long way. If ‖w0‖ + ‖w1‖ > 4π, some follow the
    motion that costs least if the rotation at t = 1 is free. For a body, the search also starts
    from the optimum of the ball and from curves that lead from one free motion to another, and it
    adds spin about the principal axes. Gauss–Newton steps lower the costs of all these curves. Then
    Newton's method solves R p = c, starting from the cheapest curves. The result is stationary, and
    `is_local_minimum` tells whether it is proven to be a local minimum. It is not proven that no
    other curve costs less, even if ``converged`` is True. For one of 300 balls with speeds of 15 to
    30 at both ends, sixteen random starts of another optimiser found a cheaper curve (by 1.2 %).
    See docs/near_optimal.md for bodies. For very thin rods, the method may not converge. If the end
    velocities are along the geodesic, the optimum is R0 exp(σ̂ p(t)), where p is a cubic and σ is a
    logarithm of R0ᵀR1 (not always the shortest logarithm).

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> ends = np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0]
    >>> minimum_acceleration_so3(*ends)([0, 1], 1).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> c = minimum_acceleration_so3(*ends, np.diag([1.0, 2.22, 3.18]))
    >>> (c(0.5) @ c.costate(0.5)).round(6) - c.c.round(6)
    array([0., 0., 0.])
    """
    given, T = Ends(R0, R1, w0, w1).over(duration)
    if inertia is None:
        return solve(ball(given), T)
    return solve(body(*with_inertia(given, inertia), of_torque=False), T)


def minimum_torque_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    inertia: ArrayLike,
    *,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the curve with these ends and the least integral of squared torque.

    Source: beyond BK 4 (see `rbcourse.curves.functionals.Effort`).

    Parameters
    ----------
    R0, R1, w0, w1, duration
        As for `projected_cubic_so3`.
    inertia
        As for `minimum_acceleration_so3`.

    Returns
    -------
    Optimum
        A `Curve` that meets all four boundary conditions. Its cost, ∫ ‖τ‖² dt with the torque τ = G
        w' + w × G w, is the lowest that was found; ``c`` is the constant R p of `Optimum.costate`.

    Notes
    -----
    The method, errors, warnings and singular set are those of `minimum_acceleration_so3`. The curve
    of a rod may not be the cheapest one, even if ``converged`` is True: for 3 of 600 rods with
    moments (1, 6 to 10, up to 1 more), angles up to π and speeds up to 9, another optimiser found
    a curve that is cheaper, by 0.5, 3.5 and 6.3 %. For thin rods, the method often does not
    converge. A turn about a principal axis is a stationary curve. A turn about the axis of the
    largest moment of inertia may be a saddle. Then a curve that leaves the axis costs less; the
    search also tries such curves. With J = R G Rᵀ and H = R G w, the equation is J H'' + H' × H =
    c; see `rbcourse.textbook.minimum_torque_so3`.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> book, rest = np.diag([1.0, 2.22, 3.18]), [0, 0, 0]
    >>> c = minimum_torque_so3(np.eye(3), exp_so3([0, 1.5, 0]), rest, rest, book)
    >>> round(c.cost, 9)  # about a principal axis 12 (2.22 · 1.5)²
    133.0668
    """
    given, T = Ends(R0, R1, w0, w1).over(duration)
    return solve(body(*with_inertia(given, inertia), of_torque=True), T)


def minimum_jerk_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    a0: ArrayLike,
    a1: ArrayLike,
    *,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the minimum-jerk curve with these ends.

    Source: beyond BK 5 (see `rbcourse.curves.functionals.Jerk`).

    Parameters
    ----------
    R0, R1, w0, w1, a0, a1, duration
        As for `projected_quintic_so3`.

    Returns
    -------
    Optimum
        A `Curve` that meets all six boundary conditions. Its cost, the integral of the squared
        covariant jerk ∫ 2 ‖w'' + ½ w × w'‖² dt, is the lowest that was found; ``c`` is the constant
        R p of `Optimum.costate`.

    Notes
    -----
    The method, errors, warnings and singular set are those of `minimum_acceleration_so3`. If all
    end velocities and accelerations are 0, the optimum is R0 exp(σ̂ (10 t³ − 15 t⁴ + 6 t⁵)). It
    follows the geodesic, and costs 1440 ‖σ‖². `exponential_quintic_so3` is near-optimal and has a
    closed form.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> rest = [0, 0, 0]
    >>> c = minimum_jerk_so3(np.eye(3), exp_so3([0, 0, 1.5]), rest, rest, rest, [0, 1, 0])
    >>> c([0, 1], 2).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    ends, a0, a1, T = ends_of_quintic(R0, R1, w0, w1, a0, a1, duration)
    return solve(jerk(ends, a0, a1), T)


def stationary_so3(guess: Curve) -> Optimum:
    """Return the stationary curve that Newton's method finds from a guess with the same ends.

    Source: BK (19).

    Parameters
    ----------
    guess : Curve
        A curve on SO(3), or a stack of curves, without NaN.

    Returns
    -------
    Optimum
        A `Curve` along which R w'' is constant. At both ends it has the rotation and the velocity
        of the guess. It may not be the cheapest such curve. If no curve is found, the result is NaN
        (see ``converged``).

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_cubic_so3
    >>> guess = projected_cubic_so3(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c = stationary_so3(guess)
    >>> bool(np.abs(c([0, 1], 1) - guess([0, 1], 1)).max() < 1e-12), c.residual < 1e-12
    (True, True)
    """
    if not isinstance(guess, Curve) or guess.size != 3 or guess.domain[0] != 0:
        raise ValueError(f"guess: a Curve on SO(3) that starts at t = 0 is wanted, got {guess!r}")
    unit = retime(guess, 1.0)
    (R0, R1), (w0, w1) = (unit([0, 1], order) for order in (0, 1))
    if not np.isfinite([w0, w1]).all():
        raise ValueError("guess: a curve is NaN, since it did not converge")
    task = ball(Ends(R0, R1, w0, w1))
    R = np.moveaxis(unit(grid(LIMITS.nodes).t).reshape(LIMITS.nodes, -1, 3, 3), 0, 1)
    with np.errstate(over="ignore", invalid="ignore"):
        found = task.solver(task.equations, R)
        return optimum_of(task.functional, task.equations.ends, found, guess.duration)


class ConvergenceError(RuntimeError):
    """The error raised if no curve is found; it gives the `residual` after `iterations` steps."""

    def __init__(self, residual: float, iterations: int) -> None:
        reason = "the end velocities may be too large, or the principal moments too different"
        if residual < EXACT:
            reason = "only a saddle was found"
        super().__init__(
            f"no convergence: residual {residual:.1e} after {iterations} iterations; {reason}"
        )
        self.residual = residual
        self.iterations = iterations

    def __reduce__(self) -> tuple[type, tuple[float, int]]:
        """Return the class and its arguments, so that pickle restores both attributes."""
        return type(self), (self.residual, self.iterations)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Optimum(Curve):
    """A `Curve` on SO(3), or a stack of curves, along which R p is constant.

    Source: beyond BK 2; BK (19). By (19), R w'' is constant, since (R w'')' = R (w''' + w × w'').

    Attributes
    ----------
    functional : Functional
        The functional that defines the cost and p.
    converged : bool, or ndarray of bool, shape (...)
        True if a solution was found and no curve that was tried costs less. The solution is
        stationary, but another curve may cost less; the functions that return optima tell for
        which problems this was tested. If no solution was found, the curve, `c` and the cost are
        NaN.
    c : ndarray, shape (..., 3)
        The constant R p in the fixed frame. Without an inertia, p is w''; with the inertia
        2 I, p is 2 w''.
    cost, residual : float or ndarray, shape (...)
        The `acceleration_cost`, `torque_cost` or `jerk_cost`. The residual is the largest error of
        the equations R0 + ∫ R ŵ dt = R(t) and R p = c at the nodes, for times from 0 to 1.
    iterations, nodes : int or ndarray of int, shape (...)
        The number of steps of the solver, and the number of nodes that represent the curve.
    """

    functional: Functional
    series: Array  # Chebyshev coefficients of R, w, w', …, with a column for each entry
    constant: Array  # c for times from 0 to 1
    found: NDArray[np.void]  # the report of each problem, with the fields of `_FOUND`

    @property
    def c(self) -> Array:
        """The constant R p in the fixed frame."""
        return self.constant / self.duration[..., None] ** (self.functional.ends + 1)

    @property
    def cost(self) -> Any:
        """The cost that the optimum minimises."""
        return self._told(self.found["cost"] / self.duration ** (self.functional.ends + 1))

    @property
    def converged(self) -> Any:
        """True if a solution was found and no curve that was tried costs less."""
        return self._told(self.found["converged"])

    @property
    def residual(self) -> Any:
        """The largest error of the equations."""
        return self._told(self.found["residual"])

    @property
    def iterations(self) -> Any:
        """The number of steps of the solver."""
        return self._told(self.found["iterations"])

    @property
    def nodes(self) -> Any:
        """The number of nodes that represent the curve."""
        return self._told(self.found["nodes"])

    def _told(self, values: NDArray[Any]) -> Any:
        return values if self.batch_shape else values.item()

    def take(self, index: Any) -> Self:
        """Return the curves that have these indices in the flattened stack."""
        functional = self.functional.take(np.reshape(index, -1))
        return replace(super().take(index), functional=functional)

    def values(self, t: Array, order: int) -> Array:
        """Return R or a derivative at the times t; R is orthogonal up to rounding."""
        columns = slice(9) if order == 0 else slice(6 + 3 * order, 9 + 3 * order)
        terms = self.series[..., columns]
        weights = chebyshev(t, terms.shape[1])
        if order:
            return weighted_sums(weights, terms, 3)
        return orthogonal(weighted_sums(weights, terms, 3, 3))

    def costate(self, t: ArrayLike) -> Array:
        """Return p in the body frame at times of any shape.

        The result has the shape t.shape + (..., 3), and R p is the constant `c`.
        """
        times = as_time(t, 0, self.domain)
        orders = range(1, self.functional.ends + 2)
        rates = [self.evaluate(times.reshape(-1, 1), order).swapaxes(0, 1) for order in orders]
        p = np.reshape(self.functional.unit, (-1, 1, 1)) * self.functional.p(*rates)
        return p.swapaxes(0, 1).reshape(*times.shape, *self.batch_shape, 3)

    def _what(self) -> str:
        return self.functional.name

    def __repr__(self) -> str:
        cost = "" if self.batch_shape else f", cost {self.cost:.6g}"
        return f"{super().__repr__()[:-1]}{cost}, residual {np.max(self.residual, initial=0):.1e}>"


def solve(task: Task, duration: Array) -> Optimum:
    """Return the cheapest curve found for each problem; see `minimum_acceleration_so3`."""
    solutions = cheapest(task)
    if not task.batch and isinstance(solutions[0], Failure):
        raise ConvergenceError(*solutions[0])
    T = np.broadcast_to(duration, task.batch)
    curve = optimum_of(task.functional, task.equations.ends, solutions, T)
    _warn_if_not_converged(curve)
    return curve


def optimum_of(
    functional: Functional,
    ends: Array,
    solutions: Sequence[Solution | Failure],
    duration: Array,
) -> Optimum:
    """Return the solutions as a stack of curves; its batch shape is the shape of the durations."""
    batch = duration.shape
    found, c = np.zeros(len(solutions), _FOUND), np.full((len(solutions), 3), np.nan)
    for i, one in enumerate(solutions):
        found[i] = False, 0, one.iterations, np.nan, one.residual
        if isinstance(one, Solution):
            c[i] = one.c
            found[i] = not one.beaten, len(one.R), one.iterations, one.cost, one.residual
    found["cost"] *= functional.scale
    c *= np.reshape(functional.unit, (-1, 1))
    series = _series(ends, solutions, found["nodes"])
    return Optimum(
        duration=duration,
        functional=functional,
        series=series.reshape(*batch, *series.shape[1:]),
        constant=c.reshape(*batch, 3),
        found=found.reshape(batch),
    )


def _series(ends: Array, solutions: Sequence[Solution | Failure], nodes: Array) -> Array:
    """Return the Chebyshev series of R, w, w', …, shape (count, n, 9 + 3 + …).

    Series of fewer nodes are padded with zeros. Series of problems without a solution are NaN.
    """
    m = ends.shape[1]
    series = np.zeros((len(nodes), nodes.max(initial=1) + m, 12 + 3 * m))
    for n in np.unique(nodes[nodes > 0]):
        index = np.flatnonzero(nodes == n)
        R, k = (np.stack([solutions[i][part] for i in index.tolist()]) for part in (0, 1))
        by = primitives(n, m)
        series[index, :n, :9] = along(grid(n).series, R).reshape(len(index), n, 9)
        for order, (E, K) in enumerate(zip(by.series_from_ends, by.series_from_k, strict=True)):
            series[index, : len(E), 9 + 3 * order : 12 + 3 * order] = E @ ends[index] + K @ k
    series[nodes == 0] = np.nan
    return series


def _warn_if_not_converged(curve: Optimum) -> None:
    lost = np.isnan(curve.cost)
    _warn(curve, lost, "did not converge", "their curves are NaN")
    beaten = ~np.asarray(curve.converged) & ~lost
    _warn(curve, beaten, "may not have reached their optimum", "a curve that was tried costs less")


def _warn(curve: Optimum, some: Array, what: str, why: str) -> None:
    places = np.argwhere(some)
    if len(places):
        first = [int(i) for i in places[0]]
        warnings.warn(
            f"{len(places)} of {curve.count} problems {what}, the first of them {first}: {why} "
            "(see converged)",
            RuntimeWarning,
            stacklevel=5,
        )
