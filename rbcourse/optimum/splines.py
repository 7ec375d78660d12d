"""Optima through many poses: Newton's method solves for all legs together.

Vary a curve R(t) to R exp(η̂), with η = 0 at the poses. On each leg of an optimum, R p = c, as
between two poses (see `rbcourse.optimum.functionals`). The variation of the cost is then a sum over
the ends of the legs. Each term is the product of the momenta and the change of the end values; for
a ball, it is 4 w' · δw. So at an optimum the momenta are the same on both sides of each inner pose,
and 0 at natural ends.

In a Newton step, each leg is linearised, and its responses to unit changes of its end values are
computed (`collocation`). The changes of the momenta give a symmetric matrix for each leg. Together
these matrices form the linear system for the values at the poses
(`rbcourse.velocities.KnotSystem`). The matrix of this system is the second derivative of the cost.
If this matrix is positive definite, and each leg is a strict local minimum among the curves with
its ends (`second_variation`), the whole spline is a strict local minimum.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_finite, as_inertia, as_positive, as_single
from rbcourse._hermite import hermite
from rbcourse._numerics import Array, blocks, matvec
from rbcourse.closed_forms import quaternion_cubic
from rbcourse.curves import Ends
from rbcourse.motions import RigidMotion, rigid_motion
from rbcourse.optimum import ConvergenceError, Optimum, optimum_of
from rbcourse.optimum.chebyshev import along, chebyshev, grid, interpolation, primitives
from rbcourse.optimum.collocation import (
    EXACT,
    LONGEST_STEP,
    Arrays,
    BallStationary,
    Equations,
    Failure,
    Solution,
    Stationary,
    cayley,
    orthogonal,
    rates_at_nodes,
)
from rbcourse.optimum.functionals import BallAcceleration, Effort, Functional, Jerk
from rbcourse.optimum.guesses import by_eta, cost_at_nodes, rates_of
from rbcourse.optimum.second_variation import is_positive
from rbcourse.paths import Chain
from rbcourse.projection import nearest
from rbcourse.so3 import exp_so3, log_so3
from rbcourse.velocities import (
    KnotSystem,
    PathEnds,
    as_ends,
    checked_path,
    is_periodic,
    path_system,
    quaternion_system,
)

NODES = 17, 25, 33, 49, 65, 97, 129
LOWERED = 33  # nodes of curves whose costs are lowered
STEPS = 20
BUMPS, DESCENT_STEPS = 8, 150
DESCENTS = 1e-2, 1e-4, 1e-6
"""Shares of the cost. If Newton's method finds no minimum, Gauss–Newton steps lower the cost of its
start until a step lowers it by less than the first share. Newton's method is then tried again. If
it fails again, the next share is used."""
FLAT = 1e-9  # eigenvalues below this share of the diagonal may be 0
ASIDE = np.array([0.4, 0.6, 0.8])  # rad: displacement from the axis in the middle of a leg


def minimum_acceleration_spline_so3(
    times: ArrayLike,
    rotations: ArrayLike,
    ends: PathEnds = "natural",
    *,
    inertia: ArrayLike | None = None,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve of least acceleration through many rotations, for a ball or any body.

    Each leg of the starting curve turns the short way, or the long way if `long` requests it.
    Source: BK (18); beyond BK 12, beyond BK 15.

    Parameters
    ----------
    times, rotations, ends
        As for `projected_spline_so3`.
    inertia : array_like, shape (3, 3), optional
        As for `minimum_acceleration_so3`.
    long : array_like of bool, shape (N − 1,), optional
        Whether each leg of the starting curve turns the long way, by 2π minus the angle between its
        two rotations.

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
    periodic ends, such a curve may not exist. For example, take rotations by 0, 1 and 0.3 rad about
    one axis, at the times 0, 1 and 1 + √2. The result costs 5.6, but with more full turns on the
    legs, the cost can be as small as you like. A `certified` result is proven to be a local
    minimum. For bodies, a result that is not certified can have a leg that is a saddle. A leg that
    is much shorter than its neighbours may spin; to prevent this, insert poses. Singular set:
    neighbouring rotations a half-turn apart raise ValueError.

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
    G = None if inertia is None else as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    return _spline(times, rotations, ends, G, "acceleration", long)


def minimum_torque_spline_so3(
    times: ArrayLike,
    rotations: ArrayLike,
    ends: PathEnds = "natural",
    *,
    inertia: ArrayLike,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve with the least integral of squared torque through many rotations.

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

    Notes
    -----
    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> turns, book = exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]), np.diag([1.0, 2.22, 3.18])
    >>> minimum_torque_spline_so3([0, 1, 3], turns, inertia=book).definite
    True
    """
    G = as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    return _spline(times, rotations, ends, G, "torque", long)


def minimum_jerk_spline_so3(
    times: ArrayLike, rotations: ArrayLike, ends: PathEnds = "natural", *, long: ArrayLike = False
) -> OptimalChain:
    """Return the curve of least jerk through many rotations.

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

    Notes
    -----
    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.

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

    Notes
    -----
    Errors, domain and singular set are those of `minimum_acceleration_spline_so3`.

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
    times, poses, _ = checked_path(times, as_finite("poses", poses, "N", 4, 4))
    G = None if inertia is None else as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    fixed, given = as_ends(ends, len(poses), 6)
    pair: PathEnds = ends
    if not isinstance(ends, str):
        pair = tuple(given[i, :3] if fixed[i] else None for i in (0, -1))  # type: ignore[assignment]
    turning = _spline(times, poses[:, :3, :3], pair, G, "acceleration", long)
    moved = poses.copy()
    moved[:, :3, 3] += poses[:, :3, :3] @ r
    w, own = turning.velocities, given[:, 3:] + np.cross(given[:, :3], r)
    assert w is not None
    v = path_system(times, moved).solve(fixed, np.where(fixed[:, None], own, 0), is_periodic(ends))
    d, rate = moved[:, :3, 3], matvec(poses[:, :3, :3], v)
    legs = rigid_motion(RigidMotion, turning.legs, d[:-1], d[1:], rate[:-1], rate[1:], centre=r)
    h = np.diff(times)[:, None]
    start, end = (
        hermite([d[:-1], d[1:], h * rate[:-1], h * rate[1:]], np.array(t), 2) for t in (0.0, 1.0)
    )
    moving = np.sum((start**2 + start * end + end**2) / 3 / h**3)  # d'' is linear
    return replace(
        turning,
        legs=legs,
        velocities=np.concatenate([w, v - np.cross(w, r)], axis=1),
        cost=turning.cost + mass * float(moving),
    )


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
    certified : bool
        The result of `is_local_minimum` for the chain.
    """

    cost: float
    definite: bool

    @property
    def rotation(self) -> Optimum:
        """The rotations of the legs."""
        legs: Any = self.legs
        return legs if isinstance(legs, Optimum) else legs.rotation

    @property
    def c(self) -> Array:
        """The constant R p of each leg in the fixed frame, shape (N − 1, 3)."""
        return self.rotation.c

    @property
    def residual(self) -> float:
        """The largest residual of the legs."""
        return float(np.max(self.rotation.residual))

    @property
    def iterations(self) -> int:
        """The number of steps of Newton's method."""
        return int(np.max(self.rotation.iterations))

    @property
    def converged(self) -> bool:
        """Whether a solution was found: always True, since a failure raises ConvergenceError."""
        return bool(np.all(self.rotation.converged))

    @property
    def certified(self) -> bool:
        """Whether the chain is proven to be a strict local minimum."""
        return bool(is_local_minimum(self))

    def lasting(self, duration: Array) -> Self:
        """Return the chain with another duration and the same start time."""
        start, end = self.domain
        share = float(duration) / (end - start)
        power = self.rotation.functional.ends + 1
        return replace(super().lasting(duration), cost=self.cost / share**power)


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
    """The data of a spline: rotations, durations with mean 1, given values, and functional."""

    R: Array
    h: Array
    fixed: NDArray[np.bool_]
    given: Array
    periodic: bool
    functional: Functional

    @property
    def scale(self) -> Array:
        """The powers of `h` that scale values at the rotations to unit time, (N, 3 m/2)."""
        orders = np.arange(1, 1 + self.functional.ends // 2)
        return np.repeat(self.h[:, None] ** orders, 3, axis=1)

    @property
    def weight(self) -> Array:
        """The weight of each leg in the cost: the factor of ∫ ‖u‖² dt for times from 0 to 1."""
        weight: Array = self.functional.scale * self.h ** -(self.functional.ends + 1.0)
        return weight

    def cost(self, R: Array) -> float:
        """Return the cost of the curve given by R at the nodes of all legs."""
        return float(np.sum(cost_at_nodes(self.functional, R) * self.weight))

    def ends_of_legs(self, knots: Array) -> Array:
        """Return w0, w1 (and a0, a1) of the legs for times from 0 to 1, (N, m, 3)."""
        both = np.stack([self.scale * knots[:-1], self.scale * knots[1:]], axis=1)
        parts = both.reshape(len(both), 2, -1, 3).swapaxes(1, 2)
        return parts.reshape(len(both), -1, 3)

    def equations(self, ends: Array, n: int) -> BallStationary | Stationary:
        """Return the equations R p = c of the legs, for n nodes."""
        parts = self.R[:-1], self.R[1:], ends
        if isinstance(self.functional, BallAcceleration):
            return BallStationary(*parts, coarse=9 if n < 33 else 17)
        return Stationary(self.functional, *parts)

    def on_nodes(self, R: Array, n: int) -> Array:
        """Return R interpolated to n nodes, with the given rotations at the ends of the legs."""
        return self.with_ends(along(interpolation(R.shape[1], n), R))

    def with_ends(self, R: Array) -> Array:
        """Return R, orthogonal up to rounding, with the given rotations at the ends of the legs."""
        R = orthogonal(R)
        R[:, 0], R[:, -1] = self.R[:-1], self.R[1:]
        return R

    def solve(self, system: KnotSystem) -> Array:
        """Solve a system for the changes of the values at the rotations.

        If the matrix is not positive definite, a diagonal matrix is added until it is.
        """
        sizes = np.abs(np.diagonal(system.A + system.D, axis1=1, axis2=2)).max(axis=0)
        for shift in (0.0, *(4.0**k for k in range(-3, 10))):
            more = shift * np.diag(sizes)
            shifted = system._replace(A=system.A + more, D=system.D + more)
            with suppress(np.linalg.LinAlgError):
                return shifted.solve(self.fixed, np.zeros_like(self.given), self.periodic)
        raise np.linalg.LinAlgError("the system of a step is singular")

    def least_sign(self, system: KnotSystem) -> int:
        """Return the sign of the least eigenvalue of a system, or 0 if this eigenvalue may be 0."""
        sizes = np.diag(np.abs(np.diagonal(system.A + system.D, axis1=1, axis2=2)).max(axis=0))
        for sign, shift in (1, -FLAT), (0, FLAT):
            moved = system._replace(A=system.A + shift * sizes, D=system.D + shift * sizes)
            with suppress(np.linalg.LinAlgError):
                moved.solve(self.fixed, np.zeros_like(self.given), self.periodic)
                return sign
        return -1


class _Curve(NamedTuple):
    """A curve: rotations at the nodes of the legs, and values at the poses."""

    R: Array
    knots: Array


class _Found(NamedTuple):
    """The result of Newton's method; `sign` is the sign of the least eigenvalue."""

    curve: _Curve
    legs: list[Solution]
    cost: float
    sign: int


def _spline(
    times: ArrayLike, R: ArrayLike, ends: PathEnds, G: Array | None, what: str, long: ArrayLike
) -> OptimalChain:
    times, R, _ = checked_path(times, as_finite("rotations", R, "N", 3, 3))
    T, R, size = np.diff(times), nearest(R)[0], 6 if what == "jerk" else 3
    unit, way = T.mean(), np.asarray(long)
    if way.dtype != bool or way.shape not in ((), T.shape):
        raise ValueError(f"long: a bool for each of {len(T)} legs is wanted, got {long!r}")
    fixed, given = as_ends(ends, len(R), size)
    given = given * np.repeat(unit ** np.arange(1, 1 + size // 3), 3)
    periodic = is_periodic(ends)
    problem = _Problem(R, T / unit, fixed, given[:, :3], periodic, BallAcceleration())
    start = _quaternion_spline(problem, np.broadcast_to(way, len(T)))
    if what == "jerk":
        problem = problem._replace(given=given, functional=Jerk())
        bends = rates_of(start.R, 2)[1] / problem.h[:, None, None] ** 2
        knots = np.append(start.knots, np.append(bends[:, 0], bends[-1:, -1], axis=0), axis=1)
        start = start._replace(knots=np.where(fixed[:, None], given, knots))
    elif G is not None:
        of_ball = _found(problem, start)
        start = of_ball.curve if isinstance(of_ball, _Found) else start
        effort = Effort(np.broadcast_to(G, (len(T), 3, 3)), of_torque=what == "torque")
        problem = problem._replace(functional=effort)
    found = _found(problem, start)
    if isinstance(found, Failure):
        raise ConvergenceError(*found)
    own = problem.ends_of_legs(found.curve.knots)
    legs = optimum_of(problem.functional, own, found.legs, T)
    return OptimalChain(
        duration=np.array(times[-1] - times[0]),
        times=times,
        legs=legs,
        velocities=found.curve.knots[:, :3] / unit,
        cost=float(np.sum(legs.cost)),
        definite=found.sign > 0,
    )


def _quaternion_spline(problem: _Problem, long: NDArray[np.bool_]) -> _Curve:
    R, h, times = problem.R, problem.h, np.append(0.0, np.cumsum(problem.h))
    w = quaternion_system(times, R, long).solve(problem.fixed, problem.given, problem.periodic)
    ends = Ends(R[:-1], R[1:], h[:, None] * w[:-1], h[:, None] * w[1:])
    legs = quaternion_cubic(ends, np.ones(len(h)), long)
    return _Curve(np.ascontiguousarray(legs(grid(NODES[0]).t).swapaxes(0, 1)), w)


def _found(problem: _Problem, start: _Curve) -> _Found | Failure:
    """Return a minimum that Newton's method finds.

    If a curve turns about one axis only, no step leaves this axis. For a body, curves that leave
    the axis can cost less, so a second search starts from a curve off the axis.
    """
    found = _searched(problem, start, lower=False)
    if isinstance(problem.functional, Effort) and (
        isinstance(found, Failure) or _is_about_one_axis(found.curve.R)
    ):
        t = grid(start.R.shape[1]).t[:, None]
        sides = ASIDE * (-1.0) ** np.arange(len(start.R))[:, None, None]  # alternating
        aside = start._replace(R=start.R @ exp_so3(16 * t**2 * (1 - t) ** 2 * sides))
        other = _searched(problem, aside, lower=True)
        if isinstance(other, _Found) and (
            isinstance(found, Failure) or other.cost < found.cost * (1 - 1e-9)
        ):
            return other
    return found


def _is_about_one_axis(R: Array) -> bool:
    """Tell whether all rotations of a curve, relative to the first one, are about one axis."""
    v = log_so3(R[0, 0].T @ R).reshape(-1, 3)
    return bool(np.linalg.svd(v, compute_uv=False)[1] < 1e-6 * np.linalg.norm(v))


def _searched(problem: _Problem, start: _Curve, *, lower: bool) -> _Found | Failure:
    """Return a minimum that Newton's method finds from a curve or from cheaper curves.

    The minimum must not cost more than its start. This is not required for the jerk, since its
    start does not have all given end values.
    """
    found: _Found | Failure = Failure(np.inf, 0)
    bound = problem.cost(start.R) if problem.functional.ends == 2 else np.inf
    if not lower:
        found = _newton(problem, start, NODES[0])
    for worthwhile in (*DESCENTS, None):
        if isinstance(found, _Found) and found.sign >= 0 and found.cost < bound * (1 + 1e-4):
            return found
        if worthwhile is None or bound == np.inf:
            break
        start = start._replace(R=problem.on_nodes(start.R, LOWERED))
        start, bound = _lowered(problem, start, worthwhile)
        found = _newton(problem, start, LOWERED)
    return found if isinstance(found, Failure) else Failure(found.legs[0].residual, STEPS)


def _newton(problem: _Problem, start: _Curve, n: int) -> _Found | Failure:
    """Return the result of Newton's method from a curve; an overflow is a failure."""
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            return _iterated(problem, start, n)
    except (FloatingPointError, np.linalg.LinAlgError):
        return Failure(np.inf, STEPS)


def _iterated(problem: _Problem, start: _Curve, n: int) -> _Found | Failure:
    knots, R, last = start.knots, problem.on_nodes(start.R, n), np.inf
    legs = problem.equations(problem.ends_of_legs(knots), n)
    unknowns: Arrays = R, *legs.first(R)
    for step in range(STEPS):
        while True:  # use more nodes if these do not resolve the curve
            legs = problem.equations(problem.ends_of_legs(knots), n)
            left, parts = legs.errors(unknowns)
            tail = legs.tails(unknowns).max()
            if tail < EXACT or last > 1e3 * tail:
                break
            if n == NODES[-1]:
                return Failure(float(left.max()), step)
            few, n = n, NODES[NODES.index(n) + 1]
            R, *others = unknowns
            more = (interpolation(few, n) @ x if x.ndim == 3 else x for x in others)
            unknowns = problem.on_nodes(R, n), *more
        exact = max(left.max(), tail) < EXACT and last < 1e-5
        if exact and _balanced(problem, legs, unknowns):
            sign = problem.least_sign(_linearised(problem, legs, unknowns, parts)[0])
            k, c, costs = legs.solution(unknowns)
            each = zip(unknowns[0], k, c, costs.tolist(), left.tolist(), strict=True)
            solutions = [Solution(*one, iterations=step) for one in each]
            curve = _Curve(unknowns[0], knots)
            return _Found(curve, solutions, float(np.sum(costs * problem.weight)), sign)
        system, responses = _linearised(problem, legs, unknowns, parts)
        change = problem.solve(system)
        own = problem.ends_of_legs(change).reshape(len(change) - 1, -1)
        x = np.append(np.ones((len(own), 1)), own, axis=1)
        turn, *changes = (np.einsum("i...j,ij->i...", y, x) for y in responses)
        last = float(np.linalg.norm(turn, axis=-1).max())
        share = LONGEST_STEP / max(LONGEST_STEP, last)
        R = problem.with_ends(cayley(share * turn) @ unknowns[0])
        others = [y + share * dy for y, dy in zip(unknowns[1:], changes, strict=True)]
        unknowns, knots = (R, *others), knots + share * change
    return Failure(float(left.max()), STEPS)


def _momenta(problem: _Problem, legs: Equations, unknowns: Arrays) -> tuple[Array, list[Array]]:
    """Return the momenta at both ends of the legs, and their derivatives, for times from 0 to 1."""
    rates = rates_at_nodes(legs.ends, legs.bend(unknowns))[: problem.functional.ends]
    return problem.functional.momenta(*(x[:, [0, -1]] for x in rates))


def _balanced(problem: _Problem, legs: Equations, unknowns: Arrays) -> bool:
    """Tell whether the momenta agree on both sides of each pose that has no given values."""
    weight = problem.weight[:, None] * problem.scale
    found = weight[:, None] * _momenta(problem, legs, unknowns)[0]
    jump = np.zeros_like(problem.given)
    jump[:-1] -= found[:, 0]
    jump[1:] += found[:, 1]
    if problem.periodic:
        jump[0] = jump[-1] = jump[0] + jump[-1]
    rounding = weight * np.abs(legs.ends).max(axis=(1, 2))[:, None]
    allowed = 1e-10 * np.abs(found).max(axis=(0, 1)) + 1e-13 * rounding.max(axis=0)
    return bool(np.all(np.abs(jump[~problem.fixed]) <= allowed))


def _linearised(
    problem: _Problem, legs: Equations, unknowns: Arrays, parts: Arrays
) -> tuple[KnotSystem, Arrays]:
    """Return the linear system of a Newton step, and the responses of the legs' unknowns."""
    m, count = problem.functional.ends, len(problem.h)
    made = []
    for some in blocks(count, legs.together):
        own = (tuple(x[some] for x in arrays) for arrays in (unknowns, parts))
        made.append(legs.take(some).responses(next(own), next(own), by_ends=True))
    responses = tuple(np.concatenate(x) for x in zip(*made, strict=True))
    by, bends = primitives(unknowns[0].shape[1], m), legs.bend_by(unknowns, responses)
    found, slopes = _momenta(problem, legs, unknowns)
    change = np.zeros((*found.shape, 1 + 3 * m))
    for E, K, D in zip(by.from_ends, by.from_k, slopes, strict=False):
        rate = along(K[[0, -1]], bends)
        rate[..., 1:] += np.kron(E[[0, -1]][:, None], np.eye(3)).reshape(2, 3, 3 * m)
        change += D @ rate
    # the axes are: leg, end, momentum, rotation, value
    by_knots = change[..., 1:].reshape(count, 2, -1, m // 2, 2, 3).swapaxes(3, 4)
    by_knots = by_knots.reshape(count, 2, -1, 2, 3 * (m // 2)) * problem.scale[:, None, None, None]
    weight = (problem.weight[:, None] * problem.scale)[:, None]
    H, value = weight[..., None, None] * by_knots, weight * (found + change[..., 0])
    A, D = -H[:, 0, :, 0], H[:, 1, :, 1]
    B = (H[:, 1, :, 0].mT - H[:, 0, :, 1]) / 2
    return KnotSystem((A + A.mT) / 2, B, (D + D.mT) / 2, value[:, 0], -value[:, 1]), responses


def _lowered(problem: _Problem, start: _Curve, worthwhile: float) -> tuple[_Curve, float]:
    """Lower the cost of a curve by Gauss–Newton steps; return the curve and its cost.

    For R exp(η̂) with η = 0 at the poses, u changes to first order by D₀ η + D₁ η' + D₂ η'' (see
    `guesses.lowered`). A step uses the η that minimises the integral of the squared new u. On each
    leg, η is a cubic with any η' at the poses, plus a sum of `BUMPS` polynomials t² (1 − t)² p(t).
    The coefficients of this sum are eliminated leg by leg.
    """
    functional, h, R = problem.functional, problem.h[:, None], start.R
    cost, count, n = problem.cost(R), len(h), R.shape[1]
    shapes, root = _shapes(n), np.sqrt(grid(n).integral[-1])[:, None]
    for _ in range(DESCENT_STEPS):
        rates = rates_of(R, 2)
        u, by = functional.deviation(*rates), by_eta(functional.deviation_by(*rates), rates)
        J = sum(f[:, None, :, None] * D[:, :, :, None] for f, D in zip(shapes, by, strict=True))
        J = (root[..., None, None] * J).reshape(count, 3 * n, -1)
        r = (root * u).reshape(count, 3 * n, 1)
        M = problem.weight[:, None, None] * (J.mT @ np.concatenate([J, r], axis=2))
        outer = np.delete(M, np.s_[6:-1], axis=2)
        inner = np.linalg.solve(M[:, 6:, 6:-1], outer[:, 6:])
        E = outer[:, :6] - M[:, :6, 6:-1] @ inner
        H, b = h[..., None] ** 2 * E[..., :6], -h * E[..., 6]
        system = KnotSystem(H[:, :3, :3], H[:, :3, 3:], H[:, 3:, 3:], b[:, :3], b[:, 3:])
        change = problem.solve(system)
        x = np.append(h * change[:-1], h * change[1:], axis=1)
        z = -matvec(inner[..., :6], x) - inner[..., 6]
        eta = shapes[0] @ np.append(x, z, axis=1).reshape(count, -1, 3)
        tried = [R @ cayley(share * eta) for share in (1, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)]
        costs = [problem.cost(one) for one in tried]
        best = int(np.nanargmin(costs))
        if not costs[best] < cost:
            break
        before, cost, R = cost, costs[best], tried[best]
        if cost > (1 - worthwhile) * before:
            break
    w = rates_of(R, 1)[0] / h[:, None]
    knots = np.append(w[:, 0], w[-1:, -1], axis=0)
    if problem.periodic:
        knots[[0, -1]] = (knots[0] + knots[-1]) / 2
    return _Curve(R, np.where(problem.fixed[:, None], problem.given, knots)), cost


@lru_cache
def _shapes(n: int) -> list[Array]:
    """Return the cubics and the polynomials of `_lowered`, and two derivatives, at the nodes."""
    nodes = grid(n)
    t = nodes.t[:, None]
    cubics = t * (1 - t) ** 2, -(t**2) * (1 - t)
    shapes = [np.concatenate([*cubics, (t * (1 - t)) ** 2 * chebyshev(nodes.t, BUMPS)], axis=1)]
    for _ in range(2):
        shapes.append(nodes.derivative @ shapes[-1])
    return shapes
