"""The optima on SO(3): least acceleration, BK (19), of balls and real bodies; torque; jerk."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_time
from rbcourse._numerics import Array
from rbcourse.curves import Curve, Ends, retime, weighted_sums, with_inertia
from rbcourse.optimum.chebyshev import along, chebyshev, grid, primitives
from rbcourse.optimum.collocation import Failure, Solution, orthogonal
from rbcourse.optimum.functionals import Functional
from rbcourse.optimum.search import LIMITS, Task, ball, body, cheapest, jerk
from rbcourse.projected_cubic import ends_of_quintic

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
    """Return the minimum-acceleration curve with these ends, of a ball or of any body.

    Source: BK (19), BK 6.2, BK Prop. 7; for bodies beyond BK 3 (see
    `rbcourse.optimum.functionals.Effort`).

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    inertia : array_like, shape (..., 3, 3), optional
        G, the metric or the inertia of a body, body frame: symmetric and positive definite. By
        default 2 I, the metric (12).
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all four ends, with the least ∫ 2 ‖w'‖² dt that
        was found, and w''' + w × w'' = 0; with an inertia, the least ∫ τᵀ G⁻¹ τ dt with the torque
        τ = G w' + w × G w. Its ``converged``, ``residual``, ``iterations`` and ``nodes`` tell how
        it was found; ``c`` is the constant R w'', with an inertia the constant R p of `costate`.

    Raises
    ------
    ConvergenceError
        For a single problem, if Newton's method converges from none of its starts.

    Warns
    -----
    RuntimeWarning
        For a stack, if that happens to some: there the curve is NaN and ``converged`` False. Also
        if a start costs less than the curve that is returned: there ``converged`` is False, too.

    See Also
    --------
    rbcourse.textbook.minimum_acceleration_so3 : The equation, and SciPy's `solve_bvp`.
    shoot_minimum_acceleration_so3 : The same by shooting.
    minimum_torque_so3, minimum_jerk_so3 : Least torque, and least jerk.
    projected_cubic_so3, weighted_cubic_so3 : Near-optimal stand-ins, in closed form.
    acceleration_cost : What they cost.

    Notes
    -----
    Singular set: none is known in closed form. (19) is necessary, not sufficient, and has several
    solutions: a turn by σ and one by σ ± 2π reach the same rotation. Of curves whose costs differ
    by less than 1e-9, as a share, the arguments decide which one is returned, not their rounding.

    There is a start for each way round, and more of them, with full turns more, where
    ‖w0‖ + ‖w1‖ > 6π. A body is also started from the optimum of the ball and from two curves that
    lead from a free motion into another, and full turns about its principal axes are added to
    these. Steps of Gauss and Newton lower the cost of each. Newton's method for R p = c then goes
    on from the cheapest and from those that cost up to a tenth more; if the result costs more than
    a start, or ‖w0‖ + ‖w1‖ > 24, from all of them, on more nodes. The cheapest curve that it finds
    is returned. It is stationary. That none costs less is not proven; docs/near_optimal.md tells on
    which random problems it was tried: for balls with ‖w0‖, ‖w1‖ < 12 no cheaper curve was found,
    for bodies one in 500 problems. Problems of very thin rods may not converge.

    End velocities along the geodesic give R0 exp(σ̂ p(t)), with p a cubic and σ a logarithm of
    R0ᵀR1, the shortest or one with full turns more or the other way round; about a principal axis
    of a body these curves are stationary, too. Where the free motion of a body meets the ends, it
    costs nothing.

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
    >>> book = np.diag([1.0, 2.22, 3.18])
    >>> c = minimum_acceleration_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0], book)
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
    """Return the curve with these ends that takes a body there with the least squared torque.

    Source: beyond BK 4 (see `rbcourse.optimum.functionals.Effort`).

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    inertia : array_like, shape (..., 3, 3)
        G, body frame: symmetric and positive definite.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all four ends, with the least ∫ ‖τ‖² dt that was
        found, where τ = G w' + w × G w is the torque. Its ``c`` is the constant R p of `costate`.

    Raises
    ------
    ConvergenceError
        As `minimum_acceleration_so3`.

    Warns
    -----
    RuntimeWarning
        As `minimum_acceleration_so3`.

    See Also
    --------
    rbcourse.textbook.minimum_torque_so3 : The equation, and SciPy's `solve_bvp`.
    minimum_acceleration_so3 : The least of ∫ τᵀ G⁻¹ τ dt, the covariant acceleration.
    torque_cost : What curves cost.

    Notes
    -----
    The curve is found as that of `minimum_acceleration_so3`, and is stationary; problems of thin
    rods often do not converge (see docs/near_optimal.md).

    A turn about one axis is stationary about each principal axis; about that of the largest moment
    it may be a saddle: a curve that leaves the axis can cost a fifth less. Curves bent aside are
    tried where the solution turns about one axis, nearly.

    In the fixed frame, with J = R G Rᵀ and H = R G w, so that H' is the torque, the equation is
    J H'' + H' × H = c.

    Examples
    --------
    >>> from rbcourse import exp_so3, torque_cost
    >>> book, rest = np.diag([1.0, 2.22, 3.18]), [0, 0, 0]
    >>> c = minimum_torque_so3(np.eye(3), exp_so3([0, 1.5, 0]), rest, rest, book)
    >>> float(torque_cost(c, book).round(9))  # about a principal axis 12 (2.22 · 1.5)²
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

    Source: beyond BK 5 (see `rbcourse.optimum.functionals.Jerk`).

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        The boundary conditions, see `Ends`.
    a0, a1 : array_like, shape (..., 3)
        Angular accelerations w' there, body frame, in rad per unit time squared.
    duration : array_like, shape (...), optional
        How long it takes; velocities are per unit of that time.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all six ends, with the least
        ∫ 2 ‖w'' + ½ w × w'‖² dt that was found: the squared covariant jerk in the metric (12). Its
        ``c`` is the constant R p of `costate`.

    Raises
    ------
    ConvergenceError
        As `minimum_acceleration_so3`.

    Warns
    -----
    RuntimeWarning
        As `minimum_acceleration_so3`.

    See Also
    --------
    exponential_quintic_so3 : Its near-optimal stand-in, in closed form.
    jerk_cost : What curves cost.

    Notes
    -----
    The curve is found as that of `minimum_acceleration_so3`, and is stationary (see
    docs/near_optimal.md). About one axis it is the cheapest of the quintics to σ with any number of
    full turns.

    From rest to rest without acceleration it is the geodesic, R0 exp(σ̂ (10 t³ − 15 t⁴ + 6 t⁵)), and
    costs 1440 ‖σ‖².

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
    """Return the stationary curve that Newton's method finds from a curve with the same ends.

    Source: BK (19).

    Parameters
    ----------
    guess : Curve
        On SO(3), or a stack of them.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, with the rotations and the velocities of the guess at both
        ends, and R w'' constant, as for the least ∫ 2 ‖w'‖² dt. It need not be the cheapest; NaN
        where nothing is found (see ``converged``).

    Raises
    ------
    ValueError
        If `guess` is no such curve, or is NaN at a time.

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_cubic_so3
    >>> guess = projected_cubic_so3(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c = stationary_so3(guess)
    >>> bool(np.abs(c([0, 1], 1) - guess([0, 1], 1)).max() < 1e-12), c.residual < 1e-12
    (True, True)
    """
    if not isinstance(guess, Curve) or guess.size != 3 or guess.domain[0] != 0:
        raise ValueError(f"guess: a Curve on SO(3) from t = 0 on is wanted, got {guess!r}")
    unit = retime(guess, 1.0)
    (R0, R1), (w0, w1) = (unit([0, 1], order) for order in (0, 1))
    if not np.isfinite([w0, w1]).all():
        raise ValueError("guess: a curve is NaN, it did not converge")
    task = ball(Ends(R0, R1, w0, w1))
    R = np.moveaxis(unit(grid(LIMITS.nodes).t).reshape(LIMITS.nodes, -1, 3, 3), 0, 1)
    with np.errstate(over="ignore", invalid="ignore"):
        return _optimum(task, task.solver(task.equations, R), guess.duration)


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
            "the ends may be too fast, or the inertia too uneven"
        )
        self.residual = residual
        self.iterations = iterations

    def __reduce__(self) -> tuple[type, tuple[float, int]]:
        """Return how to make it again; its only argument would be the message."""
        return type(self), (self.residual, self.iterations)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Optimum(Curve):
    """A `Curve` on SO(3), or a stack of them, along which R p is constant; as Chebyshev series.

    Source: beyond BK 2; BK (19), which says that R w'' is constant: (R w'')' = R (w''' + w × w'').

    Attributes
    ----------
    functional : Functional
        What is least, and p.
    converged : bool, or ndarray of bool, shape (...)
        Where a solution was found, and no curve that was tried costs less. Where none was found
        the curve, `c` and the cost are NaN.
    c : ndarray, shape (..., 3)
        R p, which does not depend on t, in the fixed frame. Without an inertia p is w'': half of
        what it is with ``inertia=2 * np.eye(3)``.
    cost : float or ndarray, shape (...)
        What is least: as `acceleration_cost`, `torque_cost` or `jerk_cost` of the curve.
    residual : float or ndarray, shape (...)
        The largest error of the equations R0 + ∫ R ŵ dt = R(t) and R p = c at the nodes, for the
        time from 0 to 1.
    iterations, nodes : int or ndarray of int, shape (...)
        How many steps the solver took, and how many nodes carry the curve.
    """

    functional: Functional
    series: Array  # of the entries of R, w, w', …, in columns; shape (..., most nodes, columns)
    constant: Array  # c for the time from 0 to 1
    found: NDArray[np.void]  # the report of each problem, with the fields of `_FOUND`

    @property
    def c(self) -> Array:
        """R p, in the fixed frame."""
        return self.constant / self.duration[..., None] ** (self.functional.ends + 1)

    @property
    def cost(self) -> Any:
        """What is least."""
        return self._told(self.found["cost"] / self.duration ** (self.functional.ends + 1))

    @property
    def converged(self) -> Any:
        """Where a solution was found, and no curve that was tried costs less."""
        return self._told(self.found["converged"])

    @property
    def residual(self) -> Any:
        """The largest error of the equations."""
        return self._told(self.found["residual"])

    @property
    def iterations(self) -> Any:
        """How many steps the solver took."""
        return self._told(self.found["iterations"])

    @property
    def nodes(self) -> Any:
        """How many nodes carry the curve."""
        return self._told(self.found["nodes"])

    def _told(self, values: NDArray[Any]) -> Any:
        return values if self.batch_shape else values.item()

    def take(self, index: Any) -> Self:
        """Return the stack of the curves with these numbers, which count through the stack."""
        functional = self.functional.take(np.reshape(index, -1))
        return replace(super().take(index), functional=functional)

    def values(self, t: Array, order: int) -> Array:
        """Return the sums of the series; of R without their rounding."""
        columns = slice(9) if order == 0 else slice(6 + 3 * order, 9 + 3 * order)
        terms = self.series[..., columns]
        weights = chebyshev(t, terms.shape[1])
        if order:
            return weighted_sums(weights, terms, 3)
        return orthogonal(weighted_sums(weights, terms, 3, 3))

    def costate(self, t: ArrayLike) -> Array:
        """Return p at the times t, body frame: R p is `c`.

        Parameters
        ----------
        t : array_like
            Times in the domain, of any shape.

        Returns
        -------
        ndarray, shape t.shape + (..., 3)

        Examples
        --------
        >>> from rbcourse import exp_so3
        >>> G, R1 = np.diag([1.0, 2, 2.5]), exp_so3([0.3, 0.5, 1.2])
        >>> c = minimum_torque_so3(np.eye(3), R1, [0, 1, 0], [0, 0, 0], G)
        >>> t = np.linspace(0, 1, 11)
        >>> bool(np.abs((c(t) @ c.costate(t)[..., None])[..., 0] - c.c).max() < 1e-11)
        True
        """
        times = as_time(t, 0, self.domain)
        orders = range(1, self.functional.ends + 2)
        rates = [self.evaluate(times.reshape(-1, 1), order).swapaxes(0, 1) for order in orders]
        p = np.reshape(self.functional.unit, (-1, 1, 1)) * self.functional.p(*rates)
        return p.swapaxes(0, 1).reshape(*times.shape, *self.batch_shape, 3)

    def _what(self) -> str:
        return self.functional.name

    def __repr__(self) -> str:
        """Return what it is, what it costs, and what is left of the equations."""
        cost = "" if self.batch_shape else f", cost {self.cost:.6g}"
        return f"{super().__repr__()[:-1]}{cost}, residual {np.max(self.residual, initial=0):.1e}>"


def solve(task: Task, duration: Array) -> Optimum:
    """Return for each problem the cheapest curve that is found from its starts.

    Raises
    ------
    ConvergenceError
        If none is found, for a single problem.

    Warns
    -----
    RuntimeWarning
        If none is found, for some of a stack.
    """
    solutions = cheapest(task)
    if not task.batch and isinstance(solutions[0], Failure):
        raise ConvergenceError(*solutions[0])
    curve = _optimum(task, solutions, duration)
    _warn_if_not_converged(curve)
    return curve


def _optimum(task: Task, solutions: list[Solution | Failure], duration: Array) -> Optimum:
    """Return the curves of solutions."""
    functional, ends, batch = task.functional, task.equations.ends, task.batch
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
        duration=np.broadcast_to(duration, batch),
        functional=functional,
        series=series.reshape(*batch, *series.shape[1:]),
        constant=c.reshape(*batch, 3),
        found=found.reshape(batch),
    )


def _series(ends: Array, solutions: list[Solution | Failure], nodes: Array) -> Array:
    """Return the Chebyshev series of R, w, w', …, shape (count, n, 9 + 3 + …).

    Series of fewer nodes are padded with zeros. Where no solution was found they are NaN.
    """
    m = ends.shape[1]
    series = np.zeros((len(nodes), nodes.max(initial=1) + m, 12 + 3 * m))
    for n in np.unique(nodes[nodes > 0]):
        index = np.flatnonzero(nodes == n)
        R, k = (np.stack([solutions[i][part] for i in index]) for part in (0, 1))
        by = primitives(n, m)
        series[index, :n, :9] = along(grid(n).series, R).reshape(len(index), n, 9)
        for order, (E, K) in enumerate(zip(by.series_from_ends, by.series_from_k, strict=True)):
            series[index, : len(E), 9 + 3 * order : 12 + 3 * order] = E @ ends[index] + K @ k
    series[nodes == 0] = np.nan
    return series


def _warn_if_not_converged(curve: Optimum) -> None:
    lost = np.isnan(curve.cost)
    _warn(curve, lost, "did not converge", "there the curve is NaN")
    beaten = ~np.asarray(curve.converged) & ~lost
    _warn(curve, beaten, "may not have their optimum", "a curve that was tried costs less")


def _warn(curve: Optimum, which: Array, what: str, why: str) -> None:
    places = np.argwhere(which)
    if len(places):
        first = [int(i) for i in places[0]]
        warnings.warn(
            f"{len(places)} of {curve.count} problems {what}, the first of them {first}: {why} "
            "(see converged)",
            RuntimeWarning,
            stacklevel=5,
        )
