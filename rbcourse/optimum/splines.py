"""Optima through many poses: Newton's method solves for all legs together.

Vary a curve R(t) to R exp(η̂), with η = 0 at the poses. On each leg of an optimum, R p = c, as
between two poses (see `rbcourse.optimum.functionals`). The variation of the cost is then a sum over
the ends of the legs. Each term is the product of the momenta and the change of the end values; for
a ball, it is 4 w' · δw. So at an optimum the momenta are the same on both sides of each inner pose,
and 0 at natural ends.

A Newton step linearises each leg (`collocation`). The changes of the momenta, for unit changes of
the end values, give a symmetric matrix for each leg. Together these matrices form the linear system
for the values at the poses (`rbcourse.velocities.KnotSystem`), the second derivative of the cost.
If it is positive definite, and each leg is a strict local minimum among the curves with its ends
(`second_variation`), the whole spline is a strict local minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_inertia, as_positive, as_single
from rbcourse._numerics import Array, blocks, matvec
from rbcourse._valid import as_poses, as_rotations
from rbcourse.closed_forms import quaternion_cubic
from rbcourse.curves import Ends
from rbcourse.motions import RigidMotion, rigid_motion
from rbcourse.optimum import ConvergenceError, Optimum, optimum_of
from rbcourse.optimum.chebyshev import along, chebyshev, grid, primitives
from rbcourse.optimum.collocation import (
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
from rbcourse.optimum.functionals import BallAcceleration, Effort, Functional, Jerk
from rbcourse.optimum.guesses import cost_at_nodes, gauss_newton, rates_of, with_derivatives
from rbcourse.optimum.second_variation import is_positive
from rbcourse.paths import Chain
from rbcourse.projection import nearest
from rbcourse.so3 import exp_so3, log
from rbcourse.velocities import (
    Conditions,
    KnotSystem,
    PathEnds,
    as_ends,
    checked_path,
    path_system,
    quaternion_system,
)

STEPS, DESCENT_STEPS = 20, 150
LOWERED, BUMPS = 33, 8  # nodes of curves whose costs are lowered, and polynomials on each leg
DESCENTS = 1e-2, 1e-4, 1e-6
"""Shares of the cost. If Newton's method finds no minimum, Gauss–Newton steps lower the cost of its
start until a step lowers it by less than the first share; if it fails again, the next share."""
SHARES = 1, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001  # multiples of a step; the best one is used
SHIFTS = 0.0, *(4.0**k for k in range(-3, 10))
FLAT = 1e-9  # eigenvalues below this share of the diagonal may be 0


def minimum_acceleration_spline_so3(
    times: ArrayLike,
    rotations: ArrayLike,
    ends: PathEnds = "natural",
    *,
    inertia: ArrayLike | None = None,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve of least acceleration through many rotations, for a ball or any body.

    Source: BK (18); beyond BK 12, beyond BK 15.

    Parameters
    ----------
    times, rotations, ends
        As for `projected_spline_so3`.
    inertia : array_like, shape (3, 3), optional
        As for `minimum_acceleration_so3`.
    long : array_like of bool, shape (N − 1,), optional
        Whether each leg of the starting curve turns the long way, by 2π minus the least angle.

    Returns
    -------
    OptimalChain
        A `Chain` of `Optimum` legs with the least `acceleration_cost` that Newton's method finds,
        starting from `quaternion_spline_so3`. w' (for a body, the torque) is continuous, and 0 at
        natural ends.

    Raises
    ------
    ConvergenceError
        If no minimum is found.

    Notes
    -----
    If velocities are given at both ends, a curve of least acceleration exists. With natural or
    periodic ends, it may not exist. For example, for rotations by 0, 1 and 0.3 rad about one axis,
    at the times 0, 1 and 1 + √2, more full turns on the legs make the cost as small as you like.
    For bodies, a result that is not `certified` can have a leg that is a saddle.
    A leg that is much shorter than its neighbours may spin; to prevent this, insert poses. Singular
    set: neighbouring rotations a half-turn apart raise ValueError.

    Examples
    --------
    >>> from rbcourse import acceleration_cost, exp_so3, projected_spline_so3
    >>> path = [0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]])
    >>> c = minimum_acceleration_spline_so3(*path)
    >>> c.certified, bool(np.abs(c.jumps(2)).max() < 1e-9)
    (True, True)
    >>> round(float(acceleration_cost(projected_spline_so3(*path)) / c.cost) - 1, 3)
    0.201
    """
    return _spline(times, rotations, ends, inertia, "acceleration", long)


def minimum_torque_spline_so3(
    times: ArrayLike,
    rotations: ArrayLike,
    ends: PathEnds = "natural",
    *,
    inertia: ArrayLike,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve with the least integral of squared torque through many rotations.

    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.
    Source: beyond BK 4, beyond BK 12.

    Parameters
    ----------
    times, rotations, ends, inertia, long
        As for `minimum_acceleration_spline_so3`.

    Returns
    -------
    OptimalChain
        The chain with the least `torque_cost` that was found. The torque is continuous, and 0 at
        natural ends.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> turns, book = exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]), np.diag([1.0, 2.22, 3.18])
    >>> minimum_torque_spline_so3([0, 1, 3], turns, inertia=book).definite
    True
    """
    return _spline(times, rotations, ends, inertia, "torque", long)


def minimum_jerk_spline_so3(
    times: ArrayLike, rotations: ArrayLike, ends: PathEnds = "natural", *, long: ArrayLike = False
) -> OptimalChain:
    """Return the curve of least jerk through many rotations.

    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.
    Source: beyond BK 5, beyond BK 12.

    Parameters
    ----------
    times, rotations, long
        As for `minimum_acceleration_spline_so3`.
    ends : {"natural", "periodic"} or pair of array_like, optional
        As for `minimum_acceleration_spline_so3`, but each array has the shape (6,): the velocity,
        followed by the acceleration.

    Returns
    -------
    OptimalChain
        The chain with the least `jerk_cost` that was found. w, w', w'' and w''' are continuous. At
        natural ends, the covariant jerk and its derivative are 0.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = minimum_jerk_spline_so3([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(3).round(8) + 0.0
    array([[0., 0., 0.]])
    """
    return _spline(times, rotations, ends, None, "jerk", long)


def minimum_acceleration_spline_se3(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    *,
    inertia: ArrayLike | None = None,
    mass: float = 1.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the motion of least acceleration through many poses, for a ball or any body.

    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.
    Source: BK 6.3; beyond BK 12.

    Parameters
    ----------
    times, poses, ends
        As for `spline_velocities`.
    inertia, mass, centre
        As for `minimum_acceleration_se3`.
    long
        As for `minimum_acceleration_spline_so3`.

    Returns
    -------
    OptimalChain
        A chain of `RigidMotion` legs. The rotation is the result of
        `minimum_acceleration_spline_so3`; the centre of mass moves on a cubic spline.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> poses = pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0], [0, 0, 2, 2, 2, 0]])
    >>> c = minimum_acceleration_spline_se3([0, 2, 3], poses)
    >>> c(2)[:3, 3].round(12), c([0, 3], 2).round(9) + 0.0
    (array([2., 0., 0.]), array([[0., 0., 0., 0., 0., 0.],
           [0., 0., 0., 0., 0., 0.]]))
    """
    r = as_single("centre", centre, 3)
    as_positive("mass", mass)
    times, poses, _ = checked_path(times, as_poses("poses", poses))
    R, h, conditions = poses[:, :3, :3], np.diff(times), as_ends(ends, len(poses), 6)
    w, v = conditions.given[:, :3], conditions.given[:, 3:]
    turning = _spline(times, R, conditions._replace(given=w), inertia, "acceleration", long)
    d, conditions = poses[:, :3, 3] + R @ r, conditions._replace(given=v + np.cross(w, r))
    v = path_system(h, R, d).solve(conditions)
    rate = matvec(R, v)
    legs = rigid_motion(RigidMotion, turning.legs, d[:-1], d[1:], rate[:-1], rate[1:], centre=r)
    start, end = (legs.path[:, i] - (legs.path[:, 1] - legs.path[:, 0]) for i in (2, 3))
    moving = 4 * np.sum((start**2 + start * end + end**2) / h[:, None] ** 3)
    velocities = np.append(turning.velocities, v - np.cross(turning.velocities, r), axis=1)
    cost = turning.cost + mass * float(moving)
    return replace(turning, legs=legs, velocities=velocities, cost=cost)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OptimalChain(Chain):
    """A `Chain` of optimal legs that is optimal, or at least stationary, as a whole.

    Attributes
    ----------
    cost : float
        The `acceleration_cost`, `torque_cost` or `jerk_cost`.
    definite : bool
        Whether the second derivative of the cost with respect to the values at the poses is
        positive definite. This is False if a family of curves has the same cost, for example if a
        body is symmetric about the axis of all rotations.
    residual, iterations, converged : float, int, bool
        The largest residual of the legs, and the number of steps of Newton's method. `converged` is
        always True, since a failure raises ConvergenceError.
    """

    velocities: Array
    cost: float
    definite: bool
    residual: float
    iterations: int
    converged: bool = True

    @property
    def rotation(self) -> Optimum:
        """The rotations of the legs."""
        legs: Any = self.legs
        return getattr(legs, "rotation", legs)

    @property
    def c(self) -> Array:
        """The constant R p of each leg in the fixed frame, shape (N − 1, 3)."""
        return self.rotation.c

    @property
    def certified(self) -> bool:
        """Whether the chain is proven to be a strict local minimum (`is_local_minimum`)."""
        return bool(is_local_minimum(self))

    def lasting(self, duration: Array) -> Self:
        """Return the chain with another duration and the same start time."""
        share = float(duration / self.duration) ** (self.rotation.functional.ends + 1)
        return replace(super().lasting(duration), cost=self.cost / share)


def is_local_minimum(curve: Optimum | OptimalChain | RigidMotion) -> NDArray[np.bool_]:
    """Tell whether an optimum is proven to be a strict local minimum of its cost.

    Source: beyond BK 15.

    Parameters
    ----------
    curve : Optimum, OptimalChain or RigidMotion
        A result of one of the functions ``minimum_…`` or of `stationary_so3`; it may be a stack.

    Returns
    -------
    ndarray of bool, shape curve.batch_shape
        True if all nearby curves with the same ends and poses are proven to cost more. It is False
        for a saddle, for a curve that is NaN, and if the proof fails.

    Notes
    -----
    If R p is constant, a curve is stationary, but it may not be a minimum. This function proves
    that the second variation is positive: it computes this quadratic form on polynomials and bounds
    the rest (see `rbcourse.optimum.second_variation`). The proof holds up to rounding, quadrature
    and the error of the computed curve. It does not exclude distant curves that cost less. An
    eigenvalue below 1e-6 times the leading term counts as 0. For the acceleration of a ball and
    times from 0 to 1, ‖c‖ < 2π³ is a sufficient condition (docs/near_optimal.md).

    Examples
    --------
    From rest to rest, a turn of a book about the axis of its largest moment has the least torque if
    the angle is at most about 107.9°. Beyond this angle, curves that leave the axis cost less:

    >>> from rbcourse import exp_so3, minimum_torque_so3
    >>> book, rest = np.diag([1.0, 2.22, 3.18]), [0, 0, 0]
    >>> R1 = exp_so3([0, 0, np.radians(100)])
    >>> bool(is_local_minimum(minimum_torque_so3(np.eye(3), R1, rest, rest, book)))
    True
    """
    rotation = getattr(curve, "rotation", curve)
    if not isinstance(rotation, Optimum):
        raise ValueError(f"curve: an optimum is wanted, got {curve!r}")
    found = is_positive(rotation.flat).reshape(rotation.batch_shape)
    if isinstance(curve, OptimalChain):
        return np.array(curve.definite and found.all())
    return found


class _Problem(NamedTuple):
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


class _Found(NamedTuple):
    """The result of Newton's method; `shift` makes the last system positive definite."""

    R: Array
    values: Array
    legs: list[Solution]
    cost: float
    shift: float


def _spline(
    times: ArrayLike, R: ArrayLike, ends: PathEnds | Conditions, G: Any, what: str, long: ArrayLike
) -> OptimalChain:
    times, R, _ = checked_path(times, as_rotations("rotations", R))
    T, R, order = np.diff(times), nearest(R)[0], 2 if what == "jerk" else 1
    unit, way = T.mean(), np.asarray(long)
    if way.dtype != bool or way.shape not in ((), T.shape):
        raise ValueError(f"long: a bool for each of {len(T)} legs is wanted, got {long!r}")
    conditions, h = as_ends(ends, len(R), 3 * order), T / unit
    given = conditions.given * np.repeat(unit ** np.arange(1, 1 + order), 3)
    w = quaternion_system(h, R, way).solve(conditions._replace(given=given[:, :3]))
    legs = quaternion_cubic(Ends(R[:-1], R[1:], *(h[:, None] * [w[:-1], w[1:]])), h, way)
    curve = np.ascontiguousarray(legs.values(grid(NODES[0]).t[:, None], 0).swapaxes(0, 1))
    functional = Jerk() if what == "jerk" else BallAcceleration()
    problem = _Problem(R, h, conditions._replace(given=given), functional)
    if what == "torque" or G is not None:
        G = as_inertia("inertia", as_single("inertia", G, 3, 3))
        of_ball = _found(problem, curve)
        curve = on_nodes(of_ball.R, NODES[0]) if isinstance(of_ball, _Found) else curve
        effort = Effort(np.broadcast_to(G, (len(T), 3, 3)), of_torque=what == "torque")
        problem = problem._replace(functional=effort)
    found = _found(problem, curve)
    if isinstance(found, Failure):
        raise ConvergenceError(*found)
    optima = optimum_of(problem.functional, problem.own(found.values), found.legs, T)
    return OptimalChain(
        duration=np.array(times[-1] - times[0]),
        times=times,
        legs=optima,
        velocities=found.values[:, :3] / unit,
        cost=float(np.sum(optima.cost)),
        definite=found.shift < 0,
        residual=float(np.max(optima.residual)),
        iterations=found.legs[0].iterations,
    )


def _found(problem: _Problem, R: Array) -> _Found | Failure:
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


def _searched(problem: _Problem, R: Array, descents: Sequence[float | None]) -> _Found | Failure:
    """Return a minimum that Newton's method finds from a curve (None) or from cheaper curves.

    The minimum must not cost more than its start. For the jerk, this is not required, and the cost
    is not lowered, since the start does not have all given end values.
    """
    of_jerk = problem.functional.ends == 4
    bound = np.inf if of_jerk else problem.cost(R)
    for worthwhile in descents[:1] if of_jerk else descents:
        if worthwhile is not None:
            R, bound = _lowered(problem, on_nodes(R, LOWERED), worthwhile)
        found: _Found | Failure = Failure(np.inf, STEPS)
        with suppress(FloatingPointError, np.linalg.LinAlgError):
            found = _newton(problem, R)
        if isinstance(found, _Found) and found.shift <= FLAT and found.cost < bound * (1 + 1e-4):
            return found
    return found if isinstance(found, Failure) else Failure(found.legs[0].residual, STEPS)


@np.errstate(over="raise", invalid="raise", divide="raise")
def _newton(problem: _Problem, R: Array) -> _Found | Failure:
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
                return _Found(unknowns[0], values, solutions, cost, shift)
        x = np.insert(problem.own(change).reshape(len(left), -1), 0, 1, axis=1)
        turn, *changes = (np.einsum("i...j,ij->i...", y, x) for y in responses)
        last = float(np.linalg.norm(turn, axis=-1).max())
        share = LONGEST_STEP / max(LONGEST_STEP, last)
        others = [y + share * dy for y, dy in zip(unknowns[1:], changes, strict=True)]
        unknowns = orthogonal(cayley(share * turn) @ unknowns[0]), *others
        values = values + share * change
    return Failure(float(left.max()), STEPS)


def _linearised(
    problem: _Problem, legs: Equations, unknowns: Arrays, parts: Arrays
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


def _lowered(problem: _Problem, R: Array, worthwhile: float) -> tuple[Array, float]:
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
