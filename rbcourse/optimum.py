"""The optima on SO(3): least acceleration, BK (19), of balls and real bodies; torque; jerk."""

from __future__ import annotations

import warnings
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._chebyshev import along, chebyshev, grid, primitives
from rbcourse._checks import as_time
from rbcourse._numerics import Array
from rbcourse.curves import Chosen, Curve, Ends, combine, with_inertia
from rbcourse.functionals import Functional
from rbcourse.projected_cubic import check_ends_of_quintic
from rbcourse.relaxation import Failure, Solution, orthogonal
from rbcourse.search import COARSE, Task, ball, body, cheapest, jerk


def minimum_acceleration_so3(
    R0: ArrayLike,
    R1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    inertia: ArrayLike | None = None,
) -> Optimum:
    """Return the minimum-acceleration curve with these ends, of a ball or of any body.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    inertia : array_like, shape (..., 3, 3), optional
        G, the metric or the inertia of a body, body frame: symmetric and positive definite. By
        default 2 I, the metric (12).

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all four ends, with the least ∫ 2 ‖w'‖² dt that
        was found, and w''' + w × w'' = 0; with an inertia, the least ∫ τᵀ G⁻¹ τ dt with the torque
        τ = G w' + w × G w. Its ``converged``, ``residual``, ``iterations`` and ``nodes`` tell how
        it was found; ``c`` is the constant R w'', with an inertia the constant R p of `costate`.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, the batches do not broadcast, or `inertia`
        is not symmetric and positive definite.
    ConvergenceError
        For a single problem, if Newton's method converges from none of its starts. Of 1,000 random
        problems (see Notes) with ‖w0‖, ‖w1‖ < 50 this happened in none.

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
    retime : From [0, 1] to T seconds.

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
    is returned. It is stationary. That none costs less is not proven, but was tried on random
    problems, with σ in a ball of radius π and w0, w1 in larger ones:

    - ‖w0‖, ‖w1‖ < 12, 20,000 problems of two seeds: none costs more than one of the six closed
      forms with the same ends, nor than what Newton's method finds from `cumulative_bezier_so3`
      either way round. Turning the room or the body, or reversing time, changes the cost by less
      than 1e-11, relatively. Eight random starts found no cheaper curve for any of 4,000.
    - ‖w0‖, ‖w1‖ < 20, 3,000 problems: none costs more than a closed form, one more than a curve
      that was found from one way round; reversing time changes the cost of 5. Eight random starts
      found no cheaper curve for any of 1,000.
    - Bodies whose largest moment is at most ten times the least, ‖σ‖ < 3, ‖w0‖, ‖w1‖ < 9, 3,300
      problems: all converge. Sixteen random starts of another optimiser found a cheaper curve for
      6, by less than 0.4 %.

    End velocities along the geodesic give R0 exp(σ̂ p(t)), with p a cubic and σ a logarithm of
    R0ᵀR1, the shortest or one with full turns more or the other way round. Of those the cheapest
    was found for all of 900 such problems with velocities up to 80. About a principal axis of a
    body these curves are stationary, too. Where the free motion of a body meets the ends, it costs
    nothing; it was found in all of 800 problems with speeds of 3 to 16.

    Problems of very thin rods may not converge: of 240 with ‖σ‖ < 2, ‖w0‖, ‖w1‖ < 4 none with the
    moments (0.01, 1, 1), 28 with (0.0001, 1, 1).

    References
    ----------
    BK (19), BK 6.2, BK Prop. 7; for bodies beyond BK 3 (see `rbcourse.functionals.Effort`).

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
    given = Ends(R0, R1, w0, w1)
    if inertia is None:
        return solve(ball(given))
    return solve(body(*with_inertia(given, inertia), of_torque=False))


def minimum_torque_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, inertia: ArrayLike
) -> Optimum:
    """Return the curve with these ends that takes a body there with the least squared torque.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    inertia : array_like, shape (..., 3, 3)
        G, body frame: symmetric and positive definite.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all four ends, with the least ∫ ‖τ‖² dt that was
        found, where τ = G w' + w × G w is the torque. Its ``c`` is the constant R p of `costate`.

    Raises
    ------
    ValueError
        As `minimum_acceleration_so3`.
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
    retime : From [0, 1] to T seconds.

    Notes
    -----
    The curve is found as that of `minimum_acceleration_so3`, and is stationary. All of 3,300 random
    problems, ‖σ‖ < 3, ‖w0‖, ‖w1‖ < 9, of bodies whose largest moment is at most ten times the
    least, converged. Sixteen random starts of another optimiser found a cheaper curve for 2, by
    less than 0.2 %.

    Thin rods are another matter: with the moments (0.01, 1, 1) 19 to 23 of 60 problems with
    ‖σ‖ < 2, ‖w0‖, ‖w1‖ < 4 did not converge; with (0.03, 1, 1) all of 240 did, but for 2 of them a
    start costs less.

    A turn about one axis is stationary about each principal axis; about that of the largest moment
    it may be a saddle: a curve that leaves the axis can cost a fifth less. Curves bent aside are
    tried where the solution turns about one axis, nearly.

    In the fixed frame, with J = R G Rᵀ and H = R G w, so that H' is the torque, the equation is
    J H'' + H' × H = c.

    References
    ----------
    beyond BK 4 (see `rbcourse.functionals.Effort`).

    Examples
    --------
    >>> from rbcourse import exp_so3, torque_cost
    >>> book, rest = np.diag([1.0, 2.22, 3.18]), [0, 0, 0]
    >>> c = minimum_torque_so3(np.eye(3), exp_so3([0, 1.5, 0]), rest, rest, book)
    >>> float(torque_cost(c, book).round(9))  # about a principal axis 12 (2.22 · 1.5)²
    133.0668
    """
    given = Ends(R0, R1, w0, w1)
    return solve(body(*with_inertia(given, inertia), of_torque=True))


def minimum_jerk_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, a0: ArrayLike, a1: ArrayLike
) -> Optimum:
    """Return the minimum-jerk curve with these ends.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    a0, a1 : array_like, shape (..., 3)
        Angular accelerations w' there, body frame, in rad per unit time squared.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, that meets all six ends, with the least
        ∫ 2 ‖w'' + ½ w × w'‖² dt that was found: the squared covariant jerk in the metric (12). Its
        ``c`` is the constant R p of `costate`.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.
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
    retime : From [0, 1] to T seconds.

    Notes
    -----
    The curve is found as that of `minimum_acceleration_so3`, and is stationary. All of 600 random
    problems, ‖σ‖ < 3, ‖w0‖, ‖w1‖ < 9, ‖a0‖, ‖a1‖ < 20, converged, and all of 1,200 with these
    vectors near one axis, ‖w0‖, ‖w1‖ from 5 to 9 and ‖a0‖, ‖a1‖ from 10 to 20. Sixteen random
    starts of another optimiser found a cheaper curve for one of the latter, by 0.4 %. About one
    axis it is the cheapest of the quintics to σ with any number of full turns, in all of 1,000
    problems.

    From rest to rest without acceleration it is the geodesic, R0 exp(σ̂ (10 t³ − 15 t⁴ + 6 t⁵)), and
    costs 1440 ‖σ‖².

    References
    ----------
    beyond BK 5 (see `rbcourse.functionals.Jerk`).

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> rest = [0, 0, 0]
    >>> c = minimum_jerk_so3(np.eye(3), exp_so3([0, 0, 1.5]), rest, rest, rest, [0, 1, 0])
    >>> c([0, 1], 2).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    return solve(jerk(*check_ends_of_quintic(R0, R1, w0, w1, a0, a1)))


def stationary_so3(guess: Curve) -> Optimum:
    """Return the stationary curve that Newton's method finds from a curve with the same ends.

    Parameters
    ----------
    guess : Curve
        On SO(3) and [0, 1], or a stack of them.

    Returns
    -------
    Optimum
        A `Curve`, or a stack of them, with the rotations and the velocities of the guess at t = 0
        and 1, and R w'' constant, as for the least ∫ 2 ‖w'‖² dt. It need not be the cheapest; NaN
        where nothing is found (see ``converged``).

    Raises
    ------
    ValueError
        If `guess` is no such curve, or is NaN at a time.

    See Also
    --------
    minimum_acceleration_so3 : The cheapest curve that is known.

    References
    ----------
    BK (19).

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_cubic_so3
    >>> guess = projected_cubic_so3(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c = stationary_so3(guess)
    >>> bool(np.abs(c([0, 1], 1) - guess([0, 1], 1)).max() < 1e-12), c.residual < 1e-12
    (True, True)
    """
    if not isinstance(guess, Curve) or (guess.size, guess.domain) != (3, (0, 1)):
        raise ValueError(f"guess: a Curve on SO(3) and [0, 1] is wanted, got {guess!r}")
    values = guess([0, 1]), guess([0, 1], 1)
    if not np.isfinite(values[1]).all():
        raise ValueError("guess: a curve is NaN, it did not converge")
    task = ball(Ends(*values[0], *values[1]))
    R = np.moveaxis(guess(grid(COARSE).t).reshape(COARSE, -1, 3, 3), 0, 1)
    with np.errstate(over="ignore", invalid="ignore"):
        solutions = task.solver(task.equations, R)
    return Optimum(task.functional, task.equations.ends, solutions, task.batch)


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


class Optimum(Curve):
    """A `Curve` on SO(3), or a stack of them, along which R p is constant; as Chebyshev series.

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
        The largest error of the equations R0 + ∫ R ŵ dt = R(t) and R p = c at the nodes.
    iterations, nodes : int or ndarray of int, shape (...)
        How many steps the solver took, and how many nodes carry the curve.

    References
    ----------
    beyond BK 2; BK (19), which says that R w'' is constant: (R w'')' = R (w''' + w × w'').
    """

    def __init__(
        self,
        functional: Functional,
        ends: Array,
        solutions: list[Solution | Failure],
        batch_shape: tuple[int, ...],
    ) -> None:
        self.functional, self._ends, self.batch_shape = functional, ends, batch_shape
        self._solutions, total = solutions, len(solutions)
        found = {i: s for i, s in enumerate(solutions) if isinstance(s, Solution)}
        nodes, c = np.zeros(total, int), np.full((total, 3), np.nan)
        for i, solution in found.items():
            nodes[i], c[i] = len(solution.R), solution.c
        cost = np.array([s.cost if isinstance(s, Solution) else np.nan for s in solutions], float)
        residual = np.array([s.residual for s in solutions], float)
        iterations = np.array([s.iterations for s in solutions], int)
        beaten = np.array([isinstance(s, Solution) and s.beaten for s in solutions], bool)
        self.c = (np.reshape(functional.unit, (-1, 1)) * c).reshape(*batch_shape, 3)
        self.converged, self.nodes, self.cost, self.residual, self.iterations = (
            x.reshape(batch_shape) if batch_shape else x.item()
            for x in ((nodes > 0) & ~beaten, nodes, functional.scale * cost, residual, iterations)
        )

    @cached_property
    def _series(self) -> list[Array]:
        """The Chebyshev series of R, w, w', …, shape (n, count, 9) or (n, count, 3).

        Series of fewer nodes are padded with zeros. Where no solution was found they are NaN.
        """
        nodes, m = np.ravel(self.nodes), self._ends.shape[1]
        most, orders = nodes.max(initial=1) + m, range(m + 2)
        series = [np.zeros((most, len(nodes), 3 if order else 9)) for order in orders]
        for n in np.unique(nodes[nodes > 0]):
            index = np.flatnonzero(nodes == n)
            solutions = [self._solutions[i] for i in index]
            R, k = (np.stack([getattr(one, name) for one in solutions]) for name in ("R", "k"))
            by = primitives(n, m)
            rates = zip(by.series_from_ends, by.series_from_k, strict=True)
            w = [E @ self._ends[index] + K @ k for E, K in rates]
            for whole, part in zip(series, [along(grid(n).series, R), *w], strict=True):
                columns = part.reshape(*part.shape[:2], -1).swapaxes(0, 1)
                whole[: len(columns), index] = columns
        for whole in series:
            whole[:, nodes == 0] = np.nan
        return series

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
        rates = [self._at_all(times.reshape(-1, 1), order).swapaxes(0, 1) for order in orders]
        p = np.reshape(self.functional.unit, (-1, 1, 1)) * self.functional.p(*rates)
        return p.swapaxes(0, 1).reshape(*times.shape, *self.batch_shape, 3)

    def take(self, index: Any) -> Self:
        """Return the stack of the curves with these numbers, which count through the stack."""
        numbers = np.reshape(index, -1)
        functional, solutions = self.functional.take(numbers), [self._solutions[i] for i in numbers]
        return type(self)(functional, self._ends[numbers], solutions, np.shape(index))

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        terms = self._series[order]
        weights = np.moveaxis(chebyshev(t, len(terms)), -1, 0)
        combine(weights, terms, which, out.reshape(*out.shape[:2], terms.shape[-1]))
        if order == 0:
            out[...] = orthogonal(out)

    def _what(self) -> str:
        return self.functional.name

    def __repr__(self) -> str:
        """Return what it is, what it costs, and what is left of the equations."""
        cost = "" if self.batch_shape else f", cost {self.cost:.6g}"
        return f"{super().__repr__()[:-1]}{cost}, residual {np.max(self.residual, initial=0):.1e}>"


def solve(task: Task) -> Optimum:
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
    curve = Optimum(task.functional, task.equations.ends, solutions, task.batch)
    _warn_if_not_converged(curve)
    return curve


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
