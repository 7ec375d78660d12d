"""Optima through many poses (`rbcourse.optimum._spline` has the method)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._chebyshev import grid
from rbcourse._checks import as_inertia, as_positive, as_single
from rbcourse._numerics import Array, matvec
from rbcourse._valid import as_poses, as_rotations
from rbcourse.curves.chain import Chain
from rbcourse.curves.closed import quaternion_cubic
from rbcourse.curves.curve import Ends
from rbcourse.curves.functionals import BallAcceleration, Effort, Jerk
from rbcourse.curves.rigid import RigidMotion, rigid_motion
from rbcourse.curves.velocities import (
    Conditions,
    PathEnds,
    as_ends,
    checked_path,
    path_system,
    quaternion_system,
)
from rbcourse.optimum import ConvergenceError, Optimum, optimum_of
from rbcourse.optimum._collocation import (
    NODES,
    Failure,
    on_nodes,
)
from rbcourse.optimum._second_variation import is_positive
from rbcourse.optimum._spline import Found, Problem, solve_spline
from rbcourse.projection import nearest


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
    the rest (see `rbcourse.optimum._second_variation`). The proof holds up to rounding, quadrature
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
    problem = Problem(R, h, conditions._replace(given=given), functional)
    if what == "torque" or G is not None:
        G = as_inertia("inertia", as_single("inertia", G, 3, 3))
        of_ball = solve_spline(problem, curve)
        curve = on_nodes(of_ball.R, NODES[0]) if isinstance(of_ball, Found) else curve
        effort = Effort(np.broadcast_to(G, (len(T), 3, 3)), of_torque=what == "torque")
        problem = problem._replace(functional=effort)
    found = solve_spline(problem, curve)
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
