"""What both solvers of BK (19) share: the curve they return, and the way to hard problems."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebint, chebval, chebvander
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_finite
from rbcourse.curves import Curve, geodesic_so3
from rbcourse.polynomials import cubic_coefficients
from rbcourse.projected import ProjectedPolynomial
from rbcourse.quaternion import matrix_from_quaternion, quaternion_from_matrix
from rbcourse.so3 import hat_so3, vee_so3


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

    `derivative`, `integral` from 0 and `twice` give values at the nodes, `twice` of the solution y
    of y'' = values that is 0 at both ends. `series`, `once` and `again` give the Chebyshev
    coefficients of the function, of its integral from 0 and of the integral of that.
    """

    t: Array
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
    return Grid(t, derivative, integral, double - np.outer(t, double[-1]), series, once, again)


def along(matrix: Array, values: Array) -> Array:
    """Return a matrix of a `Grid` applied to values at the nodes, of any shape (n, ...)."""
    return (matrix @ values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])


class MinimumAcceleration(Curve):
    """A `Curve` on SO(3) that solves (19), as Chebyshev series of its quaternion and of w''.

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
        nodes = grid(self.nodes)
        q = quaternion_from_matrix(R)
        flips = np.sum(q[1:] * q[:-1], axis=-1) < 0
        q[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
        jerk = np.swapaxes(R, -1, -2) @ c
        self._series = nodes.series @ q, *_rates(ends, jerk)
        self._tail = np.abs(nodes.series[-2:] @ R.reshape(-1, 9)).max()
        spin = R @ hat_so3(velocity(ends, jerk))
        off = ends.R0 + along(nodes.integral, spin) - R
        self.residual = float(np.abs(off).max())

    @property
    def resolved(self) -> bool:
        """Whether the nodes carry the curve, to rounding."""
        return bool(self._tail < 1e-13 and self.residual < 1e-11)

    def _evaluate(self, t: Array, order: int) -> Array:
        value = chebval(2 * t[..., None] - 1, self._series[order], tensor=False)
        if order:
            return value
        return matrix_from_quaternion(value / np.linalg.norm(value, axis=-1, keepdims=True))


def velocity(ends: Ends, jerk: Array) -> Array:
    """Return w at the nodes, from w'' there and w at the ends."""
    t, twice = grid(len(jerk)).t, grid(len(jerk)).twice
    return np.outer(1 - t, ends.w0) + np.outer(t, ends.w1) + twice @ jerk


def _rates(ends: Ends, jerk: Array) -> tuple[Array, Array]:
    """Return the series of w and w', from w'' at the nodes and w at the ends."""
    nodes = grid(len(jerk))
    w, acceleration = nodes.again @ jerk, nodes.once @ jerk
    slope = ends.w1 - ends.w0 - w.sum(axis=0)
    acceleration[0] += slope
    w[:2] += slope / 2
    w[0] += ends.w0
    return w, acceleration


def first_guess(ends: Ends, guess: Curve, n: int) -> tuple[Array, Array]:
    """Return R of a curve at n nodes, and the c for which w'' = Rᵀc gives w most nearly."""
    nodes = grid(n)
    R = guess(nodes.t)
    R[0], R[-1] = ends.R0, ends.R1
    Rt = np.swapaxes(R, -1, -2)
    w = vee_so3(Rt @ along(nodes.derivative, R))
    lacking = w - velocity(ends, np.zeros_like(w))
    effect = along(nodes.twice, Rt)
    return R, np.linalg.lstsq(effect.reshape(-1, 3), lacking.ravel())[0]


Solver = Callable[[Ends, Curve], MinimumAcceleration]


def solve(
    solver: Solver, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Solve from the projected cubic; if that fails, by continuation.

    Raises
    ------
    ValueError
        If an argument is not finite or not of its shape.
    ConvergenceError
        If both fail.
    """
    ends = Ends(_one("R0", R0, 3, 3), _one("R1", R1, 3, 3), _one("w0", w0, 3), _one("w1", w1, 3))
    try:
        return _attempt(solver, ends, _projected_cubic(ends))
    except ConvergenceError:
        return _continue(solver, ends)


def _attempt(solver: Solver, ends: Ends, guess: Curve) -> MinimumAcceleration:
    """Count a guess that jumps, an overflow and a singular system as no convergence."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return solver(ends, guess)
    except ValueError as error:
        raise ConvergenceError(np.inf, 0) from error


def _projected_cubic(ends: Ends) -> ProjectedPolynomial:
    R0, R1, w0, w1 = ends
    return ProjectedPolynomial(cubic_coefficients(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1)))


def _continue(solver: Solver, ends: Ends) -> MinimumAcceleration:
    """Change the end velocities from those of the geodesic to the wanted ones, step by step."""
    geodesic = geodesic_so3(ends.R0, ends.R1)
    guess: Curve = geodesic
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


def _one(name: str, value: ArrayLike, *core: int) -> Array:
    array = as_finite(name, value, *core)
    if array.ndim > len(core):
        raise ValueError(
            f"{name}: shape {core} wanted, got {array.shape}; give one curve at a time"
        )
    return array
