"""Optima as curves: the class `Optimum`, its curves on SO(3) and SE(3), and chains of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_time
from rbcourse._numerics import Array
from rbcourse._polynomials import along, chebyshev, grid, primitives
from rbcourse.body import Body
from rbcourse.curves.chain import Chain
from rbcourse.curves.curve import Curve, weighted_sums
from rbcourse.curves.functionals import Functional
from rbcourse.curves.rigid import RigidMotion
from rbcourse.optimum._collocation import EXACT, Failure, Solution, orthogonal
from rbcourse.optimum._second_variation import is_positive

_FOUND = [
    ("converged", bool),
    ("nodes", int),
    ("iterations", int),
    ("cost", float),
    ("residual", float),
]


def _reported(name: str) -> Any:
    """Return a property of `Optimum`: a field of the report of its rotation."""
    return property(lambda self: self._told(self.found.report[name]))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Optimum(Curve):
    """A `Curve`, or a stack of curves, of least acceleration, torque or jerk.

    For a stack, the attributes below are arrays of the shape of the stack.
    Source: BK (19); beyond BK 2, beyond BK 15.

    Attributes
    ----------
    cost : float
        The `acceleration_cost`, `torque_cost` or `jerk_cost` for the body of the curve.
    converged : bool
        Whether a solution was found and no curve that was tried costs less; another curve may. If
        no solution was found, the curve, `c` and the cost are NaN.
    certified : bool
        Whether the curve is proven to be a strict local minimum: all nearby curves with the same
        ends cost more. It is False for a saddle, for a curve that is NaN, and if the proof fails.
        It is computed when it is first used, in a few ms for each curve.
    c : ndarray, shape (..., 3)
        The constant vector R p in the fixed frame (R w'' for the acceleration of a ball; p is the
        costate of `rbcourse.curves.functionals`).
    residual, iterations : float, int
        The largest error of the equations, and the number of steps of the solver.

    Notes
    -----
    The proof of `certified` shows that the second variation is positive, up to rounding, quadrature
    and the error of the computed curve. It does not exclude distant curves that cost less. For the
    acceleration of a ball and times from 0 to 1, ‖c‖ < 2π³ is a sufficient condition
    (docs/near_optimal.md).
    """

    @property
    def found(self) -> OptimalRotation:
        raise NotImplementedError

    @property
    def cost(self) -> Any:
        return self.found.cost

    @property
    def certified(self) -> Any:
        return self._told(self.found.positive.copy())

    @property
    def c(self) -> Array:
        return self.found.constant / self.duration[..., None] ** (self.found.functional.ends + 1)

    converged = _reported("converged")
    residual = _reported("residual")
    iterations = _reported("iterations")
    nodes = _reported("nodes")

    def _told(self, values: NDArray[Any]) -> Any:
        return values if self.batch_shape else values.item()

    def _what(self) -> str:
        return f"Optimum of {self.found.functional.name}"

    def _result(self) -> str:
        if self.batch_shape:
            return f", {np.count_nonzero(self.converged)} of {self.count} converged"
        proof = "a proven local minimum" if self.certified else "not proven to be a minimum"
        return f", cost {self.cost:.6g}, {proof}"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OptimalRotation(Optimum):
    """An `Optimum` on SO(3), along which R p is constant."""

    functional: Functional
    series: Array  # Chebyshev coefficients of R, w, w', …, with a column for each entry
    constant: Array  # c for times from 0 to 1
    report: NDArray[np.void]  # the report of each problem, with the fields of `_FOUND`

    @property
    def found(self) -> OptimalRotation:
        return self

    @property
    def cost(self) -> Any:
        return self._told(self.report["cost"] / self.duration ** (self.functional.ends + 1))

    @cached_property
    def positive(self) -> NDArray[np.bool_]:
        """Whether the second variation is proven to be positive, shape (...)."""
        proven = [is_positive(self._take([i])) for i in range(self.count)]
        return np.array(proven, bool).reshape(self.batch_shape)

    def _take(self, index: Any) -> Self:
        functional = self.functional.take(np.reshape(index, -1))
        return replace(super()._take(index), functional=functional)

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
        rates = [self._evaluate(times.reshape(-1, 1), order).swapaxes(0, 1) for order in orders]
        p = np.reshape(self.functional.unit, (-1, 1, 1)) * self.functional.p(*rates)
        return p.swapaxes(0, 1).reshape(*times.shape, *self.batch_shape, 3)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OptimalMotion(RigidMotion, Optimum):
    """An `Optimum` on SE(3): an `OptimalRotation`, and a cubic for the centre of mass."""

    rotation: OptimalRotation

    @property
    def found(self) -> OptimalRotation:
        return self.rotation

    @property
    def cost(self) -> Any:
        return self._told(self.rotation.cost + self.body.mass * self.moving_cost)

    @property
    def moving_cost(self) -> Array:
        """The integral of ‖d_c''‖² of the centre of mass, for a cubic path, shape (...)."""
        x0, x1, v0, v1 = np.moveaxis(self.path, -2, 0)
        start, end = v0 - (x1 - x0), v1 - (x1 - x0)
        squares: Array = np.sum(start**2 + start * end + end**2, axis=-1)
        return 4 * squares / self.duration**3


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OptimalChain(Chain):
    """A `Chain` of optimal legs that is optimal, or at least stationary, as a whole.

    Attributes
    ----------
    cost, certified : float, bool
        As for `Optimum`; all nearby curves through the same poses cost more than a certified chain.
    definite : bool
        Whether the second derivative of the cost with respect to the values at the poses is
        positive definite. This is False if a family of curves has the same cost, for example if a
        body is symmetric about the axis of all rotations.
    c : ndarray, shape (N − 1, 3)
        The constant R p of each leg in the fixed frame.
    residual, iterations : float, int
        The largest residual of the legs, and the number of steps of Newton's method.
    converged : bool
        False if another leg with the same ends costs less, but no spline with this leg was found.
    """

    legs: Optimum
    velocities: Array
    cost: float
    definite: bool
    residual: float
    iterations: int
    converged: bool = True

    @property
    def optimum(self) -> OptimalRotation:
        return self.legs.found

    @property
    def c(self) -> Array:
        return self.optimum.c

    @property
    def certified(self) -> bool:
        return bool(self.definite and self.optimum.positive.all())

    def _lasting(self, duration: Array) -> Self:
        share = float(duration / self.duration) ** (self.optimum.functional.ends + 1)
        return replace(super()._lasting(duration), cost=self.cost / share)

    def _moved(self, L: Array, X: Array) -> Chain:
        parts = {name: getattr(self, name) for name in ("duration", "times", "legs", "velocities")}
        return Chain(**parts, body=self.body)._moved(L, X)

    def _what(self) -> str:
        return f"Optimum of {self.optimum.functional.name} through {len(self.times)} poses"

    def _result(self) -> str:
        proof = "a proven local minimum" if self.certified else "not proven to be a minimum"
        return f", cost {self.cost:.6g}, {proof}"


class ConvergenceError(RuntimeError):
    """The error raised if no curve is found; it gives the `residual` after `iterations` steps."""

    def __init__(self, residual: float, iterations: int, reason: str) -> None:
        if residual < EXACT:
            reason = "only a saddle was found"
        what = f"no convergence: residual {residual:.1e} after {iterations} iterations"
        super().__init__(f"{what}; {reason}")
        self.residual = residual
        self.iterations = iterations
        self.reason = reason

    def __reduce__(self) -> tuple[type, tuple[float, int, str]]:
        return type(self), (self.residual, self.iterations, self.reason)  # for pickle


def optimum_of(
    functional: Functional,
    ends: Array,
    solutions: Sequence[Solution | Failure],
    duration: Array,
    body: Body,
) -> OptimalRotation:
    """Return the solutions as a stack of curves; its batch shape is that of the durations."""
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
    return OptimalRotation(
        duration=duration,
        body=body,
        functional=functional,
        series=series.reshape(*batch, *series.shape[1:]),
        constant=c.reshape(*batch, 3),
        report=found.reshape(batch),
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
